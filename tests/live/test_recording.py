"""Recordings: what was written can be read by any MCAP reader, and again byte for byte."""

import json
import struct
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader
from tests.fixtures.live import run, until

from miburi.bodies import BodyState
from miburi.errors import InputError
from miburi.feelings import FEELINGS, EmotionalModel, Expression, Stimulus, shipped_temperament
from miburi.live.recording.recorder import Recorder, read, step_messages
from miburi.live.runner import Runner
from miburi.live.wishes import Feel, MoveHand, Perform, Sense, Speak
from miburi.partner import Released, Stopped
from miburi.robot import JOINTS, forward
from miburi.safety.stop import Phase, Stop, StopReason
from miburi.senses.happenings import notice
from miburi.senses.words import hear

STOP = Stop(0.1, StopReason.CONTACT, "waist", "speed", 0.5)


def record(file: BytesIO) -> None:
    feelings = EmotionalModel()
    feelings.set_state(emotion={"anger": 0.5})
    with Recorder(file) as recorder:
        for k in range(50):
            angles = np.full(8, 0.01 * k)
            state = BodyState(0.02 * k, angles, angles, Phase.MOVING, None)
            last = k == 49
            events = [Stopped(1.0, STOP, 0.9, 0.72), Released(2.0)] if last else []
            recorder.write(step_messages(state, feelings if last else None, events))


def test_a_recording_is_read_by_any_reader(tmp_path: Path) -> None:
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
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert all(s.encoding == "jsonschema" and s.data for s in summary.schemas.values())
    for schema in summary.schemas.values():
        if schema.name.startswith("miburi.") and schema.name != "miburi.events":
            for field in json.loads(schema.data)["properties"].values():
                assert "number" not in str(field) or "description" in str(field)
    assert summary.statistics is not None
    assert summary.statistics.message_count == 52


@pytest.mark.proof("test_a_recording_is_read_by_any_reader")
def test_it_says_what_it_is_of_and_when_and_opens_in_3d(runner: Runner, tmp_path: Path) -> None:
    """Every message fits its schema; Foxglove's frames, put together, end where the hands are."""
    before = datetime.now(UTC).timestamp()
    runner.tick()
    runner.recordings.start()
    runner.ask(Speak("Good morning."))
    run(runner, 0.5)
    runner.ask(Sense(hear("I am so sad today")))
    runner.ask(MoveHand(np.array([0.12, -0.11, 0.12]), np.array([1.0, 0.0, 0.0])))
    run(runner, 1.5)
    runner.ask(Perform(Expression("happiness", 0.9)))
    until(runner, lambda state: state.stop is not None, 8.0)
    run(runner, 0.1)
    runner.recordings.end()
    (path,) = (tmp_path / "recordings").glob("*.mcap")
    told: dict[str, list[tuple[float, Any]]] = {}
    with path.open("rb") as file:
        (about,) = [one.metadata for one in make_reader(file).iter_metadata()]
        file.seek(0)
        for schema, channel, record in make_reader(file).iter_messages():
            assert schema is not None
            content = json.loads(record.data)
            jsonschema.validate(content, json.loads(schema.data))
            told.setdefault(channel.topic, []).append((record.log_time / 1e9, content))
    assert about["robot"] == "iphonoid"
    assert {"version", "temperament", "seed", "servo", "boot"} < about.keys()
    times = [when for messages in told.values() for when, _ in messages]
    assert before - 1 < min(times) <= max(times) < datetime.now(UTC).timestamp() + 1

    (_, stop), *_ = told["/contacts"]
    (told_stop,) = [one["stop"] for _, one in told["/events"] if one["kind"] == "stop"]
    assert stop["force"] == told_stop["force"] > 0
    assert stop["part"].startswith("right")
    assert max(one["force"] for _, one in told["/touch"]) == pytest.approx(stop["force"], abs=5e-3)
    said = [content["text"] for _, content in told["/events"] if content["kind"] == "speech_begun"]
    assert "Good morning." in said
    assert "sad today" not in str(told)

    for (_, joints), (_, frames) in zip(told["/joint_states"], told["/tf"], strict=True):
        places = at_the_ends(frames["transforms"])
        ends = forward(runner.robot, np.array(joints["position"]))
        assert places == pytest.approx(ends, abs=1e-4)
    (_, scene), *_ = told["/scene"]
    (forearm,) = [one for one in scene["entities"] if one["id"] == "right_forearm"]
    (rod,) = forearm["cylinders"]
    x, y, z, w = (rod["pose"]["orientation"][key] for key in "xyzw")
    # It lies along the forearm, whose fingertip is straight to the right.
    assert abs(2 * (y * z - w * x)) == pytest.approx(1.0, abs=1e-4)
    assert rod["size"]["z"] == pytest.approx(runner.robot.lengths.L34)


