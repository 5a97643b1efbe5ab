"""Identify each servo from free moves: how it differs from the servo that the description names.

It takes the robot and :class:`~miburi.calibration.free_motion.Trace` objects of some fifty moves,
and gives :class:`Identified`, from which :func:`expecting` makes the contact rule for *these*
servos; :mod:`miburi.calibration.guards` gives the rule its guards. :func:`in_words` says what the
robot's builder may want to look at, and :func:`check` refuses servos that cannot be driven safely.

Importing this module loads Numba.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import radians

import numpy as np

from miburi.calibration.free_motion import Trace
from miburi.calibration.shares import Shares
from miburi.errors import BodyError, InputError
from miburi.ground.compiled import compiled
from miburi.robot import JOINTS, Array, Robot, buildable, iphonoid
from miburi.robot.guards import Guards
from miburi.robot.loads import loads
from miburi.safety.contact import Loading
from miburi.safety.free import FreeRule
from miburi.safety.profile import FINE, Steps
from miburi.servos.free import STEP, travel

#: The allowed and the recommended range of a servo's stiffness at the horn, N·m/rad. A softer servo
#: cannot carry the body to a pose; a stiffer one oscillates where gears have backlash (our choice).
#: The measured stiffness is too low, by 10 % on average and by 20 % at most: while all joints move,
#: the wiring drops some of the supply's voltage, and the gears lose more torque than the model
#: assumes. The true stiffness should be 4 to 6 N·m/rad.
STIFFNESS, _WELL = (2.0, 8.0), (4.0, 5.5)
#: Steps of the search, coarse to fine: factors of the constants, and steps of the delay in µs.
_FACTORS = (1.6, 1.25, 1.12, 1.06, 1.03)
_DELAYS = (2000, 1000, 500, 250, 250)
#: Passes over the constants with each step, at most.
_PASSES = 4
#: The search goes on to finer steps once a pass has reduced the errors by less than this share.
_LITTLE = 0.001
#: The search range of each constant, as multiples of the description's.
_BOX = (0.2, 5.0)
#: A servo is reported if it differs by more than these factors: from its counterpart on the other
#: side or, if it has none, from the others; and from its description (our choice).
_MIRRORED, _SINGLE, _EXPECTED = 1.5, 2.0, 1.25
#: A servo is also reported if it is softer than its mirror image by more than this factor. A servo
#: with a third of its torque measures 0.67 of its counterpart's stiffness and is reported; a servo
#: with twice the friction measures 0.7 and is not reported (our choice).
_SOFTER = 1.45
#: The servos' common wear is measured at joints without play if there are at least this many of
#: them (our choice).
_FIRM_ONES = 3
#: The estimate of the wear is never above this value: with more wear, the gears would take all of a
#: motor's torque (our choice).
_MOST_WEAR = 2.5
#: The number of passes that estimate the wear, and the share of the dry friction that shows in free
#: moves, since friction is lower in motion than at rest (found on simulated servos of known wear).
_WEARS, _SEEN = 3, 0.92
#: The model's RMS error in rad: the usual error without play, and the error above which gears count
#: as loose. The pair after them holds both errors in encoder steps, for coarser encoders. The last
#: value converts the error beyond the usual error into play, in rad per rad. Simulated servos
#: without play had an error of 0.4 to 1.02 steps of 0.088°; joints that carry little had 1.0 to 1.6
#: steps with a play of 0.25°, and 1.6 to 3.7 steps with 0.5°.
_FIRM, _LOOSE, _IN_STEPS, _PLAYS = radians(0.057), radians(0.092), (0.65, 1.05), 3.3
#: Friction explains a part of the model's error, so a joint with more friction than the others
#: needs a larger error before it counts as loose. This is the largest ratio of frictions that is
#: allowed for (our choice): with a larger ratio, half a degree of play at a joint with much
#: friction would go unreported.
_RUBS = 2.0
#: Joints that move this many times the shipped robot's inertia may seem to have play (simulated:
#: 2.2 times did, 1.1 times did not).
_HEAVY = 1.5
_MIRROR = {"left": "right", "right": "left"}
_NAMES = ("stiffness", "damping", "friction", "gravity")
#: Constants that the search changes in one step: each constant alone, and then two groups, without
#: and with friction. If all constants of a group change by the same factor, the motion hardly
#: changes.
_TOGETHER = (*((name,) for name in _NAMES), ("stiffness", "damping", "gravity"), _NAMES)


@dataclass(frozen=True)
class Identified(Shares):
    """The constants of the eight servos, estimated from free moves.

    Attributes
    ----------
    delay
        How far all servos are behind the profile, in µs; the model's own delay is included.
    missed
        The root mean square error of the model with these constants, in steps.
    """

    delay: int = field(kw_only=True)
    missed: Array = field(kw_only=True)


def identify(robot: Robot, traces: Sequence[Trace], wear: float = 1.0) -> Identified:
    """Identify the servos of a robot from free moves, slow and fast, of every joint.

    This is a coordinate search over four constants of each servo, one by one and some together, and
    over one delay. The search minimises each servo's squared error and, for the delay, the mean
    logarithm of these errors. ``wear`` is the wear that the robot's description includes already.

    Raises
    ------
    InputError
        There is no trace.
    """
    if not traces:
        raise InputError(
            "Servos are identified from the traces of some free moves; there are none."
        )
    rule = FreeRule.of(robot)
    shares = {name: np.ones(len(JOINTS)) for name in _NAMES}
    delay = int(rule.guards.lag[0])
    moves = _moves(traces, delay)
    errors = _errors(rule, moves, shares)
    for factor, wait in zip(_FACTORS, _DELAYS, strict=True):
        for _ in range(_PASSES):
            before = _missed_by_all(errors)
            for names in _TOGETHER:
                for times in (factor, 1 / factor):
                    tried = {name: np.clip(shares[name] * times, *_BOX) for name in names}
                    found = _errors(rule, moves, shares | tried)
                    better = found < errors
                    for name, values in tried.items():
                        shares[name] = np.where(better, values, shares[name])
                    errors = np.where(better, found, errors)
            for other in (delay - wait, delay + wait):
                later = _moves(traces, max(other, 0))
                found = _errors(rule, later, shares)
                if _missed_by_all(found) < _missed_by_all(errors):
                    delay, moves, errors = max(other, 0), later, found
            if _missed_by_all(errors) > before - _LITTLE:
                break
    count = sum(len(trace.times) for trace in traces)
    return Identified(**shares, delay=delay, missed=np.sqrt(errors / count), wear=wear)


def _missed_by_all(errors: Array) -> float:
    """Return the model's error over all servos: the mean logarithm of their errors.

    If the errors were summed, one bad servo alone would decide the delay of all. 1 step² is added,
    so that a servo with hardly any error does not decide it either.
    """
    return float(np.log1p(errors).mean())


@dataclass(frozen=True)
class _Move:
    """A trace for the model: at each step, the profile and the fraction of the move completed."""

    loading: Loading
    profile: Steps
    share: Steps
    before: Steps
    part: Array
    travel: Steps


def _moves(traces: Sequence[Trace], delay: int) -> list[_Move]:
    moves = []
    for trace in traces:
        steps = np.arange(int(trace.times[-1]) // STEP + 2, dtype=np.int64)[:, None]
        went = trace.profile.position(steps * STEP - delay)
        went[0] = 0
        share = went // np.maximum(trace.profile.distance, 1)
        before, part = trace.times // STEP, trace.times % STEP / STEP
        profile = trace.loading.offset + went
        moves.append(_Move(trace.loading, profile, share, before, part, trace.travel))
    return moves


def _errors(rule: FreeRule, moves: Sequence[_Move], shares: dict[str, Array]) -> Array:
    """Return the sum of the model's squared errors, (8,) steps²."""
    servo = rule.servo.scaled(shares["stiffness"], shares["damping"], shares["friction"])
    weight = shares["gravity"] / shares["stiffness"]
    errors = np.zeros(len(JOINTS))
    for move in moves:
        loading = move.loading
        begin, end = ((each * weight).astype(np.int64) for each in (loading.begin, loading.end))
        sag = begin + (((end - begin) * move.share) >> 8)
        way = travel(move.profile, sag, loading.most, servo)
        errors += _missed(way, move.before, move.part, move.travel)
    return errors


