"""Results name what they come from: models with the same names can be told apart."""

import json
import re
from importlib import resources
from pathlib import Path

import pyarrow.parquet
import pytest
from mcap.reader import NonSeekingReader
from tests.fixtures.command import miburi, miburi_apart

SOFTWARE = ("python", "mujoco", "numpy", "numba", "platform")


def changed(folder: Path, package: str, file: str, key: str, value: str) -> Path:
    """Write a copy of a shipped file in which only one value differs."""
    text = (resources.files(f"miburi.{package}") / file).read_text(encoding="utf-8")
    copy = folder / "copy.toml"
    other = re.sub(rf"(?m)^{key} = [^ #\n]+", f"{key} = {value}", text, count=1)
    copy.write_text(other, encoding="utf-8")
    assert copy.read_text(encoding="utf-8") != text
    return copy


def conditions(folder: Path, *options: str | Path) -> dict[str, str]:
    """Return what an experiment's files say about it; they must agree."""
    line = ("experiment", "--seconds", "2", "--no-hand", "--no-film", "--out", folder)
    # A process reads its feelings once.
    done = miburi_apart(*options, *line) if "--feelings" in options else miburi(*line, *options)
    assert done.returncode == 0, done.stderr
    report = json.loads((folder / "experiment.json").read_text(encoding="utf-8"))
    with (folder / "experiment.mcap").open("rb") as file:
        (record,) = NonSeekingReader(file).iter_metadata()
    said = {
        name: value
        for name, value in report.items()
        if name.endswith("_checksum") or name in (*SOFTWARE, "command")
    }
    assert said.items() <= record.metadata.items()
    assert record.metadata["robot"] == "iphonoid"
    return said


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return conditions(tmp_path_factory.mktemp("shipped"))


def test_an_experiment_names_its_software_and_its_options(shipped: dict[str, str]) -> None:
    assert all(shipped[name] for name in SOFTWARE)
    assert shipped["command"].startswith("miburi experiment --seed 1 --seconds 2.0 --feeling happ")
    assert "--no-hand" in shipped["command"]
    assert "--out" not in shipped["command"]  # the same bytes wherever they are written


@pytest.mark.parametrize(
    ("option", "copied", "differ"),
    [
        (
            "--temperament",
            ("feelings", "temperaments/default.toml", "mood", "600"),
            {"temperament_checksum"},
        ),
        (
            "--servo",
            ("servos", "xl330-m288-t.toml", "dry", "0.05"),
            {"robot_checksum", "servo_checksum"},
        ),
        (
            "--gestures",
            ("gestures", "happiness.toml", "duration", "2.5"),
            {"gestures_checksum"},
        ),
        ("--feelings", ("feelings", "feelings.toml", "tint", '"#f0c9a1"'), {"feelings_checksum"}),
    ],
)
def test_a_copy_with_another_value_has_another_checksum(
    option: str,
    copied: tuple[str, str, str, str],
    differ: set[str],
    shipped: dict[str, str],
    tmp_path: Path,
) -> None:
    copy = changed(tmp_path, *copied)
    own = conditions(tmp_path, option, tmp_path if option == "--gestures" else copy)
    assert own.keys() == shipped.keys()
    assert {name for name in own if own[name] != shipped[name]} == {*differ, "command"}


def test_trials_say_it_too_and_a_calibration_is_named(tmp_path: Path) -> None:
    calibration, out = tmp_path / "own.toml", tmp_path / "trials.parquet"
    calibrated = miburi("calibrate", "--out", calibration)
    assert calibrated.returncode == 0, calibrated.stderr
    few = ("trials", "--free", "1", "--blocked", "0", "--workers", "1", "--out", out)
    assert miburi(*few, "--calibration", calibration).returncode == 0
    said = pyarrow.parquet.read_schema(out).metadata
    assert said[b"command"] == (
        b"miburi trials --free 1 --blocked 0 --seed 1 --servos 0 --rule miburi "
        b"--calibration own.toml"
    )
    assert said[b"calibration_checksum"]
    assert f'servo = "{said[b"servo_checksum"].decode()}"' in calibration.read_text()
    assert all(said[name.encode()] for name in SOFTWARE)
