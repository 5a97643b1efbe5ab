"""Compilers for these tests. Where one is missing they skip, and in CI they fail."""

import fcntl
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HERE = Path(__file__).parent
SKETCH = ROOT / "firmware/miburi"
BUILD = ROOT / "build/firmware"
NATIVE = ["g++", "-std=gnu++11", f"-I{SKETCH}", f"-I{HERE}", "-Wall", "-Wextra", "-Werror"]
#: Without optimisation: these compile in a fifth of the time, and run for less than a second.
SANITIZED = ["-g", "-O0", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]


def need(tool: str, package: str) -> None:
    """Skip, or fail in CI, when a tool is missing."""
    if shutil.which(tool) or Path(tool).exists():
        return
    message = f"{tool} is missing; install the Debian package {package}"
    if os.environ.get("CI") == "true":
        pytest.fail(message)
    pytest.skip(message)


@contextmanager
def building() -> Iterator[None]:
    """One build at a time, however many workers there are."""
    BUILD.mkdir(parents=True, exist_ok=True)
    with (BUILD / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def changed_card(folder: Path, name: str, old: str, new: str) -> Path:
    """Build the sketch with one change in the file ``name``; return where the binary is."""
    shutil.copytree(SKETCH.parent, folder / "firmware")
    file = folder / "firmware" / "miburi" / name
    text = file.read_text(encoding="utf-8")
    assert text.count(old) == 1
    file.write_text(text.replace(old, new), encoding="utf-8")
    run("make", "-C", folder / "firmware", f"OUT={folder / 'built'}")
    return folder / "built"


def run(*command: str | Path, data: bytes = b"") -> bytes:
    done = subprocess.run(
        [str(word) for word in command], input=data, capture_output=True, check=False
    )
    assert done.returncode == 0, (done.stdout[-2000:] + done.stderr[-4000:]).decode()
    return done.stdout
