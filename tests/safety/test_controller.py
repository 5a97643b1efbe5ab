"""The card's logic: idle → moving → stopped → returning → idle, and no other order."""

from contextlib import suppress

import numpy as np
import pytest

from miburi.errors import BodyError
from miburi.robot import JOINTS, Robot
from miburi.safety.contact import Rule
from miburi.safety.controller import FURTHEST, GIVE_WAY, RETURN_SPEED, YIELD_AFTER, Controller
from miburi.safety.drive import aim
from miburi.safety.move import Move, plan_move
from miburi.safety.profile import FINE, SECOND, Steps, to_steps
from miburi.safety.stop import Phase, StopReason

TICK = 10_000


class Motors:
    """Ideal motors with a lag; ``blocked`` names one that no longer moves."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.time = 0
        self.blocked: int | None = None
        self.positions: Steps = controller.origin.copy()
        self.lag = int(controller.rule.guards.lag[0])

    @property
    def read_at(self) -> int:
        """When the positions were read."""
        return self.time - TICK

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * SECOND / TICK)):
            before = self.positions
            goal = self.controller.setpoint(self.time - self.lag)
            self.positions = np.rint(goal / FINE).astype(np.int64)
            if self.blocked is not None:
                self.positions[self.blocked] = before[self.blocked]
            self.controller.update(self.positions, self.time)
            self.time += TICK


@pytest.fixture
def motors(robot: Robot) -> Motors:
    return Motors(Controller(robot, Rule.of(robot), to_steps(robot, robot.neutral)))


def raised(robot: Robot, duration: float = 0.8) -> Move:
    end = robot.neutral + np.array([0.3, 1.2, -0.5, 0.2, 1.2, 0.5, -0.2, 0.2])
    return plan_move(robot, robot.neutral, end, duration)


def test_a_free_move_ends_idle_at_its_goal(motors: Motors, robot: Robot) -> None:
    controller, move = motors.controller, raised(robot)
    controller.move(move, motors.positions, motors.time)
    assert controller.phase is Phase.MOVING
    motors.run(1.2)
    assert controller.phase is Phase.IDLE
    np.testing.assert_array_equal(controller.origin, to_steps(robot, move.angles))
    np.testing.assert_array_equal(motors.positions, controller.origin)


@pytest.mark.parametrize("motor", range(8))
def test_one_blocked_motor_stops_all_and_the_stop_is_latched(
    motors: Motors, robot: Robot, motor: int
) -> None:
    controller = motors.controller
    controller.move(raised(robot), motors.positions, motors.time)
    motors.run(0.3)
    motors.blocked = motor
    motors.run(0.3)
    assert controller.phase is Phase.STOPPED
    stop = controller.latched
    assert stop is not None
    assert (stop.reason, stop.motor) == ("contact", JOINTS[motor])
    held = controller.setpoint(motors.time)
    motors.run(5.0)
    np.testing.assert_array_equal(controller.setpoint(motors.time), held)
    assert controller.latched == stop


@pytest.mark.parametrize(
    ("motor", "seconds"), [(motor, (0.1, 0.3, 0.6)[motor % 3]) for motor in range(8)]
)
def test_after_a_contact_the_body_goes_back_along_its_path(
    motors: Motors, robot: Robot, motor: int, seconds: float
) -> None:
    """Far enough to stop pressing, but never behind where the move began."""
    controller = motors.controller
    controller.move(raised(robot), motors.positions, motors.time)
    start = motors.positions
    motors.run(seconds)
    motors.blocked = motor
    while controller.phase is Phase.MOVING:
        motors.run(TICK / SECOND)
    direction = np.sign(to_steps(robot, raised(robot).angles) - start)
    travel = (motors.positions - start) * direction
    back = (motors.positions - controller.origin) * direction
    give_way, furthest = (round(limit / robot.servo.step) for limit in (GIVE_WAY, FURTHEST))
    part = min(1.0, give_way / max(travel[motor], 1), furthest / max(travel.max(), 1))
    assert ((back >= travel * part - 1) & (back <= travel * part)).all()
    assert back.max() <= furthest
    assert back[motor] <= give_way
    assert back.max() > 0


@pytest.mark.parametrize(("motor", "off"), [(motor, (-1) ** motor) for motor in range(8)])
def test_a_motor_that_is_held_away_from_its_place_yields_once(
    motors: Motors, robot: Robot, motor: int, off: int
) -> None:
    """It must not push back for ever, and a load must not pull it further and further."""
    controller = motors.controller
    controller.move(raised(robot), motors.positions, motors.time)
    motors.run(0.3)
    motors.blocked = 1
    while controller.phase is Phase.MOVING:
        motors.run(TICK / SECOND)
    stopped, place = motors.time - TICK, controller.origin
    # What a motor at rest is granted.
    most = int(controller.rule.guards.slack[motor]) // 2
    pushed = place.copy()
    pushed[motor] += off * most
    controller.update(pushed, stopped + YIELD_AFTER - 1)
    controller.update(pushed, stopped + YIELD_AFTER)
    np.testing.assert_array_equal(controller.origin, place)

    controller.release(place, motors.time)
    controller.update(place + 1000, motors.time + TICK)
    assert controller.phase is Phase.STOPPED
    stopped, place = motors.time + TICK, controller.origin
    pushed = place.copy()
    pushed[motor] += off * (most + 1)
    controller.update(pushed, stopped + YIELD_AFTER - 1)
    np.testing.assert_array_equal(controller.origin, place)
    controller.update(pushed, stopped + YIELD_AFTER)
    np.testing.assert_array_equal(controller.origin, pushed)
    np.testing.assert_array_equal(controller.setpoint(stopped + SECOND), pushed * FINE)
    controller.update(pushed + 50, stopped + 2 * YIELD_AFTER)
    np.testing.assert_array_equal(controller.origin, pushed)


@pytest.mark.parametrize("hangs", [-4, 0, 4, 100])
def test_after_a_contact_the_goals_stay_above_the_motors_by_their_sag(
    motors: Motors, robot: Robot, hangs: int
) -> None:
    """With goals where they hang, loaded motors would sink again, onto the person they touch."""
    controller = motors.controller
    held = min(hangs, round(GIVE_WAY / robot.servo.step))
    here = controller.origin - hangs
    controller.move(raised(robot), here, motors.time)
    # A motor that is pushed before it has moved has no path to go back along.
    pushed = here.copy()
    pushed[6] += 200
    controller.update(pushed, TICK)
    assert controller.phase is Phase.STOPPED
    np.testing.assert_array_equal(controller.origin, pushed + held)
    # A motor that hangs as before is not held away from its place.
    controller.update(pushed, TICK + YIELD_AFTER)
    np.testing.assert_array_equal(controller.origin, pushed + held)


def test_a_requested_stop_moves_nothing(motors: Motors, robot: Robot) -> None:
    controller = motors.controller
    controller.move(raised(robot), motors.positions, motors.time)
    motors.run(0.4)
    controller.stop(motors.positions, motors.time)
    held = motors.positions
    np.testing.assert_array_equal(controller.setpoint(motors.time), held * FINE)
    controller.update(held + 100, motors.time + 2 * YIELD_AFTER)
    np.testing.assert_array_equal(controller.setpoint(motors.time), held * FINE)


def test_a_stop_at_rest_moves_nothing(motors: Motors, robot: Robot) -> None:
    """Not even by the sag that the motors had in the pose before."""
    controller = motors.controller
    controller.move(raised(robot), motors.positions - 3, motors.time)
    motors.run(1.2)
    assert controller.phase is Phase.IDLE
    goals = controller.origin
    controller.stop(motors.positions, motors.time)
    np.testing.assert_array_equal(controller.origin, goals)


def test_the_return_is_slow_and_ends_at_neutral(motors: Motors, robot: Robot) -> None:
    controller = motors.controller
    controller.move(raised(robot), motors.positions, motors.time)
    motors.run(0.4)
    controller.stop(motors.positions, motors.time)
    with pytest.raises(BodyError, match="stopped"):
        controller.move(raised(robot), motors.positions, motors.time)
    controller.release(motors.positions, motors.time)
    assert controller.phase is Phase.RETURNING
    assert controller.latched is None
    limit = RETURN_SPEED / robot.servo.step
    while controller.phase is Phase.RETURNING:
        before = motors.positions
        motors.run(TICK / SECOND)
        assert np.abs(motors.positions - before).max() <= limit * TICK / SECOND + 1
        assert motors.time < 20 * SECOND
    assert controller.phase is Phase.IDLE
    np.testing.assert_array_equal(motors.positions, to_steps(robot, aim(robot, robot.neutral)))


def test_a_motor_that_is_blocked_on_the_return_stops_the_body_again(
    motors: Motors, robot: Robot
) -> None:
    controller = motors.controller
    controller.move(raised(robot), motors.positions, motors.time)
    motors.run(0.5)
    controller.stop(motors.positions, motors.time)
    controller.release(motors.positions, motors.time)
    motors.run(0.3)
    motors.blocked = 1
    motors.run(0.5)
    assert controller.phase is Phase.STOPPED
    assert controller.latched is not None
    assert controller.latched.motor == "right_shoulder"


def test_a_release_starts_from_where_somebody_moved_the_arms(motors: Motors, robot: Robot) -> None:
    controller = motors.controller
    controller.stop(motors.positions, motors.time)
    pushed = motors.positions + np.array([0, 200, 0, 0, -150, 0, 0, 0])
    controller.release(pushed, motors.time)
    np.testing.assert_array_equal(controller.setpoint(motors.time), pushed * FINE)


def test_wrong_calls_are_refused(motors: Motors, robot: Robot) -> None:
    controller = motors.controller
    with pytest.raises(BodyError, match="only a stopped body"):
        controller.release(motors.positions, 0)
    neutral, still = robot.neutral, np.zeros(8)
    for motor in range(8):
        beyond = neutral.copy()
        beyond[motor] = robot.upper[motor] + 2 * robot.servo.step
        with pytest.raises(BodyError, match="allowed is"):
            controller.move(Move(beyond, still), motors.positions, 0)
        fast = still.copy()
        fast[motor] = robot.servo.max_speed * 1.01
        with pytest.raises(BodyError, match="at most"):
            controller.move(Move(neutral.copy(), fast), motors.positions, 0)
    assert controller.phase is Phase.IDLE
    controller.move(raised(robot), motors.positions, 0)
    controller.stop(motors.positions, 0)
    with pytest.raises(BodyError, match="The body is stopped"):
        controller.move(raised(robot), motors.positions, 0)
    motors.time = 10_000
    controller.release(motors.positions, motors.time)
    with pytest.raises(BodyError, match="The body is returning"):
        controller.move(raised(robot), motors.positions, motors.time)


def test_a_move_within_a_move_goes_on_at_its_speed(motors: Motors, robot: Robot) -> None:
    controller = motors.controller
    controller.move(raised(robot), motors.positions, motors.time)
    motors.run(0.4)
    place, speed = controller.setpoint(motors.read_at), controller.speed(motors.read_at)
    assert np.abs(speed).max() > 500 * FINE
    back = plan_move(robot, robot.neutral, robot.neutral, 0.5)
    controller.move(Move(back.angles, np.full(8, 2.0)), motors.positions, motors.read_at)
    assert np.abs(controller.setpoint(motors.read_at) - place).max() <= FINE // 2
    np.testing.assert_array_equal(controller.speed(motors.read_at), speed)
    motors.run(2.0)
    assert controller.phase is Phase.IDLE, controller.latched
    np.testing.assert_array_equal(motors.positions, to_steps(robot, robot.neutral))


@pytest.mark.parametrize("motor", [1, 3, 6])
@pytest.mark.parametrize("every", [0.02, 0.05, 0.13])
def test_moves_that_replace_one_another_do_not_hide_a_contact(
    motors: Motors, robot: Robot, motor: int, every: float
) -> None:
    """There and back, so that no window lasts; the motor is held all the while."""
    controller = motors.controller
    ends = (raised(robot, 0.6), Move(np.array(robot.neutral), np.full(8, 2.5)))
    controller.move(ends[0], motors.positions, motors.time)
    motors.run(0.3)
    motors.blocked = motor
    for turn in range(40):
        if controller.phase is Phase.STOPPED:
            break
        with suppress(BodyError):  # a move judges the latest reading, too
            controller.move(ends[turn // 8 % 2], motors.positions, motors.read_at)
        motors.run(every)
    stop = controller.latched
    assert stop is not None
    assert (stop.reason, stop.motor) == (StopReason.CONTACT, JOINTS[motor])
    assert motors.time <= 700_000


def test_a_contact_soon_after_another_move_began_gives_way_as_far(
    motors: Motors, robot: Robot
) -> None:
    """The way back may lead beyond where the present move began."""
    controller, move = motors.controller, raised(robot)
    controller.move(move, motors.positions, motors.time)
    motors.run(0.4)
    motors.blocked = 1
    while controller.phase is not Phase.STOPPED:
        with suppress(BodyError):
            controller.move(move, motors.positions, motors.read_at)
        motors.run(0.01)
    assert motors.positions[1] - controller.origin[1] >= 0.9 * GIVE_WAY / robot.servo.step


def test_a_second_stop_keeps_the_first_reason(motors: Motors) -> None:
    controller = motors.controller
    controller.stop(motors.positions, 0, StopReason.SERVO_HOT)
    controller.stop(motors.positions, 10)
    assert controller.latched is not None
    assert controller.latched.reason == StopReason.SERVO_HOT


@pytest.mark.parametrize("after", [0.01, 0.03])
def test_a_motor_that_is_blocked_while_it_turns_round_gives_way(
    motors: Motors, robot: Robot, after: float
) -> None:
    """It still goes the old way; what it meets there is not in its new one."""
    controller = motors.controller
    controller.move(raised(robot, 0.6), motors.positions, motors.time)
    motors.run(0.3)
    home = Move(np.array(robot.neutral), np.full(8, 2.5))
    controller.move(home, motors.positions, motors.read_at)
    motors.run(after)
    motors.blocked = 1
    while controller.phase is Phase.MOVING:
        motors.run(0.01)
    assert controller.latched is not None
    assert controller.latched.motor == JOINTS[1]
    assert motors.positions[1] - controller.origin[1] >= 0.9 * GIVE_WAY / robot.servo.step
