"""Robot, servos and a human hand in MuJoCo: the physics alone, without the contact rule.

A servo follows its setpoint with limited torque and reports its angle in encoder steps. Quantities
that only a simulation knows, such as forces, are reported in :class:`~miburi.bodies.Touch`.

MuJoCo models the position control, its limit and the back EMF (see :mod:`miburi.servos.voltage`).
Dry friction is updated from the torques at every physics step, and the supply's voltage from the
currents at every reading. Where gears have play, the encoder sits behind them, at the horn; back
EMF and most of the friction act at the motor. The friction at the motor follows the load at the
horn, even while backlash keeps the teeth apart. This module leaves out the servo's control rate,
its rounding to encoder steps, and the ramp of its PWM; :class:`miburi.servos.Axis` models them.
"""

import numpy as np
from numpy.typing import NDArray

from miburi.bodies.base import Touch
from miburi.errors import DescriptionError, InputError
from miburi.robot import JOINTS, Array, Robot
from miburi.robot.mjcf import HAND_AWAY, HORN, PLAY, TIMESTEP, to_mjcf
from miburi.robot.physics import mujoco
from miburi.robot.shape import BASE
from miburi.safety.drive import aim
from miburi.safety.profile import Steps, to_steps

#: How far parts may overlap at neutral, in m, since their shapes only approximate the robot's (our
#: choice).
_DEEP = 0.001
#: The clearance between a placed hand and the trunk, in m (our choice). Both are rigid: if they
#: touched, rounding errors alone would decide the force between them.
_CLEAR = 0.0002


