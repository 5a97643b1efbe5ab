"""Every script in examples/ is short, runs as it stands, and shows what it promises."""

import re
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from tests.fixtures.live import Server

from miburi import Expression, connect

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


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_script_is_short(script: Path) -> None:
    assert len(script.read_text(encoding="utf-8").splitlines()) <= 40


@pytest.mark.parametrize("name", [s.stem for s in SCRIPTS if s.stem != "listen_to_contacts"])
def test_a_script_shows_what_it_promises(name: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", FOLDER / f"{name}.py"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert any(re.fullmatch(LINES[name], line) for line in done.stdout.splitlines())


def test_a_contact_is_heard(server: Server) -> None:
    with connect(server.url) as partner:
        partner.place_hand((0.12, -0.11, 0.12), (1, 0, 0))  # where the right arm will pass
        partner.express(Expression("happiness", 1.0))
        for state in partner.watch():
            if state.stop is not None and state.stop.reason == "contact":
                break
            if state.phase == "stopped":  # a slow machine's loop may be late, and stop it
                partner.release()
            elif state.expressed is None:
                partner.express(Expression("happiness", 1.0))
        partner.stop()  # the stop lasts until the script has heard of it
        with subprocess.Popen(
            [sys.executable, FOLDER / "listen_to_contacts.py", server.url],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        ) as listener:  # fmt: skip
            assert listener.stdout is not None
            patience = threading.Timer(60.0, listener.kill)  # or it would be waited for for ever
            patience.start()
            line = listener.stdout.readline().rstrip()
            patience.cancel()
            assert re.fullmatch(LINES["listen_to_contacts"], line)
            listener.send_signal(signal.SIGINT)
            assert listener.communicate(timeout=30) == ("", "")
            assert listener.returncode == 0
