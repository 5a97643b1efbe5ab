"""The moves of a card's calibration, on the physical body."""

import numpy as np

from miburi.bodies.simulated import Simulated
from miburi.calibration.free_motion import Trace
from miburi.card.calibration import free_moves, grant_guards
from miburi.card.settings import CardSettings
from miburi.robot import Robot
from miburi.safety.profile import FINE, plan_profile, to_steps
from miburi.safety.stop import Phase
from miburi.servos import load_servo
from miburi.studies.trials.plant import TrialPlant, Variation
from miburi.studies.trials.trial import TrialKind, trace_of, trial


def make_moves(robot: Robot, plant: TrialPlant) -> list[Trace]:
    """Make the moves of a calibration, and return their traces.

    The rule, with the generous guards of a card that is not calibrated, must not stop them.
    """
    settings = CardSettings.of(robot)
    body = Simulated(robot, settings.generous.rule, plant=plant)
    origin, traces = np.array(robot.neutral), []
    for _, move in free_moves(robot):
        readings = [body.encoders]
        body.move(move)
        while body.phase is Phase.MOVING:
            body.read()
            readings.append(body.encoders)
        assert body.phase is Phase.IDLE, body.state.stop
        for _ in range(20):
            body.read()
            readings.append(body.encoders)
        traces.append(trace_of(robot, origin, move, readings))
        origin = move.angles
    assert np.abs(body.state.angles - robot.neutral).max() < 0.03
    return traces


def test_a_calibrations_moves_meet_nothing_and_end_where_they_began(robot: Robot) -> None:
    plant = TrialPlant(robot)
    plant.begin(robot.neutral, Variation(), np.random.default_rng(0))
    make_moves(robot, plant)
    assert plant.itself is None


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


def test_a_calibrated_robot_has_no_false_stops_in_other_conditions(robot: Robot) -> None:
    """With another battery, other loads and other gestures, and it still notices people."""
    robot = robot.with_servo(load_servo("xl330-m288-t"))
    plant = TrialPlant(robot)
    plant.begin(robot.neutral, Variation(noise=0.15, delay=1), np.random.default_rng(1))
    rule = grant_guards(robot, CardSettings.of(robot), make_moves(robot, plant)).rule
    assert not any(trial(plant, rule, 9, TrialKind.FREE, index).stopped for index in range(60))
    assert all(trial(plant, rule, 9, TrialKind.BLOCKED, index).stopped for index in range(30))
