"""A servo's constants: one TOML file, checked once and loaded into an immutable ``Servo``.

Every table of the file states its source, and whether its numbers are the maker's, other people's
or ours. Values that follow from the constants alone, such as the stiffness of the position control,
are properties here; those that depend on a motor's state are in :mod:`miburi.servos.voltage`.
"""

from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from miburi.errors import InputError
from miburi.ground.tables import Table, between, load_table

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(ge=0, lt=1)]
# The ranges are far wider than any small servo; they find numbers in another unit.
_Torque = Annotated[NotNegative, between(0, 1, "it is in N·m")]
_REGISTER = between(0, 65_535, "it is in units of its register")
_DIVISOR = between(0.1, 1e6, "it divides a register")

#: The servos that ship with Miburi.
SERVOS: tuple[str, ...] = ("xl330-m288-t", "imagined")


class Origin(Table):
    """Where a table's numbers come from."""

    standing: Literal["identified by others", "data sheet", "ours"]
    source: str


class MotorTable(Origin):
    """The motor as seen through its gears, at the horn, in N·m/A, V·s/rad, Ω and kg·m²."""

    torque_constant: Annotated[Positive, between(0.01, 20, "it is in N·m/A")]
    back_emf: Annotated[NotNegative, between(0, 20, "it is in V·s/rad")]
    resistance: Annotated[Positive, between(0.05, 500, "it is in Ω")]
    armature: Annotated[Positive, between(1e-6, 0.5, "it is in kg·m²")]


class Friction(Origin):
    """The friction in a joint, in N·m and rad/s: see :func:`miburi.servos.voltage.dry_friction`."""

    dry: _Torque
    stiction: _Torque
    viscous: Annotated[NotNegative, between(0, 2, "it is in N·m·s/rad")]
    motor_load: Share
    load_stiction: Share
    stribeck_speed: Annotated[Positive, between(0.001, 60, "it is in rad/s")]
    stribeck_shape: Annotated[Positive, between(0.1, 50, "it is an exponent")]
    solver_time: Annotated[float, Field(gt=0, le=1)]
    solver_grip: Annotated[float, Field(gt=0, lt=1)]

    @property
    def row(self) -> tuple[float, float, float, float, float, float]:
        """The constants of the dry friction, in the order in which ``dry_friction`` takes them."""
        return (
            self.dry, self.stiction, self.motor_load, self.load_stiction,
            self.stribeck_speed, self.stribeck_shape,
        )  # fmt: skip


class DataSheet(Origin):
    """The maker's numbers at the nominal voltage, in N·m, rad/s and A."""

    stall_torque: Annotated[Positive, between(0.01, 50, "it is in N·m")]
    no_load_speed: Annotated[Positive, between(0.1, 60, "it is in rad/s")]
    stall_current: Annotated[Positive, between(0.01, 50, "it is in A")]


class Encoder(Origin):
    """The resolution of the servo's angle."""

    steps_per_turn: Annotated[int, Field(ge=256, le=1 << 16)]


class Gains(Origin):
    """The factory settings of the position control.

    The gains are in units of their registers, ``pwm_limit`` in PWM units and ``pwm_slope`` in V/s.
    """

    p: Annotated[NotNegative, _REGISTER]
    d: Annotated[NotNegative, _REGISTER]
    d_divisor: Annotated[Positive, _DIVISOR]
    pwm_limit: Annotated[int, between(100, 65_535, "it is in units of the PWM register")]
    pwm_slope: Annotated[Positive, between(1, 1e6, "it is in V/s")]


class Divisor(Origin):
    """The divisor of the P gain."""

    p_divisor: Annotated[Positive, _DIVISOR]


class ProfileTable(Origin):
    """The units of the profile's registers, in rad/s and rad/s²."""

    speed_unit: Annotated[Positive, between(1e-4, 0.15, "it is in rad/s")]
    acceleration_unit: Annotated[Positive, between(1e-4, 50, "it is in rad/s²")]


class Supply(Origin):
    """The supply's voltage (V), and the resistance that all servos share (Ω)."""

    voltage: Annotated[float, between(1, 50, "it is in V")]
    resistance: Annotated[NotNegative, between(0, 10, "it is in Ω")]


