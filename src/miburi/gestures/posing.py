"""Perform gestures: turn movement functions and moods into timed key poses.

The mood μ is a fuzzy membership (Section 4, Fig. 7). Each key pose has two Takagi–Sugeno rules:
*if the feeling holds, go to the written pose; if it does not, stay at neutral*. Their weighted mean
is taken in the polar coordinates of the three extremities (:mod:`miburi.gestures.coordinates`), so
at half the mood the body goes half as far along the same path. The result is in the paper's nine
coordinates; the inverse kinematics turns them into angles.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from miburi.errors import InputError
from miburi.gestures import coordinates
from miburi.gestures.movement import MovementFunction
from miburi.robot import Array, Robot, forward

#: A movement that changes a coordinate by more than this (rad, or multiples of the reach) is wide;
#: with bound flow it halts half-way.
_WIDE = 0.5
#: How much a performance varies: the share by which a coordinate may fall short of the written
#: coordinate, and the share by which a duration may differ from the written duration.
_REACH_VARIES, _TIME_VARIES = 0.15, 0.12
#: A beat of an arm: the hand's offset at the turning point; the times to get there and back, in s;
#: and how long lagging servos take to reach the turning point, in s (all our choice).
_BEAT = np.array([-0.03, 0.0, 0.3])
_BEAT_TIMES = (0.4, 0.4)
BEAT_LEAD = 0.44
#: Where the partner can look. The partner does not know where people are, so ``user`` means
#: straight ahead.
Direction = Literal["user", "left", "right", "up", "down", "aside"]
#: The head's turn to its left and its rise from neutral, rad (our choice).
_LOOKS: dict[Direction, tuple[float, float]] = {
    "user": (0.0, 0.0),
    "left": (0.7, 0.0),
    "right": (-0.7, 0.0),
    "up": (0.0, 0.35),
    "down": (0.0, -0.35),
    "aside": (0.4, 0.3),
}
#: How long a look takes from rest to rest, in s (our choice).
_LOOK_TIME = 0.8


@dataclass(frozen=True)
class KeyPose:
    """Where the three extremities go next (the nine coordinates of Section 4), and how fast.

    Attributes
    ----------
    right, left, head
        The position of each extremity, as x, y and z in m in the base frame.
    duration
        The time in s from rest to rest; a body that cannot move that fast takes longer.
    hold
        The pause before the next key pose, in s.
    passes
        Whether the body moves on to the next key pose without stopping or holding, if it can.
    """

    right: Array
    left: Array
    head: Array
    duration: float
    hold: float = 0.0
    passes: bool = False

    @property
    def target(self) -> Array:
        """The nine coordinates in m: right hand, left hand, head."""
        return np.concatenate([self.right, self.left, self.head])


@dataclass(frozen=True)
class _Beat:
    """One movement of a gesture: the weight of each pose, and duration and hold in s at tempo 1."""

    weights: Array
    duration: float
    hold: float
    passes: bool = False


def membership(function: MovementFunction, mood: float) -> float:
    """Return the membership of the function's rule at ``mood``: μ, shaped by the hedge.

    Raises
    ------
    InputError
        The mood is not from 0 to 1.
    """
    if not 0 <= mood <= 1:
        raise InputError(f"mood must be from 0 to 1, got {mood!r}.")
    power = {"plainly": 1.0, "very": 2.0, "more or less": 0.5}[function.hedge]
    return float(mood**power)


def key_poses(
    robot: Robot, function: MovementFunction, mood: float, *, variation: int | None = None
) -> list[KeyPose]:
    """Return one performance of a gesture, from neutral to neutral (Section 4).

    The number of key poses does not depend on the mood. So if the mood changes part-way through,
    take the next key pose from the list for the new mood.

    Parameters
    ----------
    robot, function
        The body, and its gesture.
    mood
        The membership μ, from 0 to 1: a greater mood makes the gesture larger and faster.
    variation
        A seed. Each seed gives a slightly different performance; None gives the gesture as written.

    Raises
    ------
    InputError
        The mood is not from 0 to 1.
    """
    return blend(robot, [(function, mood)], variation=variation)


def blend(
    robot: Robot,
    parts: Sequence[tuple[MovementFunction, float]],
    *,
    variation: int | None = None,
) -> list[KeyPose]:
    """Return one performance of several gestures at once, each weighted by its mood.

    The strongest gesture gives the number of key poses and their rhythm; the others are added at
    the same phases. Memberships that sum to more than 1 are scaled down to 1.

    Raises
    ------
    InputError
        There are no parts, or a mood is not between 0 and 1.
    """
    if not parts:
        raise InputError("A blend needs at least one gesture with its mood, got none.")
    memberships = [membership(function, mood) for function, mood in parts]
    shares = np.array(memberships) / max(1.0, sum(memberships))
    lead = parts[int(np.argmax(shares))][0]
    phases = np.array([pose.phase for pose in lead.pose])
    offsets = np.zeros((len(phases), len(coordinates.COORDINATES)))
    time = 0.0
    for (function, _), share in zip(parts, shares, strict=True):
        offsets += share * function.effort.space * _offsets_at(robot, function, phases)
        time += share * function.effort.time
    # The mean of the leading gesture's Laban time and the mood-weighted Laban time of all.
    time = (lead.effort.time + min(time, 1.0)) / 2
    tempo = lead.effort.model_copy(update={"time": time}).tempo
    rng = None if variation is None else np.random.default_rng(variation)
    performance = []
    for beat in _timeline(robot, lead):
        offset, slower = beat.weights @ offsets, 1.0 / tempo
        if rng is not None:
            offset = offset * rng.uniform(1 - _REACH_VARIES, 1, len(offset))
            slower *= rng.uniform(1 - _TIME_VARIES, 1 + _TIME_VARIES)
        pose = key_pose(robot, offset, beat.duration * slower, beat.hold * slower)
        performance.append(replace(pose, passes=beat.passes))
    return performance


def beat(robot: Robot, hands: Array, rise: float = 0.0) -> list[KeyPose]:
    """Return a beat of the arms, and the way back to rest.

    ``hands`` has the sizes of the right and of the left hand's beat; 1 is usual. The head is
    raised by ``rise`` rad throughout.
    """
    there, back = _BEAT_TIMES
    return [
        key_pose(robot, np.array([*np.outer(size, _BEAT).ravel(), 0.0, rise]), duration, 0.0)
        for size, duration in ((hands, there), (np.zeros(2), back))
    ]


def turned(target: Array, angle: float) -> Array:
    """Return a target's nine coordinates, turned by ``angle`` rad to the left about the waist."""
    if angle == 0:
        return target  # exactly, without rounding
    cos, sin = np.cos(angle), np.sin(angle)
    about = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    placed: Array = target.reshape(3, 3) @ about
    return placed.ravel()


