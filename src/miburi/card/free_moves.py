"""Free motion of a card's robot, recorded as traces: the moves of a calibration, and gestures."""

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np

from miburi import ik
from miburi.calibration.free_motion import Trace
from miburi.card.card import Card
from miburi.errors import BodyError
from miburi.gestures import key_poses, load, shipped_functions
from miburi.robot import JOINTS, Array, Robot
from miburi.safety.move import Move, plan_move
from miburi.safety.stop import Phase, StopReason

#: How far a joint moves to either side of the middle, as a share of half its range. A move reaches
#: the speed v and comes back to rest within v²/a. So at top speed the swing may have to be longer:
#: from side to side it is at least ``_RUN`` times v²/a. On either side the joint moves no further
#: than ``_FARTHEST`` of half its range (our choice).
_REACH, _RUN, _FARTHEST = 0.35, 1.1, 0.97
#: Speeds, in rad/s, for moves of one joint; the last is faster than any servo can go (our choice).
_SPEEDS = (0.8, 2.5, np.inf)
#: Durations, in s, of moves of all joints; the last is shorter than any servo can manage (our
#: choice).
_DURATIONS = (1.5, 0.8, 0.1)
#: Slow speeds in rad/s, at which encoder steps matter most, and the distance in rad that is moved
#: at each speed (our choice).
_SLOWLY, _BIT = (0.05, 0.1, 0.2, 0.4), 0.15
#: How long recording goes on after each move, in s; longer than the rule waits for a motor to
#: arrive.
_AFTER = 0.3
#: What to do about a contact in free motion.
_ROOM = (
    "Give the robot room, keep hands away, and calibrate again. If nothing is in its way, look at "
    "that joint's horn and screws, its plug, and cables that pull."
)
#: The mood of the gestures that test a calibration (our choice).
_MOOD = 0.9
#: The value of ``Report.heard`` when all motors have answered.
_ALL = 0xFF


def free_moves(robot: Robot) -> Iterator[tuple[str, Move]]:
    """Yield the moves of a calibration, each with the name of the joint that moves.

    First each joint moves to and fro, then all move at once, slow to fast. The moves begin and end
    at neutral. A resting joint is in the middle of its range, where the arms touch neither the body
    nor each other. To reach its servo's top speed v, a joint needs to travel v²/a; the ranges of
    elbows and fingertips are barely longer than this distance.
    """
    middle, half = (robot.lower + robot.upper) / 2, (robot.upper - robot.lower) / 2
    run = _RUN * robot.servo.max_speed**2 / robot.servo.acceleration
    far = np.minimum(np.maximum(run / 2, _REACH * half), _FARTHEST * half)
    half = _REACH * half
    yield "all joints", _move(robot, middle, _SPEEDS[0])
    for motor, name in enumerate(JOINTS):
        only = np.arange(len(JOINTS)) == motor
        for speed, way, sides in (
            (_SPEEDS[0], half, (-1.0, 1.0)),
            (_SPEEDS[-1], far, (-1.0, 1.0, -1.0)),
        ):
            for side in sides:
                yield name, _move(robot, middle + side * way * only, speed)
        yield name, _move(robot, middle, _SPEEDS[1])
    # Both arms do the same, so that they do not meet; the left arm's lower joints are mirrored.
    alike = np.where([name in ("left_elbow", "left_fingertip") for name in JOINTS], -1.0, 1.0)
    for speed in _SLOWLY:
        for bit in (_BIT, 0.0):
            yield "all joints", _move(robot, middle + alike * bit, speed)
    # As in gestures, all joints start together and arrive together.
    here = middle
    for duration in _DURATIONS:
        for side in (-1.0, 1.0):
            there = middle + side * alike * half
            yield "all joints", plan_move(robot, here, there, duration)
            here = there
    yield "all joints", plan_move(robot, here, robot.neutral, _DURATIONS[0])


