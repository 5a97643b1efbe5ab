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

from miburi import __version__
from miburi.errors import OutputError
from miburi.feelings import TEMPERAMENTS
from miburi.robot import EXTREMITIES, Robot, forward
from miburi.studies.paper.page import write_paper

NEUTRAL = ["0", "0.1", "1.3", "0.25", "0.1", "-1.3", "-0.25", "0.8"]


def places(robot: Robot, angles: np.ndarray) -> list[str]:
    """The arguments of ``ik`` for where a pose is."""
    points = forward(robot, angles).reshape(3, 3)
    words = [
        [f"--{name}", *map(str, point)] for name, point in zip(EXTREMITIES, points, strict=True)
    ]
    return [word for group in words for word in group]


def test_version_and_help() -> None:
    assert miburi_apart("--version").stdout == f"miburi {__version__}\n"
    assert "experiment" in miburi_apart("--help").stdout


def test_a_place_out_of_reach_ends_with_1() -> None:
    far = [f"--{end}=15 0 0".split("=") for end in ("right", "left", "head")]
    words = [word for name, place in far for word in (name, *place.split())]
    done = miburi("ik", *words)
    assert done.returncode == 1
    assert "out of reach" in done.stdout
    assert not done.stderr


def test_an_experiment_in_which_nothing_was_touched_says_so(tmp_path: Path) -> None:
    done = miburi("experiment", "--seconds", "2", "--no-film", "--out", str(tmp_path))
    assert "nothing was touched" in done.stdout


def test_help_lists_every_temperament() -> None:
    for command in (("feelings", "day"), ("run",)):
        words = re.findall(r"\w+", miburi(*command, "--help").stdout)
        assert set(TEMPERAMENTS) <= set(words)


def test_forward_in_words_and_json(robot: Robot) -> None:
    words = miburi("forward", *NEUTRAL)
    assert words.returncode == 0
    assert words.stdout.splitlines()[0].split() == [
        "right",
        "x",
        "+0.0138",
        "y",
        "-0.0677",
        "z",
        "-0.0171",
        "m",
    ]
    answer = json.loads(miburi("forward", "--json", *NEUTRAL).stdout)
    flat = np.concatenate([answer[name] for name in EXTREMITIES])
    np.testing.assert_allclose(flat, forward(robot, robot.neutral), atol=1e-9)


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


def test_ik_in_words(robot: Robot) -> None:
    out = miburi("ik", *places(robot, robot.neutral))
    assert out.returncode == 0
    assert "waist  +0.0000 rad" in out.stdout.replace("-0.0000", "+0.0000")
    assert "error: right 0.0" in out.stdout


def test_ik_says_when_it_is_out_of_reach() -> None:
    far = ["--right", "1", "0", "0", "--left", "1", "0", "0", "--head", "0.03", "0", "0.2"]
    answer = json.loads(miburi("ik", "--json", *far).stdout)
    assert "reach" in answer["status"]
    assert answer["error_m"][0] > 0.5


@pytest.mark.parametrize(
    ("arguments", "given", "said"),
    [
        (["forward", "1", "2"], "", "8 angles are needed, got [1.0, 2.0]"),
        (["forward"], "[1, 2]\n", "8 angles are needed, got [1, 2]"),
        (["forward"], "[1, 2\n", "line 1 is not JSON"),
        (["forward"], "[" * 100_000, "line 1 is not JSON"),
        (["forward"], "[" + "9" * 5000 + "]", "line 1 is not JSON"),
        (["forward"], '["a", 0, 0, 0, 0, 0, 0, 0]', "8 angles are needed"),
        (["forward"], "[NaN, 0, 0, 0, 0, 0, 0, 0]", "finite"),
        (["ik"], "[1, 2, 3]", "9 coordinates are needed"),
        (["ik"], '{"right": 1}', "9 coordinates are needed"),
        (["ik", "--right", "0", "0", "0"], "", "needs all of --right, --left and --head"),
        (["export", "obj"], "", "must be one of mjcf, urdf, got 'obj'"),
        (["experiment", "--seed", "-1"], "", "the seed must be 0 or more, got -1"),
        (["experiment", "--seconds", "nan"], "", "the length must be from 2"),
        (["feelings", "day", "--emotional-model", "x"], "", "must be one of cascade, spiking"),
    ],
)
def test_mistakes_are_answered_in_words(arguments: list[str], given: str, said: str) -> None:
    out = miburi(*arguments, given=given)
    assert out.returncode == 2
    assert said in out.stderr
    assert "Traceback" not in out.stderr
    assert out.stdout == ""


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["card", "info", "/dev/nowhere"], "there is no port /dev/nowhere"),
        (["card", "load", "/dev/nowhere", "no.toml"], "no.toml: cannot be read"),
        (["card", "upload", "/dev/nowhere", "--firmware", "no.hex"], "no.hex"),
        (["experiment", "--calibration", "no.toml"], "no.toml: cannot be read"),
        (["run", "--calibration", "no.toml"], "no.toml: cannot be read"),
    ],
)
def test_what_is_not_there_is_said_in_words(arguments: list[str], said: str) -> None:
    out = miburi(*arguments)
    assert out.returncode == 1
    assert said in out.stderr
    assert "Traceback" not in out.stderr


