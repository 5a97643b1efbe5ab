"""The physical robot of contact trials: varied servos, and a human hand on springs.

Unlike the simulated hand of :mod:`miburi.studies.experiment`, this hand has mass and hangs on
springs. It can give way, move towards the robot, or hold on to it, and the plant records the force
on it at every physics step.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from miburi.bodies import Touch
from miburi.bodies.plant import Plant
from miburi.robot import JOINTS, Array, Robot
from miburi.robot.mjcf import HAND_AWAY
from miburi.robot.physics import mujoco
from miburi.safety.profile import Steps


@dataclass(frozen=True)
class Variation:
    """The differences of one trial's robot from its description (our assumptions)."""

    voltage: float = 5.0  #: V of the battery
    #: Factor on the servos' dry friction and its growth with torque and load; one number for all
    #: servos, or eight.
    friction: float | tuple[float, ...] = 1.0
    load: float = 0.0  #: kg in each hand
    noise: float = 0.0  #: standard deviation of an encoder's reading, steps
    delay: int = 0  #: of a setpoint on its way to the servo, physics steps (2 ms)


@dataclass(frozen=True)
class Skin:
    """The mechanics of a human hand (our assumptions)."""

    stiffness: float  #: N/m, of the arm that holds it
    damping: float  #: N·s/m, of that arm
    softness: float  #: s, the time constant of a contact with it
    grip: float  #: friction coefficient


