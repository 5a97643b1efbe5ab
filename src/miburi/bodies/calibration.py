"""Finds out what a card's servos are like, from free motion, and derives their guards for the rule.

For each joint, a few moves to and fro while nobody touches the robot; the card reports positions
about 50 times a second. The lag is the delay at which the commanded profile fits best; the ramp
is fitted beside it, as a check; the noise is what is left.
"""

import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from miburi.bodies.base import Phase
from miburi.bodies.card import Card
from miburi.bodies.card_settings import (
    CardSettings,
    JointSettings,
    real_acceleration,
    real_speed,
)
from miburi.bodies.link import Report
from miburi.errors import BodyError, DescriptionError
from miburi.motion import FINE, Move, Profile, Steps, to_steps
from miburi.robot import JOINTS, Array

#: The moves: fractions of the range about its middle, and speeds in rad/s (ours).
_REACH = 0.35
_SPEEDS = (0.8, 2.5)
#: Lags that are tried, µs.
_LAGS = np.arange(0, 80_001, 500)
#: Ramps that are tried, as parts of the commanded one.
_RAMPS = np.linspace(0.6, 1.2, 25)
#: While the lags are not known the rule is on, with guards that any lag up to 50 ms passes (ours).
_GENEROUS = {"lag": 30_000, "slack": 40, "least": 16, "tracking": 150, "arrival": 60}
#: Guards never go below these steps: an encoder step and the play of the gears (ours).
_LEAST_SLACK, _LEAST_TRACKING, _LEAST_ARRIVAL = 3, 20, 10


@dataclass(frozen=True)
class Measured:
    """A joint's servo: lag µs, ramp over the commanded one, noise and worst misses in steps."""

    lag: int
    ramp: float
    noise: float
    behind: float
    at_goal: float

    def guards(self, joint: JointSettings) -> JointSettings:
        """Return the joint with guards of three times what was measured, none too small."""
        return replace(
            joint,
            lag=self.lag,
            slack=min(max(_LEAST_SLACK, 1 + round(3 * self.noise)), 40),
            tracking=min(max(_LEAST_TRACKING, 1 + round(3 * self.behind)), 300),
            arrival=min(max(_LEAST_ARRIVAL, 1 + round(3 * self.at_goal)), 150),
        )


def fit(profile: Profile, times: Steps, travel: Array, at_goal: float) -> Measured:
    """Fit lag and ramp to one motor's travel (n,) steps at ``times`` (n,) µs."""

    def misses(lag: int, ramp: float) -> Array:
        steeper = Profile.plan(
            profile.distance, profile.speed, np.rint(profile.acceleration * ramp).astype(np.int64)
        )
        missed: Array = travel - steeper.position(times - lag) / FINE
        return missed

    def error(lag: int, ramp: float) -> float:
        return float(np.sum(misses(lag, ramp) ** 2))

    lag = int(min(_LAGS, key=lambda value: error(int(value), 1.0)))
    ramp = float(min(_RAMPS, key=lambda value: error(lag, float(value))))
    left = misses(lag, 1.0)
    return Measured(lag, ramp, float(left.std()), float(np.abs(left).max()), at_goal)


def measure(card: Card, motor: int) -> Measured:
    """Move one joint of an idle card to and fro, and fit its servo.

    Raises
    ------
    BodyError
        A move was stopped.
    """
    robot = card.robot
    reports: list[Report] = []
    found = []
    heard, card.on_report = card.on_report, reports.append
    middle = (robot.lower[motor] + robot.upper[motor]) / 2
    half = (robot.upper[motor] - robot.lower[motor]) / 2 * _REACH
    try:
        for index, speed in enumerate((_SPEEDS[0], *_SPEEDS, *_SPEEDS)):
            angles = np.array(robot.neutral)
            angles[motor] = middle + (half if index % 2 else -half)
            start, origin = card.report.positions[motor], card.goals[motor]
            reports.clear()
            card.move(Move(angles, np.full(len(JOINTS), speed)))
            began = card.move_began
            while card.step(0.02).phase is Phase.MOVING:
                pass
            stop = card.state.stop
            if stop is not None:
                raise BodyError(
                    f"{JOINTS[motor]}: the calibration was stopped ({stop.reason}). Give the "
                    "robot room, keep hands away, and start again."
                )
            way = int(to_steps(robot, angles)[motor]) - origin
            if index == 0:
                continue  # on the way to the first place
            profile = _profile(card, abs(way), speed)
            seen = [r for r in reports if r.heard >> motor & 1]
            times = np.array([r.time - began for r in seen])
            travel = np.array([r.positions[motor] - start for r in seen]) * np.sign(way)
            ends = float(abs(travel[-1] - abs(way)))
            found.append(fit(profile, times, travel.astype(np.float64), ends))
    finally:
        card.on_report = heard
    return Measured(
        lag=int(np.median([one.lag for one in found])),
        ramp=float(np.median([one.ramp for one in found])),
        noise=max(one.noise for one in found),
        behind=max(one.behind for one in found),
        at_goal=max(one.at_goal for one in found),
    )


