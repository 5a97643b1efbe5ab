"""The physical robot with identified servos: what was measured on one, seen in the whole body."""

import numpy as np
import pytest

from miburi.bodies.plant import Plant
from miburi.errors import DescriptionError
from miburi.robot import Robot
from miburi.robot.loads import loads
from miburi.robot.mjcf import TIMESTEP
from miburi.robot.physics import mujoco
from miburi.servos import Axis, Servo, load_servo, no_load_speed

LEVEL = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.8])  # both arms straight out sideways


@pytest.fixture(scope="module")
def servo() -> Servo:
    """The identified servo, with goals as they are asked for."""
    servo = load_servo("xl330-m288-t")
    return servo.model_copy(update={"drive": servo.drive.model_copy(update={"lift": 0.0})})


@pytest.fixture(scope="module")
def plant(robot: Robot, servo: Servo) -> Plant:
    return Plant(robot.with_servo(servo))


def held(pose, seconds: float):
    return np.tile(pose, (round(seconds / TIMESTEP), 1))


def test_a_robot_whose_hands_hang_into_the_table_is_refused_in_words(robot: Robot) -> None:
    lengths = robot.lengths.model_copy(update={"L23": 0.08, "L34": 0.107})
    with pytest.raises(DescriptionError, match="table and the right hand are .* L01 raises"):
        Plant(robot.model_copy(update={"lengths": lengths}))


def test_the_waist_turns_at_full_duty_as_fast_as_a_servo_without_load(plant, servo) -> None:
    plant.rest(LEVEL)
    goal = LEVEL.copy()
    goal[0] = 100.0
    plant.model.jnt_limited[plant.model.joint("waist").id] = 0
    plant.advance(held(goal, 1.5), servo.motor_torque)
    plant.model.jnt_limited[plant.model.joint("waist").id] = 1
    assert plant.velocities[0] == pytest.approx(no_load_speed(servo, 5.0), rel=0.02)
    assert plant.velocities[0] == pytest.approx(servo.data_sheet.no_load_speed, rel=0.1)


@pytest.mark.parametrize(("torque", "lifts"), [(0.42, True), (0.445, False)])
def test_the_head_stalls_where_a_servo_does(robot, servo, torque: float, lifts: bool) -> None:
    """Heavier gravity, until the head is just too heavy."""
    supply = servo.supply.model_copy(update={"resistance": 0.0})
    strong = servo.model_copy(update={"supply": supply})
    plant = Plant(robot.with_servo(strong))
    low, high = LEVEL.copy(), LEVEL.copy()
    low[7], high[7] = 0.5, 1.1
    plant.rest(low)
    weight = loads(robot, low).gravity[7]
    plant.model.opt.gravity[2] *= torque / weight
    plant.advance(held(high, 0.05), strong.motor_torque)
    assert (plant.angles[7] > low[7] + 0.002) == lifts


def test_arms_and_head_sag_within_the_band_that_friction_leaves(plant, servo, robot) -> None:
    plant.rest(LEVEL, settle=2.0)
    load = np.abs(loads(robot, LEVEL).gravity)
    friction = servo.friction
    held_back = friction.dry + friction.stiction + friction.load_stiction * load
    most = (load + held_back) / servo.stiffness / (1 - friction.motor_load)
    least = (load - held_back) / servo.stiffness / (1 + friction.motor_load)
    sag = np.abs(LEVEL - plant.angles)
    assert (sag <= most).all()
    assert (sag >= least - 1e-3).all()
    assert sag[7] > 0.004


def test_a_joint_at_rest_does_not_creep(plant) -> None:
    plant.rest(LEVEL, settle=1.0)
    before = plant.angles
    plant.data.qfrc_applied[0] = 0.003  # less than dry friction
    plant.advance(held(LEVEL, 2.0), 0.0)
    assert abs(plant.angles[0] - before[0]) < 1e-5


