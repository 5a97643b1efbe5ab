"""A robot, gestures and a temperament of one's own: the same files in every command."""

import json
import re
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from math import radians
from pathlib import Path

import httpx
import pytest
from tests.fixtures.command import miburi
from tests.fixtures.program import address, running
from tests.fixtures.waiting import until
from typer.testing import CliRunner

from miburi.cli.commands import app
from miburi.cli.options import calibrated, warn_of_meetings
from miburi.errors import BodyError, OutputError
from miburi.gestures import MovementFunction, load
from miburi.robot import Robot
from miburi.safety.free import FreeRule
from miburi.studies.trials import plan, runs, workshop
from miburi.studies.trials.plan import Chunk, Plan
from miburi.studies.trials.trial import Outcome
from miburi.studies.trials.workshop import Calibrated

#: Trials in this process; others start two more.
TRIALS = ("trials", "--workers", "1", "--json")


def test_run_takes_a_robot_gestures_and_a_temperament(
    tall_file: Path, own_gestures: Path, own_temperament: Path, tmp_path: Path
) -> None:
    options = ("--robot", tall_file, "--gestures", own_gestures, "--temperament", own_temperament)
    options += ("--rest", "lively")
    with running(tmp_path, *map(str, options)) as program, httpx.Client(verify=False) as client:
        url = address(program.out.next())
        api = url + "/api/v1"

        def get(path: str) -> object:
            return client.get(api + path).json()

        robot = get("/robot")
        assert (robot["name"], robot["temperaments"][-1]) == ("tall", "mine")
        happy = [g["name"] for g in get("/gestures") if g["feeling"] == "happiness"]
        assert happy == ["cheer"]
        performed = until(
            lambda: [one["name"] for one in get("/log") if one["kind"] == "gesture_begun"]
        )
        assert performed[0] == "cheer"
        for name in ("calm", "mine"):
            assert client.post(api + "/temperament", json={"name": name}).status_code == 204
            until(lambda: get("/state")["temperament"], name.__eq__)
        assert client.get(url).status_code == 200
    (bent,) = [line for line in program.errors.all if "cannot reach every pose" in line]
    assert "disgust" in bent
    assert "happiness" not in bent  # ours has taken its place
    assert "surprise" not in bent
    assert "--gestures" in bent


@pytest.mark.parametrize("command", [("run", "--headless", "--port", "0"), ("experiment",)])
def test_a_gesture_that_does_not_fit_the_robot_is_refused_by_name(
    command: tuple[str, ...], tall_file: Path, unfit_gestures: Path
) -> None:
    out = miburi(*command, "--robot", tall_file, "--gestures", unfit_gestures)
    assert out.returncode == 1
    assert f"{unfit_gestures / 'hooray.toml'}: pose 1: right = [0.1, 0.3, 0.94]" in out.stderr
    assert "allowed is what the joint limits let the arm do" in out.stderr
    assert "Traceback" not in out.stderr


