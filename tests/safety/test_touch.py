"""A body at rest is led by the hand: it stops, yields, and goes back slowly."""

import numpy as np
import pytest

from miburi.robot import JOINTS, Robot
from miburi.safety.contact import Rule
from miburi.safety.controller import RETURN_SPEED, YIELD_AFTER, YIELDS, Controller, return_speed
from miburi.safety.profile import FINE, SECOND, Steps, to_steps
from miburi.safety.stop import Phase, StopReason

TICK = 10_000


@pytest.fixture
def controller(robot: Robot) -> Controller:
    return Controller(robot, Rule.of(robot), to_steps(robot, robot.neutral))


def see(controller: Controller, positions: Steps, begin: int, until: int) -> None:
    """Let the controller read the same positions from one time, µs, until another, inclusive."""
    for time in range(begin, until + 1, TICK):
        controller.update(positions, time)


def pushed(controller: Controller, motor: int, by: int) -> Steps:
    positions = controller.origin.copy()
    positions[motor] += by
    return positions


def most(controller: Controller, motor: int) -> int:
    """Steps that a motor at rest may be away from its place."""
    guards = controller.rule.guards
    return int(max(guards.slack[motor], guards.arrival[motor]))


@pytest.mark.parametrize("motor", range(8))
@pytest.mark.parametrize("side", [-1, 1])
def test_a_steady_push_stops_it_and_names_the_motor(
    controller: Controller, motor: int, side: int
) -> None:
    see(controller, controller.origin, 0, SECOND)
    within = pushed(controller, motor, side * most(controller, motor))
    see(controller, within, SECOND, 3 * SECOND)
    assert controller.phase is Phase.IDLE
    beyond = pushed(controller, motor, side * (most(controller, motor) + 1))
    begin = 4 * SECOND
    see(controller, beyond, begin, begin + YIELD_AFTER - TICK)
    assert controller.phase is Phase.IDLE
    controller.update(beyond, begin + YIELD_AFTER)
    stop = controller.latched
    assert stop is not None
    assert (stop.reason, stop.motor) == (StopReason.TOUCHED, JOINTS[motor])
    np.testing.assert_array_equal(controller.origin, beyond)


def test_pushes_that_are_short_do_not_add_up(controller: Controller) -> None:
    here, there = controller.origin, pushed(controller, 2, most(controller, 2) + 1)
    for begin in range(0, 10 * SECOND, 2 * YIELD_AFTER):
        see(controller, there, begin, begin + YIELD_AFTER - TICK)
        controller.update(here, begin + YIELD_AFTER)
    assert controller.phase is Phase.IDLE


def test_where_it_hangs_under_its_load_is_its_place(controller: Controller) -> None:
    hanging = pushed(controller, 2, -2 * most(controller, 2))
    see(controller, hanging, 0, 10 * SECOND)
    assert controller.phase is Phase.IDLE


def lead(controller: Controller, motor: int, seconds: float, by: int) -> int:
    """Lead a motor on, always ``by`` steps ahead of its goal; return the time at the end, µs."""
    end = round(seconds * SECOND)
    controller.update(controller.origin, 0)
    for time in range(TICK, end, TICK):
        controller.update(pushed(controller, motor, by), time)
    assert controller.phase is Phase.STOPPED
    return end


def test_it_yields_again_and_again_but_not_for_ever(controller: Controller) -> None:
    """A motor that turns backwards, or a servo that says that it is elsewhere, is a hand, too."""
    begin, by = int(controller.origin[2]), 12
    lead(controller, 2, 60.0, by)
    assert controller.origin[2] - begin == by * (YIELDS + 1)
    held = controller.origin.copy()
    time = 100 * SECOND
    see(controller, pushed(controller, 2, by), time, time + SECOND)
    np.testing.assert_array_equal(controller.origin, held)
    # A hand that has let go for a moment may lead it on.
    see(controller, held, time + SECOND + TICK, time + 2 * SECOND)
    see(controller, pushed(controller, 2, by), time + 2 * SECOND + TICK, time + 3 * SECOND)
    assert controller.origin[2] != held[2]


def test_it_is_not_held_beyond_its_limits(controller: Controller, robot: Robot) -> None:
    lead(controller, 2, 2.0, 400)
    assert controller.origin[2] == to_steps(robot, robot.upper)[2]


def test_it_goes_back_slowly(controller: Controller, robot: Robot) -> None:
    time = lead(controller, 2, 1.0, 40)
    controller.release(controller.origin, time)
    usual = round(RETURN_SPEED / robot.servo.step)
    assert controller.watch.profile.speed.max() <= return_speed(usual, led=True) * FINE
    assert return_speed(usual, led=True) < usual / 2 < return_speed(usual, led=False)
    assert controller.phase is Phase.RETURNING


def test_a_stop_that_somebody_asks_for_takes_the_place_of_a_touch(controller: Controller) -> None:
    time = lead(controller, 2, 1.0, 40)
    place = controller.origin.copy()
    controller.stop(place, time)
    see(controller, pushed(controller, 2, 100), time + TICK, time + 5 * SECOND)
    np.testing.assert_array_equal(controller.origin, place)
    assert controller.latched is not None
    assert controller.latched.reason is StopReason.ASKED
    controller.stop(place, time + SECOND, StopReason.LINE_LOST)
    assert controller.latched.reason is StopReason.ASKED


def test_a_body_that_never_moved_holds_under_its_load(controller: Controller) -> None:
    """Its motors hang from their goals: a touch elsewhere lets none of them sink."""
    hanging = pushed(controller, 7, -8)
    see(controller, hanging, 0, SECOND)
    led = hanging.copy()
    led[2] += 2 * most(controller, 2)
    see(controller, led, SECOND + TICK, 2 * SECOND)
    assert controller.phase is Phase.STOPPED
    assert controller.origin[7] == hanging[7] + 8
