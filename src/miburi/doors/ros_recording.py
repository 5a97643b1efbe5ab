"""Convert one of Miburi's recordings to MCAP with ROS messages, for ROS 2's tools.

Times are by the recording's clock: the computer's clock or, in an experiment, the robot's from 0.
This module needs the extra ``ros``.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, TypeVar

from cyclonedds.idl import IdlStruct
from mcap.well_known import MessageEncoding, Profile, SchemaEncoding
from mcap.writer import CompressionType, Writer
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from miburi.doors.ros_messages import (
    express,
    fixed_frames,
    frames,
    joint_state,
    stop_report,
)
from miburi.doors.ros_network import RosNetwork
from miburi.doors.ros_types import StringMsg, definition, ros_name
from miburi.errors import InputError
from miburi.feelings.catalogue import FeelingName
from miburi.ground.files import whole_files
from miburi.live.recording.recorder import RecordedMessage, read, recorded_about
from miburi.live.state import Eight, Expressed, StopOut
from miburi.robot import Robot, iphonoid
from miburi.robot.shape import links
from miburi.robot.urdf import to_urdf
from miburi.safety.stop import Phase
from miburi.version import __version__

_Timed = tuple[str, IdlStruct]
_Content = TypeVar("_Content", bound=BaseModel)
#: Recorded frames have no namespace.
_NOWHERE = RosNetwork()
#: How rosbag2 marks a topic whose last message is kept for late subscribers; a player then keeps
#: this message, too.
_EVER = "{sec: 9223372036, nsec: 854775807}"
_KEPT = (
    "- {history: 1, depth: 1, reliability: 1, durability: 1, "
    f"deadline: {_EVER}, lifespan: {_EVER}, liveliness: 1, liveliness_lease_duration: {_EVER}, "
    "avoid_ros_namespace_conventions: false}"
)


class _Joints(BaseModel):
    model_config = ConfigDict(allow_inf_nan=False)

    position: Eight
    velocity: Eight


class _Commands(BaseModel):
    model_config = ConfigDict(allow_inf_nan=False)

    position: Eight
    speed: Eight


class _Feelings(BaseModel):
    name: list[str]
    mood: list[Annotated[float, Field(ge=0, le=1)]]
    expressed: FeelingName | None
    expressed_mood: Annotated[float, Field(ge=0, le=1)] | None = None  # old recordings lack it


def convert_recording(recording: Path, out: Path, robot: Robot | None = None) -> int:
    """Write a recording for ROS 2's tools; return the number of its messages.

    ``robot`` is needed only for an old recording that lacks its robot's description; by default it
    is the iphonoid.

    The description and the fixed frames come first; joint states come with their frames. Commands
    are joint states, too, with the joints' goals and speeds. A recording that is cut off is
    converted up to the cut.

    Raises InputError if the file is no Miburi recording, or another robot's; OutputError if the
    file cannot be written.
    """
    robot, messages = _recorded_robot(recording, robot), read(recording)
    try:
        first = next(messages)
    except StopIteration:
        raise InputError(f"{recording}: there is nothing in this recording.") from None
    with whole_files(out.resolve().parent) as draft, (draft / out.name).open("wb") as file:
        bag = _Bag(Writer(file, compression=CompressionType.ZSTD))
        start = _stamp(first)
        bag.write(start, "/robot_description", StringMsg(to_urdf(robot)), _KEPT)
        bag.write(start, "/tf_static", fixed_frames(robot, _NOWHERE, start), _KEPT)
        last: Expressed | None = None
        unsaid, stopped = True, False
        for message in (first, *messages):
            stamp = _stamp(message)
            if message.topic == "/feelings":
                shown = _shown(_check(recording, _Feelings, message))
                if (unsaid or shown != last) and (said := express(stamp, shown)) is not None:
                    bag.write(stamp, "/expression", said, _KEPT)
                last, unsaid = shown, False
            elif message.topic in _KINDS:
                if message.topic == "/joint_states":
                    before, stopped = stopped, message.content.get("phase") == Phase.STOPPED
                    if before and not stopped:
                        bag.write(stamp, "/diagnostics", stop_report(stamp, None))
                for topic, one in _KINDS[message.topic](recording, robot, message):
                    bag.write(stamp, topic, one)
        bag.end()
    return bag.written


def _recorded_robot(recording: Path, given: Robot | None) -> Robot:
    about = recorded_about(recording)
    if (description := about.get("description")) is None:
        robot = given or iphonoid()
        if about.get("robot", robot.name) != robot.name:
            raise InputError(
                f"{recording} is of the robot {about['robot']}, and this one is {robot.name}; give "
                "the file of that robot with --robot."
            )
        return robot
    try:
        robot = Robot.model_validate_json(description)
    except ValidationError as error:
        raise InputError(
            f"{recording}: the description of its robot cannot be read; another version of Miburi "
            "has written it."
        ) from error
    if given is not None and to_urdf(given) != to_urdf(robot):
        raise InputError(
            f"{recording} has the description of its robot, and --robot gives another; leave "
            "--robot out."
        )
    return robot


class _Bag:
    """An MCAP file of ROS 2 messages."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._channels: dict[str, int] = {}
        self._schemas: dict[type[IdlStruct], int] = {}
        self.written = 0
        writer.start(profile=Profile.ROS2, library=f"miburi {__version__}")

    def write(self, time: int, topic: str, message: IdlStruct, qos: str = "") -> None:
        """Write a message with its time in ns."""
        kind = type(message)
        if kind not in self._schemas:
            self._schemas[kind] = self._writer.register_schema(
                ros_name(kind), SchemaEncoding.ROS2, definition(kind).encode()
            )
        if topic not in self._channels:
            self._channels[topic] = self._writer.register_channel(
                topic, MessageEncoding.CDR, self._schemas[kind], {"offered_qos_profiles": qos}
            )
        data = message.serialize(use_version_2=False)
        self._writer.add_message(self._channels[topic], time, data, time)
        self.written += 1

    def end(self) -> None:
        """Finish the file."""
        self._writer.finish()  # type: ignore[no-untyped-call]  # mcap leaves it untyped


