"""A file that ships is printed as it is, so that its copy works at once."""

import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from miburi.cli.commands import app
from miburi.feelings import load_temperament
from miburi.feelings.catalogue import load_catalogue
from miburi.gestures import load
from miburi.robot import load_robot
from miburi.servos import load_servo


def run(*arguments: str) -> str:
    done = CliRunner().invoke(app, ["template", *arguments], catch_exceptions=False)
    assert done.exit_code == 0
    return done.stdout


def test_the_english_files_of_a_language_are_all_there() -> None:
    for name in ("care", "distress", "language", "pages", "rhythm", "talk"):
        assert tomllib.loads(run("language", name))


def test_the_only_file_of_a_kind_needs_no_name(tmp_path: Path) -> None:
    (tmp_path / "feelings.toml").write_text(run("feelings"), encoding="utf-8")
    assert len(load_catalogue(tmp_path / "feelings.toml").feeling) == 8


@pytest.mark.parametrize(
    ("kind", "read"),
    [
        ("gesture", load),
        ("robot", load_robot),
        ("servo", load_servo),
        ("temperament", load_temperament),
    ],
)
def test_a_copy_of_each_file_works(kind: str, read, tmp_path: Path) -> None:
    names = run(kind).split()
    assert names
    for name in names:
        copy = tmp_path / f"{name}.toml"
        copy.write_text(run(kind, name), encoding="utf-8")
        read(copy)
