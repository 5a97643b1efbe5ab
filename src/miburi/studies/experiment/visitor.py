"""The experiment's person in the way: a scripted hand.

A :class:`Visitor` reads the robot's angles and the partner's events, and moves the simulated hand.
In some gestures, during one move, the hand reaches into the path of an arm, stays a moment after
the robot has stopped, and withdraws.
"""

from dataclasses import dataclass

import numpy as np

from miburi.bodies import Touchable
from miburi.partner import Event, GestureStarted, MoveSent, Stopped
from miburi.robot import Array, Robot, forward
from miburi.robot.geometry import shoulders

#: How long, in s, the hand takes to reach in, at about 1 m/s (our choice).
_REACH = 0.16
#: The distance from which the hand comes, in m, and the directions to choose from: outwards,
#: forwards and up from the place where it blocks (our choice).
_APPROACH = 0.16
_DIRECTIONS = (
    (1, 0, 0), (1, 0.7, 0.3), (0.5, 1, 0), (0, 1, 0.3), (0.7, 0, 0.7), (0.7, 0, -0.7),
    (0.6, -0.6, 0.3),
)  # fmt: skip
#: A move shorter than this, in m, ends before a hand can block it.
_WORTH_BLOCKING = 0.05
#: How many gestures pass before the first visit, and how many between visits: the minimum, and the
#: exclusive maximum (our choice).
_BEFORE, _BETWEEN = (0, 4), (1, 4)
#: How long, in s, the hand waits for an arm that does not come.
_PATIENCE = 2.5


@dataclass
class _Visit:
    place: Array  # (3,) m, where the hand blocks
    outside: Array  # (3,) m, where the hand comes from
    along: Array  # (3,), direction of its fingers
    age: float = 0.0
    leaves_at: float = _PATIENCE


def in_the_way(
    robot: Robot, start: Array, end: Array, arm: int, part: float, reach: float
) -> tuple[Array, Array]:
    """Return where a hand blocks an arm after part of a move, and in which direction it points.

    The place has shape (3,), in m. ``reach`` is the share of the way from shoulder to fingertip at
    which hand and arm meet.
    """
    here, ahead = (
        forward(robot, start + share * (end - start))[3 * arm : 3 * arm + 3]
        for share in (part, part + 0.05)
    )
    shoulder = shoulders(robot)[arm]
    return shoulder + reach * (here - shoulder), np.cross(ahead - here, here - shoulder)


class Visitor:
    """Blocks an arm in one of the first four gestures, and then every two to four gestures.

    ``rng`` chooses gestures, arms, places and how long the hand stays.
    """

    def __init__(self, robot: Robot, body: Touchable, rng: np.random.Generator) -> None:
        self._robot, self._body, self._rng = robot, body, rng
        self._gestures_left = int(rng.integers(*_BEFORE))
        self._key_pose = int(rng.integers(0, 3))
        self._visit: _Visit | None = None

    def step(self, angles: Array, events: list[Event], dt: float) -> None:
        """Advance by ``dt`` s, and move the hand.

        ``angles``, shape (8,), in rad, are the encoders' readings, and ``events`` the partner's
        events in this step.
        """
        for event in events:
            match event:
                case GestureStarted():
                    self._gestures_left -= 1
                case MoveSent() if self._is_due(angles, event):
                    self._gestures_left = int(self._rng.integers(*_BETWEEN))
                    self._key_pose = int(self._rng.integers(0, 3))
                    self._visit = self._plan(angles, event)
                case Stopped() if self._visit is not None:
                    stays = float(self._rng.uniform(0.3, 0.7))
                    self._visit.leaves_at = min(self._visit.leaves_at, self._visit.age + stays)
        if self._visit is not None:
            self._move_hand(self._visit, dt)

    def _is_due(self, angles: Array, event: MoveSent) -> bool:
        """Whether to block this move: its gesture is due, and it is long enough."""
        return (
            self._visit is None
            and self._gestures_left < 0
            and event.key_pose >= self._key_pose
            and self._travel(angles, event).max() > _WORTH_BLOCKING
        )

    def _travel(self, angles: Array, event: MoveSent) -> Array:
        """Return how far each hand goes in a move, shape (2,), in m."""
        ways = forward(self._robot, np.array([angles, event.move.angles]))
        travel: Array = np.linalg.norm((ways[1] - ways[0])[:6].reshape(2, 3), axis=1)
        return travel

    def _plan(self, angles: Array, event: MoveSent) -> _Visit:
        """Choose a place on the path of an arm that moves far, and a way to reach it."""
        end = event.move.angles
        # Aim at the later part of the way, so that the hand is there before the arm.
        part = self._rng.uniform(0.5, 0.8)
        travel = self._travel(angles, event)
        arms = np.flatnonzero(travel >= 0.6 * travel.max())
        arm = int(self._rng.choice(arms))
        reach = self._rng.uniform(0.5, 0.95)
        place, along = in_the_way(self._robot, angles, end, arm, part, reach)
        outside = self._free_way(angles, end, part, arm, place)
        return _Visit(place, outside, along)

    def _free_way(self, start: Array, end: Array, part: float, arm: int, place: Array) -> Array:
        """Return a starting point from which the hand first meets the arm at ``place``."""
        sign = 1.0 if arm else -1.0
        poses = start + np.linspace(0.0, part - 0.2, 5)[:, None] * (end - start)
        hands = forward(self._robot, poses)[:, 3 * arm : 3 * arm + 3]
        arms = np.concatenate([hands, (hands + shoulders(self._robot)[arm]) / 2])
        best, room = place, -1.0
        for outwards, forwards, up in _DIRECTIONS:
            direction = np.array([forwards, sign * outwards, up])
            outside = place + _APPROACH * direction / np.linalg.norm(direction)
            way = place + np.linspace(0.0, 1.0, 7)[:, None] * (outside - place)
            gap = float(np.linalg.norm(way[:, None] - arms, axis=2).min(axis=1)[1:].min())
            if gap > room:
                best, room = outside, gap
        return best

    def _move_hand(self, visit: _Visit, dt: float) -> None:
        visit.age += dt
        inside = min(visit.age / _REACH, 1.0, 1.0 - (visit.age - visit.leaves_at) / _REACH)
        if inside <= 0.0 and visit.age > visit.leaves_at:
            self._body.remove_hand()
            self._visit = None
        else:
            way = visit.place - visit.outside
            self._body.place_hand(visit.outside + inside * way, visit.along)
