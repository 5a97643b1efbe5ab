"""A body that still swings from its last move is no contact when the next one begins."""

import numpy as np
import pytest

from miburi.robot import Robot
from miburi.robot.loads import loads
from miburi.safety.controller import Controller
from miburi.safety.free import FreeRule
from miburi.safety.profile import FINE, to_steps
from miburi.safety.stop import Phase
from miburi.servos import Axis

READING = 0.02


class Swinging:
    """A body whose waist, at rest until then, is knocked by ``torque`` N·m for 30 ms."""

    def __init__(self, robot: Robot, torque: float) -> None:
        self.robot = robot
        self.controller = Controller(robot, FreeRule.of(robot), to_steps(robot, robot.neutral))
        self.waist = Axis(robot.servo.model, float(loads(robot, robot.neutral).inertia[0]))
        self.time = 0
        self.pass_on()
        self.waist.load = torque
        self.turn(0.01)
        self.pass_on()
        self.waist.load = 0.0

    @property
    def positions(self) -> np.ndarray:
        steps = to_steps(self.robot, self.robot.neutral)
        steps[0] += round(self.waist.angle / self.robot.servo.step)
        return steps

    def turn(self, seconds: float) -> None:
        """Let the waist go on."""
        for _ in range(round(seconds / 0.001)):
            goal = self.controller.setpoint(self.time)[0] * self.robot.servo.step / FINE
            self.waist.advance(float(goal - self.robot.neutral[0]), 0.001)
            self.time += 1000

    def pass_on(self) -> None:
        """Let the time of a reading pass."""
        self.turn(READING)
        self.controller.update(self.positions, self.time)


@pytest.mark.parametrize(
    ("turn", "torque", "late"),
    [
        (turn, torque, 0.012 * (turn * torque >= 0))
        for turn in (-0.4, 0.0, 0.4)
        for torque in (-0.3, 0.3)
    ],
)
def test_a_waist_that_still_swings_is_no_contact(
    robot: Robot, turn: float, torque: float, late: float
) -> None:
    """The order comes just after a reading, or on the way to the next one."""
    body = Swinging(robot, torque)
    for _ in range(3):  # it goes back through its place at 700 steps/s
        body.pass_on()
    assert body.controller.phase is Phase.IDLE
    read = body.positions
    body.turn(late)
    goals = robot.neutral + turn * np.eye(8)[0]
    body.controller.start(Phase.MOVING, to_steps(robot, goals), np.full(8, 500), read, body.time)
    for _ in range(60):
        body.pass_on()
        assert body.controller.latched is None
