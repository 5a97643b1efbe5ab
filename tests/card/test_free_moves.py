"""The moves of a card's calibration, on the physical body."""

import numpy as np
import pytest

from miburi.bodies.simulated import Simulated
from miburi.card.free_moves import free_moves, gestures, swings
from miburi.card.settings import CardSettings
from miburi.feelings import FEELINGS
from miburi.robot import Robot
from miburi.safety.profile import FINE, plan_profile, to_steps
from miburi.safety.stop import Phase
from miburi.studies.trials.plant import TrialPlant, Variation


@pytest.mark.proof("test_free_moves_are_never_stopped")
def test_a_calibrations_moves_meet_nothing_and_end_where_they_began(robot: Robot) -> None:
    """The rule, with the generous guards of a card that is not calibrated, must not stop them."""
    plant = TrialPlant(robot)
    plant.begin(robot.neutral, Variation(), np.random.default_rng(0))
    body = Simulated(robot, CardSettings.of(robot).generous.rule, plant=plant)
    for move in [*(move for _, move in free_moves(robot)), *swings(robot)]:
        body.move(move)
        while body.phase is Phase.MOVING:
            body.read()
        assert body.phase is Phase.IDLE, body.state.stop
        for _ in range(20):
            body.read()
    assert np.abs(body.state.angles - robot.neutral).max() < 0.03
    assert plant.itself is None


def test_the_gestures_that_test_a_calibration_are_all_that_ship(robot: Robot) -> None:
    made = dict(gestures(robot))
    assert list(made) == list(FEELINGS)
    for moves in made.values():
        angles = np.array([move.angles for move in moves])
        assert (angles >= robot.lower).all()
        assert (angles <= robot.upper).all()
        np.testing.assert_allclose(angles[-1], robot.neutral, atol=0.01)


def test_every_joint_is_seen_at_the_fastest_that_it_can_go(robot: Robot) -> None:
    """To and fro: a move is as fast as its way within the limits is long."""
    servo = robot.servo
    can = np.minimum(servo.max_speed, np.sqrt(servo.acceleration * (robot.upper - robot.lower)))
    seen, here = np.zeros((2, 8)), to_steps(robot, robot.neutral)
    for _, move in free_moves(robot):
        goal = to_steps(robot, move.angles)
        profile, direction = plan_profile(robot, here, goal, to_steps(robot, move.speeds))
        fastest = profile.fastest * servo.step / FINE
        for row, sign in enumerate((-1, 1)):
            seen[row] = np.maximum(seen[row], np.where(direction == sign, fastest, 0.0))
        here = goal
    assert (seen / can).min() > 0.97, (seen / can).round(2)
