"""A servo's file: what ships is what others found, and a wrong file is refused in words."""

from importlib import resources

import pytest

from miburi.errors import DescriptionError, InputError
from miburi.servos import SERVOS, load_servo

TEXT = (resources.files("miburi.servos") / "xl330-m288-t.toml").read_text()


@pytest.mark.parametrize("name", SERVOS)
def test_every_servo_that_ships_can_be_read(name: str) -> None:
    servo = load_servo(name)
    assert servo.step == pytest.approx(0.00153398, rel=1e-5)
    assert 4 <= servo.stiffness <= 6


def test_the_identified_servo_gives_credit() -> None:
    servo = load_servo("xl330-m288-t")
    assert servo.motor.standing == servo.friction.standing == "identified by others"
    for words in ("Better Actuator Models", "1.0.2", "Rhoban", "Apache License 2.0"):
        assert words in TEXT


def test_your_own_file_is_read_by_its_path(tmp_path) -> None:
    path = tmp_path / "hot.toml"
    path.write_text(TEXT.replace("resistance = 2.811", "resistance = 3.373"))
    assert load_servo(path).motor.resistance == 3.373


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("resistance = 2.811", "resistance = 0.0", ["motor.resistance", "greater than 0"]),
        ("motor_load = 0.2668", "motor_load = 1.0", ["friction.motor_load", "less than 1"]),
        ('standing = "ours"', 'standing = "hearsay"', ["supply.standing", "'data sheet'"]),
        ("headroom = 1.0", "headroom = 0.9", ["drive.headroom", "greater than or equal to 1"]),
        (
            "voltage = 5.0",
            "voltage = 5000.0",
            ["supply.voltage = 5000.0: it is in V, from 1 to 50"],
        ),
        ("dry = 0.004771", "dry = 4.771", ["friction.dry", "it is in N·m, from 0 to 1"]),
        ("stall_torque = 0.52", "stall_torque = 520.0", ["data_sheet.stall_torque", "N·m"]),
        ("start_delay = 0.0025", "start_delay = 2.5", ["loop.start_delay", "it is in s"]),
        ("rate = 1000.0", "rate = 1.0", ["loop.rate", "it is in Hz, from 20"]),
        ("backlash = 0.0 ", "backlash = 0.5 ", ["loop.backlash", "it is in rad"]),
        ("pwm_limit = 885", "pwm_limit = 1", ["gains.pwm_limit", "from 100 to 65535"]),
        ("gain = 3200.0", "gain = 1e300", ["drive.gain", "from 1 to 65535"]),
        ("gain = 3200.0", "", ["drive.gain", "missing"]),
        ("room = 0.05", "room = 1.5", ["drive.room", "less than or equal to 1"]),
    ],
)
def test_a_wrong_file_is_refused_in_words(tmp_path, old: str, new: str, words: list[str]) -> None:
    path = tmp_path / "wrong.toml"
    assert old in TEXT
    path.write_text(TEXT.replace(old, new, 1))
    with pytest.raises(DescriptionError) as error:
        load_servo(path)
    assert [word for word in [str(path), *words] if word not in str(error.value)] == []


def test_an_unknown_servo_is_refused_with_the_names_of_the_known() -> None:
    with pytest.raises(InputError, match="xl331.*xl330-m288-t, imagined.*toml"):
        load_servo("xl331")
