"""What servos are told beside a move: goals above the sag, and a ceiling for their push."""

import numpy as np
import pytest

from miburi.bodies.simulated import Simulated
from miburi.robot import JOINTS, Array, Robot
from miburi.robot.loads import loads
from miburi.safety.drive import EASES_AFTER, aim, demand
from miburi.safety.free import FreeRule
from miburi.safety.move import plan_move
from miburi.safety.profile import Steps, plan_profile, to_steps
from miburi.servos import Servo, load_servo
from miburi.studies.trials.plant import TrialPlant
from miburi.studies.trials.replay import DeafRule
from miburi.studies.trials.trial import TrialKind, enact, sustained_force

REACHING = np.array([0.4, 0.3, 0.2, 0.1, 0.3, -0.2, -0.1, 1.0])


@pytest.fixture(scope="module")
def servo() -> Servo:
    return load_servo("xl330-m288-t")


def driven(servo: Servo, **changes: float) -> Servo:
    return servo.model_copy(update={"drive": servo.drive.model_copy(update=changes)})


def ceiling(robot: Robot, speed: float) -> Array:
    """Return the ceiling of a move to REACHING in which no motor is faster than ``speed`` rad/s."""
    origin, goal = to_steps(robot, robot.neutral), to_steps(robot, REACHING)
    speeds = to_steps(robot, np.full(8, speed))
    profile, direction = plan_profile(robot, origin, goal, speeds)
    return demand(robot, origin, origin, profile, direction).ceiling


def test_goals_stay_inside_the_limits(robot: Robot, servo: Servo) -> None:
    real = robot.with_servo(servo)
    rng = np.random.default_rng(5)
    angles = rng.uniform(robot.lower, robot.upper, (200, 8))
    angles[:100] = np.where(rng.random((100, 8)) < 0.5, robot.lower, robot.upper)
    goals = aim(real, angles)
    assert (goals >= robot.lower).all()
    assert (goals <= robot.upper).all()
    inside = (angles > robot.lower + 0.02) & (angles < robot.upper - 0.02)
    lift = loads(robot, angles).gravity / servo.stiffness
    np.testing.assert_allclose((goals - angles)[inside], lift[inside], atol=1e-12)


def test_goals_above_the_sag_delay_no_move(robot: Robot) -> None:
    """A motor with one step to go, that is lifted by one more, took twice the move's time."""
    rng = np.random.default_rng(8)
    for _ in range(50):
        start, end = rng.uniform(robot.lower, robot.upper, (2, 8))
        near = np.clip(start + robot.servo.step, robot.lower, robot.upper)
        end = np.where(rng.random(8) < 0.5, near, end)
        move = plan_move(robot, start, end, 1.2)
        origin, goal = (to_steps(robot, aim(robot, pose)) for pose in (start, end))
        profile, _ = plan_profile(robot, origin, goal, to_steps(robot, move.speeds))
        # A few steps in that time are no whole number of steps/s.
        assert profile.total.max() <= 1.5e6
        assert profile.total[profile.distance > 40].max() < 1.02 * 1.2e6


def test_loaded_motors_come_to_what_was_asked(robot: Robot, servo: Servo) -> None:
    missed = []
    for lift in (0.0, 1.0):
        body = Simulated(robot.with_servo(driven(servo, lift=lift)), DeafRule.of(robot))
        body.move(plan_move(robot, robot.neutral, REACHING, 0.8))
        body.step(1.5)
        missed.append(np.abs(body.configuration[0] - REACHING).max())
    assert missed[1] < 0.5 * missed[0]
    assert missed[1] < 0.005


def test_a_ceiling_leaves_the_free_move_as_it_is(robot: Robot, servo: Servo) -> None:
    ways = []
    for headroom in (1000.0, servo.drive.headroom):
        body = Simulated(robot.with_servo(driven(servo, headroom=headroom)), DeafRule.of(robot))
        body.move(plan_move(robot, robot.neutral, REACHING, 0.4))
        ways.append([body.step(0.01).angles for _ in range(120)])
    assert np.abs(np.subtract(*ways)).max() < 0.01