class Loop(Origin):
    """The control's rate (Hz) and its imperfections."""

    rate: Annotated[Positive, between(20, 100_000, "it is in Hz")]
    noise: Annotated[NotNegative, between(0, 20, "it is in encoder steps")]
    start_delay: Annotated[NotNegative, between(0, 0.1, "it is in s")]
    clock_error: Annotated[NotNegative, between(0, 0.2, "it is a share")]
    backlash: Annotated[NotNegative, between(0, 0.1, "it is in rad")]


class Drive(Origin):
    """How Miburi drives the servo: the P gain, and how a move's torque limit and goal are computed.

    The limit of a motor's torque is ``headroom`` times the torque that the move needs. After the
    acceleration, the limit is the torque that the rest of the move needs, plus the share ``room``
    of the motor's torque. With ``room`` = 1 the limit does not change. Goals are corrected by the
    share ``lift`` of the sag under load.
    """

    gain: Annotated[Positive, between(1, 65_535, "it is in units of the P gain's register")]
    headroom: Annotated[float, Field(ge=1, le=10_000)]
    room: Annotated[float, Field(ge=0, le=1)]
    lift: Annotated[float, Field(ge=0, le=1)]


class Servo(Table):
    """One kind of servo."""

    name: str
    motor: MotorTable
    friction: Friction
    data_sheet: DataSheet
    encoder: Encoder
    gains: Gains
    divisor: Divisor
    profile: ProfileTable
    supply: Supply
    loop: Loop
    drive: Drive

    @property
    def step(self) -> float:
        """The angle of one encoder step, in rad."""
        return 2 * np.pi / self.encoder.steps_per_turn

    @property
    def motor_torque(self) -> float:
        """The motor's stall torque, in N·m, at full duty and nominal voltage, without its gears."""
        return self.supply.voltage * self.motor.torque_constant / self.motor.resistance

    @property
    def duty_per_rad(self) -> float:
        """The duty per rad of position error."""
        gains = self.gains
        return self.drive.gain / self.divisor.p_divisor / gains.pwm_limit / self.step

    @property
    def duty_per_speed(self) -> float:
        """The duty by which the D gain brakes, per rad/s of speed."""
        gains = self.gains
        return gains.d / gains.d_divisor / gains.pwm_limit / self.loop.rate / self.step

    @property
    def stiffness(self) -> float:
        """The motor's torque per rad of position error at nominal voltage, in N·m/rad."""
        return self.duty_per_rad * self.motor_torque

    @property
    def control_damping(self) -> float:
        """The torque by which the D gain brakes at nominal voltage, in N·m per rad/s of speed."""
        return self.duty_per_speed * self.motor_torque

    @property
    def damping(self) -> float:
        """The damping by back EMF and viscous friction, whatever the duty, in N·m·s/rad."""
        motor = self.motor
        return motor.torque_constant * motor.back_emf / motor.resistance + self.friction.viscous

    def varied(self, *, friction: float) -> "Servo":
        """Return a servo with this one's dry friction times a factor."""
        names = ("dry", "stiction", "motor_load", "load_stiction")
        dry = {name: getattr(self.friction, name) * friction for name in names}
        return self.model_copy(update={"friction": self.friction.model_copy(update=dry)})


def load_servo(name: str | Path) -> Servo:
    """Read and check a servo.

    ``name`` is one of ``SERVOS``, or the path of a TOML file with exactly the keys of
    ``xl330-m288-t.toml``.

    Raises
    ------
    InputError
        There is no servo of that name, and it is not the path of a TOML file.
    DescriptionError
        The file cannot be read, is not TOML, or a key is missing, unknown or out of range.
    """
    if str(name) in SERVOS:
        with resources.as_file(resources.files(__package__) / f"{name}.toml") as path:
            return load_table(Servo, path)
    if Path(name).suffix != ".toml":
        raise InputError(
            f"there is no servo {str(name)!r}; choose one of {', '.join(SERVOS)}, or the path of "
            "a .toml file."
        )
    return load_table(Servo, name)
