"""How a stop begins and ends, in the tests of the real binary."""

import numpy as np
from tests.firmware.rig import Rig

from miburi.card.card import wake
from miburi.safety.stop import Phase


def raise_arms(rig: Rig, speed: float = 1.0) -> None:
    """Start a move of a second or more, and let half of it pass."""
    rig.turn([1, 4], by=1.2, speed=speed)
    rig.run(0.5)
    assert rig.body.state.phase is Phase.MOVING


def recovers(rig: Rig) -> None:
    """Release the body, and check that it returns to neutral and then moves."""
    wake(rig.body)
    assert np.abs(rig.body.state.angles - rig.robot.neutral).max() < 0.01
    rig.turn([0, 4], by=0.1, speed=1.0)
    assert rig.settle() is Phase.IDLE
