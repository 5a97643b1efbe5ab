"""From a movement function and a mood to timed key poses.

The mood μ is a fuzzy membership (Section 4, Fig. 7). Two Takagi–Sugeno rules hold for every key
pose: *if the feeling holds, take the written pose; if it does not, stay at neutral*. Their
weighted mean is taken in the arms' own polar coordinates, the joint angles: the joint limits
make a box, so every mean of reachable poses is reachable, and a body at half the mood makes
half the way along the same path.
"""

from dataclasses import dataclass, replace

import numpy as np

from miburi.errors import InputError
from miburi.gestures.movement import MovementFunction, angles
from miburi.laban import Effort
from miburi.robot import Array, Robot, forward


@dataclass(frozen=True)
class KeyPose:
    """Where the three extremities go next (Section 4's nine coordinates), and how fast.

    Attributes
    ----------
    right, left, head
        (3,) m in the base frame.
    duration
        s, from rest to rest.
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
class Beat:
    """A key pose before the mood is known.

    Attributes
    ----------
    offset
        (8,) rad away from neutral at full intensity.
    duration, hold
        s at tempo 1.
    """

    offset: Array
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


def effort_at(function: MovementFunction, mood: float) -> Effort:
    """Return the gesture's effort at ``mood``: space and time rise with it (Section 4)."""
    full, weight = function.effort, membership(function, mood)
    return full.model_copy(update={"space": full.space * weight, "time": full.time * weight})


def beats(robot: Robot, function: MovementFunction) -> list[Beat]:
    """Lay a movement function out in time, repeats included, ending at neutral."""
    strike = function.effort.strike
    played = []
    left = 0.0
    for pose in function.pose:
        until = pose.phase if pose.until is None else pose.until
        span, stay = pose.phase - left, until - pose.phase
        offset = angles(robot, pose) - robot.neutral
        played.append(Beat(offset, span * strike, stay + span * (1 - strike)))
        left = until
    if function.repeat:
        first, last = function.repeat.first - 1, function.repeat.last
        once = played[first:last]
        again = [replace(once[0], duration=function.repeat.back * strike), *once[1:]]
        played[first:last] = once + again * (function.repeat.times - 1)
    played.append(Beat(np.zeros_like(robot.neutral), 1 - left, 0.0))
    return [
        replace(
            beat, duration=beat.duration * function.duration, hold=beat.hold * function.duration
        )
        for beat in played
    ]


def key_pose(robot: Robot, function: MovementFunction, beat: Beat, mood: float) -> KeyPose:
    """Return one beat at ``mood``; a mood that changes shows from the next beat on.

    Raises
    ------
    InputError
        The mood is not from 0 to 1.
    """
    effort = effort_at(function, mood)
    nine = forward(robot, robot.neutral + effort.space * beat.offset).reshape(3, 3)
    right, left, head = nine
    return KeyPose(right, left, head, beat.duration / effort.tempo, beat.hold / effort.tempo)


def key_poses(robot: Robot, function: MovementFunction, mood: float) -> list[KeyPose]:
    """Return one performance of a gesture, from neutral to neutral.

    Raises
    ------
    InputError
        The mood is not from 0 to 1.
    """
    return [key_pose(robot, function, beat, mood) for beat in beats(robot, function)]
