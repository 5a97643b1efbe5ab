"""A recording for ROS 2's tools, opened by a third-party library."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from typer.testing import CliRunner

from miburi.bodies import BodyState
from miburi.cli.commands import app
from miburi.doors.ros_recording import convert_recording
from miburi.errors import InputError
from miburi.feelings import EmotionalModel, Expression
from miburi.live.recording.recorder import (
    RecordedMessage,
    Recorder,
    RecordingAbout,
    read,
    step_messages,
)
from miburi.partner import Stopped
from miburi.robot import JOINTS, Robot, buildable
from miburi.robot.urdf import to_urdf
from miburi.safety.stop import Phase, Stop, StopReason

STOP = Stop(1.0, StopReason.CONTACT, "waist", "speed", 0.5)
STEPS = 50


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """A second of a happy partner that turns its waist, and meets something at its end."""
    feelings = EmotionalModel()
    feelings.set_state(emotion={"happiness": 0.8}, mood={"happiness": 0.5})
    path = tmp_path / "miburi-0001.mcap"
    with path.open("wb") as file, Recorder(file) as recorder:
        for k in range(STEPS):
            angles = np.zeros(8)
            angles[0] = 0.01 * k
            state = BodyState(0.02 * (k + 1), angles, np.full(8, 0.5), Phase.MOVING, None)
            events = [Stopped(1.0, STOP, 0.5, 0.4)] if k == STEPS - 1 else []
            recorder.write(step_messages(state, feelings, events))
    return path


@pytest.fixture
def converted(recording: Path, tmp_path: Path) -> Path:
    """The same for ROS 2."""
    out = tmp_path / "ros.mcap"
    assert convert_recording(recording, out) == 2 * STEPS + 4
    return out


def test_rosbags_opens_it_with_the_right_names_stamps_and_profiles(
    converted: Path, robot: Robot
) -> None:
    heard: dict[str, list[tuple[int, Any]]] = {}
    with AnyReader([converted]) as bag:
        kinds = {one.topic: one.msgtype for one in bag.connections}
        kept = {one.topic for one in bag.connections if one.ext.offered_qos_profiles}
        for connection, time, raw in bag.messages():
            message = bag.deserialize(raw, connection.msgtype)
            heard.setdefault(connection.topic, []).append((time, message))
    assert kinds == {
        "/joint_states": "sensor_msgs/msg/JointState",
        "/tf": "tf2_msgs/msg/TFMessage",
        "/tf_static": "tf2_msgs/msg/TFMessage",
        "/robot_description": "std_msgs/msg/String",
        "/expression": "hri_msgs/msg/Expression",
        "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    }
    assert kept == {"/tf_static", "/robot_description", "/expression"}
    joints = heard["/joint_states"]
    assert [time for time, _ in joints] == [20_000_000 * (k + 1) for k in range(STEPS)]
    assert [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for _, m in joints] == [
        time for time, _ in joints
    ]
    assert all(message.name == list(JOINTS) for _, message in joints)
    assert joints[7][1].position.tolist() == [0.07, *[0.0] * 7]
    assert joints[7][1].velocity.tolist() == [0.5] * 8
    turned = heard["/tf"][7][1].transforms[0]
    assert (turned.header.frame_id, turned.child_frame_id) == ("base_link", "torso")
    assert 2 * np.arcsin(turned.transform.rotation.z) == pytest.approx(0.07)
    assert heard["/robot_description"][0][1].data == to_urdf(robot)
    ((_, said),) = heard["/expression"]
    assert said.expression == "happy"
    ((_, told),) = heard["/diagnostics"]
    assert told.status[0].message == "stopped: contact at waist"


def test_a_stop_ends_and_a_requested_gesture_is_shown(tmp_path: Path) -> None:
    path, out, asked = tmp_path / "r.mcap", tmp_path / "ros.mcap", Expression("sadness", 0.9)
    with path.open("wb") as file, Recorder(file) as recorder:
        for k, phase in enumerate((Phase.MOVING, Phase.STOPPED, Phase.STOPPED, Phase.RETURNING)):
            state = BodyState(0.02 * k, np.zeros(8), np.zeros(8), phase, None)
            events = [Stopped(0.02, STOP, 0.5, 0.4)] if k == 1 else []
            recorder.write(step_messages(state, EmotionalModel(), events, asked=asked))
    convert_recording(path, out)
    with AnyReader([out]) as bag:
        heard = [(c.topic, bag.deserialize(raw, c.msgtype)) for c, _, raw in bag.messages()]
    told = [one.status[0].message for topic, one in heard if topic == "/diagnostics"]
    assert told == ["stopped: contact at waist", "not stopped"]
    (said,) = [one for topic, one in heard if topic == "/expression"]
    assert (said.expression, said.valence) == ("sad", pytest.approx(0.9 * -0.63))


def test_the_robot_is_the_recorded_one_whatever_its_name(
    recording: Path, robot: Robot, tmp_path: Path
) -> None:
    own = robot.model_copy(update={"lengths": robot.lengths.model_copy(update={"L34": 0.11})})
    of_own, out = tmp_path / "own.mcap", tmp_path / "ros.mcap"
    with of_own.open("wb") as file, Recorder(file, RecordingAbout(own)) as recorder:
        recorder.write(read(recording))
    for given in (None, own):
        assert convert_recording(of_own, out, given) > STEPS
        with AnyReader([out]) as bag:
            (described,) = [one for one in bag.connections if one.topic == "/robot_description"]
            ((_, _, raw),) = bag.messages([described])
            assert bag.deserialize(raw, described.msgtype).data == to_urdf(own) != to_urdf(robot)
    with pytest.raises(InputError, match="--robot gives another; leave --robot out"):
        convert_recording(of_own, out, robot)


def test_an_old_recording_of_another_robot_is_refused(recording: Path, tmp_path: Path) -> None:
    old, out = tmp_path / "old.mcap", tmp_path / "ros.mcap"
    about = RecordingAbout(None, {"robot": "buildable"})
    with old.open("wb") as file, Recorder(file, about) as recorder:
        recorder.write(read(recording))
    with pytest.raises(InputError, match="is of the robot buildable, and this one is iphonoid"):
        convert_recording(old, out)
    assert convert_recording(old, out, buildable()) > STEPS


def test_what_is_no_recording_of_ours_is_refused(tmp_path: Path) -> None:
    wrong = [RecordedMessage(0.5, "/joint_states", {"position": [0.0] * 7})]
    for messages, words in (
        (wrong, r"not a recording by Miburi: /joint_states at 0.50 s: pos"),
        ([], "nothing in this recording"),
    ):
        path = tmp_path / "other.mcap"
        with path.open("wb") as file, Recorder(file) as recorder:
            recorder.write(messages)
        with pytest.raises(InputError, match=words):
            convert_recording(path, tmp_path / "out.mcap")
        assert [one.name for one in tmp_path.iterdir()] == ["other.mcap"]


def test_the_command_says_what_it_wrote(recording: Path, tmp_path: Path) -> None:
    out = tmp_path / "ros.mcap"
    done = CliRunner().invoke(app, ["to-ros", str(recording), str(out)])
    assert done.output == f"{2 * STEPS + 4} messages in {out}.\n"
