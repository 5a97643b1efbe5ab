"""The settings of a card, and the robots that it refuses."""

import pytest

from miburi.card.card import Card
from miburi.card.line import Line
from miburi.card.settings import CardSettings
from miburi.errors import BodyError, InputError
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


@pytest.mark.parametrize(
    ("table", "key", "value", "words"),
    [
        (
            "servo",
            "max_speed",
            19.0,
            r"servo\.max_speed gives a max_speed of 12386 steps/s; a card",
        ),
        ("servo", "acceleration", 450.0, r"servo\.acceleration gives .* 244 steps/s² to 40000 st"),
        ("drive", "gain", 60_000.0, r"iphonoid with XL330-M288-T does not fit a card: drive\.gain"),
        ("divisor", "p_divisor", 1e6, r"divisor\.p_divisor divided by drive\.gain gives"),
    ],
)
def test_a_value_that_does_not_fit_the_wire_is_refused_by_its_key(
    robot: Robot, table: str, key: str, value: float, words: str
) -> None:
    data = robot.model_dump()
    tables = {"servo": data["servo"], **data["servo"]["model"]}
    tables[table][key] = value
    with pytest.raises(InputError, match=words):
        CardSettings.of(Robot.model_validate(data))
