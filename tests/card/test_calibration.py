"""The moves of a card's calibration, on the physical body."""

import numpy as np

from miburi.bodies.simulated import Simulated
from miburi.calibration.free_motion import Trace
from miburi.card.calibration import free_moves, granted
from miburi.card.settings import CardSettings
from miburi.robot import Robot
from miburi.safety.stop import Phase
from miburi.studies.trials.plant import TrialPlant, Variation
from miburi.studies.trials.trial import Kind, trace_of, trial


def made(robot: Robot, plant: TrialPlant) -> list[Trace]:
    """Make a calibration's moves, and look for what must not happen meanwhile.

    The rule does not stop them, with the guards that it has while the servos are unknown.
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
    made(robot, plant)
    assert plant.itself is None


def test_a_robot_calibrated_at_one_time_is_not_stopped_for_nothing_at_others(robot: Robot) -> None:
    """Other states of the battery, other loads, other gestures; and people are still noticed."""
    plant = TrialPlant(robot)
    plant.begin(robot.neutral, Variation(noise=0.15, delay=1), np.random.default_rng(1))
    rule = granted(robot, CardSettings.of(robot), made(robot, plant)).rule
    assert not any(trial(plant, rule, 9, Kind.FREE, index).stopped for index in range(60))
    assert all(trial(plant, rule, 9, Kind.BLOCKED, index).stopped for index in range(30))
