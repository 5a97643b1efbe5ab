"""Builds what these tests run."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from rig import Rig
from toolchain import BUILD, HERE, NATIVE, ROOT, SANITIZED, SKETCH, building, need, run


@pytest.fixture(scope="session")
def native(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The rule, natively, under the sanitizers."""
    need("g++", "g++")
    program = tmp_path_factory.mktemp("native") / "traces"
    run(*NATIVE, *SANITIZED, HERE / "traces_native.cpp", "-o", program)
    return program


@pytest.fixture(scope="session")
def firmware() -> Path:
    """The folder with the binary that would be flashed, and the emulated processor."""
    need("avr-g++", "gcc-avr")
    need("/usr/share/arduino/hardware/arduino/avr", "arduino-core-avr")
    need("/usr/lib/avr/include/avr/io.h", "avr-libc")
    need("/usr/include/simavr/sim_avr.h", "libsimavr-dev")
    need("/usr/include/libelf.h", "libelf-dev")
    with building():
        run("make", "-C", ROOT / "firmware")
    return BUILD


@pytest.fixture
def rig(firmware: Path) -> Iterator[Rig]:
    """The card with its servos, awake at neutral."""
    made = Rig(firmware, twin=False)
    yield made
    made.close()


@pytest.fixture(scope="session")
def rule_on_avr(firmware: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The rule alone, for the card's processor."""
    elf = tmp_path_factory.mktemp("avr") / "traces.elf"
    run(
        "avr-g++", "-mmcu=atmega2560", "-DF_CPU=16000000L", "-Os", "-std=gnu++11",
        "-Wall", "-Wextra", "-Werror", f"-I{SKETCH}", HERE / "traces_avr.cpp", "-o", elf,
    )  # fmt: skip
    return elf
