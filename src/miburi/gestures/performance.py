"""From movement functions and moods to timed key poses.

The mood μ is a fuzzy membership (Section 4, Fig. 7). Two Takagi–Sugeno rules hold for every key
pose: *if the feeling holds, go to the written pose; if it does not, stay at neutral*. Their
weighted mean is taken in the arms' own polar coordinates, the joint angles: the joint limits
make a box, so every mean of reachable poses is reachable, and a body with half the mood goes
half the way along the same path.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from miburi.errors import InputError
from miburi.gestures.movement import MovementFunction, angles
from miburi.robot import Array, Robot, forward

__all__ = [
    "REACH_VARIES",
    "TIME_VARIES",
    "WIDE",
    "KeyPose",
    "blend",
    "breath",
    "key_poses",
    "membership",
]

#: A movement that turns a joint further than this, in rad, is wide: bound flow halts in it.
WIDE = 0.5
#: Variation: how much less a joint may turn than is written, and how much the times differ.
REACH_VARIES, TIME_VARIES = 0.15, 0.12
#: Breathing: rad that each joint moves at the height of a breath, and s for in and out.
_BREATH = np.array([0.0, 0.03, -0.05, 0.05, 0.03, 0.05, -0.05, 0.035])
_BREATH_TIMES = (1.4, 2.0)


@dataclass(frozen=True)
class KeyPose:
    """Where the three extremities go next (Section 4's nine coordinates), and how fast.

    Attributes
    ----------
    right, left, head
        (3,) m in the base frame.
    duration
        s, from rest to rest; a body that needs longer takes longer.
    hold
        s, to stay there before the next key pose.
    """

    right: Array
    left: Array
    head: Array
    duration: float
    hold: float = 0.0

    @property
    def target(self) -> Array:
        """Return the nine coordinates, (9,) m: right, left, head."""
        return np.concatenate([self.right, self.left, self.head])


@dataclass(frozen=True)
class _Beat:
    """A moment of a gesture: the weights (k,) of its k written poses; s at tempo 1."""

    weights: Array
    duration: float
    hold: float


def membership(function: MovementFunction, mood: float) -> float:
    """Return how much the function's rule holds at ``mood``: μ, shaped by the hedge.

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

    The number of key poses does not depend on the mood: where the mood changes on the way, the
    next key pose is simply taken from a list for the new mood.

    Parameters
    ----------
    robot
        Gives lengths, limits and neutral.
    function
        What to perform.
    mood
        The membership μ, 0 to 1: the greater, the more space and the faster.
    variation
        A seed: each makes a performance that is a little different; None as written.

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
    """Return one performance of several gestures at once, each as much as its mood.

    The strongest gives the key poses and their rhythm; the others are taken at the same phases.
    Memberships that sum to more than 1 are shared out.

    Raises
    ------
    InputError
        There is no part, or a mood is not from 0 to 1.
    """
    if not parts:
        raise InputError("a blend needs at least one gesture with its mood.")
    held = [membership(function, mood) for function, mood in parts]
    shares = np.array(held) / max(1.0, sum(held))
    lead = parts[int(np.argmax(shares))][0]
    phases = np.array([pose.phase for pose in lead.pose])
    offsets = np.zeros((len(phases), len(robot.neutral)))
    time = 0.0
    for (function, _), share in zip(parts, shares, strict=True):
        offsets += share * function.effort.space * _at(robot, function, phases)
        time += share * function.effort.time
    # Half of the leading gesture's time is its own, the other half comes with the mood.
    time = (lead.effort.time + min(time, 1.0)) / 2
    tempo = lead.effort.model_copy(update={"time": time}).tempo
    varied = None if variation is None else np.random.default_rng(variation)
    performance = []
    for beat in _timeline(robot, lead):
        offset, slower = beat.weights @ offsets, 1.0 / tempo
        if varied is not None:
            offset = offset * varied.uniform(1 - REACH_VARIES, 1, len(offset))
            slower *= varied.uniform(1 - TIME_VARIES, 1 + TIME_VARIES)
        performance.append(_key_pose(robot, offset, beat.duration * slower, beat.hold * slower))
    return performance


def breath(robot: Robot, *, variation: int | None = None) -> list[KeyPose]:
    """Return one breath of a body at rest: in, and out to neutral again."""
    depth = slower = 1.0
    if variation is not None:
        varied = np.random.default_rng(variation)
        depth, slower = varied.uniform(0.7, 1.0), varied.uniform(1.0, 1.3)
    inwards, outwards = (slower * time for time in _BREATH_TIMES)
    return [
        _key_pose(robot, depth * _BREATH, inwards, 0.1),
        _key_pose(robot, np.zeros_like(_BREATH), outwards, 0.3 * slower),
    ]


def _key_pose(robot: Robot, offset: Array, duration: float, hold: float) -> KeyPose:
    pose = np.clip(robot.neutral + offset, robot.lower, robot.upper)
    right, left, head = forward(robot, pose).reshape(3, 3)
    return KeyPose(right, left, head, duration, hold)


def _offsets(robot: Robot, function: MovementFunction) -> Array:
    """Return how far from neutral the written poses are, (k, 8) rad."""
    # Worked out once for each robot and function; both are frozen, and kept so that ids last.
    key = (id(robot), id(function))
    if key not in _known:
        if len(_known) >= _MOST_KNOWN:
            _known.clear()
        poses = np.array([angles(robot, pose) for pose in function.pose])
        _known[key] = (robot, function, poses - robot.neutral)
    return _known[key][2]


_known: dict[tuple[int, int], tuple[Robot, MovementFunction, Array]] = {}
_MOST_KNOWN = 256


def _at(robot: Robot, function: MovementFunction, phases: Array) -> Array:
    """Return a gesture's offsets (n, 8) at any phases (n,), straight between its poses."""
    arrivals = [pose.phase for pose in function.pose]
    leaves = [pose.leaves for pose in function.pose]
    times = np.array([0.0, *np.column_stack([arrivals, leaves]).ravel(), 1.0])
    rest = np.zeros((1, len(robot.neutral)))
    values = np.vstack([rest, np.repeat(_offsets(robot, function), 2, axis=0), rest])
    return np.column_stack([np.interp(phases, times, column) for column in values.T])


def _timeline(robot: Robot, function: MovementFunction) -> list[_Beat]:
    """Lay a movement function out in time: repeats, strokes, halts; at last neutral."""
    effort, count = function.effort, len(function.pose)
    moves = []  # weights of the poses; move and halt in parts of the duration
    left = 0.0
    for index, pose in enumerate(function.pose):
        span = pose.phase - left
        halt = pose.leaves - pose.phase + span * (1 - effort.stroke)
        moves.append((np.eye(count)[index], span * effort.stroke, halt))
        left = pose.leaves
    if function.repeat:
        first, last = function.repeat.first - 1, function.repeat.last
        (weights, _, halt), *others = once = moves[first:last]
        again = [(weights, function.repeat.back * effort.stroke, halt), *others]
        moves[first:last] = once + again * (function.repeat.times - 1)
    moves.append((np.zeros(count), 1 - left, 0.0))
    written = _offsets(robot, function)
    before, beats = np.zeros(count), []
    for weights, share, halt in moves:
        duration = share * function.duration
        pause = duration * effort.hesitation
        if pause and np.abs((weights - before) @ written).max() > WIDE:
            duration = (duration - pause) / 2
            beats.append(_Beat((before + weights) / 2, duration, pause))
        beats.append(_Beat(weights, duration, halt * function.duration))
        before = weights
    return beats