@pytest.mark.parametrize(
    ("table", "changes", "words"),
    [
        ("left_elbow", {"min": -0.174, "max": 1.744, "neutral": 1.3}, "the joint limits of iphon"),
        ("motor", {"resistance": 4.0}, "the servo's constants or speeds of iph"),
    ],
)
def test_guards_for_other_limits_or_servos_are_named(
    robot: Robot, table: str, changes: dict[str, float], words: str,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    calibrated(robot, None)
    assert not capsys.readouterr().err
    data = robot.model_dump()
    ({**data["joints"], **data["servo"]["model"]}[table]).update(changes)
    calibrated(Robot.model_validate(data), None)
    assert f"are for {words}" in capsys.readouterr().err


def test_gestures_in_which_long_arms_meet_are_named(
    robot: Robot, capsys: pytest.CaptureFixture[str]
) -> None:
    functions = [load("fear"), load("surprise")]
    warn_of_meetings(robot, functions)
    assert not capsys.readouterr().err
    data = robot.model_dump()
    data["lengths"] |= {"L01": 0.2, "L23": 0.09, "L34": 0.12}
    warn_of_meetings(Robot.model_validate(data), functions)
    assert "in these gestures, at mood 1: fear (right_hand and left_hand). Gest" in (
        capsys.readouterr().err
    )
    data["lengths"]["L01"] = 0.06
    warn_of_meetings(Robot.model_validate(data), functions)
    assert "at neutral the table and the right hand are" in capsys.readouterr().err


def test_experiment_with_a_robot_and_a_gesture_of_ones_own(
    tall_file: Path, own_gestures: Path, tmp_path: Path
) -> None:
    options = ("--robot", tall_file, "--gestures", own_gestures, "--emotional-model", "spiking")
    for earlier in ("experiment.mp4", "experiment-strip.png", "mine.png"):
        (tmp_path / earlier).write_bytes(b"of another run")
    out = miburi("experiment", "--seconds", "2", "--no-film", "--out", tmp_path, *options)
    assert out.returncode == 0, out.stderr
    assert (
        "are for the lengths and joint limits of iphonoid, and this robot has others" in out.stderr
    )
    pictures = {file.name for file in tmp_path.iterdir() if file.suffix in (".mp4", ".png")}
    assert pictures == {"experiment.png", "mine.png"}
    assert "nothing was touched" in out.stdout
    report = json.loads((tmp_path / "experiment.json").read_text())
    assert report["gestures"]
    chosen = ("robot", "repertoire", "body", "calibration", "solver", "hand", "emotional_model")
    assert [report[name] for name in chosen] == [
        tall_file.name, own_gestures.name, "simulated", None, "default", True, "spiking",
    ]  # fmt: skip
    assert report["false_stops"] == 0
    assert report["ik"]["max_error_m"] < 1e-3


@pytest.mark.proof("test_a_calibration_of_a_users_own_robot_is_used")
def test_without_a_rule_the_motors_limit_alone_keeps_the_push_low() -> None:
    options = ("--free", "2", "--blocked", "25", "--rule", "off")
    done = miburi(*TRIALS, *options)
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)
    assert figures["missed"] == 25  # nothing stops
    done = miburi(*TRIALS, *options, "--servo", "imagined")
    assert "are for XL330-M288-T servos, and this robot has imagined" in done.stderr
    imagined = json.loads(done.stdout)  # it has no such limit
    assert figures["sustained_force_p95"] <= 0.7 * imagined["sustained_force_p95"]


