"""Every script in examples/ is short, runs as it stands, and shows what it promises."""

import re
import runpy
import signal
import sqlite3
import subprocess
import sys
import threading
from contextlib import closing
from pathlib import Path

import pytest
from tests.fixtures.live import Server, interface, serving

from miburi import Expression, connect
from miburi.live.runner import Runner
from miburi.senses.happenings import happenings

FOLDER = Path(__file__).parents[2] / "examples"
SCRIPTS = sorted(FOLDER.glob("*.py"))
#: A line that each script prints; of listen_to_contacts, the only one.
LINES = {
    "feel": r"     8    0\.\d{3}    0\.\d{3}   0\.\d{3}  happiness",
    "inverse_kinematics": r"8 cm  error  0\.0\d\d mm  converged",
    "listen_to_contacts": r"\d+\.\d\d s: the right_\w+ met something",
    "own_gesture": r" 1\.0 s  right hand at \[ *\d+\. +-\d+\. +2\d\d\.\] mm",
    "own_temperament": r"  grumpy shows anger; half an hour later its strongest mood is 0\.\d+",
    "happy_talk": r"after 900 s: mood 0\.\d+, gesture +\d+ mm",
    "own_trial": r"mood 1\.0: stopped \d+ ms after the touch, \d+\.\d N",
}


#: Those that need a live partner.
LIVE = ("listen_to_contacts", "tea_timer", "guessing_game", "log_to_sqlite", "own_sense")


def test_each_script_is_short() -> None:
    lengths = {one.stem: len(one.read_text(encoding="utf-8").splitlines()) for one in SCRIPTS}
    assert {name for name, length in lengths.items() if length > 40} == set()


@pytest.mark.parametrize("name", [s.stem for s in SCRIPTS if s.stem not in LIVE])
def test_a_script_shows_what_it_promises(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", [f"{name}.py"])
    runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
    out, errors = capsys.readouterr()
    assert errors == ""
    assert any(re.fullmatch(LINES[name], line) for line in out.splitlines())


def test_a_contact_is_heard(server: Server) -> None:
    with (
        connect(server.url) as partner,
        subprocess.Popen(
            [sys.executable, FOLDER / "listen_to_contacts.py", server.url],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        ) as listener,
    ):  # fmt: skip
        partner.place_hand((0.12, -0.11, 0.12), (1, 0, 0))  # where the right arm will pass
        heard, lines = threading.Event(), list[str]()

        def hear() -> None:
            assert listener.stdout is not None
            lines.append(listener.stdout.readline())
            heard.set()

        threading.Thread(target=hear).start()
        for state in partner.watch():  # contacts end by themselves; it meets the hand again
            if heard.is_set():
                break
            if state.expressed is None and not state.stop:
                partner.express(Expression("happiness", 1.0))
        listener.send_signal(signal.SIGINT)
        assert listener.stderr is not None
        assert listener.stderr.read() == ""
    assert re.fullmatch(LINES["listen_to_contacts"], lines[0].strip())


def run_script(name: str, *arguments: str, said: str = "") -> str:
    command = [sys.executable, "-W", "error", FOLDER / f"{name}.py", *arguments]
    done = subprocess.run(command, input=said, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


@pytest.mark.proof("test_a_contact_is_heard")
def test_a_timer_makes_it_happy_and_knows_when_that_is_over(server: Server) -> None:
    said = run_script("tea_timer", server.url, "0.1")
    assert said.splitlines() == ["performance begun", "performance ended"]
    assert server.runner.snapshot.state.spoken is not None
    assert server.runner.snapshot.state.spoken.text == "Your tea is ready!"


@pytest.mark.proof("test_a_contact_is_heard")
def test_a_game_is_played_to_its_end(server: Server) -> None:
    said = run_script("guessing_game", server.url, said="fear\nfear\nfear\n")
    assert re.search(r"[0-3] of 3\.$", said.strip())
    with connect(server.url) as partner:
        sources = {event.by for event in partner.log() if event.kind == "stimulus"}
    assert sources == {"program"}


@pytest.mark.proof("test_a_contact_is_heard")
def test_a_logger_that_was_killed_begins_where_it_was(server: Server, tmp_path: Path) -> None:
    path, command = tmp_path / "events.db", [sys.executable, FOLDER / "log_to_sqlite.py"]
    for _ in range(2):
        with (
            connect(server.url) as partner,
            subprocess.Popen([*command, server.url, path], stdout=-1, text=True) as logger,
        ):
            partner.express(Expression("surprise", 0.3))
            assert logger.stdout is not None
            while not logger.stdout.readline().endswith("gesture_ended\n"):
                pass
            logger.kill()
    with closing(sqlite3.connect(path)) as file:
        kept = [row[0] for row in file.execute("SELECT id FROM events ORDER BY rowid")]
    numbers = [int(one.partition(":")[2]) for one in kept]
    assert numbers == [*range(1, len(numbers) + 1)], "none is missing, and none twice"


def test_a_sense_of_ones_own_is_one_file_and_a_program_that_reports(
    live: Runner, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("MIBURI_SENSES", str(FOLDER / "own_sense.toml"))
    happenings.cache_clear()
    notes = tmp_path / "notes.txt"
    notes.write_text("first", encoding="utf-8")
    try:
        with serving(interface(live)) as url:
            command = [sys.executable, FOLDER / "own_sense.py", url, notes]
            with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
                assert program.stdout is not None
                assert program.stdout.readline() == "it has 5 bytes\n"
                with notes.open("a", encoding="utf-8") as file:
                    file.write("x" * 2_000)
                assert program.stdout.readline() == "it grew by 2000 bytes\n"
                notes.unlink()
                assert program.stdout.readline() == "it is gone\n"
            with connect(url) as partner:
                felt = [each for each in partner.log() if each.kind == "stimulus"]
    finally:
        happenings.cache_clear()
    assert [(each.feeling, each.detail) for each in felt] == [
        ("surprise", "'file grew': surprise 0.60"), ("sadness", "'file gone': sadness 0.90"),
    ]  # fmt: skip
