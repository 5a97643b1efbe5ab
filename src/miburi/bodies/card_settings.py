"""What the card must know of the body: the rule's figures, limits, and each joint's servo.

``firmware/miburi/settings.h`` is the other side; it refuses values outside its safe ranges.
"""

import struct
from dataclasses import astuple, dataclass, replace

import numpy as np

from miburi.bodies.controller import RETURN_SPEED
from miburi.bodies.link import crc16
from miburi.contact import Guards, Rule
from miburi.motion import to_steps
from miburi.robot import Robot

_GENERAL = struct.Struct("<i6H2B")
_JOINT = struct.Struct("<BbHhhhihhhh")
#: Current of an XL330-M288 for each N·m, from its stall at 5 V: 1.47 A, 0.52 N·m.
MILLIAMPERES_PER_NM = 1470 / 0.52
#: Servos hotter than this, in °C, or with a lower supply, in 0.1 V, stop the body (ours).
HOTTEST, LOWEST = 65, 42
#: The servo's middle position.
_MIDDLE = 2048


def real_speed(speed: int) -> int:
    """Return what an XL330 does when asked for steps/s: whole units of 0.229 turns/min."""
    return (max((speed * 1000 + 7816) // 15_633, 1) * 15_633 + 500) // 1000


def real_acceleration(acceleration: int) -> int:
    """Return the same for steps/s², in units of 214.577 turns/min²."""
    return (max((acceleration * 1000 + 122_070) // 244_141, 1) * 244_141 + 500) // 1000


@dataclass(frozen=True)
class General:
    """Figures for all joints: µs, 1/10 000, steps/s², steps/s, mA, °C, 0.1 V, in this order."""

    period: int
    ratio: int
    acceleration: int
    max_speed: int
    return_speed: int
    move_current: int
    hold_current: int
    hottest: int = HOTTEST
    lowest: int = LOWEST

    def pack(self) -> bytes:
        """Return the bytes that the card takes."""
        return _GENERAL.pack(*astuple(self))

    @classmethod
    def unpack(cls, data: bytes) -> "General":
        """Read the card's bytes."""
        return cls(*_GENERAL.unpack(data))


@dataclass(frozen=True)
class JointSettings:
    """One joint's servo, limits (steps from the joint's zero) and guards (µs and steps).

    Attributes
    ----------
    servo
        The servo's id on the bus.
    direction
        +1 or −1: the sign of the joint's angle against the servo's.
    zero
        The servo's position, 0–4095, at joint angle 0.
    """

    servo: int
    direction: int
    zero: int
    min: int
    max: int
    neutral: int
    lag: int
    slack: int
    least: int
    tracking: int
    arrival: int

    def pack(self) -> bytes:
        """Return the bytes that the card takes."""
        return _JOINT.pack(*astuple(self))

    @classmethod
    def unpack(cls, data: bytes) -> "JointSettings":
        """Read the card's bytes."""
        return cls(*_JOINT.unpack(data))


@dataclass(frozen=True)
class CardSettings:
    """All that the card must be told, in the order of ``JOINTS``."""

    general: General
    joints: tuple[JointSettings, ...]

    @classmethod
    def of(cls, robot: Robot) -> "CardSettings":
        """Return settings for a robot that has not been calibrated.

        Servos have the ids 1–8 and are mounted so that the middle of each joint's range is the
        servo's middle.
        """
        rule, step = Rule.of(robot), robot.servo.step
        lower, upper = to_steps(robot, robot.lower), to_steps(robot, robot.upper)
        neutral = to_steps(robot, robot.neutral)
        guards = zip(*(getattr(rule.guards, name).tolist() for name in GUARDS), strict=True)
        return cls(
            General(
                period=rule.period,
                ratio=rule.ratio,
                acceleration=round(robot.servo.acceleration / step),
                max_speed=round(robot.servo.max_speed / step),
                return_speed=round(RETURN_SPEED / step),
                move_current=round(robot.servo.stall_torque * MILLIAMPERES_PER_NM),
                hold_current=round(robot.servo.hold_torque * MILLIAMPERES_PER_NM),
            ),
            tuple(
                JointSettings(
                    i + 1,
                    1,
                    _MIDDLE - int(lower[i] + upper[i]) // 2,
                    int(lower[i]),
                    int(upper[i]),
                    int(neutral[i]),
                    *of_joint,
                )
                for i, of_joint in enumerate(guards)
            ),
        )

    def with_servos(self, other: "CardSettings") -> "CardSettings":
        """Return these settings with the other's ids, directions, zeros and guards."""
        kept = ("servo", "direction", "zero", *GUARDS)
        joints = (
            replace(mine, **{name: getattr(theirs, name) for name in kept})
            for mine, theirs in zip(self.joints, other.joints, strict=True)
        )
        return replace(self, joints=tuple(joints))

    @property
    def rule(self) -> Rule:
        """The contact rule that the card follows with these settings."""
        guards = {
            name: np.array([getattr(joint, name) for joint in self.joints], dtype=np.int64)
            for name in GUARDS
        }
        return Rule(Guards(**guards), self.general.period, self.general.ratio)

    @property
    def crc(self) -> int:
        """The check sum by which the card names the settings that it has."""
        return crc16(self.general.pack() + b"".join(joint.pack() for joint in self.joints))


#: The guards' names, in the card's order.
GUARDS = ("lag", "slack", "least", "tracking", "arrival")
#: Names of the values in the order in which the card counts them when it refuses one.
GENERAL_NAMES = tuple(General.__dataclass_fields__)
JOINT_NAMES = tuple(JointSettings.__dataclass_fields__)
