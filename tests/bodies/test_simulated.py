"""The physical body: it moves freely without a stop, and stops at a hand."""

from dataclasses import replace

import numpy as np
import pytest

from miburi.bodies import Body, Motor, Motors
from miburi.bodies.simulated import Simulated
from miburi.errors import InputError
from miburi.robot import JOINTS, Robot, forward
from miburi.robot.geometry import shoulders
from miburi.safety.free import FreeRule
from miburi.safety.move import plan_move
from miburi.safety.stop import Phase

RAISED = np.array([0.2, 1.4, 0.9, 0.3, 1.4, -0.9, -0.3, 1.0])
LIFT = (1, 4)  # the shoulders


def run(body: Simulated, seconds: float) -> float:
    """Let the body run; return the largest force on the hand."""
    force = 0.0
    for _ in range(round(seconds / 0.02)):
        body.step(0.02)
        force = max(force, body.touch.force)
    return force


def block(body: Simulated, arm: int, part: float = 0.5) -> None:
    """Put the hand in the way of an arm (0 right, 1 left) that will be raised."""
    robot = body.robot
    start = body.state.angles
    here, ahead = (forward(robot, start + f * (RAISED - start)) for f in (part, part + 0.05))
    hand, motion = here[3 * arm : 3 * arm + 3], (ahead - here)[3 * arm : 3 * arm + 3]
    shoulder = shoulders(robot)[arm]
    body.place_hand(shoulder + 0.85 * (hand - shoulder), np.cross(motion, hand - shoulder))


def raise_arms(body: Simulated, duration: float = 0.8) -> None:
    body.move(plan_move(body.robot, body.state.angles, RAISED, duration))


def test_a_new_body_rests_at_neutral(robot: Robot) -> None:
    body: Body = Simulated(robot)
    state = body.state
    assert (state.time, state.phase, state.stop) == (0.0, Phase.IDLE, None)
    # A soft servo sags by a few steps under gravity.
    assert np.abs(state.angles - robot.neutral).max() < 0.03


def test_motors_have_the_rule_but_no_servo_data(robot: Robot) -> None:
    rule = replace(FreeRule.of(robot), period=50_000, ratio=9000)
    assert Simulated(robot, rule).motors() == Motors((Motor(),) * 8, rule)


def test_a_free_move_arrives_within_the_sag(robot: Robot) -> None:
    body = Simulated(robot)
    raise_arms(body)
    run(body, 1.2)
    assert body.state.phase is Phase.IDLE
    assert np.abs(body.state.angles - RAISED).max() < 0.03
    assert np.abs(body.state.velocities).max() < 0.05


@pytest.mark.parametrize("arm", [0, 1])
@pytest.mark.parametrize("duration", [0.4, 2.0])
def test_a_hand_in_the_way_stops_the_body_gently(robot: Robot, arm: int, duration: float) -> None:
    body = Simulated(robot)
    block(body, arm)
    raise_arms(body, duration)
    began, force = None, 0.0
    while body.state.phase is Phase.MOVING:
        body.step(0.01)
        began = body.touch.began if began is None else began
        force = max(force, body.touch.force)
        assert body.state.time < 5.0
    stop = body.state.stop
    assert stop is not None
    assert began is not None
    assert (stop.reason, stop.motor) == ("contact", JOINTS[LIFT[arm]])
    assert 0 < stop.time - began <= 0.3
    assert force < 20.0
    # The motors give way, so that only the weight of the arm rests on the hand.
    run(body, 0.3)
    assert run(body, 0.5) < 0.5
    assert body.state.phase is Phase.STOPPED


def test_without_the_rule_the_arm_would_push_on(robot: Robot) -> None:
    """This mutation, a ratio of 0 and no backstops, shows that the test above can fail."""
    rule = FreeRule.of(robot)
    far = np.full(8, 10**6)
    guards = replace(rule.guards, slack=far, behind=far, ahead=far, arrival=far)
    body = Simulated(robot, replace(rule, ratio=0, guards=guards))
    block(body, 0)
    raise_arms(body)
    run(body, 1.5)
    assert body.state.phase is not Phase.STOPPED
    assert run(body, 0.5) > 1.2  # no more, for the limit of its motors' push


def test_a_release_returns_the_body_to_neutral(robot: Robot) -> None:
    body = Simulated(robot)
    block(body, 0)
    raise_arms(body)
    run(body, 1.0)
    assert body.state.phase is Phase.STOPPED
    body.remove_hand()
    body.release()
    assert body.state.phase is Phase.RETURNING
    run(body, 4.0)
    assert body.state.phase is Phase.IDLE
    assert np.abs(body.state.angles - robot.neutral).max() < 0.03


def test_a_person_can_stop_it_and_move_the_soft_arm(robot: Robot) -> None:
    body = Simulated(robot)
    raise_arms(body)
    run(body, 0.3)
    body.stop()
    assert body.state.phase is Phase.STOPPED
    assert body.state.stop is not None
    assert body.state.stop.reason == "asked"
    before = body.state.angles
    run(body, 2.0)
    assert np.abs(body.state.angles - before).max() < 0.05
    assert body.state.phase is Phase.STOPPED


def test_a_closed_body_is_stopped(robot: Robot) -> None:
    body = Simulated(robot)
    raise_arms(body)
    body.close()
    assert body.state.phase is Phase.STOPPED


def test_crossed_arms_meet_and_stop(robot: Robot) -> None:
    body = Simulated(robot)
    crossed = np.array([0, 1.5, 1.7, 1.2, 1.5, -1.7, -1.2, 0.8])
    body.move(plan_move(robot, robot.neutral, crossed, 1.0))
    met = None
    for _ in range(100):
        body.step(0.02)
        met = met or body.touch.itself
    assert met is not None
    assert body.state.phase is Phase.STOPPED


def test_time_adds_up_over_steps_of_any_length(robot: Robot) -> None:
    coarse, fine = Simulated(robot), Simulated(robot)
    for body, step, times in ((coarse, 0.9, 1), (fine, 0.003, 300)):
        raise_arms(body)
        for _ in range(times):
            body.step(step)
        assert body.state.time == pytest.approx(0.9)
    np.testing.assert_array_equal(coarse.configuration[0], fine.configuration[0])


def test_a_hand_without_a_place_or_direction_is_refused(robot: Robot) -> None:
    body = Simulated(robot)
    for place, along in [([np.nan, 0, 0], [1, 0, 0]), ([0, 0, 0], [0, 0, 0])]:
        with pytest.raises(InputError, match="hand needs"):
            body.place_hand(np.array(place), np.array(along))
