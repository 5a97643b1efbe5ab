"""`miburi card measure` from end to end: a script is the person, the real binary the card."""

import os
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from miburi.card.bench import LEVER, STEPS, WEIGHT, peek
from miburi.card.card import Card
from miburi.card.free_moves import free_moves
from miburi.card.settings import CardSettings
from miburi.cli.card import app
from miburi.emulation.body import EmulatedRobot
from miburi.errors import BodyError
from miburi.robot import Robot, iphonoid
from miburi.robot.loads import GRAVITY, loads


@pytest.fixture(scope="module")
def real() -> Robot:
    return iphonoid()


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


def test_the_seven_measurements_find_what_is_true(
    firmware: Path, real: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Skipped, stopped and taken up again; then everything is in the report.

    Of the free moves it makes the quickest ones of two joints and of all: those tell most, and
    are stopped first. `make firmware-proof` makes them all.
    """
    some = ("waist", "right_elbow", "all joints")
    quickest = [one for one in free_moves(real) if one[0] in some and one[1].speeds.max() > 5.0]
    moves = [*free_moves(real)] if "MIBURI_MOVES" in os.environ else quickest
    monkeypatch.setattr("miburi.card.bench.free_moves", lambda _: moves)
    emulation = EmulatedRobot(real, CardSettings.of(real))
    monkeypatch.setattr("miburi.card.card.SerialLine", lambda _: emulation)
    monkeypatch.setattr(emulation, "close", lambda: None)
    monkeypatch.setattr("miburi.cli.card.robot_of", lambda _: real)
    monkeypatch.setattr("miburi.cli.card.wait_for_enter", person(emulation, real))
    out = tmp_path / "measured.toml"

    def measure(*answers: str) -> str:
        command = ["measure", "card", "--out", str(out), "--gestures", "1"]
        done = CliRunner().invoke(app, command, input="\n".join(answers) + "\n")
        assert done.exit_code == 0, done.output
        return done.output

    assert "Nothing was measured." in measure("s", "q")
    first = measure("", "s", "", "q")
    assert "The report is in" in first
    assert list(tomllib.loads(out.read_text())["measured"]) == ["stiffness", "ceiling"]
    assert "It is in the report already." in measure("", "", "", "", "")
    report = tomllib.loads(out.read_text())
    assert set(report["measured"]) == {step.name for step in STEPS}
    measured, constants = report["measured"], report["constants"]
    servo = real.servo.model
    motor = np.array([servo.stiffness / 4, servo.stiffness])
    np.testing.assert_allclose(measured["stiffness"]["stiffness"], motor, rtol=0.1)
    assert constants["divisor"]["p_divisor"] == pytest.approx(256, rel=0.1)
    assert max(measured["hunting"]["steps"]) <= 2
    assert measured["ceiling"]["obeys"] == "yes"
    assert constants["loop"]["clock_error"] < 0.002
    assert constants["motor"]["resistance"] == pytest.approx(servo.motor.resistance, rel=0.1)
    assert len(measured["friction"]["friction_warm"]) == 8
    assert measured["false_stops"]["stops"] == []
    assert measured["false_stops"]["moves"] > len(moves) >= 8
    # Nothing of it stays on the card.
    assert Card(lambda: emulation, real).settings == CardSettings.of(real)


def test_registers_are_read_at_rest_alone(firmware: Path, real: Robot) -> None:
    emulation = EmulatedRobot(real, CardSettings.of(real))
    card = Card(lambda: emulation, real)
    assert peek(card, 3, 0, 2) == 1200
    assert peek(card, 3, 144, 2) == 50
    for motor, address, count in ((8, 0, 2), (0, 0, 0), (0, 0, 13)):
        with pytest.raises(BodyError, match="out of range"):
            peek(card, motor, address, count)
    with pytest.raises(BodyError, match="head: servo does not answer"):
        peek(card, 7, 14, 2)  # nothing is defined there
    card.release()
    with pytest.raises(BodyError, match="returning; it does not take peek"):
        peek(card, 0, 0, 2)
    card.close()
