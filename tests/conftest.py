"""Fixtures shared by all rooms."""

import gc
import os
import signal
from importlib import resources
from importlib.util import find_spec
from pathlib import Path

import pytest
from hypothesis import settings
from xdist.remote import Producer
from xdist.scheduler import LoadScopeScheduling

from miburi.robot import Robot, iphonoid

gc.disable()  # loading libraries leaves no garbage to collect

# A shell's background job ignores Ctrl-C, and so do all whom it starts; some tests press it.
signal.signal(signal.SIGINT, signal.default_int_handler)

# It would hide that a command keeps its lines from who reads them through a pipe.
os.environ.pop("PYTHONUNBUFFERED", None)

# The same examples on every machine, and no clock: machines are slow and noisy.
settings.register_profile("miburi", deadline=None, derandomize=True)
settings.load_profile("miburi")


#: Not every system has wheels for DDS. In CI a missing one is a failure.
NO_DDS = os.environ.get("CI") != "true" and find_spec("cyclonedds") is None
collect_ignore_glob = ["doors/test_ros*"] if NO_DDS else []


def pytest_report_header() -> str | None:
    return "left out: tests/doors/test_ros* (cyclonedds is not installed)" if NO_DDS else None


def pytest_collection_finish() -> None:
    """Let no collection of garbage look through all that was loaded: parsers' tests took 10 s."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(100_000, 20, 20)  # the usual 700 took half the time of some tests
    gc.enable()


#: Tests that share what takes long to make; one worker runs all of a line.
TOGETHER: list[tuple[str, ...]] = [
    tuple(f"tests/studio/browser/test_{name}" for name in ("pa", "ta", "ax", "cl", "lo")),
    ("tests/studio/browser/",),
    ("tests/firmware/test_fuzz.py",),
    ("tests/firmware/test_mutants.py",),
    ("tests/test_house.py",),
    ("tests/host/test_server.py",),
    ("tests/studies/experiment/",),
    ("tests/studies/paper/",),
    ("tests/studies/study/test_report.py",),
    ("tests/studies/trials/test_workshop.py",),
    ("tests/feelings/test_ninth.py",),
]


class Together(LoadScopeScheduling):
    """Gives each test to the next free worker, and those of a line of :data:`TOGETHER` to one."""

    def _split_scope(self, nodeid: str) -> str:
        return next((line[0] for line in TOGETHER if nodeid.startswith(line)), nodeid)


def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> Together:
    return Together(config, log)


pytest_plugins = [
    f"tests.fixtures.{name}" for name in ("firmware", "program", "live", "talk", "broker", "ros")
]


@pytest.fixture(scope="session")
def robot() -> Robot:
    return iphonoid()


def _rewritten(source: str, changes: dict[str, str]) -> str:
    """The text of a shipped file, each change made once."""
    text = (resources.files("miburi") / source).read_text()
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new, 1)
    return text


@pytest.fixture(scope="session")
def tall_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot of one's own: taller, arms a third longer, a right shoulder that goes less far."""
    changes = {
        'name = "iphonoid"': 'name = "tall"',
        "L23 = 0.06": "L23 = 0.08",
        "L01 = 0.12": "L01 = 0.16",
        "L34 = 0.08": "L34 = 0.107",
        "max = 3.1415": "max = 2.0",
        "neutral = 0.8": "neutral = 0.9",
    }
    path = tmp_path_factory.mktemp("robot") / "tall.toml"
    path.write_text(_rewritten("robot/iphonoid.toml", changes))
    return path


@pytest.fixture(scope="session")
def own_temperament(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A temperament of one's own, called mine."""
    path = tmp_path_factory.mktemp("temperament") / "mine.toml"
    changes = {'name = "playful"': 'name = "mine"'}
    path.write_text(_rewritten("feelings/temperaments/playful.toml", changes))
    return path


_GESTURE = """
name = "cheer"
feeling = "happiness"
duration = 1.8

[effort]
space = 1.0
weight = 0.1
time = 0.6
flow = 0.8

[[pose]]
phase = 0.5
right = [0.7, 0.5, 0.3]
left = [0.7, 0.5, 0.3]
head = [0.6, 0.3, 0.74]
"""


@pytest.fixture(scope="session")
def own_gestures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one gesture of happiness, which any robot can do."""
    folder = tmp_path_factory.mktemp("mine")
    (folder / "cheer.toml").write_text(_GESTURE)
    return folder


@pytest.fixture(scope="session")
def unfit_gestures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a gesture too high for the tall robot's right arm."""
    folder = tmp_path_factory.mktemp("unfit")
    raised = _GESTURE.replace("cheer", "hooray").replace("[0.7, 0.5, 0.3]", "[0.1, 0.3, 0.94]")
    (folder / "hooray.toml").write_text(raised)
    return folder
