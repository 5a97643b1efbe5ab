"""The command line, as a user meets it: answers, refusals, interruptions."""

import json
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.fixtures.command import COMMAND, miburi, miburi_apart
from typer.testing import CliRunner

from miburi import __version__
from miburi.cli.commands import app
from miburi.errors import OutputError
from miburi.feelings import TEMPERAMENTS
from miburi.robot import EXTREMITIES, Robot, forward
from miburi.studies.experiment import results
from miburi.studies.paper.page import write_paper

NEUTRAL = ["0", "0.1", "1.3", "0.25", "0.1", "-1.3", "-0.25", "0.8"]


def test_version_and_help() -> None:
    assert miburi_apart("--version").stdout == f"miburi {__version__}\n"
    assert "experiment" in miburi("--help").stdout
    for command in (("feelings", "day"), ("run",)):
        words = re.findall(r"\w+", miburi(*command, "--help").stdout)
        assert set(TEMPERAMENTS) <= set(words)


def test_a_place_out_of_reach_ends_with_1() -> None:
    far = ["--right", "1", "0", "0", "--left", "1", "0", "0", "--head", "0.03", "0", "0.2"]
    for words in (far, [*far, "--json"]):
        done = miburi("ik", *words)
        assert (done.returncode, done.stderr) == (1, "")
        assert "out of reach" in done.stdout
    assert json.loads(done.stdout)["error_m"][0] > 0.5


def test_forward_as_printed_differs() -> None:
    real, printed = (
        json.loads(miburi("forward", "--json", *flags, *NEUTRAL).stdout)
        for flags in ([], ["--as-printed"])
    )
    assert real["left"][2] - printed["left"][2] == pytest.approx(0.24)


def test_many_lines_in_many_lines_out(robot: Robot) -> None:
    poses = np.random.default_rng(2).uniform(robot.lower, robot.upper, (5, 8))
    out = miburi(
        "forward", "--json", given="\n".join(json.dumps(p.tolist()) for p in poses) + "\n\n"
    )
    answers = [json.loads(line) for line in out.stdout.splitlines()]
    assert len(answers) == 5
    targets = [[x for name in EXTREMITIES for x in answer[name]] for answer in answers]
    out = miburi("ik", "--json", given="\n".join(map(json.dumps, targets)))
    for line, target in zip(out.stdout.splitlines(), targets, strict=True):
        answer = json.loads(line)
        assert set(answer) == {"angles", "error_m", "status", "generations", "evaluations"}
        np.testing.assert_allclose(forward(robot, answer["angles"]), target, atol=1e-4)
        assert max(answer["error_m"]) < 1e-4


@pytest.mark.proof("test_many_lines_in_many_lines_out")
def test_each_command_reads_what_the_other_prints() -> None:
    places = miburi_apart("forward", "--json", *NEUTRAL).stdout
    turned = json.dumps(dict(reversed(json.loads(places).items())))  # the names say which is which
    angles = miburi_apart("ik", "--json", given=f"{places}{turned}\n").stdout
    again = miburi_apart("forward", "--json", given=angles).stdout.splitlines()
    for line in again:
        for name, place in json.loads(line).items():
            np.testing.assert_allclose(place, json.loads(places)[name], atol=1e-6)
    assert len(again) == 2
    refused = miburi_apart("ik", "--json", given='{"right": [0, 0, 0], "left": 3}')
    assert refused.returncode == 2
    assert refused.stderr.startswith("miburi: 9 coordinates are needed, got [0, 0, 0, 3, null]")


@pytest.mark.parametrize(
    ("command", "given", "said"),
    [
        ("forward", "[1, 2]\n", "8 angles are needed, got [1, 2]"),
        ("forward", "[0, 0, 0\n", "line 1 is not JSON"),
        ("forward", "[0, 0, 0\n", "got '[0, 0, 0'. A line is a list of numbers"),
        ("forward", "[" * 100_000, "line 1 is not JSON"),
        ("forward", "[" + "9" * 5000 + "]", "line 1 is not JSON"),
        ("forward", '["a", 0, 0, 0, 0, 0, 0, 0]', "8 angles are needed"),
        ("forward", "[NaN, 0, 0, 0, 0, 0, 0, 0]", "finite"),
        ("ik", "[1, 2, 3]", "9 coordinates are needed"),
        ("ik", '{"right": 1}', "9 coordinates are needed"),
    ],
)
def test_a_wrong_line_of_numbers_is_answered_in_words(command: str, given: str, said: str) -> None:
    out = miburi(command, given=given)
    assert (out.returncode, out.stdout) == (2, "")
    assert said in out.stderr
    assert "Traceback" not in out.stderr


@pytest.mark.parametrize("form", ["mjcf", "urdf"])
def test_export(form: str) -> None:
    written = miburi("export", form).stdout
    assert "right_shoulder" in written
    assert "table" not in written  # the robot alone


