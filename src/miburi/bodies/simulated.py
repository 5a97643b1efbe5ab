"""A physical body for everyone: MuJoCo under the card's own logic.

The servos follow their commanded profile with a lag, limited torque and encoder steps; every
part can touch every other, and a human hand can be put in the way. Stops are decided by the
:class:`~miburi.bodies.controller.Controller` from encoder positions alone: it never sees the
physics. What only a simulation can know, such as forces, is told apart, in :class:`Touch`.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

from miburi.bodies.base import BodyState, Phase
from miburi.bodies.controller import Controller
from miburi.contact import Rule, Window
from miburi.errors import InputError
from miburi.motion import FINE, SECOND, Move, Steps, to_steps
from miburi.physics import mujoco
from miburi.robot import JOINTS, Array, Robot
from miburi.robot.mjcf import HAND_AWAY, TIMESTEP, to_mjcf

#: Physics steps between two readings of the encoders: 10 ms, as a servo bus allows.
_SUBSTEPS = 5
_READING = TIMESTEP * _SUBSTEPS
#: Readings over which velocities are measured: 50 ms.
_VELOCITY_READINGS = 5


@dataclass(frozen=True)
class Touch:
    """What happened to the body during the latest step; known to the simulation alone.

    Attributes
    ----------
    force
        Largest force between human hand and robot, N.
    began
        First moment of that contact in the step, s; None without one.
    part
        The robot's part that was touched last; None without a contact.
    itself
        Two parts of the robot that met, or None.
    """

    force: float = 0.0
    began: float | None = None
    part: str | None = None
    itself: tuple[str, str] | None = None


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
        self._model = mujoco.MjModel.from_xml_string(to_mjcf(robot))
        self._data = mujoco.MjData(self._model)
        self._qpos = np.array([self._model.joint(name).qposadr[0] for name in JOINTS])
        self._hand = self._model.geom("hand").id
        self._table = self._model.geom("table").id
        self._data.qpos[self._qpos] = robot.neutral
        self._data.ctrl[:] = robot.neutral
        # The servos have pulled before the story begins: let them settle under gravity.
        mujoco.mj_step(self._model, self._data, nstep=round(0.5 / TIMESTEP))
        self._start = self._data.time
        self._readings = 0
        self._wanted = 0.0
        goal = to_steps(robot, robot.neutral)
        self._controller = Controller(robot, rule or Rule.of(robot), goal)
        self._history: deque[Steps] = deque(maxlen=_VELOCITY_READINGS + 1)
        self._history.append(self._encoders())
        self.touch = Touch()

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
    def window(self) -> Window | None:
        """What the contact rule compared at its latest look, or None before the first."""
        return self._controller.window

    @property
    def configuration(self) -> tuple[Array, Array]:
        """True joint angles (8,) rad, and the human hand's pose (7,): m and quaternion."""
        hand = np.concatenate([self._data.mocap_pos[0], self._data.mocap_quat[0]])
        return self._data.qpos[self._qpos].copy(), hand

    def move(self, move: Move) -> None:
        """Start a move; see :meth:`miburi.bodies.Body.move`."""
        self._controller.move(move, self._encoders(), self._clock)

    def stop(self) -> None:
        """Stop all motors and hold softly until released."""
        self._controller.stop(self._encoders(), self._clock)

    def release(self) -> None:
        """End a stop; see :meth:`miburi.bodies.Body.release`."""
        self._controller.release(self._encoders(), self._clock)

    def place_hand(self, position: Array, along: Array) -> None:
        """Put the human hand somewhere; move it there in small steps or through free space.

        Parameters
        ----------
        position
            (3,) m, its middle.
        along
            (3,), the direction of the fingers; any length but zero.

        Raises
        ------
        InputError
            A value is not finite, or ``along`` has no length.
        """
        length = float(np.linalg.norm(along))
        if not (np.all(np.isfinite(position)) and np.isfinite(length) and length > 0):
            raise InputError(
                f"a hand needs a finite position and direction, got {position}, {along}."
            )
        self._data.mocap_pos[0] = position
        mujoco.mju_quatZ2Vec(self._data.mocap_quat[0], np.asarray(along, dtype=np.float64) / length)

    def remove_hand(self) -> None:
        """Take the human hand away."""
        self._data.mocap_pos[0] = HAND_AWAY

    def step(self, dt: float) -> BodyState:
        """Let ``dt`` seconds pass; encoders are read every 10 ms, and remainders add up."""
        self._wanted += dt
        force, began, part, itself = 0.0, None, None, None
        while (self._readings + 1) * _READING <= self._wanted + 1e-9:
            controller = self._controller
            controller.update(self._history[-1], self._clock)
            stopped = controller.phase is Phase.STOPPED
            torque = self._robot.servo.hold_torque if stopped else self._robot.servo.stall_torque
            self._model.actuator_forcerange[:] = (-torque, torque)
            times = self._clock + _SUBTIMES
            goals = controller.setpoint(times) * (self._robot.servo.step / FINE)
            for goal in goals:
                self._data.ctrl[:] = goal
                mujoco.mj_step(self._model, self._data)
                if self._data.ncon:
                    now, touched, met = self._touched()
                    itself = itself or met
                    if touched is not None:
                        began = self._data.time - self._start if began is None else began
                        part, force = touched, max(force, now)
            self._readings += 1
            self._history.append(self._encoders())
        self.touch = Touch(force, began, part, itself)
        return self.state

    @property
    def _clock(self) -> int:
        return self._readings * round(_READING * SECOND)

    def _encoders(self) -> Steps:
        return to_steps(self._robot, self._data.qpos[self._qpos])

    def _touched(self) -> tuple[float, str | None, tuple[str, str] | None]:
        """Force on the hand (N) and the part it met; and a pair of the robot's own parts."""
        total, part, itself = np.zeros(3), None, None
        wrench = np.zeros(6)
        for index, contact in enumerate(self._data.contact):
            pair = (contact.geom1, contact.geom2)
            if self._hand in pair:
                mujoco.mj_contactForce(self._model, self._data, index, wrench)
                sign = 1.0 if pair[0] == self._hand else -1.0
                total += sign * (contact.frame.reshape(3, 3).T @ wrench[:3])
                part = self._model.geom(pair[0] if pair[1] == self._hand else pair[1]).name
            else:
                itself = (self._model.geom(pair[0]).name, self._model.geom(pair[1]).name)
        return float(np.linalg.norm(total)), part, itself


_SUBTIMES = (np.arange(1, _SUBSTEPS + 1, dtype=np.int64) * round(TIMESTEP * SECOND))[:, None]
