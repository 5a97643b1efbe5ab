"""Read a robot's description from one TOML file into one immutable :class:`Robot`.

The file holds the lengths, joint limits, servo, guards, masses and outer shape. Everything that
Miburi knows of a robot is derived from it.
"""

from functools import cached_property, lru_cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, Strict, ValidationInfo, model_validator

from miburi.errors import InputError
from miburi.ground.tables import Table, between, load_table
from miburi.robot.guards import Guards, check_ranges
from miburi.servos import Servo, load_servo

Array = NDArray[np.float64]

#: The eight joints in the paper's order (Table 1); every array of eight follows it.
JOINTS = (
    "waist",
    "right_shoulder",
    "right_elbow",
    "right_fingertip",
    "left_shoulder",
    "left_elbow",
    "left_fingertip",
    "head",
)
#: The order of the three extremities in every array of nine coordinates.
EXTREMITIES = ("right", "left", "head")

Positive = Annotated[float, Field(gt=0)]
Length = Annotated[Positive, between(0.015, 1, "lengths are in metres")]
Size = Annotated[Positive, between(0.001, 0.5, "sizes are in metres")]
Mass = Annotated[Positive, between(0.001, 5, "masses are in kg")]


class Lengths(Table):
    """The six static lengths of Section 3, in m."""

    L01: Length
    L12: Length
    L23: Length
    L34: Length
    LH1: Length
    LH2: Length


class Joint(Table):
    """One motor: its symbol in the paper, its range (Table 1) and its neutral angle, in rad."""

    symbol: str
    min: Annotated[float, Field(ge=-np.pi, le=np.pi)]
    max: Annotated[float, Field(ge=-np.pi, le=np.pi)]
    neutral: float

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.min < self.max:
            raise ValueError(f"min must be less than max, got min {self.min} and max {self.max}")
        if not self.min <= self.neutral <= self.max:
            raise ValueError(
                f"neutral must lie between min {self.min} and max {self.max}, got {self.neutral}"
            )
        return self


_ODD = {True: "missing", False: "not a known joint"}


class Joints(Table):
    """The eight joints, in the paper's order."""

    waist: Joint
    right_shoulder: Joint
    right_elbow: Joint
    right_fingertip: Joint
    left_shoulder: Joint
    left_elbow: Joint
    left_fingertip: Joint
    head: Joint

    @model_validator(mode="before")
    @classmethod
    def _of_one_body(cls, value: object) -> object:
        if isinstance(value, dict) and (odd := value.keys() ^ JOINTS):
            told = (f"joints.{name} is {_ODD[name in JOINTS]}" for name in sorted(odd))
            raise ValueError(
                f"{', '.join(told)}. Miburi knows one body: a waist, two arms of three joints each "
                "and a head; its lengths, limits, masses and servo may differ"
            )
        return value


def _servo(value: object, info: ValidationInfo) -> object:
    """Load the servo that the file names; a path is relative to the description's own folder."""
    if not isinstance(value, str):
        return value
    folder = (info.context or {}).get("folder", Path())
    return load_servo(folder / value if value.endswith(".toml") else value)


#: The largest share of a motor's full duty with which a stopped body may hold (``settings.h``).
HOLD = 400 / 885


class ServoTable(Table):
    """The servo of every joint, and the speed, acceleration and torque that are asked of it.

    The units are rad/s, rad/s², and N·m at the horn.
    """

    model: Annotated[Servo, BeforeValidator(_servo)]
    max_speed: Annotated[Positive, between(0.05, 20, "it is in rad/s")]
    acceleration: Annotated[Positive, between(0.4, 500, "it is in rad/s²")]
    hold_torque: Positive

    @model_validator(mode="after")
    def _soft(self) -> Self:
        self.check_hold()
        return self

    @property
    def hold_duty(self) -> float:
        """The share of full duty with which a stopped motor holds ``hold_torque``."""
        servo = self.model
        return self.hold_torque / (1 - servo.friction.motor_load) / servo.motor_torque

    def check_hold(self) -> None:
        """Raise InputError if a person could hardly move the stopped body."""
        if self.hold_duty > HOLD:
            raise InputError(
                f"hold_torque = {self.hold_torque:g}: it is in N·m, and a stopped body must stay "
                f"soft, so {self.model.name} may hold with at most "
                f"{self.hold_torque * HOLD / self.hold_duty:.3f} ({HOLD:.0%} of its duty)"
            )

    @property
    def step(self) -> float:
        """Angle of one encoder step, in rad."""
        return self.model.step


