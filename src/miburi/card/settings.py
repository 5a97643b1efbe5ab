"""The settings of a card: the rule's parameters, and the limits and servo of each joint.

A robot's description, with a calibration if there is one, becomes the bytes that the card takes. A
card compares each motor with the model of an unhindered servo (:mod:`miburi.safety.free`), so each
joint has constants of its own. Their counterpart on the card, ``firmware/miburi/settings.h``,
refuses values outside the ranges in ``ALLOWED``.
"""

import struct
from dataclasses import astuple, dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from miburi.calibration.file import Mounting
from miburi.card.link import crc16
from miburi.card.units import STEPS_PER_TURN, check_encoder
from miburi.errors import InputError
from miburi.robot import JOINTS, Robot
from miburi.robot.description import HOLD
from miburi.robot.guards import GUARDS, Guards, by_motor
from miburi.safety.contact import Rule
from miburi.safety.controller import RETURN_SPEED
from miburi.safety.drive import aim
from miburi.safety.profile import FINE, to_steps
from miburi.servos import Servo

if TYPE_CHECKING:
    from miburi.safety.free import FreeRule


_GENERAL = struct.Struct("<i8H2B")
_JOINT = struct.Struct("<BbHhhh" + "".join(guard.unit.code for guard in GUARDS.values()) + "3HBH")
#: Full duty of an XL330, in units of its registers 36 and 100; as in ``settings.h``.
FULL_PWM = 885
#: A servo stops the body if it is hotter than this, in °C, or if its supply falls below this, in
#: units of 0.1 V (our choice).
HOTTEST, LOWEST = 65, 42
#: The least distance, in steps, between a joint's range and the point where the encoder's count
#: wraps around; as in ``settings.h``.
SEAM = 100
#: The settings of :class:`General` that belong to a calibration.
_CALIBRATED = ("period", "ratio", "p_gain", "d_gain", "error_per_pwm")
_MIDDLE = STEPS_PER_TURN // 2
#: Least and greatest value that the card accepts (``settings.h``), and the unit. The card also
#: refuses a joint range that comes near the servo's seam.
ALLOWED = {
    "period": (20_000, 200_000, "µs"),
    "ratio": (8000, 10_000, "parts of 10 000"),
    "acceleration": (244, 40_000, "steps/s²"),
    "max_speed": (16, 6957, "steps/s"),
    "return_speed": (16, 1304, "steps/s"),
    "hold_pwm": (0, round(HOLD * FULL_PWM), "of 885"),
    "p_gain": (100, 16_383, ""),
    "d_gain": (0, 16_383, ""),
    "error_per_pwm": (256, 32_000, "× 1/65536 steps"),
    "hottest": (40, 75, "°C"),
    "lowest": (35, 60, "× 0.1 V"),
    "servo": (0, 252, ""),
    "direction": (-1, 1, ""),
    "zero": (0, 4095, "steps"),
    **{name: (guard.low, guard.high, guard.unit.whole) for name, guard in GUARDS.items()},
    "pull": (1, 16_383, "× 1/65536"),
    "brake": (0, 65_535, "× 1/65536"),
    "friction": (0, 32_767, "× 1/65536 steps for each 5 ms"),
    "lost": (0, 255, "× 1/256"),
    "sag": (0, 768, "× 1/256"),
}
#: The keys of a robot's or servo's file from which settings follow.
_KEYS = {
    "acceleration": "servo.acceleration",
    "max_speed": "servo.max_speed",
    "hold_pwm": "servo.hold_torque",
    "p_gain": "drive.gain",
    "d_gain": "gains.d",
    "error_per_pwm": "divisor.p_divisor divided by drive.gain",
    "pull": "the stiffness (drive.gain, divisor and motor) divided by the inertia",
    "brake": "the damping (motor.back_emf, friction.viscous) divided by the inertia",
    "friction": "friction.dry and friction.stiction divided by the inertia",
    "lost": "friction.motor_load",
}


