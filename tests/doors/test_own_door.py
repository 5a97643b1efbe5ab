"""A door that another package ships."""

import sys
from pathlib import Path

import pytest
from fastapi import FastAPI
from tests.fixtures.live import serving
from tests.fixtures.waiting import get

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
    (metadata / "entry_points.txt").write_text("[miburi.doors]\nlamp = own_door:open_door\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "own_door", raising=False)


@pytest.mark.usefixtures("installed")
def test_a_door_of_another_package_is_opened(live: Runner) -> None:
    doors, app = Doors(others=("lamp",)), FastAPI()
    doors.need()
    doors.open(app, live)
    with serving(app) as url:
        assert get(f"{url}/lamp").text == "green"
        live.stop().result(10)
        assert get(f"{url}/lamp").text == "red"


@pytest.mark.usefixtures("installed")
def test_a_door_that_nobody_ships_is_refused_by_name() -> None:
    with pytest.raises(InputError, match="'bell'; installed: lamp"):
        Doors(others=("bell",)).need()
