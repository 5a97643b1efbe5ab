"""A partner's joints, frames, stop, motors and expression as ROS 2 messages.

This module needs the extra ``ros``.
"""

from collections.abc import Mapping, Sequence
from math import hypot
from typing import NamedTuple

from miburi.doors.ros_network import RosNetwork
from miburi.doors.ros_types import (
    DiagnosticArrayMsg,
    DiagnosticStatusMsg,
    ExpressionMsg,
    HeaderMsg,
    JointStateMsg,
    KeyValueMsg,
    QuaternionMsg,
    TFMessageMsg,
    TimeMsg,
    TransformMsg,
    TransformStampedMsg,
    Vector3Msg,
)
from miburi.errors import InputError
from miburi.live.state import Expressed, MotorOut, MotorsOut, State, StopOut
from miburi.robot import JOINTS, Robot, shape
from miburi.safety.stop import StopReason
from miburi.wire.messages import ExpressIn

#: ROS4HRI's word for no feeling.
NEUTRAL_WORD = "neutral"
_SECOND = 1_000_000_000
_OK, _WARNING, _ERROR, _STALE = range(4)
#: A motor is reported with a warning within this many °C of its temperature limit (our choice).
_NEARLY_HOT = 10.0


class Place(NamedTuple):
    """A feeling's word in ROS4HRI, and its valence and arousal, −1 to 1."""

    word: str
    valence: float
    arousal: float


#: We chose the words from those of hri_msgs/Expression. Valence and arousal are people's ratings of
#: happy, sad, terrified, fearful, excited, disgusted, angry and surprised (pleasure and arousal in
#: Russell and Mehrabian 1977, "Evidence for a three-factor theory of emotions", Journal of Research
#: in Personality 11).
PLACES: dict[str, Place] = {
    "happiness": Place("happy", 0.81, 0.51),
    "sadness": Place("sad", -0.63, -0.27),
    "fright": Place("horrified", -0.62, 0.82),
    "fear": Place("scared", -0.64, 0.60),
    "thrill": Place("excited", 0.62, 0.75),
    "disgust": Place("disgusted", -0.60, 0.35),
    "anger": Place("angry", -0.51, 0.59),
    "surprise": Place("surprised", 0.40, 0.67),
}


