"""The studio is loaded when a browser first asks for it."""

import subprocess
import sys

#: NiceGUI allows one studio in a process, and other tests of this process have loaded it.
PROGRAM = """
import sys, tempfile
from pathlib import Path
from fastapi.testclient import TestClient
from miburi.feelings import EmotionalModel
from miburi.live.recording.archive import Archive
from miburi.live.runner import Runner
from miburi.robot import iphonoid
from miburi.serving.reach import Reach
from miburi.studio.app import make_app

runner = Runner(iphonoid(), EmotionalModel(), Archive(Path(tempfile.mkdtemp())))
with TestClient(make_app(runner, Reach(()))) as browser:
    for path in ("/face", "/api/v1/state", "/privacy", "/nothing", "/", "/favicon.ico", "/nothing"):
        status = browser.get(path).status_code
        print(path, status, "with" if "nicegui" in sys.modules else "without")
"""


def test_only_a_studio_page_loads_what_it_needs() -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines() == [
        "/face 200 without",
        "/api/v1/state 200 without",
        "/privacy 200 without",
        "/nothing 404 without",
        "/ 200 with",
        "/favicon.ico 200 with",
        "/nothing 404 with",
    ]
