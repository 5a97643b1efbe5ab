"""A robot, gestures and a temperament of one's own: the same files in every command."""

import json
import os
import subprocess
from contextlib import nullcontext
from pathlib import Path

import httpx
import pytest
from tests.fixtures.command import COMMAND, miburi
from tests.fixtures.live import address, started
from typer.testing import CliRunner

from miburi.cli.commands import app
from miburi.errors import OutputError
from miburi.gestures import MovementFunction
from miburi.robot import Robot

#: Trials in this process; others start two more.
TRIALS = ("trials", "--workers", "1", "--json")


def test_run_takes_a_robot_gestures_and_a_temperament(
    tall_file: Path, own_gestures: Path, own_temperament: Path, tmp_path: Path
) -> None:
    options = ("--robot", tall_file, "--gestures", own_gestures, "--temperament", own_temperament)
    with started(tmp_path, *map(str, options)) as said, httpx.Client() as client:
        api = address(said) + "/api/v1"

        def get(path: str) -> object:
            return client.get(api + path).json()

        robot = get("/robot")
        assert (robot["name"], robot["temperaments"][-1]) == ("tall", "mine")
        happy = [g["name"] for g in get("/gestures") if g["feeling"] == "happiness"]
        assert happy == ["cheer"]
        while not (performed := [e["name"] for e in get("/log") if e["kind"] == "gesture"]):
            pass
        assert performed[0] == "cheer"
        for name in ("calm", "mine"):
            assert client.post(api + "/temperament", json={"name": name}).status_code == 204
            while get("/state")["temperament"] != name:
                pass
        assert client.get(address(said)).status_code == 200


def test_run_says_which_shipped_gestures_are_bent(tall_file: Path, tmp_path: Path) -> None:
    process = subprocess.Popen(
        [*COMMAND, "run", "--headless", "--port", "0", "--forget", "--folder", tmp_path,
         "--robot", tall_file],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={key: value for key, value in os.environ.items() if not key.startswith("PYTEST_")},
    )  # fmt: skip
    assert process.stdout is not None
    assert "awake" in process.stdout.readline()
    process.terminate()
    _, warnings = process.communicate(timeout=30)
    (line,) = warnings.splitlines()
    assert "happiness" in line
    assert "surprise" not in line
    assert "--gestures" in line


@pytest.mark.parametrize("command", [("run", "--headless", "--port", "0"), ("experiment",)])
def test_a_gesture_that_does_not_fit_the_robot_is_refused_by_name(
    command: tuple[str, ...], tall_file: Path, unfit_gestures: Path
) -> None:
    out = miburi(*command, "--robot", tall_file, "--gestures", unfit_gestures)
    assert out.returncode == 1
    assert f"{unfit_gestures / 'hooray.toml'}: pose 1: right = [0.1, 0.3, 0.94]" in out.stderr
    assert "allowed is what the joint limits let the arm do" in out.stderr
    assert "Traceback" not in out.stderr


def test_experiment_with_a_robot_and_a_gesture_of_ones_own(
    tall_file: Path, own_gestures: Path, tmp_path: Path
) -> None:
    options = ("--robot", tall_file, "--gestures", own_gestures)
    out = miburi("experiment", "--seconds", "8", "--no-film", "--out", tmp_path, *options)
    assert out.returncode == 0, out.stderr
    report = json.loads((tmp_path / "experiment.json").read_text())
    assert len(report["gestures"]) > 2
    assert report["false_stops"] == 0
    assert report["ik"]["max_error_m"] < 1e-3


def test_trials_of_a_robot_of_ones_own(tall_file: Path) -> None:
    out = miburi(*TRIALS, "--robot", tall_file, "--free", "6", "--blocked", "4")
    assert out.returncode == 0, out.stderr
    assert json.loads(out.stdout)["free"] == 6


def test_the_servo_that_others_identified_moves_freely(tmp_path: Path) -> None:
    done = miburi("trials", "--json", "--free", "12", "--blocked", "6")
    assert done.returncode == 0, done.stderr
    counts = json.loads(done.stdout)
    assert counts["servo"] == "XL330-M288-T"
    assert counts["false_stops"] == counts["missed_above_2N"] == 0


