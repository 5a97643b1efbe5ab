"""`miburi card measure` from end to end: a script is the person, the real binary the card."""

import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from miburi.card.bench import LEVER, STEPS, WEIGHT
from miburi.card.bench_moves import peek
from miburi.card.card import Card
from miburi.card.settings import CardSettings
from miburi.cli.card import app
from miburi.emulation.body import EmulatedRobot
from miburi.errors import BodyError
from miburi.robot import Robot
from miburi.robot.loads import GRAVITY, loads


def person(emulation: EmulatedRobot, robot: Robot) -> Callable[[str], None]:
    """Return who does what is asked: hangs weights on the right forearm, and presses it down."""
    dof = emulation.plant.model.joint("right_elbow").dofadr[0]
    hung = 0

    def do(what: str) -> None:
        nonlocal hung
        hung += what.startswith("Hang") - what.startswith("Take off")
        down = -np.sign(loads(robot, emulation.plant.angles).gravity[2])
        pressed = 0.15 if what.startswith("Press") else 0.0
        force = hung * WEIGHT * GRAVITY * LEVER + pressed
        emulation.plant.data.qfrc_applied[dof] = down * force

    return do


@pytest.fixture
def emulation(firmware: Path, robot: Robot, monkeypatch: pytest.MonkeyPatch) -> EmulatedRobot:
    """The card that the command finds; it stays on from call to call."""
    made = EmulatedRobot(robot, CardSettings.of(robot))
    monkeypatch.setattr("miburi.card.line.SerialLine", lambda _: made)
    monkeypatch.setattr(made, "close", lambda: None)
    monkeypatch.setattr("miburi.cli.card.robot_of", lambda _: robot)
    monkeypatch.setattr("miburi.cli.card.wait_for_enter", person(made, robot))
    return made


def measure(out: Path, *answers: str) -> str:
    """Answer the command's questions; return what it says."""
    command = ["measure", "card", "--out", str(out), "--gestures", "2"]
    done = CliRunner().invoke(app, command, input="\n".join(answers) + "\n")
    assert done.exit_code == 0, done.output
    return done.output


def test_what_is_measured_is_kept_and_what_is_skipped_is_not(
    emulation: EmulatedRobot, robot: Robot, tmp_path: Path
) -> None:
    out = tmp_path / "measured.toml"
    assert "Nothing was measured." in measure(out, "s", "q")
    assert "The report is in" in measure(out, "s", "s", "", "q")
    report = tomllib.loads(out.read_text())
    assert list(report["measured"]) == ["ceiling"]
    assert report["measured"]["ceiling"]["obeys"] == "yes"
    assert "It is in the report already." in measure(out, "s", "s", "q")
    # Nothing of it stays on the card.
    assert Card(lambda: emulation, robot).settings == CardSettings.of(robot)


@pytest.mark.proof("test_what_is_measured_is_kept_and_what_is_skipped_is_not")
def test_the_seven_measurements_find_what_is_true(
    emulation: EmulatedRobot, robot: Robot, tmp_path: Path
) -> None:
    out = tmp_path / "measured.toml"
    measure(out, "", "", "", "", "", "", "")
    report = tomllib.loads(out.read_text())
    assert set(report["measured"]) == {step.name for step in STEPS}
    measured, constants = report["measured"], report["constants"]
    servo = robot.servo.model
    motor = np.array([servo.stiffness / 4, servo.stiffness])
    np.testing.assert_allclose(measured["stiffness"]["stiffness"], motor, rtol=0.1)
    assert constants["divisor"]["p_divisor"] == pytest.approx(256, rel=0.1)
    assert max(measured["hunting"]["steps"]) <= 2
    assert constants["loop"]["clock_error"] < 0.002
    assert constants["motor"]["resistance"] == pytest.approx(servo.motor.resistance, rel=0.1)
    assert len(measured["friction"]["friction_warm"]) == 8
    assert measured["false_stops"]["stops"] == []
    assert measured["false_stops"]["moves"] > 60


def test_registers_are_read_only_at_rest(firmware: Path, robot: Robot) -> None:
    emulation = EmulatedRobot(robot, CardSettings.of(robot))
    card = Card(lambda: emulation, robot)
    assert peek(card, 3, 0, 2) == 1200
    assert peek(card, 3, 144, 2) == 50
    for motor, address, count in ((8, 0, 2), (0, 0, 0), (0, 0, 13)):
        with pytest.raises(BodyError, match="out of range"):
            peek(card, motor, address, count)
    with pytest.raises(BodyError, match="head: servo does not answer"):
        peek(card, 7, 14, 2)  # nothing is defined there
    card.release()
    with pytest.raises(BodyError, match="refuses .peek. while it is returning"):
        peek(card, 0, 0, 2)
    card.close()