def _stamp(message: RecordedMessage) -> int:
    return round(message.time * 1e9) if message.wall is None else message.wall


def _check(recording: Path, kind: type[_Content], message: RecordedMessage) -> _Content:
    try:
        return kind.model_validate({"time": message.time, **message.content})
    except ValidationError as error:
        item = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(str(part) for part in item["loc"])
        raise InputError(
            f"{recording}: this is not a recording by Miburi: {message.topic} at "
            f"{message.time:.2f} s: {where}: {item['msg']}."
        ) from error


def _shown(feelings: _Feelings) -> Expressed | None:
    """Return the expressed feeling and its mood, to a hundredth."""
    if feelings.expressed is None:
        return None
    mood = feelings.expressed_mood
    if mood is None:
        moods = dict(zip(feelings.name, feelings.mood, strict=False))
        mood = moods.get(feelings.expressed, 0.0)
    return Expressed(feeling=feelings.expressed, mood=round(mood, 2))


def _of_joints(recording: Path, robot: Robot, message: RecordedMessage) -> Iterator[_Timed]:
    joints, stamp = _check(recording, _Joints, message), _stamp(message)
    yield "/joint_states", joint_state(stamp, joints.position, joints.velocity)
    yield "/tf", frames(links(robot), _NOWHERE, stamp, joints.position)


def _of_commands(recording: Path, _robot: Robot, message: RecordedMessage) -> Iterator[_Timed]:
    commands, stamp = _check(recording, _Commands, message), _stamp(message)
    yield "/commands", joint_state(stamp, commands.position, commands.speed)


def _of_contacts(recording: Path, _robot: Robot, message: RecordedMessage) -> Iterator[_Timed]:
    yield "/diagnostics", stop_report(_stamp(message), _check(recording, StopOut, message))


_KINDS: dict[str, Callable[[Path, Robot, RecordedMessage], Iterator[_Timed]]] = {
    "/joint_states": _of_joints,
    "/commands": _of_commands,
    "/contacts": _of_contacts,
}
