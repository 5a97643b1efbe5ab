"""Whatever one servo says, and whenever: no arm is thrown, all come to rest, and it is named.

On the real binary; `make proof` tells six lies, `make firmware-proof` 300.
"""

import os
from collections.abc import Callable
from itertools import count
from pathlib import Path

import pytest
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st
from tests.firmware.orders import Orders, begin
from tests.firmware.rig import Rig

from miburi.card.card import wake
from miburi.errors import BodyError
from miburi.robot import JOINTS
from miburi.safety.controller import YIELD_AFTER, YIELDS
from miburi.safety.profile import SECOND
from miburi.safety.stop import Phase, StopReason

TURN = 4096
#: An error that no motor can have made in the time between two readings.
GROSS = 300
KINDS = ("jump", "frozen", "far", "another's id", "seam", "none")
PHASES = ("idle", "moving", "stopping", "stopped", "releasing", "returning")
#: What may be said of each kind that does not look like the truth.
NAMES = {"another's id": StopReason.SERVO_MISNAMED, "none": StopReason.SERVO_SILENT}


def lying(kind: str, size: int, frozen: int, every: int) -> Callable[[int], int]:
    """Return what the servo makes of its position: at each reading, or at every second or third."""
    tales = {
        "jump": lambda place: place + size,
        "far": lambda _: size,
        "seam": lambda place: place + (TURN if size > 0 else -TURN),
        "frozen": lambda _: frozen,
    }
    readings = count()
    tale = tales[kind]
    return lambda place: tale(place) if next(readings) % every == 0 else place


@pytest.mark.proof("test_a_lying_reading_throws_no_arm_and_is_named")
@settings(
    max_examples=int(os.environ.get("MIBURI_LIES", "6")),
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(
    kind=st.sampled_from(KINDS),
    phase=st.sampled_from(PHASES),
    motor=st.integers(0, 7),
    size=st.one_of(st.integers(-(2**31), 2**31 - 1), st.integers(-6000, 6000)),
    every=st.sampled_from([1, 1, 2, 3]),
    wait=st.integers(0, 12),
    lasts=st.sampled_from([0.02, 0.06, 0.3, 1.5]),
)
def test_no_lie_throws_an_arm(
    firmware: Path,
    kind: str,
    phase: str,
    motor: int,
    size: int,
    every: int,
    wait: int,
    lasts: float,
) -> None:
    event(f"{kind}, {phase}")
    rig = Rig(firmware, twin=False)
    orders, servo = Orders(rig), rig.servos[motor]
    start = {"idle": Phase.IDLE, "stopped": Phase.STOPPED, "releasing": Phase.STOPPED}
    start |= {"returning": Phase.RETURNING}
    begin(rig, start.get(phase, Phase.MOVING), motor)
    rig.line.run(rig.line.mega.time + 1700 * wait)  # anywhere between two readings
    if phase == "stopping":
        rig.body.stop()
    before, place = rig.body.state, servo.shaft.place
    refused = ""
    if kind == "none":
        servo.dead = True
    elif kind == "another's id":
        servo.alias = 1 + (motor + 1 + size % 7) % 8
    else:
        servo.lie = lying(kind, size, round(place), every)
    if phase == "releasing":
        try:
            rig.body.release()
        except BodyError as error:
            refused = str(error)
    rig.run(lasts)
    stop, lied = rig.body.state.stop, servo.lie(round(servo.shaft.place))
    gross = kind in NAMES or (every == 1 and abs(lied - servo.shaft.place) > GROSS)
    if gross and lasts >= 0.3:
        # A stop that holds already keeps its reason: whoever then releases is told.
        if before.phase is Phase.STOPPED and phase != "releasing":
            try:
                rig.body.release()
            except BodyError as error:
                refused = str(error)
            stop = rig.body.state.stop
        assert rig.body.state.phase is Phase.STOPPED
        reason = NAMES.get(kind, StopReason.SERVO_ASTRAY)
        named = stop is not None and (stop.reason, stop.motor) == (reason, JOINTS[motor])
        assert named or JOINTS[motor] in refused, (stop, refused)
    rig.run(0.3)  # time to notice, and to stop
    assert rig.settle() in (Phase.IDLE, Phase.STOPPED)
    # What looks like a hand that leads the body is followed for so long, and no longer.
    led = rig.body.state.stop
    if led is not None and led.reason is StopReason.TOUCHED:
        rig.run((YIELDS + 1) * YIELD_AFTER / SECOND)
        assert abs(servo.shaft.place - place) < 500
    # Seldom lies are noticed late, even in this half second: the servo is then held where it is.
    assert rig.at_rest() or rig.at_rest()
    servo.dead, servo.alias, servo.lie = False, None, lambda place: place
    rig.run(0.2)
    assert not orders.wrong, orders.wrong
    # The truth alone does not set anything in motion again; a release does.
    rig.body.stop()
    wake(rig.body)
    assert not orders.wrong, orders.wrong
    rig.close()