class TrialPlant(Plant):
    """The physical robot of trials, built once and varied for each.

    The code that drives it knows only the description, ``robot``; ``true`` is the actual robot, if
    it differs. Errors of its servos' clocks are not simulated. ``voltage``, in V, replaces the
    voltage of a variation.

    ``touched`` is the part that met the human first, and ``touched_at`` is the time in s at which
    they met. ``itself`` names two parts of the robot that met each other before a human touched the
    robot. Each is None if there was no such contact.
    """

    def __init__(
        self, robot: Robot, true: Robot | None = None, voltage: float | None = None
    ) -> None:
        self._rng = np.random.default_rng(0)
        self._variation = Variation()
        self._supply = voltage
        own = true or robot
        # The same duty gives a different torque in a different motor.
        self._stronger = own.servo.model.motor_torque / robot.servo.model.motor_torque
        super().__init__(own, sprung_hand=True)
        self.robot = robot
        model = self.model
        self._base = {name: np.array(getattr(model, name)) for name in _VARIED}
        joints = [model.joint(f"hand_{axis}") for axis in "xyz"]
        self._hand_joints = [joint.id for joint in joints]
        # The hand has only slides, so its dofs and positions have the same indices.
        self._slides = slice(int(joints[0].dofadr[0]), int(joints[-1].dofadr[0]) + 1)
        self._constraint: NDArray[np.float64] = self.data.qfrc_constraint[self._slides]
        self._nominal_friction = self.friction.copy()
        self._grasp = model.equality("grasp").id
        self._anchor = np.array(HAND_AWAY)

    def begin(self, pose: Array, variation: Variation, rng: np.random.Generator) -> None:
        """Begin a trial: a robot of this variation rests in ``pose``, with no hand near.

        ``pose`` has shape (8,), in rad; ``rng`` makes the encoders' noise.
        """
        model = self.model
        for name, values in self._base.items():
            getattr(model, name)[:] = values
        self.voltage = self._supply or variation.voltage
        self.friction[:] = self._nominal_friction
        self.friction[:, :_TORQUES] *= np.reshape(variation.friction, (-1, 1))
        for side in ("right", "left"):
            _load(model, side, variation.load)
        mujoco.mj_setConst(model, self.data)
        self._variation, self._rng = variation, rng
        self.anchor = np.array(HAND_AWAY)
        self.rest(pose)

    def rest(self, pose: Array, settle: float = 0.15) -> None:
        """Start again at rest; see :meth:`Plant.rest`."""
        super().rest(pose, settle)
        self._pushes: list[Array] = []
        self.touched: str | None = None
        self.touched_at: float | None = None
        self.itself: tuple[str, str] | None = None
        self._late = np.repeat(pose[None], self._variation.delay, axis=0)

    @property
    def forces(self) -> Array:
        """The force between human and robot at each physics step since :meth:`begin`, (n,) in N."""
        x, y, z = np.array(self._pushes).reshape(-1, 3).T
        return np.sqrt(x * x + y * y + z * z)

    @property
    def anchor(self) -> Array:
        """Where the person holds the hand, shape (3,), in m: the rest point of its springs."""
        return self._anchor

    @anchor.setter
    def anchor(self, position: Array) -> None:
        self._anchor = position
        self.model.qpos_spring[self._slides] = position

    @property
    def hand(self) -> Array:
        """The human hand's pose, (7,): its position in m, and a quaternion."""
        return np.concatenate([self.data.qpos[self._slides], self.model.geom_quat[self._hand]])

    def offer_hand(self, position: Array, along: Array, velocity: Array, skin: Skin) -> None:
        """Put a person's hand at ``position``, (3,) in m, with ``velocity``, (3,) in m/s."""
        model, data = self.model, self.data
        geom = self._hand
        model.jnt_stiffness[self._hand_joints] = skin.stiffness
        model.dof_damping[self._slides] = skin.damping
        model.geom_solref[geom, 0] = skin.softness
        model.geom_friction[geom, 0] = skin.grip
        mujoco.mju_quatZ2Vec(model.geom_quat[self._hand], along / np.linalg.norm(along))
        data.qpos[self._slides], data.qvel[self._slides] = position, velocity
        self.anchor = position

    def path(self, body: str, local: Array, axis: Array, poses: Array) -> tuple[Array, Array]:
        """Return the path of a point on a link, in m, and the link's axis along it, both (n, 3).

        ``local`` and ``axis``, (3,), are the point and the axis in the frame of the model's
        ``body``. ``poses``, (n, 8), are in rad.
        """
        points, axes = np.empty((len(poses), 3)), np.empty((len(poses), 3))
        number = self.model.body(body).id
        self.data.qpos[self._plays] = 0.0
        for row, pose in enumerate(poses):
            self.data.qpos[self.joints] = pose
            mujoco.mj_kinematics(self.model, self.data)
            frame = self.data.xmat[number].reshape(3, 3)
            points[row] = self.data.xpos[number] + frame @ local
            axes[row] = frame @ axis
        return points, axes

    def overlaps(self) -> bool:
        """Whether the hand and the robot overlap now."""
        mujoco.mj_fwdPosition(self.model, self.data)
        return any(self._hand in (c.geom1, c.geom2) for c in self.data.contact)

    def grasp(self, link: str, point: Array, skin: Skin) -> None:
        """Make the person hold on to a ``link`` at ``point``, (3,) in m, in the link's frame."""
        model, data = self.model, self.data
        body = model.body(link).id
        mujoco.mj_kinematics(model, data)
        place = data.xpos[body] + data.xmat[body].reshape(3, 3) @ point
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_comPos(model, data)
        mujoco.mj_jac(model, data, jacobian, None, place, body)
        # The hand closes at the link's speed, without an impact.
        self.offer_hand(place, np.array([0.0, 0.0, 1.0]), jacobian @ data.qvel, skin)
        model.geom_contype[self._hand] = model.geom_conaffinity[self._hand] = 0
        model.eq_obj2id[self._grasp] = body
        model.eq_data[self._grasp, :3], model.eq_data[self._grasp, 3:6] = 0.0, point
        data.eq_active[self._grasp] = 1
        self.touched, self.touched_at = link, self.time

    def power(self, torque: Array | float) -> None:
        """Power the servos; see :meth:`Plant.power`. ``torque`` is that of the described motor."""
        super().power(torque * self._stronger)

    def encoders(self) -> Steps:
        """Return the encoders' counts, (8,) steps, with their noise."""
        noise = self._variation.noise * self._rng.standard_normal(len(JOINTS))
        steps: Steps = np.rint(self.angles / self.robot.servo.step + noise).astype(np.int64)
        return steps

    def advance(self, setpoints: Array, torque: Array | float) -> Touch:
        """Let the servos follow ``setpoints``; see :meth:`Plant.advance`."""
        data = self.data
        self.power(torque)
        if self._variation.delay:
            queue = np.concatenate([self._late, setpoints])
            setpoints, self._late = queue[: len(setpoints)], queue[len(setpoints) :]
        control, constraint, note = data.ctrl, self._constraint, self._pushes.append
        for setpoint in setpoints:
            control[:] = self.ordered(setpoint)
            self.step()
            note(constraint.copy())
            if data.ncon and self.touched_at is None:
                self._note_contacts()
        return _NO_TOUCH

    def _note_contacts(self) -> None:
        for contact in self.data.contact:
            pair = (contact.geom1, contact.geom2)
            if self._hand not in pair:
                self.itself = (self.model.geom(pair[0]).name, self.model.geom(pair[1]).name)
            elif self.touched is None:
                self.touched = self.model.geom(pair[0] if pair[1] == self._hand else pair[1]).name
                self.touched_at = self.time


#: The plant records touches itself, and reports none to the body.
_NO_TOUCH = Touch()

#: The fields of the model that trials vary.
_VARIED = (
    "dof_damping", "jnt_stiffness", "body_mass", "body_inertia", "body_ipos", "geom_quat",
    "geom_solref", "geom_friction", "geom_contype", "geom_conaffinity", "eq_obj2id", "eq_data",
)  # fmt: skip
#: The first four of a servo's friction constants are torques, or shares of a torque.
_TORQUES = 4


def _load(model: Any, side: str, mass: float) -> None:
    """Put a load of ``mass`` kg into a hand of the robot, as a point mass."""
    if not mass:
        return
    body = model.body(f"{side}_forearm").id
    tip = np.array(model.site(side).pos)
    old, centre = float(model.body_mass[body]), np.array(model.body_ipos[body])
    # The load lies along the forearm, so only the inertia across it grows.
    arm = float(np.linalg.norm(tip - centre))
    across = old * mass / (old + mass) * arm**2
    inertia = model.body_inertia[body]
    inertia[inertia > inertia.min()] += across
    model.body_mass[body] = old + mass
    model.body_ipos[body] = (old * centre + mass * tip) / (old + mass)
