"""ROS 2's messages for DDS, and their definitions for recordings.

Names, fields and order are those of common_interfaces, geometry2 and hri_msgs, without constants.
Each class gives the type name and CDR for rmw, and the text of the ``.msg`` file with the files
that it depends on.

This module needs the extra ``ros``.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeGuard, TypeVar, dataclass_transform, get_args, get_type_hints

from miburi.errors import needs_extra

try:
    from cyclonedds.idl import IdlStruct, annotations
    from cyclonedds.idl.types import byte, float32, float64, int32, sequence, uint8, uint32
except ModuleNotFoundError as error:
    raise needs_extra("ros", error) from error


_Message = TypeVar("_Message", bound=IdlStruct)
_RULE = "=" * 80
#: REP-2016's hashes of the topics' messages, which nodes exchange since Iron.
_HASHES = {
    "diagnostic_msgs/msg/DiagnosticArray": (
        "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"
    ),
    "hri_msgs/msg/Expression": "411b88e0604397d44775d8ec6a4bc69398fb0dfbfe864c33a40fa99ee85f1b00",
    "rmw_dds_common/msg/ParticipantEntitiesInfo": (
        "e725f4a506958c79f95dd693b965722c57b19cd18e7eff984f49561b93dc985d"
    ),
    "sensor_msgs/msg/JointState": (
        "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"
    ),
    "std_msgs/msg/Empty": "20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312",
    "std_msgs/msg/String": "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    "tf2_msgs/msg/TFMessage": "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
}


@dataclass_transform()
def ros_message(kind: type[_Message]) -> type[_Message]:
    """Make a class a ROS 2 message, in plain CDR: a final type with consecutive ids."""
    return annotations.final(annotations.autoid("sequential")(dataclass(kind)))


@ros_message
class TimeMsg(IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    """builtin_interfaces/Time."""

    sec: int32
    nanosec: uint32


@ros_message
class HeaderMsg(IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    """std_msgs/Header."""

    stamp: TimeMsg
    frame_id: str


@ros_message
class EmptyMsg(IdlStruct, typename="std_msgs.msg.dds_.Empty_"):
    """std_msgs/Empty; every message needs at least one byte."""

    structure_needs_at_least_one_member: uint8 = 0


@ros_message
class StringMsg(IdlStruct, typename="std_msgs.msg.dds_.String_"):
    """std_msgs/String."""

    data: str


@ros_message
class JointStateMsg(IdlStruct, typename="sensor_msgs.msg.dds_.JointState_"):
    """sensor_msgs/JointState: rad, rad/s, Nm."""

    header: HeaderMsg
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@ros_message
class Vector3Msg(IdlStruct, typename="geometry_msgs.msg.dds_.Vector3_"):
    """geometry_msgs/Vector3."""

    x: float64
    y: float64
    z: float64


@ros_message
class QuaternionMsg(IdlStruct, typename="geometry_msgs.msg.dds_.Quaternion_"):
    """geometry_msgs/Quaternion."""

    x: float64
    y: float64
    z: float64
    w: float64


@ros_message
class TransformMsg(IdlStruct, typename="geometry_msgs.msg.dds_.Transform_"):
    """geometry_msgs/Transform."""

    translation: Vector3Msg
    rotation: QuaternionMsg


@ros_message
class TransformStampedMsg(IdlStruct, typename="geometry_msgs.msg.dds_.TransformStamped_"):
    """geometry_msgs/TransformStamped."""

    header: HeaderMsg
    child_frame_id: str
    transform: TransformMsg


@ros_message
class TFMessageMsg(IdlStruct, typename="tf2_msgs.msg.dds_.TFMessage_"):
    """tf2_msgs/TFMessage."""

    transforms: sequence[TransformStampedMsg]


@ros_message
class KeyValueMsg(IdlStruct, typename="diagnostic_msgs.msg.dds_.KeyValue_"):
    """diagnostic_msgs/KeyValue."""

    key: str
    value: str


@ros_message
class DiagnosticStatusMsg(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticStatus_"):
    """diagnostic_msgs/DiagnosticStatus: level 0 ok, 1 warning, 2 error, 3 stale."""

    level: byte
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValueMsg]


@ros_message
class DiagnosticArrayMsg(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticArray_"):
    """diagnostic_msgs/DiagnosticArray."""

    header: HeaderMsg
    status: sequence[DiagnosticStatusMsg]


@ros_message
class ExpressionMsg(IdlStruct, typename="hri_msgs.msg.dds_.Expression_"):
    """hri_msgs/Expression (ROS4HRI): valence and arousal −1 to 1, confidence 0 to 1."""

    header: HeaderMsg
    expression: str
    valence: float32
    arousal: float32
    confidence: float32


def type_hash(kind: type[IdlStruct]) -> str:
    """Return ROS's hash of a topic's type."""
    return f"RIHS01_{_HASHES[ros_name(kind)]}"


def ros_name(kind: type[IdlStruct]) -> str:
    """Return ROS 2's name of a message, such as ``std_msgs/msg/String``."""
    package, message, _, name = kind.__idl_typename__.split(".")
    return f"{package}/{message}/{name.removesuffix('_')}"


def definition(kind: type[IdlStruct]) -> str:
    """Return the definition of a message and of all messages within it, as MCAP's ``ros2msg``."""
    own, *held = dict.fromkeys(_kinds(kind))
    return _lines(own) + "".join(f"{_RULE}\nMSG: {_short(one)}\n{_lines(one)}" for one in held)


def _kinds(kind: type[IdlStruct]) -> Iterator[type[IdlStruct]]:
    yield kind
    for hint in get_type_hints(kind, include_extras=True).values():
        held, _ = _held(hint)
        if _is_message(held):
            yield from _kinds(held)


def _lines(kind: type[IdlStruct]) -> str:
    text = ""
    for name, hint in get_type_hints(kind, include_extras=True).items():
        held, many = _held(hint)
        if _is_message(held):
            held_name = _short(held)
        else:
            held_name = "string" if held is str else str(get_args(held)[1])
        text += f"{held_name}{'[]' if many else ''} {name}\n"
    return text


def _held(hint: object) -> tuple[object, bool]:
    given = get_args(hint)
    return (get_args(given[0])[0], True) if given and get_args(given[0]) else (hint, False)


def _is_message(held: object) -> TypeGuard[type[IdlStruct]]:
    return isinstance(held, type) and issubclass(held, IdlStruct)


def _short(kind: type[IdlStruct]) -> str:
    return ros_name(kind).replace("/msg/", "/")
