"""A servo's motor as others identified it, driven through the official SDK.

The figures are Better Actuator Models' (M6 of the XL330) and the e-manual's.
"""

import pytest
from dynamixel_sdk import COMM_SUCCESS, PacketHandler
from tests.emulation.port import Port

from miburi.emulation.bus import Bus
from miburi.emulation.gearmotor import Gearmotor
from miburi.emulation.servos import SPEED_UNIT, Servo
from miburi.servos import Servo as Model
from miburi.servos import load_servo

SDK = PacketHandler(2.0)
#: Registers.
MODE, PWM_SLOPE, TORQUE, P, PWM, PUSHES, SPEED, GOAL = 11, 62, 64, 84, 100, 124, 128, 116
POSITION_CONTROL, PWM_CONTROL = 3, 16


class Bench:
    """One servo on a bus, with a shaft that the test loads."""

    def __init__(self, model: Model) -> None:
        self.shaft = Gearmotor(model)
        self.servo = Servo.new(1, shaft=self.shaft, model=model)
        self.port = Port(Bus([self.servo]))

    def write(self, address: int, value: int, size: int = 1) -> None:
        data = list((value % (1 << 8 * size)).to_bytes(size, "little"))
        assert SDK.writeTxRx(self.port, 1, address, size, data) == (COMM_SUCCESS, 0)

    def wait(self, seconds: float) -> float:
        """Let time pass; return where the shaft is, rad from where it was mounted."""
        self.port.time += seconds * 1e6
        return (self.shaft.position(self.servo, self.port.time) - 2048) * self.shaft.axis.servo.step

    def hold(self, gain: int = 3200) -> None:
        self.write(MODE, POSITION_CONTROL)
        self.write(P, gain, 2)
        self.write(GOAL, 2048, 4)
        self.write(TORQUE, 1)

    def pushes(self) -> int:
        """Return the present PWM."""
        return int(SDK.read2ByteTxRx(self.port, 1, PUSHES)[0])

    def push(self, pwm: int) -> None:
        self.write(MODE, PWM_CONTROL)
        self.write(TORQUE, 1)
        self.write(PWM, pwm, 2)


@pytest.fixture
def model() -> Model:
    return load_servo("xl330-m288-t")


@pytest.fixture
def bench(model: Model) -> Bench:
    """On a supply as stiff as theirs."""
    supply = model.supply.model_copy(update={"resistance": 0.0})
    return Bench(model.model_copy(update={"supply": supply}))


def test_at_full_pwm_it_turns_as_fast_as_theirs(bench: Bench) -> None:
    bench.push(885)
    bench.wait(0.5)
    speed, result, _ = SDK.read4ByteTxRx(bench.port, 1, SPEED)
    assert result == COMM_SUCCESS
    turning = speed * SPEED_UNIT * bench.shaft.axis.servo.step
    assert turning == pytest.approx(11.73, rel=0.01)
    assert turning == pytest.approx(bench.shaft.axis.servo.data_sheet.no_load_speed, rel=0.1)


@pytest.mark.parametrize(("load", "gives_way"), [(0.42, False), (0.44, True)])
def test_at_full_pwm_it_stalls_where_theirs_does(
    bench: Bench, load: float, gives_way: bool
) -> None:
    bench.shaft.load = -load
    bench.push(885)
    assert (bench.wait(1.0) < 0.1) == gives_way


@pytest.mark.parametrize(("gain", "stiffness"), [(400, 0.749), (3200, 5.99)])
def test_it_hangs_from_its_goal_by_the_gain_in_its_table(
    bench: Bench, gain: int, stiffness: float
) -> None:
    """Within what friction may hold; whoever leaves the factory's gain has a spring of 0.75."""
    load, friction = 0.1, bench.shaft.axis.servo.friction
    bench.hold(gain)
    bench.shaft.load = -load
    sag = -bench.wait(2.0)
    held = friction.dry + friction.stiction + friction.load_stiction * load
    least = (load - held) / stiffness / (1 + friction.motor_load)
    most = (load + held) / stiffness / (1 - friction.motor_load)
    step = bench.shaft.axis.servo.step
    assert least - step <= sag <= most + step


@pytest.mark.parametrize("pwm", [221, 100])
def test_goal_pwm_bounds_the_push_while_it_holds(bench: Bench, pwm: int) -> None:
    """221 of 885 is the hold's 0.12 N·m."""
    bench.hold()
    bench.write(PWM, pwm, 2)
    gears = 1 - bench.shaft.axis.servo.friction.motor_load
    motor = bench.shaft.axis.servo.motor_torque * pwm / 885
    bench.shaft.load = -0.8 * motor * gears
    assert bench.wait(1.0) > -0.2
    bench.shaft.load = -2 * motor
    assert bench.wait(1.0) < -0.3


def test_the_pwm_rises_with_its_slope(bench: Bench) -> None:
    """The e-manual's example: from 0 to 885 in 18 ms with 140."""
    bench.shaft.high = 2048.0
    bench.write(PWM_SLOPE, 140)
    bench.push(885)
    began = bench.port.time
    while bench.pushes() < 885:  # each reading takes a millisecond
        assert bench.port.time < began + 30_000
    assert 18_000 <= bench.port.time - began <= 19_000


def test_without_torque_only_the_gears_hold_it(bench: Bench) -> None:
    bench.shaft.load = -0.005  # less than the dry friction
    assert abs(bench.wait(1.0)) < 0.01
    bench.shaft.load = -0.03
    assert bench.wait(1.0) < -0.5


def test_a_blocked_shaft_stays_and_pushes(bench: Bench) -> None:
    bench.hold()
    bench.shaft.high = 2148.0
    bench.write(GOAL, 2848, 4)
    assert bench.wait(1.0) == pytest.approx(100 * bench.shaft.axis.servo.step, abs=0.004)
    assert bench.pushes() == 885
