"""The moves of a card's calibration, on the physical body."""

from miburi.bodies import Phase
from miburi.bodies.calibration import free_moves
from miburi.bodies.card_settings import CardSettings
from miburi.bodies.simulated import Simulated
from miburi.robot import Robot


def test_a_calibrations_moves_meet_nothing_and_end_where_they_began(robot: Robot) -> None:
    """Nor does the rule stop them, with the guards that it has while the servos are unknown."""
    body = Simulated(robot, CardSettings.of(robot).generous.rule)
    for _, move in free_moves(robot):
        body.move(move)
        while body.state.phase is Phase.MOVING:
            body.step(0.02)
            assert body.touch.itself is None
        assert body.state.phase is Phase.IDLE, body.state.stop
        body.step(0.2)
    assert abs(body.state.angles - robot.neutral).max() < 0.03