@compiled
def _missed(way: Steps, before: Steps, part: Array, seen: Steps) -> Array:
    """Return the sum of squared differences of modelled and seen travel, (8,) steps²."""
    missed = np.zeros(way.shape[1])
    for k in range(len(before)):
        for j in range(way.shape[1]):
            first, then = way[before[k], j], way[before[k] + 1, j]
            between = first * (1 - part[k]) + then * part[k]
            missed[j] += ((between - seen[k, j]) / FINE) ** 2
    return missed


def expecting(robot: Robot, shares: Shares, guards: Guards[Steps]) -> FreeRule:
    """Return the contact rule for servos with these multiples of the description's constants."""
    described = FreeRule.of(robot).servo
    return FreeRule(
        guards,
        servo=described.scaled(shares.stiffness, shares.damping, shares.friction),
        sag=np.rint(shares.gravity / shares.stiffness * FINE).astype(np.int64),
    )


def check(robot: Robot, found: Identified) -> None:
    """Refuse servos that are too soft or too stiff to be driven.

    Raises
    ------
    BodyError
        A servo's stiffness is outside ``STIFFNESS``; the message names the servo, and says what to
        check or which gain to set.
    """
    found_stiffness = stiffness(robot, found)
    outside = (found_stiffness < STIFFNESS[0]) | (found_stiffness > STIFFNESS[1])
    if not outside.any():
        return
    motor = int(np.argmax(np.abs(np.log(found.stiffness)) * outside))
    name, value = JOINTS[motor].replace("_", " "), found_stiffness[motor]
    allowed = f"{STIFFNESS[0]:g} to {STIFFNESS[1]:g} are allowed"
    middle = float(np.median(found_stiffness))
    if abs(np.log(value / middle)) > np.log(_MIRRORED):
        raise BodyError(
            f"{name} springs back with {value:.1f} N·m/rad, the others with "
            f"{middle:.1f}; {allowed}. Check its horn's screw, its connector and its "
            "P gain (address 84), or replace the servo; then calibrate again."
        )
    raise BodyError(
        f"{name} springs back with {value:.1f} N·m/rad; {allowed}. Set the P gain to "
        f"{proposed_gain(robot, found)} (it is {robot.servo.model.drive.gain:g}; gain in the "
        "servo's [drive] table), then calibrate again."
    )


