"""A physical body for everyone: MuJoCo under the card's own logic.

The servos follow their commanded profile with a lag, limited torque and encoder steps; every
part can touch every other, and a human hand can be put in the way. Stops are decided by the
:class:`~miburi.bodies.controller.Controller` from encoder positions alone: it never sees the
physics.
"""

from collections import deque

import numpy as np

from miburi.bodies.base import BodyState, Phase
from miburi.bodies.controller import Controller
from miburi.bodies.plant import Plant, Touch
from miburi.contact import Rule
from miburi.motion import FINE, SECOND, Move, Steps, to_steps
from miburi.robot import Array, Robot
from miburi.robot.mjcf import TIMESTEP

#: Physics steps between two readings of the encoders: 10 ms, as a servo bus allows.
_SUBSTEPS = 5
_READING = TIMESTEP * _SUBSTEPS
#: Readings over which velocities are measured: 50 ms.
_VELOCITY_READINGS = 5


class Simulated:
    """The robot in MuJoCo; a :class:`~miburi.bodies.Body`.

    Parameters
    ----------
    robot
        The description to build from.
    rule
        Period, ratio and guards of the contact rule; by default the robot's own.
    """

    def __init__(self, robot: Robot, rule: Rule | None = None) -> None:
        self._robot = robot
        self._plant = Plant(robot)
        self._readings = 0
        self._wanted = 0.0
        goal = to_steps(robot, robot.neutral)
        self._controller = Controller(robot, rule or Rule.of(robot), goal)
        self._history: deque[Steps] = deque(maxlen=_VELOCITY_READINGS + 1)
        self._history.append(self._plant.encoders)

    @property
    def robot(self) -> Robot:
        """The description that the body was built from."""
        return self._robot

    @property
    def state(self) -> BodyState:
        """The latest state, as the encoders tell it."""
        span = (len(self._history) - 1) * _READING
        step = self._robot.servo.step
        moved = np.multiply(self._history[-1] - self._history[0], step, dtype=np.float64)
        return BodyState(
            time=self._readings * _READING,
            angles=np.multiply(self._history[-1], step, dtype=np.float64),
            velocities=moved / max(span, _READING),
            phase=self._controller.phase,
            stop=self._controller.latched,
        )

    @property
    def touch(self) -> Touch:
        """What happened to the body during the latest step."""
        return self._plant.touch

    @property
    def configuration(self) -> tuple[Array, Array]:
        """True joint angles (8,) rad, and the human hand's pose (7,): m and quaternion."""
        return self._plant.configuration

    def move(self, move: Move) -> None:
        """Start a move; see :meth:`miburi.bodies.Body.move`."""
        self._controller.move(move, self._plant.encoders, self._clock)

    def stop(self) -> None:
        """Stop all motors and hold softly until released."""
        self._controller.stop(self._plant.encoders, self._clock)

    def release(self) -> None:
        """End a stop; see :meth:`miburi.bodies.Body.release`."""
        self._controller.release(self._plant.encoders, self._clock)

    def place_hand(self, position: Array, along: Array) -> None:
        """Put the human hand somewhere; see :meth:`Plant.place_hand`."""
        self._plant.place_hand(position, along)

    def remove_hand(self) -> None:
        """Take the human hand away."""
        self._plant.remove_hand()

    def step(self, dt: float) -> BodyState:
        """Let ``dt`` seconds pass; encoders are read every 10 ms, and remainders add up."""
        self._wanted += dt
        self._plant.forget_touch()
        while (self._readings + 1) * _READING <= self._wanted + 1e-9:
            controller = self._controller
            controller.update(self._history[-1], self._clock)
            stopped = controller.phase is Phase.STOPPED
            torque = self._robot.servo.hold_torque if stopped else self._robot.servo.stall_torque
            self._plant.limit(torque)
            times = self._clock + _SUBTIMES
            goals = controller.setpoint(times) * (self._robot.servo.step / FINE)
            for goal in goals:
                self._plant.drive(goal)
            self._readings += 1
            self._history.append(self._plant.encoders)
        return self.state

    @property
    def _clock(self) -> int:
        return self._readings * round(_READING * SECOND)


_SUBTIMES = (np.arange(1, _SUBSTEPS + 1, dtype=np.int64) * round(TIMESTEP * SECOND))[:, None]
