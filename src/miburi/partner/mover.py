"""Turn key poses into moves: solve each pose, send its move, and remember where it leads."""

from collections.abc import Callable

import numpy as np

from miburi import gestures, ik
from miburi.bma.settings import Settings
from miburi.bodies import Body
from miburi.errors import BodyError, InputError
from miburi.partner.events import MoveSent
from miburi.partner.performance import Performance
from miburi.robot import EXTREMITIES, JOINTS, Array, Robot
from miburi.safety.move import Move, plan_move, plan_on
from miburi.safety.stop import Phase

#: A partner's inverse kinematics: a function that takes the robot, the target of shape (9,) in m,
#: and the present angles of shape (8,) in rad, and returns a solution. The solution's angles and
#: error must be finite.
Solve = Callable[[Robot, Array, Array], ik.Solution]

#: The last move, back to neutral, takes at least this long, in s (our choice).
_HOMECOMING = 1.5
_WAIST, _HEAD = JOINTS.index("waist"), JOINTS.index("head")


def solve_with(settings: Settings | None = None) -> Solve:
    """Return a solver with these settings; by default, with the settings of :func:`ik.solve`."""
    return lambda robot, target, start: ik.solve(robot, target, start=start, settings=settings)


def _checked(solution: object) -> ik.Solution:
    """Return what a partner's inverse kinematics found, if it can be driven; it may be anybody's.

    Raises
    ------
    InputError
        It is not what ``Solve`` returns.
    """
    if isinstance(solution, ik.Solution):
        given = solution.angles, solution.error
        if all(
            isinstance(one, np.ndarray) and one.shape == shape and one.dtype.kind == "f"
            for one, shape in zip(given, ((len(JOINTS),), (len(EXTREMITIES),)), strict=True)
        ) and all(np.isfinite(one).all() for one in given):
            return solution
    raise InputError(
        "solve= must return a miburi.ik.Solution whose angles, (8,) rad, and error, (3,) m, are "
        f"arrays of finite floats, got {' '.join(f'{solution!r:.200}'.split())}."
    )


class Mover:
    """Sends moves to a body, which must be at neutral when the mover is created.

    If ``lively``, the body passes through key poses without stopping, where they allow it.
    """

    def __init__(self, body: Body, solve: Solve, *, lively: bool) -> None:
        self._body, self._solve, self._lively = body, solve, lively
        self._neutral: Array = np.array(body.robot.neutral)
        self._angles = self._neutral  # where the latest move leads

    @property
    def home(self) -> bool:
        """Whether the latest move leads to neutral."""
        return np.array_equal(self._angles, self._neutral)

    @property
    def turned(self) -> float:
        """How far to its left the body will be turned after the latest move, in rad."""
        return float(self._angles[_WAIST])

    @property
    def ahead(self) -> tuple[float, float]:
        """By how much, in rad, a moving head will still turn to the robot's left, and rise."""
        state = self._body.state
        if state.phase in (Phase.STOPPED, Phase.IDLE):
            return 0.0, 0.0
        left = self._angles - state.angles
        return float(left[_WAIST]), float(left[_HEAD])

    def is_released(self) -> None:
        """Note that the body goes back to neutral by itself."""
        self._angles = self._neutral

    def go_home(self) -> bool:
        """Move to neutral; return whether a move was sent."""
        way = self._body.robot, self._angles, self._neutral, _HOMECOMING
        if self.home or not self._send(plan_move(*way)):
            return False
        self._angles = self._neutral
        return True

    def go_on(self, performance: Performance, mood: float, time: float) -> list[MoveSent] | None:
        """Send the performance's next key pose that moves the body, if there is one.

        The list is empty if a moving body refused the pose; the pose is sent again once the body
        rests. The result is None if no key pose is left.
        """
        robot = self._body.robot
        for index, pose in performance.go_on(mood):
            target = gestures.turned(pose.target, performance.turn)
            solution = _checked(self._solve(robot, target, self._angles))
            if self._body.state.phase is Phase.MOVING:
                move = plan_on(robot, self._body.course(), solution.angles, pose.duration)
            else:
                move = plan_move(robot, self._angles, solution.angles, pose.duration)
            if np.max(np.abs(solution.angles - self._angles)) < robot.servo.step:
                continue  # the body is there already, as at a mood of 0
            if not self._send(move):
                performance.not_sent(index)
                return []
            self._angles = solution.angles
            performance.sent(pose, time + move.slows_at if self._lively else None)
            return [MoveSent(time, index, move, solution)]
        return None

    def _send(self, move: Move) -> bool:
        """Start a move; return False if the body has stopped since it reported its state."""
        try:
            self._body.move(move)
        except BodyError:
            if self._body.state.phase is Phase.IDLE:
                raise
            return False
        return True
