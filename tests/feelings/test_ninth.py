"""The ninth feeling of docs/feelings.md: the partner feels, performs and draws it."""

import os
import re
import subprocess
import sys
from importlib import resources
from pathlib import Path

from tests.fixtures.command import miburi_apart

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


def test_it_is_felt_performed_drawn_and_offered_to_programs(tmp_path: Path) -> None:
    mine = write_files(tmp_path)
    process = subprocess.run(
        [sys.executable, Path(__file__).with_name("pride.py"), mine],
        env={**os.environ, "MIBURI_FEELINGS": str(mine / "feelings.toml")},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert process.returncode == 0, process.stderr


def test_trials_tune_and_calibrate_take_it(tmp_path: Path) -> None:
    mine, tuned = write_files(tmp_path), tmp_path / "tuned.toml"
    nine = ("--feelings", str(mine / "feelings.toml"))
    own = ("--gestures", str(mine / "gestures"), "--seed", "1")
    few = ("--free", "5", "--blocked", "1")
    for line in (
        ("trials", *few, "--workers", "1", *own),
        ("tune", "--out", str(tuned), *few, *own),
    ):
        done = miburi_apart(*nine, *line)
        assert done.returncode == 0, done.stderr
    done = miburi_apart(*nine, "calibrate", "--out", str(tuned))
    assert done.returncode == 0, done.stderr
