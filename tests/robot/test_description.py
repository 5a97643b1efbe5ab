"""The description: it holds Table 1, and the error for a wrong file names file, key and range."""

from importlib import resources

import numpy as np
import pytest

from miburi.errors import DescriptionError
from miburi.robot import JOINTS, Robot, load_robot
from miburi.safety.free import FreeRule

TEXT = (resources.files("miburi.robot") / "iphonoid.toml").read_text()


def test_table_1(robot: Robot) -> None:
    low = [-1.744, -0.523, -0.174, -0.174, -0.523, -1.744, -1.744, 0.174]
    high = [1.744, 3.1415, 1.744, 1.744, 3.1415, 0.174, 0.174, 1.22]
    np.testing.assert_array_equal(robot.lower, low)
    np.testing.assert_array_equal(robot.upper, high)
    symbols = [getattr(robot.joints, name).symbol for name in JOINTS]
    assert symbols == ["W", "RS", "RE", "RF", "LS", "LE", "LF", "H"]


def test_limits_cannot_be_changed(robot: Robot) -> None:
    with pytest.raises(ValueError, match="read-only"):
        robot.lower[0] = -9


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("L34 = 0.08", "L34 = -0.08", ["lengths.L34", "-0.08", "greater than 0"]),
        ("L34 = 0.08", "L34 = nan", ["lengths.L34", "finite"]),
        ("L34 = 0.08", "L34 = inf", ["lengths.L34", "finite"]),
        ("L34 = 0.08", "L34 = true", ["lengths.L34", "True"]),
        ("L34 = 0.08", "L34 = 80", ["lengths.L34 = 80: lengths are in metres, from 0.015 to 1"]),
        ("L34 = 0.08", "L34 = 8.0", ["lengths.L34 = 8.0: lengths are in metres, from 0.015 to 1"]),
        ("L34 = 0.08", "L34 = 1e-9", ["lengths.L34 = 1e-09: lengths are in metres"]),
        ("arm_radius = 0.0105", "arm_radius = 10.5", ["sizes are in metres, from 0.001 to 0.5"]),
        ("phone_height = 0.105", "phone_height = 0.002", ["shape: phone_height must be at least"]),
        ("forearm = 0.025", "forearm = 25.0", ["forearm = 25.0: masses are in kg, from 0.001 to"]),
        ("hold_torque = 0.12", "hold_torque = 120.0", ["hold_torque = 120", "N·m", "most 0.216 ("]),
        ("hold_torque = 0.12", "hold_torque = 0.22", ["XL330-M288-T may hold with at most 0.216"]),
        ("acceleration = 20.0", "acceleration = 1e-300", ["servo.acceleration", "in rad/s²"]),
        ("L34 = 0.08", "", ["lengths.L34", "missing"]),
        ("[lengths]", "[lengths]\nL45 = 1.0", ["L45", "1.0", "the known ones are L01, L12, L23"]),
        (
            "[joints.head]",
            "[joints.neck]",
            [
                "joints.head is missing",
                "joints.neck is not a known",
                "Miburi knows one body: a waist",
            ],
        ),
        ("min = -1.744", "min = 1.744", ["joints.waist", "min must be less than max"]),
        ("neutral = 0.8", "neutral = 3.0", ["joints.head", "neutral must lie"]),
        ("max_speed = 6.0", 'max_speed = "fast"', ["servo.max_speed", "fast"]),
        ('"xl330-m288-t"', '"xl331"', ["servo.model", "no servo 'xl331'", "imagined"]),
        ("lag = [", "late = [", ["guards.lag is missing", "known ones are lag, slack, least"]),
        ("lag = [0.0055", "lag = [1.5", ["guards.lag.0", "1.5", "less than or equal to 1"]),
        ("lag = [0.0055", 'lag = ["0.0055"', ["guards.lag.0", "'0.0055'", "valid number"]),
        ("lag = [0.0055", "lag = [nan", ["guards.lag.0", "finite"]),
        ("lag = [0.0055,", "lag = [", ["guards.lag", "8 items"]),
        # A guard so wide is none: no contact would stop the simulated body.
        ("arrival = [0.0138", "arrival = [0.9", ["guards.arrival is 0.9", "allowed (1 to 150 ste"]),
        ("behind = [0.0230", "behind = [0.0", ["guards.behind is 0 rad", "1 to 300 steps"]),
        ('name = "iphonoid"', 'name = "i phone"', ["name", "i phone"]),
        ("[lengths]", "[lengths", ["not TOML"]),
    ],
)
def test_the_error_for_a_wrong_file_names_key_and_range(
    tmp_path, old: str, new: str, parts: list[str]
) -> None:
    path = tmp_path / "wrong.toml"
    assert old in TEXT
    path.write_text(TEXT.replace(old, new, 1))
    with pytest.raises(DescriptionError) as error:
        load_robot(path)
    assert [words for words in [str(path), *parts] if words not in str(error.value)] == []
    assert not str(error.value).endswith("..")


def test_a_missing_file_and_a_binary_file_are_refused(tmp_path) -> None:
    with pytest.raises(DescriptionError, match="No such file"):
        load_robot(tmp_path / "none.toml")
    (tmp_path / "noise.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DescriptionError, match="not TOML"):
        load_robot(tmp_path / "noise.toml")


def test_a_servo_of_your_own_lies_beside_the_robot(tmp_path) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(TEXT.replace('model = "xl330-m288-t"', 'model = "strong.toml"'))
    with pytest.raises(DescriptionError, match=r"strong\.toml: cannot be read: No such file"):
        load_robot(path)
    servo = (resources.files("miburi.servos") / "xl330-m288-t.toml").read_text()
    (tmp_path / "strong.toml").write_text(servo.replace("XL330-M288-T", "strong"))
    assert load_robot(path).servo.model.name == "strong"


@pytest.mark.parametrize("steps", [1024, 16_384])
def test_guards_are_angles_whatever_encoder_a_servo_has(robot: Robot, steps: int) -> None:
    servo = robot.servo.model
    encoder = servo.encoder.model_copy(update={"steps_per_turn": steps})
    other = robot.with_servo(servo.model_copy(update={"encoder": encoder}))
    slack = FreeRule.of(other).guards.slack * other.servo.step
    np.testing.assert_allclose(slack, robot.guards.slack, atol=other.servo.step / 2)
