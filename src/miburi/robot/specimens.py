"""Robots as they leave a workshop: each differs from its description in hidden ways.

A description and a seed give robots whose servos and masses vary as widely as may be expected of
such servos, new and worn. A program that drives these robots knows only the description. All ranges
are ours.
"""

from dataclasses import dataclass
from math import radians

import numpy as np

from miburi.robot.description import Robot
from miburi.servos import Servo

#: The description's stiffness and dry friction are multiplied or divided by at most this factor.
_FACTOR = 2.0
#: Largest relative errors of resistance (cold or hot), masses, supply voltage and clock.
_RESISTANCE, _MASS, _VOLTAGE, _CLOCK = 0.2, 0.1, 0.05, 0.005
#: The longest delay from a command to the start of its profile, in s, and the largest play of
#: gears, in rad.
_DELAY, _BACKLASH = 0.003, radians(0.5)


@dataclass(frozen=True)
class Specimen:
    """One robot, as it really is.

    Attributes
    ----------
    robot
        The robot with its true masses and the true constants of its servos, all eight alike.
    start_delay
        Delay in s from a command to the start of a servo's profile.
    clock
        How many seconds pass on a servo's clock in one real second.
    """

    robot: Robot
    start_delay: float
    clock: float


def specimens(
    robot: Robot, seed: int, count: int, play: float | None = None
) -> tuple[Specimen, ...]:
    """Return robots that were built from a description; the same ones for the same seed.

    Every other robot divides its P gain by half the description's divisor, which doubles its
    stiffness: other people measured a divisor of 256 on the XL330, while the e-manual says 128.
    ``play`` is the play of the gears in all robots, in rad; by default each robot has its own play,
    up to half a degree.
    """
    rng = np.random.default_rng([seed, 11])  # a stream of its own
    return tuple(_specimen(robot, rng, 2.0 if number % 2 else 1.0, play) for number in range(count))


def _specimen(robot: Robot, rng: np.random.Generator, finer: float, play: float | None) -> Specimen:
    def about(share: float) -> float:
        return float(1 + rng.uniform(-share, share))

    def times() -> float:
        return float(_FACTOR ** rng.uniform(-1.0, 1.0))

    servo = robot.servo.model
    own = _changed(servo.varied(friction=times()), "divisor", p_divisor=1 / (finer * times()))
    own = _changed(own, "motor", resistance=about(_RESISTANCE))
    own = _changed(own, "supply", voltage=about(_VOLTAGE))
    drawn = float(rng.uniform(0.0, _BACKLASH))
    loop = own.loop.model_copy(update={"backlash": drawn if play is None else play})
    masses = {name: mass * about(_MASS) for name, mass in robot.masses.model_dump().items()}
    true = robot.with_servo(own.model_copy(update={"loop": loop})).model_copy(
        update={"masses": robot.masses.model_copy(update=masses)}
    )
    return Specimen(true, float(rng.uniform(0.0, _DELAY)), about(_CLOCK))


def _changed(servo: Servo, table: str, **factors: float) -> Servo:
    old = getattr(servo, table)
    new = {name: getattr(old, name) * factor for name, factor in factors.items()}
    return servo.model_copy(update={table: old.model_copy(update=new)})