def test_calibrated_servos_drive_trials(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    done = miburi("calibrate", "--out", file)
    assert done.returncode == 0, done.stderr
    assert "s of the robot's time" in done.stdout
    out = miburi(*TRIALS, "--calibration", file, "--free", "8", "--blocked", "4")
    assert out.returncode == 0, out.stderr
    counts = json.loads(out.stdout)
    assert counts["false_stops"] == counts["missed_above_2N"] == 0


def test_without_a_rule_the_motors_limit_alone_keeps_the_push_low() -> None:
    options = ("--free", "2", "--blocked", "40", "--rule", "off")
    done = miburi(*TRIALS, *options)
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)
    assert figures["missed"] == 40  # nothing stops
    assert figures["sustained_force_p95"] <= 7.0
    imagined = json.loads(miburi(*TRIALS, *options, "--servo", "imagined").stdout)
    assert imagined["sustained_force_p95"] > 7.0  # it has no such limit


@pytest.mark.parametrize("option", ["--rule", "--without", "--state"])
def test_trials_name_what_they_can_compare(option: str) -> None:
    done = miburi("trials", option, "nothing")
    assert done.returncode == 2
    assert f"{option} must be one of" in done.stderr
    assert "got 'nothing'" in done.stderr


def test_a_servo_has_one_calibration() -> None:
    done = miburi("trials", "--state", "hot", "--servos", "2")
    assert done.returncode == 2
    assert "give one of them" in done.stderr


def test_in_a_state_and_without_a_part_trials_still_notice() -> None:
    few = ("--free", "3", "--blocked", "3")
    for options in (("--state", "warmed-up"), ("--without", "ceiling", "--rule", "weightless")):
        done = miburi(*TRIALS, *few, *options)
        assert done.returncode == 0, done.stderr
        figures = json.loads(done.stdout)
        assert figures["missed_above_2N"] == 0


@pytest.mark.parametrize("command", ["run", "experiment", "calibrate", "tune"])
def test_trials_alone_can_switch_the_rule_off(command: str) -> None:
    done = miburi(command, "--rule", "off")
    assert done.returncode == 2
    assert "rule" in done.stderr


def test_an_unknown_servo_is_refused_with_those_that_there_are() -> None:
    done = miburi("experiment", "--servo", "ax-12")
    assert done.returncode == 2
    assert "ax-12" in done.stderr
    assert "xl330-m288-t" in done.stderr


def test_a_calibration_of_a_robot_of_ones_own_is_used(tall_file: Path, tmp_path: Path) -> None:
    file = tmp_path / "calibration.toml"
    out = miburi("calibrate", "--robot", tall_file, "--out", file)
    assert out.returncode == 0, out.stderr
    assert "Contact rule of tall" in file.read_text()
    options = ("--robot", tall_file, "--calibration", file)
    out = miburi(*TRIALS, "--free", "2", "--blocked", "0", *options)
    assert out.returncode == 0, out.stderr


def test_export_and_gesture_check_of_a_robot_of_ones_own(
    tall_file: Path, own_gestures: Path
) -> None:
    assert '"tall"' in miburi("export", "urdf", "--robot", tall_file).stdout
    source = own_gestures / "cheer.toml"
    checked = miburi("gesture", "check", source, "--robot", tall_file, "--step", "0.5")
    assert "all is well" in checked.stdout, checked.stdout
    unfit = miburi("gesture", "check", "happiness", "--robot", tall_file, "--step", "0.5")
    assert unfit.returncode == 1
    assert "happiness: pose 1: right = " in unfit.stdout


def test_gallery_of_a_robot_and_gestures_of_ones_own(
    tall_file: Path, own_gestures: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[tuple[str, str]] = []

    def show(robot: Robot, function: MovementFunction, *_: object, **__: object) -> None:
        shown.append((robot.name, function.name))
        raise OutputError("enough")  # drawing all films takes minutes

    monkeypatch.setattr("miburi.studies.gestures.gallery.show", show)
    monkeypatch.setattr("miburi.studies.gestures.gallery.camera_on", lambda _: nullcontext())
    options = ["--robot", str(tall_file), "--gestures", str(own_gestures), "--out", str(tmp_path)]
    CliRunner().invoke(app, ["gallery", *options])
    assert shown == [("tall", "cheer")]