def stiffness(robot: Robot, found: Shares) -> Array:
    """Return the stiffness of each servo at its horn, (8,) N·m/rad, after the gears' losses."""
    servo = robot.servo.model
    at_horn: Array = found.stiffness * servo.stiffness * (1 - servo.friction.motor_load)
    return at_horn


def fitted(robot: Robot, found: Identified) -> Robot:
    """Return the description with the stiffness that was found, and with the gain that fits it."""
    gain = float(proposed_gain(robot, found))
    stiffened = _stiffened(robot, float(np.median(found.stiffness)))
    servo = stiffened.servo.model
    drive = servo.drive.model_copy(update={"gain": gain})
    return stiffened.with_servo(servo.model_copy(update={"drive": drive}))


def worn(
    robot: Robot, found: Identified, traces: Sequence[Trace]
) -> tuple[Robot, Identified, list[Trace]]:
    """Return the robot, the identified servos and the traces, adapted to the wear that was found.

    Worn gears absorb more torque, so a move needs more torque from the motor, and the same
    stiffness at the horn means a stiffer control at the motor. ``robot`` already has the wear that
    ``found`` gives. If the friction is at most ``_EXPECTED`` times the description's, nothing
    changes.
    """
    known = found.wear
    wear = known * _rubs(robot, found)
    if max(wear, known) <= _EXPECTED:
        return robot, found, list(traces)
    # Gears that absorb more torque also show more friction, so each pass applies only the square
    # root of the remaining factor.
    for _ in range(_WEARS):
        wear = min(max(wear, 1.0), _MOST_WEAR)
        rubbing = robot.with_servo(robot.servo.model.varied(friction=wear / known))
        stiffer = float(np.median(identify(rubbing, traces).stiffness))
        rubbing = _stiffened(rubbing, stiffer)
        moves = [replace(trace, loading=_softer(trace.loading, stiffer)) for trace in traces]
        own = identify(rubbing, moves, wear)
        wear *= float(np.sqrt(_rubs(rubbing, own) / _SEEN))
    return rubbing, own, moves


def _rubs(robot: Robot, found: Identified) -> float:
    """Return the friction as a multiple of the description's: the median of joints without play.

    Within its backlash a joint moves with its gears disengaged, so its friction is measured too
    low. If fewer than ``_FIRM_ONES`` joints are without play, the median is taken over all joints.
    """
    firm = play(robot, found) == 0
    return float(np.median(found.friction[firm if firm.sum() >= _FIRM_ONES else slice(None)]))


def _softer(loading: Loading, times: float) -> Loading:
    errors = (loading.begin, loading.end, loading.most)
    return Loading(loading.offset, *((error / times).astype(np.int64) for error in errors))