def test_a_robot_that_cannot_be_calibrated_makes_no_trials_and_the_others_do(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calibrated: list[float] = []

    def calibrate(body: Robot, seed: int, true: Robot) -> Calibrated:
        calibrated.append(true.servo.model.loop.backlash)
        if len(calibrated) != 2:
            raise BodyError("Look at its horn.")
        return Calibrated(body, true, FreeRule.of(body), None, (), 0.0)  # type: ignore[arg-type]

    monkeypatch.setattr(workshop, "calibrate_servos", calibrate)
    monkeypatch.setattr("miburi.cli.trials.ProcessPoolExecutor", ThreadPoolExecutor)
    options = [*TRIALS, "--servos", "3", "--play", "0.25", "--free", "1", "--blocked", "0"]
    told = CliRunner().invoke(app, options)
    counted = json.loads(told.stdout)
    assert (counted["free"], counted["robots"], counted["left_out"]) == (1, 3, 2)
    assert (counted["seed"], counted["rule"], counted["robot"]) == (1, "miburi", "iphonoid")
    assert told.stderr.count("is left out. Look at its horn.") == 2
    assert "Robot 1 of 3" in told.stderr
    assert calibrated == pytest.approx([radians(0.25)] * 3)


@pytest.mark.proof("test_a_calibration_of_a_users_own_robot_is_used")
def test_in_a_state_and_without_a_part_trials_still_notice() -> None:
    few = ("--free", "3", "--blocked", "3")
    for options in (("--state", "warmed-up"), ("--without", "ceiling", "--rule", "weightless")):
        done = miburi(*TRIALS, *few, *options)
        assert done.returncode == 0, done.stderr
        figures = json.loads(done.stdout)
        assert figures["missed_above_2N"] == 0


def test_an_interrupted_run_says_that_it_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = [*TRIALS[:-1], "--free", "2", "--blocked", "0", "--out", str(tmp_path / "t.parquet")]
    monkeypatch.setattr(plan, "CHUNK", 1)
    carry_out = runs.carry_out_chunk

    def until_interrupted(plan: Plan, chunk: Chunk) -> list[Outcome]:
        if chunk[1] == 1:
            raise KeyboardInterrupt
        return carry_out(plan, chunk)

    with monkeypatch.context() as patch:
        patch.setattr(runs, "carry_out_chunk", until_interrupted)
        told = CliRunner().invoke(app, options)
    assert "1 trials are kept; the same command goes on from there" in told.stderr
    assert "with 1 trials of an interrupted run" in CliRunner().invoke(app, options).stdout


def test_a_tuned_rule_is_judged_on_runs_that_did_not_choose_it(tmp_path: Path) -> None:
    done = miburi("tune", "--free", "2", "--blocked", "1", "--out", tmp_path / "tuned.toml")
    assert done.returncode == 0, done.stderr
    assert "judged on as many fresh ones, seed 2" in done.stdout
    assert "false stops 100.00% (43.85 to 100.00 %)" in done.stdout  # three runs, as printed
    assert re.search(r"\nthe description's +p 0.10 s  ratio 0.9372  false stops 0.00%", done.stdout)
    said = "do not show the bound of 0.10%: at least 3838 runs without a false stop would show it."
    assert said in done.stdout
    assert said in (tmp_path / "tuned.toml").read_text()


def test_a_calibration_of_a_users_own_robot_is_used(
    tall_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No servo moves here; tests/studies tests the calibration of servos."""

    def calibrate(body: Robot, _seed: int) -> Calibrated:
        rule = replace(FreeRule.of(body), period=170_000)
        return Calibrated(body, body, rule, None, ("all is well",), 9.0)  # type: ignore[arg-type]

    monkeypatch.setattr(workshop, "calibrate_servos", calibrate)
    file = tmp_path / "calibration.toml"
    out = miburi("calibrate", "--robot", tall_file, "--out", file)
    assert out.returncode == 0, out.stderr
    assert out.stdout == f"all is well\n9 s of the robot's time\n{file}\n"
    assert "Contact rule of tall" in file.read_text()
    used: list[int] = []

    def carry_out(plan: Plan, *_: object, **__: object) -> None:
        used.extend(subject.rule.period for subject in plan.servos)
        raise OutputError("enough")

    monkeypatch.setattr(runs, "carry_out_plan", carry_out)
    out = miburi(*TRIALS, "--robot", tall_file, "--calibration", file)
    assert out.stderr.endswith("miburi: enough\n")
    assert used == [170_000]


@pytest.mark.proof("test_a_calibration_of_a_users_own_robot_is_used")
def test_a_calibrated_robot_stops_when_it_should_and_only_then(
    tall_file: Path, tmp_path: Path
) -> None:
    file = tmp_path / "calibration.toml"
    assert miburi("calibrate", "--robot", tall_file, "--out", file).returncode == 0
    options = ("--robot", tall_file, "--calibration", file)
    out = miburi(*TRIALS, "--free", "4", "--blocked", "4", *options)
    assert out.returncode == 0, out.stderr
    counts = json.loads(out.stdout)
    assert counts["servo"] == "XL330-M288-T"
    assert counts["false_stops"] == counts["missed_above_2N"] == 0


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


def test_a_robots_file_is_checked_before_anything_moves(tall_file: Path, tmp_path: Path) -> None:
    shipped = tmp_path / "mine.toml"
    shipped.write_text(CliRunner().invoke(app, ["template", "robot", "iphonoid"]).stdout)
    assert "all is well" in CliRunner().invoke(app, ["robot", "check", str(shipped)]).stdout
    told = CliRunner().invoke(app, ["robot", "check", str(tall_file)])
    assert told.exit_code == 1
    assert "are for the lengths and joint limits of iphonoid" in told.stderr
    assert "cannot reach every pose of these gestures" in told.stderr
    quick = tmp_path / "quick.toml"
    quick.write_text(shipped.read_text().replace("acceleration = 20.0", "acceleration = 90.0"))
    told = CliRunner().invoke(app, ["robot", "check", str(quick)])
    assert "servo.acceleration gives" in told.stderr