def swings(robot: Robot) -> Iterator[Move]:
    """Yield moves in which the arms swing in opposite directions, from neutral to neutral.

    The swinging arms shake the waist, which turns a little with them or against them.
    """
    middle, half = (robot.lower + robot.upper) / 2, (robot.upper - robot.lower) / 2
    # The left elbow and fingertip are mirrored already, so only the shoulder changes its sign.
    against = np.where([name == "left_shoulder" for name in JOINTS], -1.0, 1.0)
    here = robot.neutral
    for side, turn in ((-1, -1), (1, 1), (-1, 3)):
        there = middle + side * against * _REACH * half
        there[JOINTS.index("waist")] = middle[JOINTS.index("waist")] + turn * _BIT
        yield plan_move(robot, here, there, _DURATIONS[-1])
        here = there
    yield plan_move(robot, here, robot.neutral, _DURATIONS[1])


def gestures(robot: Robot) -> Iterator[tuple[str, list[Move]]]:
    """Yield each feeling that has a shipped gesture, with that gesture at mood 0.9."""
    for function in shipped_functions():
        yield function.feeling, gesture(robot, function.feeling, _MOOD)


def gesture(robot: Robot, feeling: str, mood: float, variation: int | None = None) -> list[Move]:
    """Return the moves of a feeling's gesture, which begins at neutral."""
    poses = key_poses(robot, load(feeling), mood, variation=variation)
    angles = [np.array(robot.neutral)]
    for pose in poses:
        angles.append(ik.solve(robot, pose.target, start=angles[-1]).angles)
    return [
        plan_move(robot, here, there, pose.duration)
        for (here, there), pose in zip(pairwise(angles), poses, strict=True)
    ]


def _move(robot: Robot, angles: Array, speed: float) -> Move:
    return Move(np.array(angles), np.full(len(JOINTS), min(speed, robot.servo.max_speed)))


def record(card: Card, moves: Iterable[Move], driven: Robot | None = None) -> list[Trace]:
    """Let an idle card make free moves, and return a trace of each.

    If ``driven`` is given, the motors are driven as that robot's would be.

    Raises
    ------
    BodyError
        A move was stopped.
    """
    return [_record_one(card, move, driven) for move in moves]


def _begin(card: Card, move: Move, driven: Robot | None) -> None:
    try:
        card.move(move, driven)
    except BodyError as refused:
        # The card may have stopped since its last report: a weak motor sags at rest.
        try:
            card.step(_AFTER)
        except BodyError:
            raise refused from None
        _check_free(card)
        raise


def _check_free(card: Card) -> None:
    stop = card.state.stop
    if stop is None:
        return
    where = "" if stop.motor is None else f" ({stop.motor})"
    met = stop.sign is not None or stop.reason is StopReason.TOUCHED
    hint = _ROOM if met else "Put that right, then calibrate again."
    raise BodyError(f"Stopped: {stop.reason.spoken}{where}. {hint}")


def _record_one(card: Card, move: Move, driven: Robot | None) -> Trace:
    origin, reports = card.goals, [card.report]
    previous, card.on_report = card.on_report, reports.append
    try:
        _begin(card, move, driven)
        while card.step(0.02).phase is Phase.MOVING:
            pass
        if card.state.stop is None:
            card.step(_AFTER)
        _check_free(card)
    finally:
        card.on_report = previous
    if (made := card.underway) is None:
        raise BodyError("The card made no move; connect to it again.")
    before = [report for report in reports if report.time <= made.began]
    # The card does not judge a reading in which a motor was silent.
    complete = [r for r in reports if r.time > made.began and r.heard == _ALL]
    start, order = np.array(before[-1].positions), made.order
    profile, direction = order.profile(card.settings, origin)
    return Trace(
        profile,
        start,
        direction,
        times=np.array([report.time - made.began for report in complete]),
        positions=np.array([report.positions for report in complete]),
        loading=order.loading(card.settings, start, origin, direction),
    )
