"""``miburi study``: begin, serve until somebody ends it, report."""

import socket
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx
import pytest
from tests.fixtures.command import miburi
from tests.fixtures.live import Server
from tests.fixtures.program import Program
from tests.fixtures.study import TWO_GESTURES, Lab
from typer.testing import CliRunner

from miburi.cli.commands import app
from miburi.client.connection import ConnectionLostError
from miburi.client.remote import connect
from miburi.errors import InputError
from miburi.studies.study.plan import FILE, load_study


def run(*arguments: str | Path) -> str:
    done = CliRunner().invoke(app, ["study", *map(str, arguments)], catch_exceptions=False)
    return done.stdout


def test_a_new_study_is_whole_and_replaces_none(tmp_path: Path) -> None:
    assert "miburi study run" in run("new", tmp_path / "mine")
    assert load_study(tmp_path / "mine").name == "eight-feelings"
    (tmp_path / "mine" / FILE).write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="already exists"):
        run("new", tmp_path / "mine")
    assert (tmp_path / "mine" / FILE).read_text(encoding="utf-8") == "mine"


def test_a_study_must_say_who_runs_it_but_can_be_tried_out(tmp_path: Path) -> None:
    run("new", tmp_path)
    with pytest.raises(InputError, match=r"places are not filled in, such as \(WRITE: how"):
        run("run", tmp_path)
    lab = Lab(tmp_path / "two")
    with served(lab.folder, "--rehearsal") as (home, said), httpx.Client(verify=False) as browser:
        assert "This is a rehearsal" in browser.get(home).text
        browser.post(home, data={"agree": "yes"})
    assert "rehearsal.sqlite" in said[-1]
    assert lab.store.counts(4).began == 0
    run("report", lab.folder, "--rehearsal")
    page = (lab.folder / "rehearsal-report" / "index.html").read_text(encoding="utf-8")
    assert "Rehearsal: these answers are not part of the study" in page
    assert "1 people began" in page
    with pytest.raises(InputError, match=r"rehearsal\.sqlite have code 'AAAA', so nothing was"):
        run("withdraw", lab.folder, "AAAA", "--rehearsal")
    (lab.folder / "answers.sqlite").unlink()
    with pytest.raises(InputError, match="add --rehearsal"):
        run("report", lab.folder)


def test_a_closed_study_is_over(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    lab.begin()
    unsure = miburi("study", "close", tmp_path, given="\n")
    assert "No answer can be withdrawn after that" in unsure.stdout
    assert unsure.returncode == 1
    assert lab.store.closed is False
    assert "Codes erased: 1" in miburi("study", "close", tmp_path, given="y\n").stdout
    assert "Codes erased: 0" in run("close", tmp_path, "--yes")
    with pytest.raises(InputError, match="is closed"):
        run("run", tmp_path)


def test_a_board_reads_what_participants_read(tmp_path: Path) -> None:
    run("new", tmp_path)
    english = run("text", tmp_path, "--language", "en")
    assert "(WRITE: your name" in english
    assert "I agree to take part" in english
    assert "How natural is the movement?\nnot natural at all 1 – 7 very natural" in english
    assert "調査に参加し、回答が" in run("text", tmp_path)
    with pytest.raises(InputError, match="must be one of en, ja, got 'fr'"):
        run("text", tmp_path, "--language", "fr")


def test_whoever_runs_a_study_can_delete_for_a_participant(tmp_path: Path) -> None:
    run("new", tmp_path / "new")
    with pytest.raises(InputError, match="nobody has answered yet"):
        run("withdraw", tmp_path / "new", "K7QM-2XHD")
    lab = Lab(tmp_path)
    browser, _ = lab.begin(), lab.begin()
    code = browser.cookies["miburi_study"]
    with pytest.raises(InputError, match="have code 'AAAA-2222'"):
        run("withdraw", tmp_path, "AAAA-2222")
    assert "make a new report" in run("withdraw", tmp_path, f" {code.lower()} ")
    assert (lab.store.counts(4).began, lab.store.counts(4).withdrawn) == (2, 1)


@contextmanager
def served(*options: str | Path) -> Iterator[tuple[str, list[str]]]:
    """Run ``miburi study run``; yields the address, and what it says until its end."""
    program = Program("study", "run", *options, "--port", "0")
    try:
        yield program.out.next("/study/").strip(), program.out.all
    finally:
        code, _, errors = program.end()
    assert (code, errors) == (0, "")


@pytest.mark.proof("test_a_study_must_say_who_runs_it_but_can_be_tried_out")
def test_a_robot_makes_the_gestures_of_a_study(server: Server, tmp_path: Path) -> None:
    lab = Lab(tmp_path, TWO_GESTURES)
    with httpx.Client(verify=False, timeout=90) as browser, ExitStack() as stack:
        home, said = stack.enter_context(served(lab.folder, "--partner", server.url))
        assert said[0] == f"{server.url} makes the gestures, with its simulated body.\n"
        browser.post(home, data={"agree": "yes"})
        assert browser.post(f"{home}/perform").status_code == 303
        with connect(server.url) as robot, ThreadPoolExecutor(1) as pool:
            again = pool.submit(browser.post, f"{home}/perform")
            next(state for state in robot.watch() if state.asked)
            stack.close()  # whoever waits for the robot when all ends is told so
            assert "The gesture was interrupted" in again.result().text
    assert lab.store.showings()[1, 0].whole == 1
    (partner,) = lab.store.partners()
    assert (partner["robot"], partner["body"]) == ("iphonoid", "simulated")


def test_a_study_with_live_gestures_needs_its_robot(tmp_path: Path) -> None:
    Lab(tmp_path, TWO_GESTURES)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with pytest.raises(ConnectionLostError, match="is `miburi run` running there"):
        run("run", tmp_path, "--partner", f"http://127.0.0.1:{port}", "--port", "0")


def test_an_address_that_is_not_ours_is_named(tmp_path: Path) -> None:
    Lab(tmp_path)
    with pytest.raises(InputError, match=r"cannot listen on 192\.0\.2\.1 port 0"):
        run("run", tmp_path, "--host", "192.0.2.1", "--port", "0")  # nobody's address
