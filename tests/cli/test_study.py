"""``miburi study``: begin, serve until somebody ends it, report."""

import subprocess
import sys
from pathlib import Path

import httpx
import pytest
from tests.fixtures.live import address, own_environment
from tests.fixtures.study import Lab
from typer.testing import CliRunner

from miburi.cli.main import app
from miburi.errors import InputError
from miburi.studies.study.plan import FILE, load_study


def run(*arguments: str | Path) -> str:
    done = CliRunner().invoke(app, ["study", *map(str, arguments)], catch_exceptions=False)
    return done.stdout


def test_a_new_study_is_whole_and_replaces_none(tmp_path: Path) -> None:
    assert "miburi study run" in run("new", tmp_path / "mine")
    assert load_study(tmp_path / "mine").name == "eight-feelings"
    (tmp_path / "mine" / FILE).write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="there already"):
        run("new", tmp_path / "mine")
    assert (tmp_path / "mine" / FILE).read_text(encoding="utf-8") == "mine"


def test_a_study_is_served_until_somebody_ends_it(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    command = [sys.executable, "-m", "miburi", "study", "run", tmp_path, "--port", "0"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=own_environment()
    ) as process:
        assert process.stdout is not None
        home = address(process.stdout.readline()) + lab.home
        with httpx.Client(follow_redirects=True) as browser:
            page = browser.post(home, data={"agree": "yes"})
            assert "Question 1 of 4" in page.text
            assert browser.post(f"{home}/page", data={"step": "0", "answer": "fear"}).is_success
        process.terminate()
        said, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (0, "")
    assert "Next: miburi study report" in said
    assert [answer.value for answer in lab.store.answers()] == ["fear"]
    assert (tmp_path / "report" / "index.html") == Path(run("report", tmp_path).strip())


def test_an_address_that_is_not_ours_is_named(tmp_path: Path) -> None:
    Lab(tmp_path)
    with pytest.raises(InputError, match=r"cannot listen on 192\.0\.2\.1 port 0"):
        run("run", tmp_path, "--host", "192.0.2.1", "--port", "0")  # nobody's address
