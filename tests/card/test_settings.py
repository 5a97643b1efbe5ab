"""The settings of a card, and the robots that it refuses."""

import pytest

from miburi.card.card import Card
from miburi.card.line import Line
from miburi.card.settings import CardSettings
from miburi.errors import BodyError
from miburi.robot import Robot


@pytest.fixture
def coarse(robot: Robot) -> Robot:
    """Return the robot with the encoders of another servo."""
    servo = robot.servo.model
    encoder = servo.encoder.model_copy(update={"steps_per_turn": 1024})
    return robot.with_servo(servo.model_copy(update={"encoder": encoder}))


def test_the_error_for_other_encoders_says_what_to_do(coarse: Robot) -> None:
    with pytest.raises(BodyError, match="count 1024 steps a turn; .* count 4096 .*description"):
        CardSettings.of(coarse)


def test_other_encoders_are_refused_before_the_line_is_opened(robot: Robot, coarse: Robot) -> None:
    """Even with settings that fit another robot."""

    def reach() -> Line:
        pytest.fail("the card was reached")

    with pytest.raises(BodyError, match="count 1024 steps a turn"):
        Card(reach, coarse, CardSettings.of(robot))