@dataclass(frozen=True)
class General:
    """The settings for all joints, in the order of their bytes; ``ALLOWED`` has the units.

    Attributes
    ----------
    period, ratio
        The contact rule's period p, and the least share of the commanded travel that a motor must
        make.
    acceleration, max_speed, return_speed
        The moves' ramps and cruising speed, and the speed of the return to neutral.
    hold_pwm
        The duty with which a stopped servo holds.
    p_gain, d_gain
        The position gains that the card writes to its servos.
    error_per_pwm
        The position error at which a servo uses one unit of duty; so its error shows its load.
    hottest, lowest
        The body is stopped if a servo is hotter than this, or the supply's voltage lower than this.
    """

    period: int
    ratio: int
    acceleration: int
    max_speed: int
    return_speed: int
    hold_pwm: int
    p_gain: int
    d_gain: int
    error_per_pwm: int
    hottest: int = HOTTEST
    lowest: int = LOWEST

    def pack(self) -> bytes:
        """Return the bytes to send to the card."""
        return _GENERAL.pack(*astuple(self))

    @classmethod
    def unpack(cls, data: bytes) -> "General":
        """Read the bytes that a card sent."""
        return cls(*_GENERAL.unpack(data))


class FreeMotor(NamedTuple):
    """The model of one motor; :class:`miburi.servos.free.FreeServo` explains the units."""

    pull: int
    brake: int
    friction: int
    lost: int


@dataclass(frozen=True)
class JointSettings:
    """One joint's servo, its limits, its guards and its model.

    Limits are in steps from the joint's zero, guards in µs and in steps.

    Attributes
    ----------
    servo
        The servo's id on the bus.
    direction
        +1 if joint and servo turn the same way, −1 if they turn opposite ways.
    zero
        The servo's position, 0–4095, at joint angle 0.
    sag
        The position error of this servo under weight, in 1/256 of the error that the description
        predicts.
    """

    servo: int
    direction: int
    zero: int
    min: int
    max: int
    neutral: int
    guards: Guards[int]
    free: FreeMotor
    sag: int = FINE

    @property
    def values(self) -> dict[str, int]:
        """All values by name, in the order of their bytes; the card numbers them in this order."""
        own = dict(vars(self))
        guards: Guards[int] = own.pop("guards")
        free: FreeMotor = own.pop("free")
        sag: int = own.pop("sag")
        return own | vars(guards) | free._asdict() | {"sag": sag}

    def pack(self) -> bytes:
        """Return the bytes to send to the card."""
        return _JOINT.pack(*self.values.values())

    @classmethod
    def unpack(cls, data: bytes) -> "JointSettings":
        """Read the bytes that a card sent."""
        servo, direction, zero, low, high, neutral, *others, sag = _JOINT.unpack(data)
        guards, free = Guards(*others[: len(GUARDS)]), FreeMotor(*others[len(GUARDS) :])
        return cls(servo, direction, zero, low, high, neutral, guards, free, sag)


