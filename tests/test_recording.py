"""Recordings: what was written can be read by any MCAP reader, and again byte for byte."""

from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from miburi.bodies import BodyState, Phase, Stop, StopReason
from miburi.errors import InputError
from miburi.feelings import EmotionalModel
from miburi.partner import Released, Stopped
from miburi.recording import Recorder, read
from miburi.robot import JOINTS

STOP = Stop(0.1, StopReason.CONTACT, "waist", "speed", 0.5)


def record(file: BytesIO) -> None:
    feelings = EmotionalModel()
    feelings.set_state(emotion={"anger": 0.5})
    with Recorder(file) as recorder:
        for k in range(50):
            angles = np.full(8, 0.01 * k)
            recorder.state(BodyState(0.02 * k, angles, angles, Phase.MOVING, None))
        recorder.feelings(1.0, feelings)
        recorder.event(Stopped(1.0, STOP, 0.9, 0.72))
        recorder.event(Released(2.0))


def test_what_is_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    with path.open("wb") as file:
        record(file)
    messages = list(read(path))
    assert len(messages) == 52
    states = [message for message in messages if message.topic == "/joint_states"]
    assert states[7].time == pytest.approx(0.14)
    assert states[7].content["name"] == list(JOINTS)
    assert states[7].content["position"] == [0.07] * 8
    assert states[7].content["phase"] == "moving"
    stop = next(read(path, ["/contacts"])).content
    assert (stop["motor"], stop["ratio"], stop["mood_after"]) == ("waist", 0.5, 0.72)
    assert next(read(path, ["/feelings"])).content["expressed"] == "anger"


def test_every_topic_has_a_schema() -> None:
    file = BytesIO()
    record(file)
    file.seek(0)
    summary = make_reader(file).get_summary()
    assert summary is not None
    assert {c.topic for c in summary.channels.values()} == {
        "/joint_states",
        "/commands",
        "/feelings",
        "/contacts",
    }
    assert all(s.encoding == "jsonschema" and s.data for s in summary.schemas.values())
    assert summary.statistics is not None
    assert summary.statistics.message_count == 52


def test_the_same_run_gives_the_same_bytes() -> None:
    first, second = BytesIO(), BytesIO()
    record(first)
    record(second)
    assert first.getvalue() == second.getvalue()


def test_a_recording_is_whole_when_the_run_breaks_off() -> None:
    file = BytesIO()
    state = BodyState(0.0, np.zeros(8), np.zeros(8), Phase.IDLE, None)
    with pytest.raises(ValueError, match="broken"), Recorder(file) as recorder:
        recorder.state(state)
        raise ValueError("broken")
    file.seek(0)
    assert len(list(make_reader(file).iter_messages())) == 1


@pytest.mark.parametrize("content", [b"", b"not mcap at all", b"\x89MCAP0\r\n"])
def test_a_file_that_is_no_recording(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "r.mcap"
    path.write_bytes(content)
    with pytest.raises(InputError, match="not a whole MCAP"):
        list(read(path))
    with pytest.raises(InputError, match="No such file"):
        list(read(tmp_path / "none.mcap"))