def _profile(card: Card, distance: int, speed: float) -> Profile:
    steps = real_speed(round(speed / card.robot.servo.step))
    one = np.ones(1, dtype=np.int64)
    acceleration = real_acceleration(card.settings.general.acceleration)
    return Profile.plan(one * distance, one * steps, one * acceleration)


def calibrate(card: Card, tell: Callable[[str], None] = lambda _: None) -> CardSettings:
    """Measure all joints of a card; return its settings with the guards derived.

    The card is stopped first, and woken with generous guards; it is idle in the end.

    Raises
    ------
    BodyError
        A move was stopped.
    """
    settings = card.settings
    generous = tuple(replace(joint, **_GENEROUS) for joint in settings.joints)
    card.stop()
    card.configure(replace(settings, joints=generous))
    card.wake()
    joints = []
    for motor, joint in enumerate(settings.joints):
        measured = measure(card, motor)
        tell(
            f"{JOINTS[motor]:>15}: lag {measured.lag / 1000:.1f} ms, ramp × {measured.ramp:.2f}, "
            f"noise {measured.noise:.2f} steps"
        )
        joints.append(measured.guards(joint))
    return replace(settings, joints=tuple(joints))


def find_zero(
    settings: CardSettings, motor: int, at_zero: int, turned: int, angle: int
) -> CardSettings:
    """Return settings with a joint's zero and direction found by hand.

    Parameters
    ----------
    at_zero, turned
        The servo's own position at joint angle 0, and after the joint was turned the positive way.
    angle
        Steps that it should have turned at least, to be sure.

    Raises
    ------
    BodyError
        It was turned too little.
    """
    if abs(turned - at_zero) < angle:
        raise BodyError(
            f"{JOINTS[motor]} was turned by {abs(turned - at_zero)} steps only; turn it by at "
            f"least {angle}, the positive way."
        )
    joints = list(settings.joints)
    direction = 1 if turned > at_zero else -1
    joints[motor] = replace(joints[motor], zero=at_zero, direction=direction)
    return replace(settings, joints=tuple(joints))


def write_settings(settings: CardSettings, path: Path) -> None:
    """Write ids, directions, zeros and guards to a TOML file, a table for each joint."""
    names = ("servo", "direction", "zero", "lag", "slack", "least", "tracking", "arrival")
    lines = ["# A calibration of one robot's servos: µs and encoder steps.\n"]
    for name, joint in zip(JOINTS, settings.joints, strict=True):
        lines.append(f"[{name}]\n" + "".join(f"{n} = {getattr(joint, n)}\n" for n in names))
    path.write_text("\n".join(lines), encoding="utf-8")


def read_settings(settings: CardSettings, path: Path) -> CardSettings:
    """Return the settings with a calibration file's values.

    Raises
    ------
    DescriptionError
        The file cannot be read or is not a calibration.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        joints = tuple(
            replace(joint, **{key: int(value) for key, value in tables[name].items()})
            for name, joint in zip(JOINTS, settings.joints, strict=True)
        )
    except (OSError, tomllib.TOMLDecodeError, KeyError, TypeError, ValueError) as error:
        raise DescriptionError(
            f"{path}: not a calibration: {error}. Write one with `miburi card calibrate`."
        ) from error
    return replace(settings, joints=joints)
