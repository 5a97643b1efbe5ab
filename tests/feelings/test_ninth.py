"""The ninth feeling of docs/feelings.md: the partner feels, performs and draws it."""

import json
import os
import re
import subprocess
import sys
from importlib import resources
from pathlib import Path
from typing import Any

import pytest

from miburi.feelings.catalogue import PAPER

NINE = [*PAPER, "pride"]
DOCS = Path(__file__).parents[2] / "docs" / "feelings.md"


def read_shipped(name: str) -> str:
    return (resources.files("miburi.feelings") / name).read_text(encoding="utf-8")


def with_rows(text: str, rows: str) -> str:
    """Add rows to a TOML text, each in its table."""
    for header, added in re.findall(r"(\[.+\]\n)((?:\w.*\n)+)", rows):
        text = text.replace(header, header + added) if header in text else text + header + added
    return text


def write_files(folder: Path) -> Path:
    """Write the three files that the page describes."""
    page = DOCS.read_text(encoding="utf-8")
    feeling, gesture, rows = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    (folder / "feelings.toml").write_text(read_shipped("feelings.toml") + feeling)
    (folder / "gestures").mkdir()
    (folder / "gestures" / "pride.toml").write_text(gesture)
    default = read_shipped("temperaments/default.toml")
    (folder / "temperament.toml").write_text(with_rows(default, rows))
    return folder


@pytest.fixture(scope="module")
def mine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_files(tmp_path_factory.mktemp("mine"))


@pytest.fixture(scope="module")
def report(mine: Path) -> dict[str, Any]:
    """Run ``pride.py`` with these feelings, and return its report."""
    process = subprocess.run(
        [sys.executable, Path(__file__).with_name("pride.py"), mine],
        env={**os.environ, "MIBURI_FEELINGS": str(mine / "feelings.toml")},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert process.returncode == 0, process.stderr
    return dict(json.loads(process.stdout.splitlines()[-1]))


@pytest.mark.parametrize("model", ["cascade", "spiking"])
def test_it_is_felt(report: dict[str, Any], model: str) -> None:
    assert report["feelings"] == NINE
    assert report[model]["shown"] == "pride"
    assert report[model]["mood"] > 0.02
    assert report[model]["levels"] == [9, 9, 9]
    assert report[model]["again"]
    assert report["day"] == [3, 9]


def test_it_is_performed(report: dict[str, Any]) -> None:
    assert report["felt"] == report["expressed"] == "pride"
    assert report["extent"] > 0.05
    assert not report["stop"]


def test_it_is_drawn(report: dict[str, Any]) -> None:
    assert report["weights"] == [0.0] * 8 + [0.9]
    faces = report["page en"]["faces"]["feelings"]
    assert [face["name"] for face in faces] == NINE
    assert faces[-1]["mouth"] == {"width": 34, "smile": 14, "down": -2}
    assert report["page en"]["feelings"]["pride"] == "pride"
    assert report["page ja"]["feelings"]["pride"] == "誇り"
    assert report["film"]


def test_programs_see_it(report: dict[str, Any]) -> None:
    assert report["robot"] == report["stimulus"] == NINE
    for level in ("emotion", "feeling", "mood", "face"):
        assert len(report["state"][level]) == 9
    assert len(report["state"]["angles"]) == 8


def test_shipped_temperaments_have_neutral_values_for_it_and_a_users_own_must_name_it(
    report: dict[str, Any],
) -> None:
    assert report["shipped"] == [1.0, [0.0] * 8 + [1.0]]
    assert re.search("lacking.toml: lasting: .*pride is missing", report["lacking"])


def test_a_state_of_the_eight_is_refused(report: dict[str, Any]) -> None:
    assert "must be for the feelings happiness" in report["old state"]


@pytest.mark.proof("test_it_is_felt")
def test_the_command_reads_it_from_its_option(mine: Path) -> None:
    def miburi(*words: str) -> subprocess.CompletedProcess[str]:
        own = {key: value for key, value in os.environ.items() if key != "MIBURI_FEELINGS"}
        return subprocess.run(
            [sys.executable, "-m", "miburi", *words],
            cwd=mine, env=own, capture_output=True, text=True, check=False,
        )  # fmt: skip

    check = ["gesture", "check", "gestures/pride.toml", "--step", "0.5"]
    assert "all is well" in miburi("--feelings", "feelings.toml", *check).stdout
    unknown = miburi(*check)
    assert unknown.returncode == 1
    assert "feeling = 'pride' is not known" in unknown.stderr
    wrong = miburi("--feelings", "temperament.toml", "forward", *["0"] * 8)
    assert wrong.returncode == 1
    assert "temperament.toml:\n" in wrong.stderr
    assert "the known ones are rest, feeling" in wrong.stderr
    assert "Traceback" not in wrong.stderr
