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
from miburi.ground.tables import Table, load_table

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(ge=0, lt=1)]

#: The servos that ship with Miburi.
SERVOS: tuple[str, ...] = ("xl330-m288-t", "imagined")


class Origin(Table):
    """Where a table's numbers come from."""

    standing: Literal["identified by others", "data sheet", "ours"]
    source: str


class MotorTable(Origin):
    """The motor as seen through its gears, at the horn, in N·m/A, V·s/rad, Ω and kg·m²."""

    torque_constant: Positive
    back_emf: NotNegative
    resistance: Positive
    armature: Positive


class Friction(Origin):
    """The friction in a joint, in N·m and rad/s: see :func:`miburi.servos.voltage.dry_friction`."""

    dry: Positive
    stiction: NotNegative
    viscous: NotNegative
    motor_load: Share
    load_stiction: Share
    stribeck_speed: Positive
    stribeck_shape: Positive
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

    stall_torque: Positive
    no_load_speed: Positive
    stall_current: Positive


class Encoder(Origin):
    """The resolution of the servo's angle."""

    steps_per_turn: Annotated[int, Field(ge=256, le=1 << 16)]


class Gains(Origin):
    """The factory settings of the position control.

    The gains are in units of their registers, ``pwm_limit`` in PWM units and ``pwm_slope`` in V/s.
    """

    p: NotNegative
    d: NotNegative
    d_divisor: Positive
    pwm_limit: Annotated[int, Field(gt=0)]
    pwm_slope: Positive


class Divisor(Origin):
    """The divisor of the P gain."""

    p_divisor: Positive


class ProfileTable(Origin):
    """The units of the profile's registers, in rad/s and rad/s²."""

    speed_unit: Positive
    acceleration_unit: Positive


class Supply(Origin):
    """The supply's voltage (V), and the resistance that all servos share (Ω)."""

    voltage: Annotated[float, Field(gt=0, le=50)]
    resistance: NotNegative


class Loop(Origin):
    """The control's rate (Hz) and its imperfections."""

    rate: Positive
    noise: NotNegative
    start_delay: NotNegative
    clock_error: NotNegative
    backlash: NotNegative


class Drive(Origin):
    """How Miburi drives the servo: the P gain, and how a move's torque limit and goal are computed.

    The limit of a motor's torque is ``headroom`` times the torque that the move needs. After the
    acceleration, the limit is the torque that the rest of the move needs, plus the share ``room``
    of the motor's torque. With ``room`` = 1 the limit does not change. Goals are corrected by the
    share ``lift`` of the sag under load.
    """

    gain: Positive
    headroom: Annotated[float, Field(ge=1)]
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