_Grant = Annotated[float, Strict(), Field(ge=0, le=1)]
#: The contact rule's guards (allowed lags and deviations) for the eight motors, in s and rad.
GuardsTable: TypeAlias = Guards[Annotated[list[_Grant], Field(min_length=8, max_length=8)]]


class Masses(Table):
    """Masses in kg; those of arm parts are for one arm.

    :func:`~miburi.robot.shape.parts` adds 10 g each for neck and nod, and a base of 0.5 kg.
    """

    torso: Mass
    upper_arm: Mass
    forearm: Mass
    shoulder: Mass
    phone: Mass


class Shape(Table):
    """Outer dimensions in m, and the head angle at which the screen is upright, in rad.

    ``phone_below`` is how far the phone reaches below the head's centre; None means half its
    height.
    """

    pedestal_height: Length
    pedestal_radius: Length
    torso_radius: Size
    arm_radius: Size
    hand_radius: Size
    phone_width: Size
    phone_height: Size
    phone_thickness: Size
    phone_level: float
    phone_below: Size | None = None

    @model_validator(mode="after")
    def _like_a_phone(self) -> Self:
        if self.phone_height < 0.4 * self.phone_width:
            raise ValueError("phone_height must be at least 0.4 times phone_width")
        return self

    @property
    def phone_drop(self) -> float:
        """How far the phone reaches below the head's centre, in m; by default half its height."""
        return self.phone_height / 2 if self.phone_below is None else self.phone_below


class Robot(Table):
    """A robot like the iphonoid: a waist, two arms of three joints and a head."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
    lengths: Lengths
    joints: Joints
    servo: ServoTable
    guards: GuardsTable
    masses: Masses
    shape: Shape

    @model_validator(mode="after")
    def _in_range(self) -> Self:
        check_ranges(self.guards)
        return self

    @cached_property
    def lower(self) -> Array:
        """Smallest allowed angles, (8,) rad (Table 1)."""
        return self._of_joints("min")

    @cached_property
    def upper(self) -> Array:
        """Largest allowed angles, (8,) rad (Table 1)."""
        return self._of_joints("max")

    @cached_property
    def neutral(self) -> Array:
        """The pose at rest, (8,) rad."""
        return self._of_joints("neutral")

    def with_servo(self, servo: Servo) -> "Robot":
        """Return this robot with another servo; its guards do not change, and may no longer fit."""
        table = self.servo.model_copy(update={"model": servo})
        return self.model_copy(update={"servo": table})

    def _of_joints(self, field: str) -> Array:
        values = np.array([getattr(getattr(self.joints, name), field) for name in JOINTS])
        values.flags.writeable = False
        return values


def load_robot(path: Path | str) -> Robot:
    """Read and check a robot description.

    ``path`` is a TOML file with exactly the keys of ``iphonoid.toml``.

    Raises
    ------
    DescriptionError
        The file cannot be read or is not TOML, or a key is missing, unknown or out of range. The
        message names the file, every wrong key, its value and what is allowed.
    """
    return load_table(Robot, path)


@lru_cache(maxsize=1)
def iphonoid() -> Robot:
    """Return the paper's robot, from the description that ships with Miburi."""
    return _shipped("iphonoid")


@lru_cache(maxsize=1)
def buildable() -> Robot:
    """Return the robot that can be printed and built: the iphonoid with room for its servos."""
    return _shipped("buildable")


def _shipped(name: str) -> Robot:
    with resources.as_file(resources.files(__package__) / f"{name}.toml") as path:
        return load_robot(path)