def _header(stamp: int, frame: str = "") -> HeaderMsg:
    return HeaderMsg(TimeMsg(stamp // _SECOND, stamp % _SECOND), frame)


def joint_state(stamp: int, angles: Sequence[float], velocities: Sequence[float]) -> JointStateMsg:
    """Return the joints: ``stamp`` in ns, angles in rad, velocities in rad/s, (8,) each."""
    return JointStateMsg(_header(stamp), list(JOINTS), list(angles), list(velocities), [])


def frames(
    links: Sequence[shape.Link], network: RosNetwork, stamp: int, angles: Sequence[float]
) -> TFMessageMsg:
    """Return where each link is relative to its parent, as robot_state_publisher does."""
    return _transforms(network, stamp, shape.frames(links, angles))


def fixed_frames(robot: Robot, network: RosNetwork, stamp: int) -> TFMessageMsg:
    """Return the frames of hands and head, which are fixed to their links."""
    return _transforms(network, stamp, shape.fixed_frames(robot))


def _transforms(network: RosNetwork, stamp: int, frames: Sequence[shape.LinkFrame]) -> TFMessageMsg:
    return TFMessageMsg(
        [
            TransformStampedMsg(
                _header(stamp, network.frame(frame.parent)),
                network.frame(frame.child),
                TransformMsg(Vector3Msg(*map(float, frame.position)), QuaternionMsg(*frame.turn)),
            )
            for frame in frames
        ]
    )


def diagnose(
    network: RosNetwork, stamp: int, state: State | None, motors: MotorsOut
) -> DiagnosticArrayMsg:
    """Return the status of contact stop and motors; a ``state`` of None means unreachable."""
    name = network.name or "miburi"
    hardware = motors.body if motors.port is None else f"{motors.body} at {motors.port}"
    stop = _stop_status(None if state is None else state.stop)
    if state is None:
        stop.level, stop.message = _STALE, "the robot cannot be reached"
    else:
        now = {"body": state.phase, "held": state.held, "paused": state.paused}
        stop.values = [*stop.values, *_values(now)]
    each = [_motor_status(motor, motors) for motor in motors.motors]
    for status in (stop, *each):
        status.name, status.hardware_id = f"{name}: {status.name}", hardware
    return DiagnosticArrayMsg(_header(stamp), [stop, *each])


def stop_report(stamp: int, stop: StopOut | None) -> DiagnosticArrayMsg:
    """Return the diagnosis of a stop alone; None says that it has ended."""
    return DiagnosticArrayMsg(_header(stamp), [_stop_status(stop)])


def _stop_status(stop: StopOut | None) -> DiagnosticStatusMsg:
    if stop is None:
        return DiagnosticStatusMsg(_OK, "contact stop", "not stopped", "", [])
    motor = "" if stop.motor is None else f" at {stop.motor}"
    expected = stop.reason.passes or stop.reason is StopReason.ASKED
    return DiagnosticStatusMsg(
        _WARNING if expected else _ERROR,
        "contact stop",
        f"stopped: {stop.reason.spoken}{motor}",
        "",
        _values(
            {
                "reason": stop.reason.value,
                "motor": stop.motor,
                "sign": stop.sign,
                "ratio": stop.ratio,
                "force_N": stop.force,
                "part": stop.part,
                "time_s": stop.time,
            }
        ),
    )


def _motor_status(motor: MotorOut, motors: MotorsOut) -> DiagnosticStatusMsg:
    level, message = _OK, "ok"
    if motor.answers is False:
        level, message = _ERROR, "does not answer"
    elif _is_hot(motor.temperature, motors.hottest):
        level, message = _WARNING, f"hot; the body stops at {motors.hottest:g} °C"
    values = {"temperature_C": motor.temperature, "voltage_V": motor.voltage, "servo": motor.servo}
    return DiagnosticStatusMsg(level, motor.joint, message, "", _values(values))


def _is_hot(temperature: float | None, hottest: float | None) -> bool:
    return temperature is not None and hottest is not None and temperature > hottest - _NEARLY_HOT


def _values(values: Mapping[str, object]) -> list[KeyValueMsg]:
    return [KeyValueMsg(key, str(value)) for key, value in values.items() if value is not None]


def express(stamp: int, shown: Expressed | None) -> ExpressionMsg | None:
    """Return the feeling felt or shown, with valence and arousal scaled by its mood.

    Return None for a feeling that a user has added, as ROS4HRI has no word for it.
    """
    if shown is None:
        return ExpressionMsg(_header(stamp), NEUTRAL_WORD, 0.0, 0.0, 1.0)
    place = PLACES.get(shown.feeling)
    if place is None:
        return None
    valence, arousal = shown.mood * place.valence, shown.mood * place.arousal
    return ExpressionMsg(_header(stamp), place.word, valence, arousal, 1.0)


def read_expression(wish: ExpressionMsg) -> ExpressIn | None:
    """Return the gesture for a ROS expression message; None for neutral.

    An expression has a word, or valence and arousal, or both. Without a word, valence and arousal
    select the feeling with the nearest direction. Their length is the intensity. The confidence is
    ignored.

    Raises InputError if it has neither, has an unknown word, or its values are out of range.
    """
    length = hypot(wish.valence, wish.arousal)
    if not length <= hypot(1, 1):
        raise InputError(
            f"valence and arousal are from -1 to 1, got {wish.valence:g} and {wish.arousal:g}."
        )
    if wish.expression == NEUTRAL_WORD:
        return None
    if wish.expression or not length:
        feelings = [name for name, place in PLACES.items() if place.word == wish.expression]
    else:
        feelings = [max(PLACES, key=lambda name: _likeness(PLACES[name], wish))]
    if not feelings:
        known = ", ".join((NEUTRAL_WORD, *(place.word for place in PLACES.values())))
        raise InputError(
            f"it can show {known}, or a valence and an arousal; got {wish.expression[:40]!r}."
        )
    if not length:
        return ExpressIn(feeling=feelings[0])
    return ExpressIn(feeling=feelings[0], mood=min(length, 1.0))


def _likeness(place: Place, wish: ExpressionMsg) -> float:
    """Return the requested valence and arousal projected on a feeling's direction."""
    along = place.valence * wish.valence + place.arousal * wish.arousal
    return along / hypot(place.valence, place.arousal)
