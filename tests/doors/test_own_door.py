"""A door that another package ships."""

import sys
import threading
import tomllib
from importlib import import_module
from pathlib import Path

import pytest
from tests.fixtures.live import interface, serving
from tests.fixtures.waiting import get, until

from miburi.doors.doors import Doors
from miburi.errors import InputError
from miburi.live.runner import Runner

EXAMPLE = Path(__file__).parents[2] / "examples" / "own_door"


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """As pip leaves it: the module, and a folder with its metadata."""
    (tmp_path / "own_door.py").write_bytes((EXAMPLE / "own_door.py").read_bytes())
    metadata = tmp_path / "miburi_lamp-1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: miburi-lamp\nVersion: 1\n")
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    ((name, function),) = project["entry-points"]["miburi.doors"].items()
    (metadata / "entry_points.txt").write_text(f"[miburi.doors]\n{name} = {function}\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "own_door", raising=False)


@pytest.mark.usefixtures("installed")
def test_a_door_of_another_package_is_opened(live: Runner) -> None:
    doors = Doors(packages=("lamp", "lamp"))
    doors.need()
    app = interface(live)
    doors.open(app, live)
    with serving(app) as url:
        assert get(f"{url}/lamp").text == "green"
        live.stop().result(10)  # answered a step before the state shows it
        until(lambda: get(f"{url}/lamp").text, "red".__eq__)


@pytest.mark.usefixtures("installed")
def test_a_door_that_nobody_ships_is_refused_by_name() -> None:
    with pytest.raises(InputError, match="'bell'; installed: lamp"):
        Doors(packages=("bell",)).need()


@pytest.mark.parametrize(
    ("door", "words"),
    [
        ("def open_door(app): ...", r"\(own_door:open_door\) failed: TypeError: .* 1 positional"),
        ("def open_door(app, partner):\n    1 / 0", r"own_door\.py, line 2: ZeroDivisionError: "),
        ("import nowhere", r"failed in .*own_door\.py, line 1: ModuleNotFoundError: .*nowhere"),
    ],
)
@pytest.mark.usefixtures("installed")
def test_a_door_that_fails_is_named_with_its_line(
    live: Runner, tmp_path: Path, door: str, words: str
) -> None:
    (tmp_path / "own_door.py").write_text(door)
    with pytest.raises(InputError, match=f"the door lamp .*{words}"):
        Doors(packages=("lamp",)).open(interface(live), live)


@pytest.mark.usefixtures("installed")
def test_a_door_that_does_not_return_is_waited_for_aloud(
    live: Runner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "own_door.py").write_text(
        "from threading import Event\nend = Event()\ndef open_door(app, partner):\n    end.wait()\n"
    )
    monkeypatch.setattr("miburi.doors.doors.PATIENCE", 0.0)
    opening = threading.Thread(
        target=Doors(packages=("lamp",)).open, args=(interface(live), live), daemon=True
    )
    opening.start()
    until(lambda: "waiting for the door lamp (own_door:open_door)" in caplog.text)
    import_module("own_door").end.set()
    opening.join()
