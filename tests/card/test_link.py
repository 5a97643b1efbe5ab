"""Frames: what goes in comes out, and nothing else does."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miburi.card.link import Frame, FrameError, Receiver, crc16, decode, encode

FRAMES = st.builds(
    Frame,
    st.integers(0, 255),
    st.integers(0, 255),
    st.binary(max_size=96),
    version=st.integers(1, 255),
)


def test_check_sum_is_the_published_one() -> None:
    """The example of DYNAMIXEL's protocol 2.0 manual: ping to id 1."""
    assert crc16(bytes.fromhex("fffffd000103 0001")) == 0x4E19


@given(FRAMES)
def test_a_frame_comes_back(frame: Frame) -> None:
    data = encode(frame)
    assert data.index(0) == len(data) - 1
    assert decode(data[:-1]) == frame


@given(st.lists(FRAMES, max_size=5), st.integers(1, 20), st.binary(max_size=30))
def test_a_stream_in_pieces_with_noise_before_it(
    frames: list[Frame], size: int, noise: bytes
) -> None:
    receiver = Receiver()
    data = noise + b"\0" + b"".join(encode(frame) for frame in frames)
    found = [f for i in range(0, len(data), size) for f in receiver.add(data[i : i + size])]
    assert found[-len(frames) :] == frames if frames else True


@given(FRAMES, st.data())
def test_a_flipped_bit_is_noticed(frame: Frame, data: st.DataObject) -> None:
    sent = bytearray(encode(frame)[:-1])
    bit = data.draw(st.integers(0, 8 * len(sent) - 1))
    sent[bit // 8] ^= 1 << bit % 8
    pieces = bytes(sent).split(b"\0")
    assert all(_refused(piece) for piece in pieces if piece)


def _refused(piece: bytes) -> bool:
    with pytest.raises(FrameError):
        decode(piece)
    return True
