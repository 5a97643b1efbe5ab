import subprocess
import sys
from pathlib import Path

import pytest

from miburi.errors import BodyError, InputError
from miburi.live.bodies import KINDS, make_body
from miburi.robot import Robot


def test_an_emulated_card_is_there_when_its_firmware_has_been_built(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MIBURI_FIRMWARE", str(tmp_path))
    kind = KINDS["emulated-card"]
    (tmp_path / "miburi.elf").touch()
    assert not kind.available
    with pytest.raises(BodyError, match=r"libmega.so is not there. Run `make firmware`"):
        make_body("emulated-card", robot)
    (tmp_path / "libmega.so").touch()
    assert kind.available
    assert KINDS["simulated"].available


def test_which_bodies_are_there_is_known_without_the_physics() -> None:
    """Every start of Miburi asks for it, and to load MuJoCo takes a second."""
    program = (
        "import sys; from miburi.live.bodies import KINDS; "
        "[kind.available for kind in KINDS.values()]; sys.exit('mujoco' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_unknown_and_portless_bodies_are_refused(robot: Robot) -> None:
    with pytest.raises(InputError, match="one of simulated"):
        make_body("marble", robot)
    with pytest.raises(InputError, match="/dev/ttyACM0"):
        make_body("card", robot)