def test_who_has_sped_up_may_push_less(robot: Robot, servo: Servo) -> None:
    """A motor at rest needs as much all the time; one that moves has its inertia behind it."""
    real = robot.with_servo(servo)
    origin, goal = to_steps(robot, robot.neutral), to_steps(robot, REACHING)
    profile, direction = plan_profile(robot, origin, goal, to_steps(robot, np.full(8, 1.0)))
    needs = demand(real, origin, origin, profile, direction)
    assert (needs.cruise <= needs.ceiling).all()
    assert (needs.cruise < 0.75 * needs.ceiling)[[1, 4]].all()  # the shoulders
    assert needs.eases_at == profile.ramp.max() + EASES_AFTER
    body = Simulated(real, FreeRule.of(real))
    body.move(plan_move(real, real.neutral, REACHING, 1.0))
    body.step(1.5)
    assert body.state.stop is None


def test_a_slower_move_pushes_less(robot: Robot, servo: Servo) -> None:
    real = robot.with_servo(servo)
    slow, fast = (ceiling(real, speed) for speed in (0.3, 3.0))
    assert (slow < fast).all()
    assert (fast <= servo.motor_torque).all()
    assert np.median(slow) < 0.35 * servo.motor_torque


def test_a_lowered_arm_pushes_less_than_a_raised_one(robot: Robot, servo: Servo) -> None:
    """Its weight does a part of the work; to slow it down takes less than to lift it."""
    real = robot.with_servo(servo)
    low, high = to_steps(robot, robot.neutral), to_steps(robot, REACHING)
    speeds = to_steps(robot, np.full(8, 1.0))

    def ceilings(origin: Steps, goal: Steps) -> Array:
        profile, direction = plan_profile(robot, origin, goal, speeds)
        return demand(real, origin, origin, profile, direction).ceiling

    raised, lowered = ceilings(low, high), ceilings(high, low)
    shoulder = JOINTS.index("right_shoulder")
    assert lowered[shoulder] < 0.85 * raised[shoulder]


def test_full_hands_are_swung_as_fast_as_empty_ones(robot: Robot, servo: Servo) -> None:
    """10 g in each, stiff gears and a low supply: the waist lagged at its ceiling and stopped."""
    real = robot.with_servo(servo)
    laden = enact(TrialPlant(real), FreeRule.of(real), 1, TrialKind.FREE, 4170)
    assert laden.conditions.variation.load > 0.006
    assert laden.stop is None


def test_worn_gears_get_what_they_take(robot: Robot, servo: Servo) -> None:
    """With a ceiling of 1.4 times what a move needs, cold worn gears could not follow (1.4 here).

    They take half of a motor's torque: a blocked one pushes no harder than one with new gears.
    """
    new, worn = (
        ceiling(robot.with_servo(servo.varied(friction=times)), 1.0) for times in (1.0, 1.8)
    )
    assert (worn > 1.9 * new).all()
    takes = servo.friction.motor_load
    assert (worn * (1 - 1.8 * takes) < 1.5 * new * (1 - takes)).all()


def test_the_imagined_servo_is_driven_as_it_was(robot: Robot) -> None:
    imagined = robot.with_servo(load_servo("imagined"))
    np.testing.assert_array_equal(aim(imagined, REACHING), REACHING)
    np.testing.assert_array_equal(ceiling(imagined, 0.1), np.full(8, 0.52))


def test_the_ceiling_softens_the_push_without_any_rule(robot: Robot, servo: Servo) -> None:
    pushes = []
    for headroom in (1000.0, servo.drive.headroom):
        real = robot.with_servo(driven(servo, headroom=headroom))
        plant, rule = TrialPlant(real), DeafRule.of(real)
        runs = [enact(plant, rule, 11, TrialKind.BLOCKED, index) for index in range(6)]
        pushes.append(np.median([sustained_force(one.forces) for one in runs]))
    assert pushes[1] < 0.75 * pushes[0]
