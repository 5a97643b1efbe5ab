"""All gestures as moves, one after another: what a body will do, for its calibration."""

from collections.abc import Iterator, Sequence

import numpy as np

from miburi import ik
from miburi.gestures import FEELINGS, key_poses, load
from miburi.motion import Move, synchronised
from miburi.robot import Robot

#: A little, and with all its might (ours).
MOODS = (0.5, 1.0)


def exercise(robot: Robot, moods: Sequence[float] = MOODS) -> Iterator[tuple[str, Move]]:
    """Yield the moves of every feeling's gesture at each mood (0 to 1), with the feeling.

    They begin and end at neutral.
    """
    here = np.array(robot.neutral)
    for feeling in FEELINGS:
        function = load(feeling)
        for mood in moods:
            for pose in key_poses(robot, function, mood):
                there = ik.solve(robot, pose.target, start=here).angles
                yield feeling, synchronised(robot, here, there, pose.duration)
                here = there