def at_the_ends(transforms: list[dict[str, Any]]) -> list[float]:
    """Put frames together; return where right and left hand and head are."""
    poses = {"base_link": np.eye(4)}
    for one in transforms:
        x, y, z, w = (one["rotation"][key] for key in "xyzw")
        own = np.eye(4)
        own[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        own[:3, 3] = [one["translation"][key] for key in "xyz"]
        poses[one["child_frame_id"]] = poses[one["parent_frame_id"]] @ own
    return [float(v) for end in ("right", "left", "head_centre") for v in poses[end][:3, 3]]


def test_it_holds_why_the_partner_felt_something_and_replays(
    runner: Runner, tmp_path: Path
) -> None:
    runner.recordings.start()
    run(runner, 0.5)
    runner.ask(Sense(hear("I am so sad today, but thank you")))
    run(runner, 1.0)
    runner.ask(Sense(notice("stroke", 0.8)))
    runner.ask(Feel(Stimulus("thrill", 0.5, "application")))
    run(runner, 1.0)
    runner.recordings.end()
    (path,) = (tmp_path / "recordings").glob("*.mcap")
    stimuli = [message.content for message in read(path, ["/stimuli"])]
    assert [(one["feeling"], one["source"]) for one in stimuli] == [
        ("sadness", "speech"),
        ("happiness", "touch"),
        ("thrill", "application"),
    ]
    said, touched, asked = ([part["what"] for part in one["why"]] for one in stimuli)
    assert "sad" in said
    assert (touched, asked) == (["stroke"], [])
    # No sentence is in the file: only the words that moved it.
    messages = [message.content for message in read(path)]
    assert "today" not in str(messages)

    again, now = EmotionalModel(shipped_temperament("playful")), 0.0
    again.set_state(mood=dict.fromkeys(FEELINGS, 0.6))
    for time, topic, content, _ in read(path, ["/stimuli", "/feelings"]):
        again.step(time - now)
        now = time
        if topic == "/stimuli":
            content.pop("why")
            again.stimulate(Stimulus(**content))
        else:
            assert again.emotion == pytest.approx(content["emotion"], abs=1e-5)
            assert again.mood == pytest.approx(content["mood"], abs=1e-5)


def test_a_requested_gesture_is_told_as_shown(runner: Runner, tmp_path: Path) -> None:
    runner.recordings.start()
    runner.ask(Perform(Expression("sadness", 0.9)))
    run(runner, 1.0)
    runner.recordings.end()
    (path,) = (tmp_path / "recordings").glob("*.mcap")
    told = [message.content for message in read(path, ["/feelings"])]
    assert {(one["expressed"], one["expressed_mood"]) for one in told} == {("sadness", 0.9)}


def test_the_same_run_gives_the_same_bytes() -> None:
    first, second = BytesIO(), BytesIO()
    record(first)
    record(second)
    assert first.getvalue() == second.getvalue()


def test_a_recording_is_whole_when_the_run_breaks_off() -> None:
    file = BytesIO()
    state = BodyState(0.0, np.zeros(8), np.zeros(8), Phase.IDLE, None)
    with pytest.raises(ValueError, match="broken"), Recorder(file) as recorder:
        recorder.write(step_messages(state, None, []))
        raise ValueError("broken")
    file.seek(0)
    assert len(list(make_reader(file).iter_messages())) == 1


@pytest.mark.parametrize("content", [b"", b"no", b"not mcap at all", b"\x89MCAP0\r\n"])
def test_a_file_that_is_no_recording(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "r.mcap"
    path.write_bytes(content)
    with pytest.raises(InputError, match="not a recording by Miburi"):
        list(read(path))
    with pytest.raises(InputError, match="No such file"):
        list(read(tmp_path / "none.mcap"))


def test_a_recording_that_breaks_off_is_read_up_to_its_last_second(tmp_path: Path) -> None:
    """Wherever it breaks off: what was handed to the system before is there, in order."""
    file, marks = BytesIO(), []
    recorder = Recorder(file)
    for k in range(200):
        angles = np.full(8, 0.001 * k)
        state = BodyState(0.02 * k, angles, angles, Phase.MOVING, None)
        recorder.write(step_messages(state, None, []))
        if k % 50 == 49:
            recorder.flush()
            marks.append((file.tell(), k + 1))
    whole, path = file.getvalue(), tmp_path / "r.mcap"
    for length in [*range(marks[0][0], len(whole), 401), *(place for place, _ in marks)]:
        path.write_bytes(whole[:length])
        due = max(count for place, count in marks if place <= length)
        times = [message.time for message in read(path, ["/joint_states"])]
        assert len(times) >= due
        assert times == pytest.approx([0.02 * k for k in range(len(times))])
        assert list(read(path, ["/feelings"])) == []
        plain = []
        with path.open("rb") as broken, pytest.raises((EndOfFile, struct.error)):
            for record in StreamReader(broken).records:
                plain.append(record)  # noqa: PERF402  # what came before the break stays
        assert sum(isinstance(record, McapMessage) for record in plain) == len(times)
    path.write_bytes(whole[: marks[0][0] // 2])
    with pytest.raises(InputError, match="not a recording by Miburi"):
        list(read(path))