def _stiffened(robot: Robot, times: float) -> Robot:
    servo = robot.servo.model
    divisor = servo.divisor.model_copy(
        update={"standing": "ours", "p_divisor": servo.divisor.p_divisor / times}
    )
    return robot.with_servo(servo.model_copy(update={"divisor": divisor}))


def proposed_gain(robot: Robot, found: Identified) -> int:
    """Return the P gain that gives these servos the right stiffness.

    The gain stays as it is if the median of their measured stiffnesses is 4 to 5.5 N·m/rad.
    """
    gain, middle = robot.servo.model.drive.gain, float(np.median(stiffness(robot, found)))
    if _WELL[0] <= middle <= _WELL[1]:
        return round(gain)
    aim = (_WELL[0] + _WELL[1]) / 2
    return round(gain * aim / middle / 50) * 50


def play(robot: Robot, found: Identified) -> Array:
    """Return a rough estimate of the play in each servo's gears, (8,) rad; 0 where none shows.

    Backlash shows in joints that carry little, but not where a load presses the teeth together.
    """
    step = robot.servo.step
    firm, loose = (max(a, n * step) for a, n in zip((_FIRM, _LOOSE), _IN_STEPS, strict=True))
    missed = found.missed * step
    # The model's error is larger at a joint whose gears have more friction than the others'.
    rubs = np.sqrt(np.clip(found.friction / np.median(found.friction), 1.0, _RUBS))
    about: Array = np.where(missed > loose * rubs, _PLAYS * (missed - firm * rubs), 0.0)
    return about


def and_play(robot: Robot, found: Identified, *, firm: bool = False) -> str:
    """Return a sentence about gears with play, to append to another message; empty if none.

    Weight that is much larger than the shipped robot's looks like play, so it is named as another
    cause; with ``firm``, when the gears are known to have no play, as the only one.
    """
    angles = play(robot, found)
    if not angles.any():
        return ""
    loose = ", ".join(
        f"{np.degrees(angle):.1f}° at the {name.replace('_', ' ')}"
        for name, angle in zip(JOINTS, angles, strict=True)
        if angle
    )
    heavy = "Lighter or shorter arms, or a higher gain in the servo's file, help."
    if firm:
        return (
            f" The motors miss the model of these servos as if there were play, of about {loose}; "
            f"the simulated gears have none, so what they carry is too heavy for them. {heavy}"
        )
    told = (
        f" Gears seem to have play, of about {loose}: tighten the horn screws there. If "
        "they are tight, the gears are worn, or something touched the robot."
    )
    own, *shipped = (
        loads(one, (one.lower + one.upper) / 2).inertia for one in (robot, iphonoid(), buildable())
    )
    times = (own / np.max(shipped, axis=0))[angles > 0].max()
    if times <= _HEAVY:
        return told
    return (
        f"{told} Or it is no play: {times:.1f} times the inertia of a shipped robot's, as here, "
        f"looks the same. {heavy}"
    )


def in_words(robot: Robot, found: Identified, *, firm: bool = False) -> list[str]:
    """Return sentences about servos that a maker may want to check; none if all is as expected.

    ``firm`` says that the gears are known to have no play.
    """
    loose = and_play(robot, found, firm=firm).strip()
    lines = [loose] if loose else []
    for what, shares in (("stiffness", found.stiffness), ("friction", found.friction)):
        for motor, name in enumerate(JOINTS):
            side, _, part = name.partition("_")
            mirrored = f"{_MIRROR.get(side, side)}_{part}"
            than = f"the {_MIRROR[side]}" if side in _MIRROR else "the others"
            other = shares[JOINTS.index(mirrored)] if side in _MIRROR else np.median(shares)
            times = float(shares[motor] / other)
            much = _MIRRORED if side in _MIRROR else _SINGLE
            told = f"{name.replace('_', ' ')}: {_often(times)} the {what} of {than}"
            if times > much and shares[motor] > _EXPECTED:
                lines.append(told)
            soft = 1 / times > (_SOFTER if side in _MIRROR else _SINGLE)
            if what == "stiffness" and soft and 1 / shares[motor] > _EXPECTED:
                lines.append(f"{told}; check the screw of its horn and its connector")
    return lines


def _often(times: float) -> str:
    # Free moves show friction only roughly: at five joints of the emulated robot, a friction twice
    # the mirror image's was measured as 1.4 to 2.7 times. A ratio of 1.4 is not reported.
    words = {"about half": (0.42, 0.58), "about twice": (1.75, 2.75)}
    return next((word for word, (a, b) in words.items() if a <= times < b), f"{times:.1f} times")
