"""The robot's physics in MuJoCo: joints with servos, and a human hand that can get in the way.

What moves it (the simulated body's controller, or emulated servos on a card's bus) sees encoder
positions only; what only a simulation can know, such as forces, is told apart, in
:class:`Touch`.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from miburi.bodies.base import Body
from miburi.errors import InputError
from miburi.motion import Steps, to_steps
from miburi.physics import mujoco
from miburi.robot import JOINTS, Array, Robot
from miburi.robot.mjcf import HAND_AWAY, TIMESTEP, to_mjcf


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


class Tangible(Body, Protocol):
    """A body in a simulation: a hand can be put in its way, and what happened is known."""

    @property
    def touch(self) -> Touch:
        """What happened to the body during the latest step."""

    @property
    def configuration(self) -> tuple[Array, Array]:
        """True joint angles (8,) rad, and the human hand's pose (7,): m and quaternion."""

    def place_hand(self, position: Array, along: Array) -> None:
        """Put the human hand somewhere; see :meth:`Plant.place_hand`."""

    def remove_hand(self) -> None:
        """Take the human hand away."""


class Plant:
    """The robot in MuJoCo, at rest at neutral when made.

    Attributes
    ----------
    touch
        What happened since :meth:`forget_touch`.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._model = mujoco.MjModel.from_xml_string(to_mjcf(robot))
        self._data = mujoco.MjData(self._model)
        joints = [self._model.joint(name) for name in JOINTS]
        self._qpos = np.array([joint.qposadr[0] for joint in joints])
        self._dof = np.array([joint.dofadr[0] for joint in joints])
        self._hand = self._model.geom("hand").id
        self._data.qpos[self._qpos] = robot.neutral
        self._data.ctrl[:] = robot.neutral
        # The servos have pulled before the story begins: let them settle under gravity.
        mujoco.mj_step(self._model, self._data, nstep=round(0.5 / TIMESTEP))
        self._start = self._data.time
        self.touch = Touch()

    @property
    def time(self) -> float:
        """Return s since the start."""
        return float(self._data.time - self._start)

    @property
    def angles(self) -> Array:
        """True joint angles, (8,) rad."""
        angles: Array = self._data.qpos[self._qpos].copy()
        return angles

    @property
    def velocities(self) -> Array:
        """True joint velocities, (8,) rad/s."""
        velocities: Array = self._data.qvel[self._dof].copy()
        return velocities

    @property
    def encoders(self) -> Steps:
        """What the encoders read, (8,) steps."""
        return to_steps(self._robot, self._data.qpos[self._qpos])

    @property
    def configuration(self) -> tuple[Array, Array]:
        """True joint angles (8,) rad, and the human hand's pose (7,): m and quaternion."""
        hand = np.concatenate([self._data.mocap_pos[0], self._data.mocap_quat[0]])
        return self.angles, hand

    def limit(self, torque: Array | float) -> None:
        """Limit the servos' torque to (8,) N·m or the same for all."""
        self._model.actuator_forcerange[:, 1] = torque
        self._model.actuator_forcerange[:, 0] = np.negative(torque)

    def drive(self, goal: Array) -> None:
        """Let one time step pass with the servos' setpoints at ``goal`` (8,) rad."""
        self._data.ctrl[:] = goal
        mujoco.mj_step(self._model, self._data)
        if self._data.ncon:
            force, part, itself = self._touched()
            was = self.touch
            began, largest = was.began, was.force
            if part is not None:
                began = self.time if began is None else began
                largest = max(largest, force)
            self.touch = Touch(largest, began, part or was.part, was.itself or itself)

    def forget_touch(self) -> None:
        """Begin a new step."""
        self.touch = Touch()

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
