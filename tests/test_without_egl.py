"""On a computer that cannot draw, everything else works, and one line says what was left out."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from miburi.robot.physics import drawing_backend

#: Runs a command as on a machine that has neither library.
_HIDE = """
import ctypes

class Library(ctypes.CDLL):
    def __init__(self, name, *rest, **more):
        if "EGL" in str(name) or "OSMesa" in str(name):
            raise OSError(f"{name}: cannot open shared object file")
        super().__init__(name, *rest, **more)

ctypes.CDLL = ctypes.cdll._dlltype = Library
from miburi.cli import main
main()
"""


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    kept = {k: v for k, v in os.environ.items() if k not in ("MUJOCO_GL", "PYOPENGL_PLATFORM")}
    return subprocess.run(
        [sys.executable, "-c", _HIDE, *map(str, arguments)],
        check=False, capture_output=True, text=True, env=kept,
    )  # fmt: skip


def test_an_experiment_leaves_out_its_film_and_says_so(tmp_path: Path) -> None:
    done = run("experiment", "--seconds", "2", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "The film is left out: cannot draw pictures here (no EGL)" in done.stdout
    names = {file.name for file in tmp_path.iterdir()}
    assert names == {"experiment.json", "experiment.mcap", "experiment.png", "timing.json"}


@pytest.mark.proof("test_an_experiment_leaves_out_its_film_and_says_so")
def test_what_is_nothing_but_pictures_is_refused_in_one_line(tmp_path: Path) -> None:
    done = run("gesture", "preview", "happiness", "--out", tmp_path)
    assert done.returncode == 1
    assert done.stderr.strip().splitlines()[-1].startswith("miburi: cannot draw pictures here")
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("platform", "there", "chosen"),
    [
        ("linux", {"libEGL.so.1", "libOSMesa.so.8"}, "egl"),
        ("linux", {"libOSMesa.so.8"}, "osmesa"),
        ("linux", set(), "off"),
        ("darwin", set(), None),
        ("win32", set(), None),
    ],
)
def test_the_word_for_mujoco_is_one_that_it_knows_there(
    platform: str, there: set[str], chosen: str | None
) -> None:
    assert drawing_backend(platform, lambda name: name if name in there else None) == chosen