def test_a_step_is_the_single_servos(plant, servo) -> None:
    """The body's waist answers as the finer model of one servo with its inertia."""
    plant.rest(LEVEL)
    mass = np.zeros((plant.model.nv, plant.model.nv))
    mujoco.mj_fullM(plant.model, plant.data, mass)
    # At once: the PWM's slope, which the body leaves out, delays so large a step by 9 ms.
    gains = servo.gains.model_copy(update={"pwm_slope": 1e6})
    at_once = servo.model_copy(update={"gains": gains})
    axis = Axis(at_once, float(mass[0, 0]) - servo.motor.armature)
    body, alone = [], []
    goal = LEVEL.copy()
    goal[0] = 0.1
    for _ in range(60):
        plant.advance(held(goal, 0.01), servo.motor_torque)
        axis.advance(0.1, 0.01)
        body.append(plant.angles[0])
        alone.append(axis.angle)
    assert max(body) == pytest.approx(max(alone), rel=0.05)
    assert np.abs(np.subtract(body, alone)).max() < 0.005


def test_the_supply_sags_under_a_stalled_servo(plant, servo) -> None:
    plant.rest(LEVEL)
    plant.data.qfrc_applied[0] = -0.5
    goal = LEVEL.copy()
    goal[0] = 1.0
    for _ in range(3):
        plant.advance(held(goal, 0.01), servo.motor_torque)
    drop = 1 - plant.model.actuator_forcerange[0, 1] / servo.motor_torque
    wires, motor = servo.supply.resistance, servo.motor.resistance
    assert drop == pytest.approx(wires / (wires + motor), rel=0.15)


def loose(robot: Robot, play: float) -> Plant:
    """The plant of a robot whose gears play so far, rad."""
    servo = robot.servo.model
    loop = servo.loop.model_copy(update={"backlash": play})
    return Plant(robot.with_servo(servo.model_copy(update={"loop": loop})))


def test_gears_that_play_let_a_horn_go_as_far_as_their_teeth(robot: Robot) -> None:
    """Without power, and pushed by less than the motors' friction."""
    plant = loose(robot, 0.02)
    waist = plant.model.joint("waist").dofadr[0]

    def swing(one: Plant, joints: int) -> float:
        ends = []
        for side in (1.0, -1.0):
            # At the horn: with play, the waist has two joints, and the torque acts along both.
            one.data.qfrc_applied[waist : waist + joints] = 0.0025 * side
            one.advance(np.tile(robot.neutral, (400, 1)), 0.0)
            ends.append(one.angles[0])
        return ends[0] - ends[1]

    assert swing(plant, 2) == pytest.approx(0.02, abs=0.004)
    assert swing(Plant(robot), 1) < 0.002


@pytest.mark.parametrize(("rubs", "hunts"), [(1.0, 0), (0.0, 3)])
def test_after_a_move_it_rests_between_the_teeth_because_horns_rub(
    robot: Robot, rubs: float, hunts: int
) -> None:
    plant, seen = loose(robot, np.radians(0.5)), []
    plant.model.tendon_frictionloss *= rubs
    there = robot.neutral + np.array([0.2, 0.0, 0.0, 0.2, 0.0, 0.0, 0.2, 0.0])
    for _ in range(200):
        plant.advance(np.tile(there, (10, 1)), robot.servo.model.motor_torque)
        seen.append(plant.encoders())
    swings = np.ptp(seen[150:], axis=0).max()
    assert swings >= hunts if hunts else swings == 0


def test_teeth_are_harder_than_a_servo(robot: Robot) -> None:
    """With MuJoCo's own limits, 0.2 N·m turned a shoulder's horn 1.5° beyond its teeth."""
    plant = loose(robot, np.radians(0.5))
    for name in ("waist", "right_shoulder", "right_elbow", "right_fingertip", "head"):
        dof = plant.model.joint(name).dofadr[0]
        plant.rest(robot.neutral)
        plant.data.qfrc_applied[dof : dof + 2] = 0.2
        plant.advance(np.tile(robot.neutral, (250, 1)), robot.servo.model.motor_torque)
        beyond = abs(plant.data.qpos[plant.model.joint(f"play_{name}").qposadr[0]])
        assert beyond < np.radians(0.25 + 0.05), name