def test_a_seed_that_is_no_number() -> None:
    out = miburi("experiment", "--seed", "one")
    assert out.returncode == 2
    assert "--seed" in out.stderr
    assert "Traceback" not in out.stderr


@pytest.mark.parametrize("form", ["mjcf", "urdf"])
def test_export(form: str) -> None:
    assert "right_shoulder" in miburi("export", form).stdout


def test_another_robot_file(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text("name = 3")
    out = miburi("forward", "--robot", str(tmp_path / "bad.toml"), *NEUTRAL)
    assert out.returncode == 1
    assert "bad.toml" in out.stderr
    assert "lengths is missing" in out.stderr


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


@pytest.mark.parametrize(
    ("option", "words"),
    [
        (["--seconds", "1"], "from 2 to 86400 s, got 1"),
        (["--seed", "-1"], "0 or more, got -1"),
        (["--feeling", "joy"], "got 'joy'"),
        (["--mood", "2"], "from 0 to 1, got 2.0"),
        (["--period", "0"], "from 0.5 to 60 s, got 0"),
        (["--ik", "magic"], "one of default, residual, paper, got 'magic'"),
    ],
)
def test_an_experiment_begins_only_when_all_its_arguments_are_right(
    tmp_path: Path, option: list[str], words: str
) -> None:
    out = miburi("experiment", "--no-film", "--out", str(tmp_path), *option)
    assert out.returncode == 2
    (line,) = out.stderr.splitlines()
    assert words in line


def test_the_inverse_kinematics_can_be_the_papers() -> None:
    target = ["--right", "0.1", "-0.1", "0.2", "--left", "0.1", "0.1", "0.2"]
    target += ["--head", "0.0279", "0", "0.1987", "--json"]
    answers = [json.loads(miburi("ik", *target, "--ik", way).stdout) for way in
               ("default", "residual", "paper")]  # fmt: skip
    exact, same, near = (max(answer["error_m"]) for answer in answers)
    assert exact == pytest.approx(same, abs=1e-6)
    assert exact < near < 0.005
    assert answers[2]["generations"] == 35


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


def test_nowhere_to_write() -> None:
    out = miburi("experiment", "--seconds", "4", "--no-film", "--out", "/proc/miburi")
    assert out.returncode == 1
    assert "/proc/miburi cannot be written" in out.stderr


def test_an_interruption_while_it_loads_is_one_line() -> None:
    interrupt = """
import sys

class Interrupt:
    @staticmethod
    def find_spec(name, *_):
        if name == "typer":
            raise KeyboardInterrupt

sys.meta_path.insert(0, Interrupt)
from miburi.cli import main
main()
"""
    done = subprocess.run(
        [sys.executable, "-c", interrupt], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (130, "miburi: interrupted.\n")


def test_an_interrupted_compiler_that_fails_in_its_own_way_is_one_line_too() -> None:
    """Ctrl-C in a library of Numba's ended in 478 lines, of RuntimeError at last."""
    interrupt = """
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
"""
    done = subprocess.run(
        [sys.executable, "-c", interrupt], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (130, "miburi: interrupted.\n")


def test_an_interruption_that_a_compiler_loses_comes_again() -> None:
    """Ctrl-C while Numba calls Python from C was printed as ignored, and it went on."""
    interrupt = """
import ctypes, importlib, os, signal
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

import sys
sys.argv = ["miburi", "compile"]
cli.main()
"""
    done = subprocess.run(
        [sys.executable, "-c", interrupt], capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.returncode, done.stderr) == (130, "miburi: interrupted.\n")


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


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--built", "--zeros"], "give one of them"),
        (["--built"], "this robot cannot be printed"),  # the paper's body
    ],
)
def test_what_does_not_go_with_a_printed_body_is_refused_before_the_card(
    words: list[str], said: str
) -> None:
    done = miburi("card", "calibrate", "/dev/none", *words)
    assert done.returncode == 2
    assert said in done.stderr
