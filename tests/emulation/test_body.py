"""The emulated card's time, on a processor that stops exactly where it is told to."""

from math import ceil

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miburi.emulation import card as emulated
from miburi.emulation.card import EmulatedCard
from miburi.emulation.servos import Bus


class Asleep:
    """An idle processor of 16 MHz: nothing delays it by a part of an instruction."""

    def __init__(self, *_files: object) -> None:
        self.time = 0.0

    def run(self, until: float) -> bool:
        self.time = ceil(until * 16) / 16
        return False

    def take(self, _port: int) -> bytes:
        return b""


@given(steps=st.integers(1, 200), way=st.sampled_from(["read", "wait"]))
def test_a_time_that_is_waited_for_comes(steps: int, way: str) -> None:
    """Not a rounding before it: who waits for it would wait for ever."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(emulated, "Mega", Asleep)
        patch.setattr(emulated, "built", lambda name: name)
        card = EmulatedCard(Bus([]))
    until = steps * 0.02  # 0.9400000000000001 s is 940000.0 µs, and that is 0.94 s
    getattr(card, way)(until)
    assert card.now() >= until
