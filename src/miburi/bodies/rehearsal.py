"""Rehearse: perform key poses on a simulated body, and record its motion."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from miburi import ik
from miburi.bma.settings import Settings
from miburi.bodies.simulated import Simulated
from miburi.errors import BodyError
from miburi.gestures import KeyPose
from miburi.robot import Array, Robot, forward
from miburi.safety.move import plan_move, plan_on
from miburi.safety.stop import Phase, Stop

#: Time between two records, s: 50 Hz.
PERIOD = 0.02


@dataclass(frozen=True)
class Rehearsal:
    """The recorded motion of the simulated body.

    Attributes
    ----------
    angles
        The true joint angles, (n, 8) rad, one row for each ``PERIOD``; the first row is from before
        the first move.
    positions
        The positions of right hand, left hand and head, (n, 9) m.
    ik_error
        The largest distance of an extremity from its place in a key pose, in m.
    self_collisions
        Number of records in which two parts of the robot collide.
    met
        The first pair of parts that met, or None.
    stop
        The contact stop that cut the performance short, or None.
    """

    angles: Array
    positions: Array
    ik_error: float
    self_collisions: int
    met: tuple[str, str] | None
    stop: Stop | None


def rehearse(
    robot: Robot,
    performance: Sequence[KeyPose],
    settings: Settings | None = None,
    *,
    flows: bool = False,
) -> Rehearsal:
    """Perform key poses from neutral on a new simulated body.

    ``settings`` are those of :func:`miburi.ik.solve`. With ``flows``, the body does not come to
    rest at key poses that it can pass, as in a partner with ``life``.
    """
    body = Simulated(robot)
    present = np.array(robot.neutral)
    poses = [body.configuration[0]]
    met: list[tuple[str, str]] = []
    worst = 0.0

    def pass_time() -> None:
        body.step(PERIOD)
        poses.append(body.configuration[0])
        if body.touch.itself is not None:
            met.append(body.touch.itself)

    for pose in performance:
        solution = ik.solve(robot, pose.target, start=present, settings=settings)
        worst = max(worst, float(solution.error.max()))
        began = len(poses)
        if body.state.phase is Phase.MOVING:
            move = plan_on(robot, body.course(), solution.angles, pose.duration)
        else:
            move = plan_move(robot, present, solution.angles, pose.duration)
        try:
            body.move(move)
        except BodyError:
            if body.state.phase is not Phase.STOPPED:
                raise
            break  # the rule looked at the latest reading before it took the move
        present = solution.angles
        passes = flows and pose.passes
        least = move.slows_at if passes else pose.duration
        # Even a move that goes nowhere takes its full duration.
        while body.state.phase is not Phase.STOPPED and (
            (len(poses) - began) * PERIOD < least
            or (not passes and body.state.phase is Phase.MOVING)
        ):
            pass_time()
        for _ in range(0 if passes else round(pose.hold / PERIOD)):
            if body.state.phase is not Phase.STOPPED:
                pass_time()
        if body.state.phase is Phase.STOPPED:  # also while it holds a pose
            break
    angles = np.array(poses)
    return Rehearsal(
        angles=angles,
        positions=forward(robot, angles),
        ik_error=worst,
        self_collisions=len(met),
        met=met[0] if met else None,
        stop=body.state.stop,
    )
