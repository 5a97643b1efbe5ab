import numpy as np
import pytest

from miburi.bodies import registry
from miburi.bodies.registry import KINDS, Kind, make_body
from miburi.errors import BodyError, InputError
from miburi.robot import Robot


def test_the_simulated_body_is_always_there(robot: Robot) -> None:
    body = make_body("simulated", robot)
    np.testing.assert_allclose(body.state.angles, robot.neutral, atol=0.02)


def test_unknown_missing_and_portless_bodies_are_refused(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InputError, match="one of simulated"):
        make_body("marble", robot)
    marble = Kind("marble", "miburi.bodies.marble", KINDS["simulated"].make)
    monkeypatch.setitem(registry.KINDS, "marble", marble)
    with pytest.raises(BodyError, match="no marble body; it has: simulated"):
        make_body("marble", robot)
    wired = Kind("wired", "miburi.bodies.simulated", KINDS["simulated"].make, needs_port=True)
    monkeypatch.setitem(registry.KINDS, "wired", wired)
    with pytest.raises(InputError, match="/dev/ttyACM0"):
        make_body("wired", robot)
