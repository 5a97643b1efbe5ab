"""A live partner to look at, by hand or at its own pace."""

import itertools
import os
import re
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
import uvicorn
from fastapi import FastAPI
from starlette.types import ASGIApp
from tests.firmware.conftest import firmware  # noqa: F401  # a fixture for these tests, too

from miburi.feelings import FEELINGS, EmotionalModel, shipped_temperament
from miburi.robot import Robot
from miburi.studio.access import LARGEST, Gate
from miburi.studio.api import make_api
from miburi.studio.live import live_router
from miburi.studio.recordings import Recordings
from miburi.studio.runner import Runner


@pytest.fixture
def runner(robot: Robot, tmp_path: Path) -> Runner:
    """A partner in a middling mood; time passes when a test calls ``tick``."""
    feelings = EmotionalModel(shipped_temperament("playful"))
    feelings.set_state(mood=dict.fromkeys(FEELINGS, 0.6))
    return Runner(robot, feelings, Recordings(tmp_path / "recordings"))


@pytest.fixture
def live(runner: Runner) -> Iterator[Runner]:
    """The same, at its own pace."""
    runner.start()
    yield runner
    runner.close(patience=0.0)


@dataclass
class Server:
    """The interface without pages, on a port of this computer."""

    url: str
    runner: Runner


@contextmanager
def serving(app: ASGIApp) -> Iterator[str]:
    """Serve an application from a thread; yields its address."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen(256)
        listener.setblocking(False)
        config = uvicorn.Config(
            app, log_level="error", ws="websockets-sansio", ws_max_size=LARGEST, lifespan="off"
        )
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run, args=([listener],))
        thread.start()
        try:
            yield f"http://127.0.0.1:{listener.getsockname()[1]}"
        finally:
            server.should_exit = True
            thread.join()


def interface(runner: Runner) -> FastAPI:
    """The interface and its WebSocket."""
    app = make_api(runner)
    app.include_router(live_router(runner))
    return app


@pytest.fixture
def server(live: Runner) -> Iterator[Server]:
    """The interface of a live partner, behind the gate, its clock fast enough for any test."""
    ticks = itertools.count()
    with serving(Gate(interface(live), clock=lambda: 1000.0 * next(ticks))) as url:
        yield Server(url, live)


@contextmanager
def started(folder: Path, *options: str) -> Iterator[str]:
    """Run ``miburi run`` as a user does; yields what it says when it is awake."""
    process = subprocess.Popen(
        [sys.executable, "-m", "miburi", "run", "--headless", "--port", "0", "--folder",
         str(folder), *options],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=own_environment(),
    )  # fmt: skip
    try:
        assert process.stdout is not None
        yield process.stdout.readline()
    finally:
        process.terminate()
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 0, errors
    assert "Traceback" not in errors


def own_environment() -> dict[str, str]:
    """An environment without pytest's marks, by which NiceGUI would know it is being tested."""
    return {key: value for key, value in os.environ.items() if not key.startswith("PYTEST_")}


def address(said: str) -> str:
    """The server's address in what it says."""
    found = re.search(r"http://[\w.]+:\d+", said)
    assert found, said
    return found.group()


@pytest.fixture
def start(tmp_path: Path) -> Callable[..., object]:
    """Start a server with options."""
    return lambda *options: started(tmp_path, *options)