@dataclass(frozen=True)
class CardSettings:
    """All settings of a card.

    Attributes
    ----------
    general, joints
        The settings for all joints, and the settings of each joint, in the order of ``JOINTS``.
    """

    general: General
    joints: tuple[JointSettings, ...]

    @classmethod
    def of(cls, robot: Robot, rule: Rule | None = None) -> "CardSettings":
        """Return settings for a robot whose card has not been calibrated.

        By default the rule has the guards of the robot's description. Servos have the ids 1–8, and
        the middle of each joint's range is at the middle of its servo.

        Raises
        ------
        BodyError
            The robot's encoders are not those of the card's servos.
        InputError
            The robot or its servo has a value that a card does not take.
        """
        check_encoder(robot)
        from miburi.safety.free import FreeRule  # it loads Numba

        free = FreeRule.of(robot)
        rule, step, servo = rule or free, robot.servo.step, robot.servo.model
        lower, upper = to_steps(robot, robot.lower), to_steps(robot, robot.upper)
        neutral = to_steps(robot, aim(robot, robot.neutral))
        made = cls(
            General(
                period=rule.period,
                ratio=rule.ratio,
                acceleration=round(robot.servo.acceleration / step),
                max_speed=round(robot.servo.max_speed / step),
                return_speed=round(RETURN_SPEED / step),
                hold_pwm=round(robot.servo.hold_duty * FULL_PWM),
                p_gain=round(servo.drive.gain),
                d_gain=round(servo.gains.d),
                error_per_pwm=_error_per_pwm(servo),
            ),
            tuple(
                JointSettings(
                    i + 1,
                    1,
                    _MIDDLE - int(lower[i] + upper[i]) // 2,
                    int(lower[i]),
                    int(upper[i]),
                    int(neutral[i]),
                    guards,
                    FreeMotor(*(int(values[i]) for values in free.servo)),
                )
                for i, guards in enumerate(by_motor(rule.guards))
            ),
        )
        made._check(robot)
        return made

    def _check(self, robot: Robot) -> None:
        for values in (vars(self.general), *(joint.values for joint in self.joints)):
            for name, key in _KEYS.items():
                low, high, _ = ALLOWED[name]
                if not low <= values.get(name, low) <= high:
                    raise InputError(
                        f"{robot.name} with {robot.servo.model.name} does not fit a card: "
                        f"{key} gives a {name} of {format_value(name, values[name])}; a "
                        f"card takes {format_value(name, low)} to {format_value(name, high)}."
                    )

    def with_servos(self, robot: Robot, rule: "FreeRule") -> "CardSettings":
        """Return these settings with the gain of ``robot`` and the rule of its servos."""
        servo, sag = robot.servo.model, np.clip(rule.sag, *ALLOWED["sag"][:2])
        joints = (
            replace(joint, free=FreeMotor(*map(int, free)), sag=int(own))
            for joint, own, *free in zip(self.joints, sag, *rule.servo, strict=True)
        )
        gain = round(servo.drive.gain)
        general = replace(self.general, p_gain=gain, error_per_pwm=_error_per_pwm(servo))
        return CardSettings(general, tuple(joints)).with_rule(rule)

    def identified(self, robot: Robot) -> Robot:
        """Return the description with the servos that these settings assume.

        The gain of these servos is the gain that the card sets. Their stiffness follows from the
        error for each unit of duty, and their friction from how much torque the gears absorb.
        """
        servo, own = robot.servo.model, self.general
        if (own.p_gain, own.error_per_pwm) != (round(servo.drive.gain), _error_per_pwm(servo)):
            changes = {"p_divisor": own.error_per_pwm * own.p_gain / 65_536}
            divisor = servo.divisor.model_copy(update={} if servo.gains.d else changes)
            drive = servo.drive.model_copy(update={"gain": float(own.p_gain)})
            servo = servo.model_copy(update={"divisor": divisor, "drive": drive})
        described = round(servo.friction.motor_load * FINE)
        lost = float(np.median([joint.free.lost for joint in self.joints]))
        if 0 < described < lost:
            servo = servo.varied(friction=lost / described)
        return robot if servo is robot.servo.model else robot.with_servo(servo)

    def with_rule(self, rule: Rule) -> "CardSettings":
        """Return these settings with a rule's period, ratio and guards."""
        joints = (
            replace(joint, guards=guards)
            for joint, guards in zip(self.joints, by_motor(rule.guards), strict=True)
        )
        general = replace(self.general, period=rule.period, ratio=rule.ratio)
        return CardSettings(general, tuple(joints))

    def with_mounting(self, mounting: Mounting) -> "CardSettings":
        """Return these settings with other ids, directions and zeros."""
        columns = zip(mounting.id, mounting.direction, mounting.zero, strict=True)
        joints = (
            replace(joint, servo=servo, direction=direction, zero=zero)
            for joint, (servo, direction, zero) in zip(self.joints, columns, strict=True)
        )
        return replace(self, joints=tuple(joints))

    def with_calibration(self, other: "CardSettings") -> "CardSettings":
        """Return these settings with the mounting, rule, servos and gains of ``other``.

        The rule that an interrupted calibration has left on a card is not kept.
        """
        mounted = self.with_mounting(other.mounting)
        if other.generous == other:
            return mounted
        joints = (
            replace(joint, guards=found.guards, free=found.free, sag=found.sag)
            for joint, found in zip(mounted.joints, other.joints, strict=True)
        )
        found = {name: vars(other.general)[name] for name in _CALIBRATED}
        return CardSettings(replace(self.general, **found), tuple(joints))

    @property
    def generous(self) -> "CardSettings":
        """These settings with wide guards, for a card whose servos have not been measured."""
        guards = Guards(*(guard.generous for guard in GUARDS.values()))
        return replace(self, joints=tuple(replace(joint, guards=guards) for joint in self.joints))

    @property
    def mounting(self) -> Mounting:
        """How the servos are mounted."""
        return Mounting(
            id=[joint.servo for joint in self.joints],
            direction=[1 if joint.direction > 0 else -1 for joint in self.joints],
            zero=[joint.zero for joint in self.joints],
        )

    @property
    def rule(self) -> "FreeRule":
        """The contact rule that the card follows with these settings."""
        from miburi.safety.free import FreeRule  # it loads Numba
        from miburi.servos.free import FreeServo

        guards = np.array([astuple(joint.guards) for joint in self.joints], dtype=np.int64).T
        servo = np.array([joint.free for joint in self.joints], dtype=np.int64).T
        general = self.general
        return FreeRule(
            Guards(*guards),
            general.period,
            general.ratio,
            servo=FreeServo(*servo),
            sag=np.array([joint.sag for joint in self.joints], dtype=np.int64),
        )

    @property
    def crc(self) -> int:
        """The checksum by which host and card compare their settings."""
        return crc16(self.general.pack() + b"".join(joint.pack() for joint in self.joints))