@pytest.mark.proof("test_the_readmes_experiment_is_what_the_command_prints")
def test_experiment_writes_whole_files(tmp_path: Path) -> None:
    outs = []
    for name, run in (("a", miburi), ("b", miburi_apart)):
        out = run("experiment", "--seconds", "8", "--no-film", "--out", str(tmp_path / name))
        assert out.returncode == 0, out.stderr
        outs.append(out.stdout)
    names = ["experiment.json", "experiment.mcap", "experiment.png", "timing.json"]
    assert sorted(file.name for file in (tmp_path / "a").iterdir()) == names
    for name in names[:3]:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    report = json.loads((tmp_path / "a" / "experiment.json").read_text())
    assert report["seed"] == 1
    assert report["version"] == __version__
    assert "1 contact stop:" in outs[0]


def test_the_inverse_kinematics_can_be_the_papers() -> None:
    target = ["--right", "0.1", "-0.1", "0.2", "--left", "0.1", "0.1", "0.2"]
    target += ["--head", "0.0279", "0", "0.1987", "--json"]
    answers = [json.loads(miburi("ik", *target, "--ik", way).stdout) for way in
               ("default", "residual", "paper")]  # fmt: skip
    exact, same, near = (max(answer["error_m"]) for answer in answers)
    assert exact == pytest.approx(same, abs=1e-6)
    assert exact < near < 0.005
    assert answers[2]["generations"] == 35
    seeds = [json.loads(miburi("ik", *target, "--ik", "paper", "--seed", seed).stdout)["angles"]
             for seed in ("0", "7", "7")]  # fmt: skip
    assert seeds[0] == answers[2]["angles"] != seeds[1] == seeds[2]


def test_forward_says_which_angles_are_outside_their_limits() -> None:
    out = miburi("forward", "0", "0.1", "1.3", "0.25", "0.1", "1.3", "-0.25", "2")
    assert out.returncode == 0
    elbow, head = out.stderr.splitlines()
    assert "left_elbow is outside its limits: 1.3 rad; it must be from -1.744 to 0.174" in elbow
    assert "head is outside" in head
    assert miburi("forward", "0", "0.1", "1.3", "0.25", "0.1", "-1.3", "-0.25", "1").stderr == ""


def test_a_gesture_can_be_measured_with_the_papers_inverse_kinematics() -> None:
    errors = []
    for way in ("default", "paper"):
        out = miburi("gesture", "measures", "surprise", "--step", "1", "--json", "--ik", way)
        errors.append(json.loads(out.stdout.splitlines()[-1])["ik_error_m"])
    assert errors[0] < 1e-6 < 1e-4 < errors[1] < 0.005


def test_what_a_command_needs_is_looked_for_before_it_works(
    robot: Robot, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """It took 15 s and 5 minutes until somebody heard that a file or a folder was missing."""
    monkeypatch.setenv("MIBURI_FIRMWARE", "/nowhere")
    out = miburi_apart("experiment", "--body", "emulated-card", "--out", tmp_path)
    assert (out.returncode, out.stdout) == (1, "")
    assert "/nowhere/miburi.elf is not there" in out.stderr
    done: list[str] = []
    with pytest.raises(OutputError, match="cannot write there"):
        write_paper(robot, Path("/proc/miburi"), done.append)
    assert done == []


#: Programs that are interrupted: while they load; in a compiler that then fails with its own error
#: (478 lines from Numba); where Numba calls Python from C, which loses the exception.
INTERRUPTED = {
    "loading": """
import sys

class Interrupt:
    @staticmethod
    def find_spec(name, *_):
        if name == "typer":
            raise KeyboardInterrupt

sys.meta_path.insert(0, Interrupt)
from miburi.cli import main
main()
""",
    "failing": """
import importlib, os, signal
cli = importlib.import_module("miburi.cli.commands")

def compile():
    try:
        os.kill(os.getpid(), signal.SIGINT)
        signal.pause()
    finally:
        raise RuntimeError("no compiled object yet")

cli.app = compile
cli.main()
""",
    "losing": """
import ctypes, importlib, os, signal, sys
cli = importlib.import_module("miburi.cli.commands")

class Half:
    def __del__(self):
        self.made

@ctypes.CFUNCTYPE(None)
def called_from_c():
    os.kill(os.getpid(), signal.SIGINT)

@cli.app.command("compile")
def compiling():
    called_from_c()
    while True:
        Half()

sys.argv = ["miburi", "compile"]
cli.main()
""",
}


@pytest.mark.parametrize("program", INTERRUPTED)
def test_an_interruption_is_one_line(program: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED[program]],
        capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (130, "miburi: interrupted.\n")


@pytest.mark.proof("test_an_interruption_is_one_line")
def test_an_interruption_leaves_no_half_file(tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [*COMMAND, "experiment", "--seconds", "3600", "--no-film", "--out", str(out)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert "seed 1" in process.stderr.readline()
        assert list(out.glob(".unfinished-*"))
        process.send_signal(signal.SIGTERM)
        _, words = process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGTERM
    assert "interrupted" in words
    assert list(out.iterdir()) == []


def test_an_interrupted_film_leaves_the_experiment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(results, "camera", interrupted)
    (tmp_path / "experiment.mp4").write_text("of an earlier run", encoding="utf-8")
    told = CliRunner().invoke(app, ["experiment", "--seconds", "2", "--out", str(tmp_path)])
    assert told.exit_code == 130
    assert f"the film was not finished; the other files are in {tmp_path}" in told.stderr
    names = ["experiment.json", "experiment.mcap", "experiment.png", "timing.json"]
    assert sorted(file.name for file in tmp_path.iterdir()) == names