class Plant:
    """The simulated robot, at rest in neutral; :meth:`rest` starts over in any pose.

    ``sprung_hand`` says whether the human hand hangs on springs, as in trials, or stays where it is
    placed.

    Raises
    ------
    DescriptionError
        At neutral, parts of the robot are inside each other, or in the table.
    """

    def __init__(self, robot: Robot, *, sprung_hand: bool = False) -> None:
        self.robot = robot
        self.model = mujoco.MjModel.from_xml_string(to_mjcf(robot, sprung_hand=sprung_hand))
        self.data = mujoco.MjData(self.model)
        self.joints = np.array([self.model.joint(name).qposadr[0] for name in JOINTS])
        self._dofs = np.array([self.model.joint(name).dofadr[0] for name in JOINTS])
        # A hinge has the same index in qpos and in qvel here.
        self._plays = self._dofs[:0]
        if robot.servo.model.loop.backlash:
            self._plays = np.array([self.model.joint(PLAY + name).dofadr[0] for name in JOINTS])
        #: MuJoCo's rows for the motors' dry friction; no other joint has dry friction.
        self._rows = self._dofs.argsort().argsort()
        # Views of MuJoCo's own memory, which never moves.
        self._positions: Array = self.data.qpos
        self._control: Array = self.data.ctrl
        self._gain: Array = self.model.actuator_gainprm[:, 0]
        #: Which motors :meth:`push` drives by their duty; None before the first push.
        self._driven: NDArray[np.bool_] | None = None
        self._hand = self.model.geom("hand").id
        #: The parts that a placed hand is kept out of; a sprung hand gives way by itself.
        trunk = [] if sprung_hand else [self.model.body(name).id for name in (BASE, "torso")]
        self._trunk = np.flatnonzero(np.isin(self.model.geom_bodyid, trunk))
        self._start = 0.0
        self._servo = servo = robot.servo.model
        #: The supply's voltage when nothing draws current, V.
        self.voltage = servo.supply.voltage
        #: Constants of the dry friction of each servo and its horn, (8, 6).
        self.friction = np.array([servo.friction.row] * len(JOINTS))
        self._braking = np.full(len(JOINTS), servo.damping - servo.friction.viscous)
        self._stiffness, self._damping = servo.stiffness, servo.control_damping
        #: At torque T and voltage U, the supply's voltage drops by k T² / U; this is k, in
        #: V²/(N·m)².
        motor = servo.motor
        self._drop = servo.supply.resistance * motor.resistance / motor.torque_constant**2
        from miburi.servos.friction import set_friction  # it loads Numba

        self._set_friction = set_friction
        self._check_neutral()
        self.rest(robot.neutral)

    def _check_neutral(self) -> None:
        self.data.qpos[self.joints] = self.robot.neutral
        mujoco.mj_forward(self.model, self.data)
        deepest = min(self.data.contact, key=lambda contact: float(contact.dist), default=None)
        if deepest is None or deepest.dist > -_DEEP:
            return
        one, other = (
            self.model.geom(geom).name.replace("_", " ") for geom in (deepest.geom1, deepest.geom2)
        )
        raise DescriptionError(
            f"{self.robot.name}: at neutral the {one} and the {other} are "
            f"{-1000 * deepest.dist:.0f} mm inside one another. Change the joints' neutral "
            "angles or the lengths; a longer L01 raises the shoulders."
        )

    def rest(self, pose: Array, settle: float = 0.5) -> None:
        """Start over, at rest in ``pose`` (8,) rad, after gravity has pulled for ``settle`` s."""
        mujoco.mj_resetData(self.model, self.data)
        self._driven = None
        self.power(self._servo.motor_torque)
        rubbing = self.friction[:, :2].sum(axis=1)
        self._motors = self.friction
        if self._plays.size:  # the horn's share of the friction, behind the gears
            self.model.tendon_frictionloss[:] = HORN * rubbing
            self._motors = self.friction.copy()
            self._motors[:, :2] *= 1 - HORN
        self.model.dof_frictionloss[self._dofs] = self._motors[:, :2].sum(axis=1)
        self.data.qpos[self.joints] = pose
        goal = aim(self.robot, pose)
        for _ in range(round(settle / TIMESTEP)):
            self.data.ctrl[:] = self.ordered(goal)
            self.step()
        self.data.ctrl[:] = goal
        self._start = self.data.time

    @property
    def time(self) -> float:
        """Time since :meth:`rest` last ended, in s."""
        return float(self.data.time - self._start)

    @property
    def angles(self) -> Array:
        """True joint angles, (8,) rad."""
        angles: Array = self._positions.take(self.joints)
        return angles + self._positions.take(self._plays) if self._plays.size else angles

    @property
    def velocities(self) -> Array:
        """True joint velocities, (8,) rad/s."""
        velocities: Array = self.data.qvel[self._dofs]
        return velocities + self.data.qvel[self._plays] if self._plays.size else velocities

    @property
    def hand(self) -> Array:
        """The human hand's pose, (7,): its position in m, and a quaternion."""
        return np.concatenate([self.data.mocap_pos[0], self.data.mocap_quat[0]])

    def encoders(self) -> Steps:
        """Return the encoders' counts, (8,) steps."""
        return to_steps(self.robot, self.angles)

    def place_hand(self, position: Array, along: Array) -> None:
        """Put the middle of the human hand at ``position``, (3,) in m.

        ``along``, (3,), is the direction of the fingers, of any length except zero.

        A hand inside the trunk is moved out of it by the shortest way, since both are rigid.

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
        self.data.mocap_pos[0] = position
        mujoco.mju_quatZ2Vec(self.data.mocap_quat[0], np.asarray(along, dtype=np.float64) / length)
        self._leave_trunk()

    def _leave_trunk(self) -> None:
        """Move a hand that is inside a part of the trunk out of it, by the shortest way."""
        ends = np.empty(6)
        for _ in range(3):  # leaving one part may lead into the next
            for part in self._trunk:
                mujoco.mj_kinematics(self.model, self.data)
                inside = mujoco.mj_geomDistance(self.model, self.data, self._hand, part, 1.0, ends)
                if inside < 0:
                    out = ends[3:] - ends[:3]
                    self.data.mocap_pos[0] += out * (1 + _CLEAR / np.linalg.norm(out))

    def remove_hand(self) -> None:
        """Take the human hand away."""
        self.data.mocap_pos[0] = HAND_AWAY

    def power(self, torque: Array | float) -> None:
        """Power the servos from the supply's present voltage, each with its duty limited.

        ``torque`` says how far the duty is limited: it is the stall torque, in N·m, that the limit
        allows at nominal voltage, (8,) or one for all motors.
        """
        model = self.model
        strength = self.loaded_voltage / self._servo.supply.voltage
        model.actuator_gainprm[:, 0] = self._stiffness * strength
        model.actuator_biasprm[:, 1] = -self._stiffness * strength
        model.actuator_biasprm[:, 2] = -self._damping * strength
        most = torque * strength
        model.actuator_forcerange[:, 0] = -most
        model.actuator_forcerange[:, 1] = most

    @property
    def loaded_voltage(self) -> float:
        """The supply's voltage under the current that the motors draw, V."""
        force = self.data.actuator_force
        # The current from the supply is each motor's current times its duty.
        fed = float(force @ (force - self._braking * self.data.qvel.take(self._dofs)))
        return self.voltage - self._drop * max(fed, 0.0) / self.voltage

    def push(self, duties: Array, driven: NDArray[np.bool_]) -> Touch:
        """Let one physics step pass with the motors at ``duties`` (8,), −1 to 1.

        A motor that is not ``driven`` (8,) turns freely: no current flows, so only its gears brake
        it. After the first push, do not call :meth:`advance` on the same plant.
        """
        if self._driven is None or not np.array_equal(driven, self._driven):
            self._drive(driven)
        servo = self._servo
        self._gain[:] = servo.motor_torque * self.loaded_voltage / servo.supply.voltage
        self._control[:] = np.where(driven, duties, 0.0)
        self.step()
        return self._touch() if self.data.ncon else Touch()

    def _drive(self, driven: NDArray[np.bool_]) -> None:
        """Drive these motors (8,) by their duty alone."""
        model, servo = self.model, self._servo
        braking = servo.damping - servo.friction.viscous
        self._driven, self._braking = driven, np.where(driven, braking, 0.0)
        model.dof_damping[self._dofs] = servo.friction.viscous + self._braking
        model.actuator_biasprm[:] = 0.0
        model.actuator_forcerange[:, 0], model.actuator_forcerange[:, 1] = -np.inf, np.inf

    def step(self) -> None:
        """Let one physics step pass, then update dry friction from the torques."""
        model, data = self.model, self.data
        mujoco.mj_step(model, data)
        self._set_friction(
            model.dof_frictionloss, self._motors, self._braking, self._dofs, data.actuator_force,
            data.qvel, data.qfrc_bias, data.qfrc_constraint, data.efc_force, data.ne + self._rows,
        )  # fmt: skip

    def advance(self, setpoints: Array, torque: Array | float) -> Touch:
        """Let the servos follow ``setpoints``, (n, 8) rad, one row for each physics step.

        ``torque`` in N·m limits their duty; see :meth:`power`.
        """
        touch = Touch()
        self.power(torque)
        control = self.data.ctrl
        for setpoint in setpoints:
            control[:] = self.ordered(setpoint)
            self.step()
            if self.data.ncon:
                touch = touch.then(self._touch())
        return touch

    def ordered(self, setpoint: Array) -> Array:
        """Return the setpoint that the motors need so that the horns reach ``setpoint``."""
        return setpoint - self._positions.take(self._plays) if self._plays.size else setpoint

    def _touch(self) -> Touch:
        """Return the force on the hand (N), the part it met, and any two robot parts that met."""
        total, part, itself = np.zeros(3), None, None
        wrench = np.zeros(6)
        for index, contact in enumerate(self.data.contact):
            pair = (contact.geom1, contact.geom2)
            if self._hand in pair:
                mujoco.mj_contactForce(self.model, self.data, index, wrench)
                sign = 1.0 if pair[0] == self._hand else -1.0
                total += sign * (contact.frame.reshape(3, 3).T @ wrench[:3])
                part = self.model.geom(pair[0] if pair[1] == self._hand else pair[1]).name
            else:
                itself = (self.model.geom(pair[0]).name, self.model.geom(pair[1]).name)
        force = float(np.linalg.norm(total))
        return Touch(force, None if part is None else self.time, part, itself)
