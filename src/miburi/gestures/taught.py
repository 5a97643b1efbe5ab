"""Teach a gesture by hand: make a gesture file from the motion of a body that a person guides.

A few key poses describe the path of hands and head. Between two key poses the robot moves smoothly,
from rest to rest. This keeps the shape and the timing, but not the trembling of the hand.
"""

import re

import numpy as np

from miburi import feelings
from miburi.errors import InputError
from miburi.gestures import coordinates
from miburi.gestures.effort import Effort
from miburi.gestures.movement import MovementFunction, Posture
from miburi.robot import Array, Robot, forward

#: How far hands and head may be from a straight path between two key poses, m (our choice).
_NEAR = 0.02
#: A motion counts as a gesture if some joint moves by at least this, in rad (our choice).
_LEAST = 0.1
#: The weight of the head's path: the head moves only a few mm, but people see where it looks (our
#: choice).
_HEAD = 4.0
#: How long the return takes, and the longest pause that is kept at the end, both in s (our choice).
#: The pause is limited because people let go slowly.
_BACK, _REST = 0.8, 0.4
#: The greatest number of key poses (our choice).
_MOST = 12
#: A gesture is played as it was shown: all the way, without halts, at its own tempo.
_AS_SHOWN = Effort(space=1.0, weight=0.0, time=0.5, flow=1.0)


def check_name(name: str, feeling: str) -> None:
    """Refuse a name or a feeling that no gesture can have.

    Raises
    ------
    InputError
        The name has characters other than a-z, 0-9 and _, or the feeling is not known.
    """
    if not re.fullmatch("[a-z][a-z0-9_]*", name):
        raise InputError(
            f"a gesture's name may only have a-z, 0-9 and _, and must begin with a-z; got {name!r}."
        )
    if feeling not in feelings.FEELINGS:
        allowed = ", ".join(feelings.FEELINGS)
        raise InputError(f"--feeling must be one of {allowed}, got {feeling!r}.")


def taught(robot: Robot, name: str, feeling: str, times: Array, angles: Array) -> MovementFunction:
    """Return the gesture that somebody showed by leading a hand of the robot.

    ``angles`` has a row of eight angles, in rad, for each of the ascending ``times``, in s. The
    rows begin in the resting pose and end where the person let go.

    Raises
    ------
    InputError
        No joint moved as far as 0.1 rad, or the motion took longer than a gesture can.
    """
    if len(times) < 2 or np.abs(angles - angles[0]).max() < _LEAST:
        raise InputError(
            f"no joint moved as far as {np.degrees(_LEAST):.0f}°; take a hand of the resting robot "
            "and guide it slowly."
        )
    places = np.array([forward(robot, pose) for pose in angles]).reshape(-1, 3, 3)
    places[:, 2] *= _HEAD
    from_first, from_last = (_apart(places, places[end]) for end in (0, -1))
    first = max(int(np.argmax(from_first > _NEAR / 2)) - 1, 0)
    last = int(np.flatnonzero(from_last > _NEAR / 2)[-1]) + 1
    last = min(int(np.searchsorted(times, times[last] + _REST)), len(times) - 1)
    shown = slice(first, last + 1)
    keys = _key_poses(times[shown], places[shown])
    begin, length = float(times[first]), float(times[last] - times[first]) + _BACK
    if length > 20:
        raise InputError(f"a gesture takes at most 20 s, but this one took {length:.0f} s.")
    poses = []
    for arrives, leaves in keys:
        phase, until = ((float(times[first + k]) - begin) / length for k in (arrives, leaves))
        stay = angles[
            first + (arrives + leaves) // 2
        ]  # a hand slows down near its goal, so the pose is taken where it settles
        right, left, head = coordinates.relative(robot, stay)
        poses.append(
            Posture(
                phase=round(phase, 3),
                until=round(until, 3) if until - phase > 0.01 else None,
                right=_within_reach(right),
                left=_within_reach(left),
                head=np.round(head / np.linalg.norm(head), 3).tolist(),
            )
        )
    return MovementFunction(
        name=name, feeling=feeling, duration=round(max(length, 0.2), 2),
        effort=_AS_SHOWN, pose=tuple(poses),
    )  # fmt: skip


def as_toml(function: MovementFunction) -> str:
    """Return a gesture as the text of a gesture file."""
    lines = [
        f'name = "{function.name}"',
        f'feeling = "{function.feeling}"',
        f"duration = {function.duration} # s, from neutral to neutral",
        "\n[effort]",
        *(f"{name} = {share}" for name, share in function.effort.model_dump().items()),
    ]
    for pose in function.pose:
        lines += ["\n[[pose]]", f"phase = {pose.phase}"]
        if pose.until is not None:
            lines.append(f"until = {pose.until}")
        lines += [f"{name} = {getattr(pose, name)}" for name in ("right", "left", "head")]
    return "\n".join(lines) + "\n"


def _apart(places: Array, other: Array) -> Array:
    """Return the greatest distance of an extremity from its place in ``other``, by time, in m."""
    return np.asarray(np.linalg.norm(places - other, axis=-1).max(axis=-1))


def _key_poses(times: Array, places: Array) -> list[tuple[int, int]]:
    """Return when the body arrives at each key pose and when it leaves, as indices.

    The path is split where it is farthest from a straight line, until every piece is close to its
    line (Ramer, Douglas and Peucker).
    """
    near, found = _NEAR, list(range(_MOST + 2))
    while len(found) > _MOST + 1:
        found = _split(times, places, near)
        near *= 1.3
    keys: list[tuple[int, int]] = []
    for index in found[1:]:
        if keys and _apart(places[keys[-1][1] : index + 1], places[index]).max() < _NEAR:
            keys[-1] = (keys[-1][0], index)  # the body stayed there
        else:
            keys.append((index, index))
    return keys


def _split(times: Array, places: Array, near: float) -> list[int]:
    last = len(times) - 1
    share = ((times - times[0]) / (times[-1] - times[0]))[:, None, None]
    away = _apart(places, places[0] + share * (places[-1] - places[0]))
    middle = int(away.argmax())
    if away[middle] <= near or not 0 < middle < last:
        return [0, last]
    before = _split(times[: middle + 1], places[: middle + 1], near)
    after = _split(times[middle:], places[middle:], near)
    return [*before, *(middle + index for index in after[1:])]


def _within_reach(hand: Array) -> list[float]:
    rounded = np.round(hand / max(1.0, float(np.linalg.norm(hand)) * 1.002), 3)
    return [float(x) for x in rounded]