def _error_per_pwm(servo: Servo) -> int:
    """Return the error at which a servo uses one unit of duty, in 1/65536 steps."""
    # With a D gain, the same error needs less duty, so the duty sets no limit to the error.
    most = ALLOWED["error_per_pwm"][1]
    return most if servo.gains.d else round(servo.divisor.p_divisor / servo.drive.gain * 65_536)


def refusal(settings: CardSettings, piece: int, index: int) -> str:
    """Return the message for a value that the card refused; ``piece`` is its joint, 8 for all."""
    of_joint = piece < len(JOINTS)
    values = settings.joints[piece].values if of_joint else vars(settings.general)
    name, value = list(values.items())[index]
    if name in ("min", "max"):
        joint = settings.joints[piece]
        return (
            f"The card refuses {JOINTS[piece]}: its range from {joint.min} to {joint.max} steps "
            f"about its zero at {joint.zero} crosses the servo's seam between 4095 and 0, or comes "
            f"within {SEAM} steps of it. Mount the horn a quarter turn further, and find the zero "
            "again."
        )
    joint_range = (settings.joints[piece].min, settings.joints[piece].max) if of_joint else (0, 0)
    low, high = ALLOWED[name][:2] if name in ALLOWED else joint_range
    whose = f"{JOINTS[piece]}'s {name}" if of_joint else name
    return (
        f"The card refuses {whose} {format_value(name, value)}: it must be from "
        f"{format_value(name, low)} to {format_value(name, high)}."
    )


def format_value(name: str, value: int) -> str:
    """Return a value of the settings as text with its unit."""
    unit = ALLOWED[name][2] if name in ALLOWED else "steps"
    if unit == "µs":
        return f"{value / 1000:g} ms"
    if name == "ratio":
        return f"{value / 10_000:g}"
    return f"{value} {unit}".rstrip()
