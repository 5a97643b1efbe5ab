"""Emulated servos that move the whole body: as the simulated body moves, register by register."""

import numpy as np
import pytest

from miburi.bodies.plant import Plant
from miburi.emulation.servos import ACCELERATION_UNIT, SPEED_UNIT, Servo
from miburi.robot import Array, Robot, iphonoid
from miburi.robot.mjcf import TIMESTEP
from miburi.safety.profile import FINE, Profile
from miburi.servos import load_servo

TURN = 0.001  # s between two turns of the servos' control
MIDDLE = 2048


class Joints:
    """Eight servos, ids 1 to 8, whose middle is angle 0, on the physical body."""

    def __init__(self, robot: Robot, gain: int) -> None:
        self.plant, self.step = Plant(robot), robot.servo.step
        self.plant.model.opt.timestep = TURN
        self.servos = [Servo.new(i + 1, model=robot.servo.model) for i in range(8)]
        for servo, angle in zip(self.servos, robot.neutral.tolist(), strict=True):
            servo.set("position_p_gain", gain)
            servo.set("goal_position", MIDDLE + round(angle / self.step))
            servo.write(64, b"\1", 0.0)

    def run(self, seconds: float) -> Array:
        """Let time pass; return the angles at each physics step of the simulated body, (n, 8)."""
        angles = []
        for turn in range(round(seconds / TURN)):
            now = (self.plant.time + TURN) * 1e6
            places = MIDDLE + self.plant.angles / self.step
            speeds = self.plant.velocities / self.step
            duties = [
                servo.drive(now, place, speed)
                for servo, place, speed in zip(
                    self.servos, places.tolist(), speeds.tolist(), strict=True
                )
            ]
            driven = np.array([duty is not None for duty in duties])
            self.plant.push(np.array([duty or 0.0 for duty in duties]), driven)
            if turn % round(TIMESTEP / TURN) == 1:
                angles.append(self.plant.angles)
        return np.array(angles)


def robot_with(gain: int) -> Robot:
    servo = load_servo("xl330-m288-t")
    drive = servo.drive.model_copy(update={"gain": float(gain), "lift": 0.0})
    return iphonoid().with_servo(servo.model_copy(update={"drive": drive}))


@pytest.mark.parametrize("gain", [400, 3200])
def test_a_move_is_the_simulated_bodys(gain: int) -> None:
    """All joints at once, both ways; whole encoder steps and the finer control make 1.4 steps."""
    robot = robot_with(gain)
    joints, plant = Joints(robot, gain), Plant(robot)
    joints.run(0.5)
    start = np.array([servo.get("goal_position") for servo in joints.servos])
    rest = np.tile((start - MIDDLE) * robot.servo.step, (250, 1))
    plant.advance(rest, robot.servo.model.motor_torque)
    way = np.array([300, 400, -200, 150, 400, 200, -150, 100])
    began = joints.plant.time * 1e6
    for servo, to in zip(joints.servos, (start + way).tolist(), strict=True):
        servo.write(108, (50).to_bytes(4, "little") + (60).to_bytes(4, "little"), began)
        servo.write(116, to.to_bytes(4, "little"), began)
    profile = Profile.plan(
        np.abs(way),
        np.full(8, round(60 * SPEED_UNIT * FINE)),
        np.full(8, round(50 * ACCELERATION_UNIT)),
    )
    times = np.arange(1, 501)[:, None] * round(TIMESTEP * 1e6)
    there = start + np.sign(way) * profile.position(times) / FINE
    emulated = joints.run(1.0)
    simulated = []
    for row in (there - MIDDLE) * robot.servo.step:
        plant.advance(row[None], robot.servo.model.motor_torque)
        simulated.append(plant.angles)
    assert np.abs(emulated - simulated).max() < 2 * robot.servo.step
    assert np.abs(emulated - emulated[0]).max() > 0.4


def test_without_torque_the_head_sinks_and_with_a_ceiling_it_is_held() -> None:
    joints = Joints(robot_with(3200), 3200)
    joints.run(0.3)
    held = joints.plant.angles[7]
    joints.servos[7].write(100, (221).to_bytes(2, "little"), 0.3e6)  # the hold's 0.12 N·m
    joints.run(1.0)
    assert abs(joints.plant.angles[7] - held) < 0.002
    joints.servos[7].write(64, b"\0", 1.3e6)
    joints.run(1.0)
    assert abs(joints.plant.angles[7] - held) > 0.2