def look(robot: Robot, at: Direction, seconds: float) -> list[KeyPose]:
    """Return a look that is held for ``seconds``, and the way back to neutral (our choice)."""
    there = np.array([*[0.0] * 6, *_LOOKS[at]])
    return [
        key_pose(robot, there, _LOOK_TIME, seconds),
        key_pose(robot, np.zeros_like(there), _LOOK_TIME, 0.0),
    ]


def key_pose(robot: Robot, offset: Array, duration: float, hold: float) -> KeyPose:
    """Return the key pose at ``offset`` from neutral, given in the order of ``COORDINATES``."""
    if offset.any():
        places = coordinates.targets(robot, coordinates.neutral(robot) + offset)
    else:
        places = forward(robot, robot.neutral)  # exactly, without rounding
    right, left, head = places.reshape(3, 3)
    return KeyPose(right, left, head, duration, hold)


def _offsets(robot: Robot, function: MovementFunction) -> Array:
    """Return how far from neutral the written poses are, with a row of polar offsets for each."""
    written = np.array([pose.coordinates for pose in function.pose])
    return written - coordinates.neutral(robot)


def _offsets_at(robot: Robot, function: MovementFunction, phases: Array) -> Array:
    """Return a gesture's offsets at each of the ``phases``, interpolated between its poses."""
    arrivals = [pose.phase for pose in function.pose]
    leaves = [pose.leaves for pose in function.pose]
    times = np.array([0.0, *np.column_stack([arrivals, leaves]).ravel(), 1.0])
    rest = np.zeros((1, len(coordinates.COORDINATES)))
    values = np.vstack([rest, np.repeat(_offsets(robot, function), 2, axis=0), rest])
    return np.column_stack([np.interp(phases, times, column) for column in values.T])


def _timeline(robot: Robot, function: MovementFunction) -> list[_Beat]:
    """Lay a movement function out in time: repeats, strokes and halts, then neutral."""
    effort, count = function.effort, len(function.pose)
    moves = []  # weights of the poses; move and halt as shares of the duration
    left = 0.0
    for index, pose in enumerate(function.pose):
        span = pose.phase - left
        halt = pose.leaves - pose.phase + span * (1 - effort.stroke)
        passes = effort.free and pose.leaves == pose.phase
        moves.append((np.eye(count)[index], span * effort.stroke, halt, passes))
        left = pose.leaves
    if function.repeat:
        first, last = function.repeat.first - 1, function.repeat.last
        (weights, _, halt, passes), *others = once = moves[first:last]
        again = [(weights, function.repeat.back * effort.stroke, halt, passes), *others]
        moves[first:last] = once + again * (function.repeat.times - 1)
    moves.append((np.zeros(count), 1 - left, 0.0, False))
    written = _offsets(robot, function)
    before, beats = np.zeros(count), []
    for weights, share, halt, passes in moves:
        duration = share * function.duration
        pause = duration * effort.hesitation
        if pause and np.abs((weights - before) @ written).max() > _WIDE:
            duration = (duration - pause) / 2
            beats.append(_Beat((before + weights) / 2, duration, pause))
        beats.append(_Beat(weights, duration, halt * function.duration, passes))
        before = weights
    return beats
