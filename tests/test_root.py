"""The package's root: the names that most programs begin with, and a quick import."""

import subprocess
import sys

import pytest

import miburi
from miburi.feelings import Stimulus


@pytest.mark.parametrize("name", miburi.__all__)
def test_every_name_is_there(name: str) -> None:
    assert getattr(miburi, name) is not None
    assert name in dir(miburi)


def test_a_name_is_its_rooms_own() -> None:
    assert miburi.Stimulus is Stimulus


def test_another_name_is_refused() -> None:
    with pytest.raises(AttributeError, match="'miburi' has no attribute 'Robots'"):
        _ = miburi.Robots  # type: ignore[attr-defined]


def test_importing_the_root_loads_no_room() -> None:
    program = "import sys, miburi; print(*(name for name in sys.modules if 'miburi' in name))"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert set(done.stdout.split()) == {"miburi", "miburi.version"}
