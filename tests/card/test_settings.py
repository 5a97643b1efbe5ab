"""What a card is told of a robot, and for which robots it is told nothing."""

import pytest

from miburi.card.card import Card
from miburi.card.line import Line
from miburi.card.settings import CardSettings
from miburi.errors import BodyError
from miburi.robot import Robot


@pytest.fixture
def coarse(robot: Robot) -> Robot:
    """The robot with the encoders of another servo."""
    return robot.with_servo(robot.servo.model.varied(steps_per_turn=1024))


def test_a_robot_with_other_encoders_is_refused_in_words(coarse: Robot) -> None:
    with pytest.raises(BodyError, match="count 1024 steps a turn; .* count 4096 .*description"):
        CardSettings.of(coarse)


def test_a_card_is_not_even_reached_for_it(robot: Robot, coarse: Robot) -> None:
    """Settings that are given fit another robot."""

    def reach() -> Line:
        pytest.fail("the card was reached")

    with pytest.raises(BodyError, match="count 1024 steps a turn"):
        Card(reach, coarse, CardSettings.of(robot))
