"""The identified servo does what was measured on real ones, and what its data sheet says."""

from math import radians

import pytest

from miburi.servos import Axis, Servo, load_servo, no_load_speed, required_torque, stall_torque


@pytest.fixture
def servo() -> Servo:
    return load_servo("xl330-m288-t")


def changed(servo: Servo, table: str, **constants: float) -> Servo:
    new = getattr(servo, table).model_copy(update=constants)
    return servo.model_copy(update={table: new})


def test_stall_torque(servo: Servo) -> None:
    assert stall_torque(servo, 5.0) == pytest.approx(0.432, abs=0.002)  # M6, all terms
    assert stall_torque(servo, 5.0) == pytest.approx(servo.data_sheet.stall_torque, rel=0.2)
    assert stall_torque(load_servo("imagined"), 5.0) == pytest.approx(0.52, abs=0.01)


def test_no_load_speed(servo: Servo) -> None:
    assert no_load_speed(servo, 5.0) == pytest.approx(11.7, abs=0.05)  # M6, all terms
    assert no_load_speed(servo, 5.0) == pytest.approx(servo.data_sheet.no_load_speed, rel=0.1)
    axis = Axis(servo, inertia=1e-4)
    axis.advance(1e3, 0.5)
    assert axis.speed == pytest.approx(no_load_speed(servo, 5.0), rel=0.02)


def test_the_factory_gain_makes_a_soft_spring(servo: Servo) -> None:
    factory = changed(servo, "drive", gain=servo.gains.p)
    assert factory.gains.p == 400
    assert factory.stiffness == pytest.approx(0.749, abs=0.001)  # M6
    assert factory.stiffness * (1 - servo.friction.motor_load) == pytest.approx(0.55, abs=0.005)
    assert changed(factory, "divisor", p_divisor=128.0).stiffness == pytest.approx(1.498, abs=0.002)


def test_a_stalled_axis_pushes_with_the_stall_torque(servo: Servo) -> None:
    stiff = changed(servo, "supply", resistance=0.0)
    for load, moves in ((-0.42, True), (-0.44, False)):
        axis = Axis(stiff, inertia=1e-3, load=load)
        axis.advance(1.0, 0.3)
        assert (axis.angle > 0.01) == moves


@pytest.mark.parametrize("gain", [400.0, 3200.0])
def test_sag_lies_in_the_band_that_friction_leaves(servo: Servo, gain: float) -> None:
    weak, load = changed(servo, "drive", gain=gain), 0.04
    axis = Axis(weak, inertia=2e-3, load=-load)
    axis.advance(0.0, 1.0)
    gears = 1 - servo.friction.motor_load
    held = servo.friction.dry + servo.friction.stiction + servo.friction.load_stiction * load
    least = (load - held) / weak.stiffness / (1 + servo.friction.motor_load)
    most = (load + held) / weak.stiffness / gears
    assert least - servo.step <= -axis.angle <= most + servo.step


def restlessness(servo: Servo, degrees: float, inertia: float, load: float) -> float:
    """How far the axis still goes to and fro after a second at its goal, rad."""
    axis = Axis(changed(servo, "loop", backlash=radians(degrees)), inertia, -load)
    axis.advance(0.1, 1.0)
    angles = []
    for _ in range(40):
        axis.advance(0.1, 0.005)
        angles.append(axis.angle)
    return max(angles) - min(angles)


@pytest.mark.parametrize("degrees", [0.0, 0.5])
@pytest.mark.parametrize("load", [0.003, 0.05])
def test_the_chosen_gain_rests_in_spite_of_play(servo: Servo, degrees: float, load: float) -> None:
    for inertia in (0.0005, 0.002):
        assert restlessness(servo, degrees, inertia, load) < servo.step / 2


def test_a_gain_too_high_hunts_where_there_is_play(servo: Servo) -> None:
    """The mutation that shows that the test above can fail."""
    high = changed(servo, "drive", gain=6400.0)
    assert restlessness(high, 0.5, 0.002, 0.01) > 4 * servo.step


def test_the_duty_limit_bounds_the_push(servo: Servo) -> None:
    free, held = (Axis(servo, inertia=1e-3, load=-0.2, duty_limit=d) for d in (1.0, 0.25))
    free.advance(0.3, 0.5)
    held.advance(0.3, 0.5)
    assert free.angle > 0.2
    assert held.angle < 0


def test_required_torque_is_enough_for_the_motion_and_not_much_more(servo: Servo) -> None:
    """A motor that ramps up against a load reaches its speed with that duty, not with 0.8 of it."""
    speed, acceleration, load, inertia = 3.0, 20.0, 0.03, 0.002
    needed = required_torque(servo, speed, acceleration, load, inertia)
    duty = float(needed) / servo.motor_torque
    errors = []
    for limit in (duty, 0.8 * duty):
        axis = Axis(servo, inertia, -load, duty_limit=limit)
        ramp = speed / acceleration
        for i in range(300):
            t = (i + 1) / 1000
            goal = acceleration * t * t / 2 if t < ramp else speed * (t - ramp / 2)
            axis.advance(goal, 0.001)
        errors.append(goal - axis.angle)
    lag = servo.damping * speed / servo.stiffness
    assert errors[0] < 3 * lag
    assert errors[1] > 2 * errors[0]
