"""A simulated body with the real firmware in the loop, without hardware.

The chain is::

    host ◀─ link ─▶ the card's binary ◀─ servo bus ─▶ emulated servos ◀─▶ physics

:class:`EmulatedBody` is used like :class:`~miburi.bodies.simulated.Simulated`, and a hand can be
put in its way, too. Its card is a :class:`miburi.emulation.firmware.EmulatedCard`.
"""

import numpy as np

from miburi.bodies.base import BodyState, Touch
from miburi.bodies.plant import Plant
from miburi.card.card import Card, wake
from miburi.card.settings import CardSettings, JointSettings
from miburi.emulation.bus import Bus
from miburi.emulation.firmware import EmulatedCard
from miburi.emulation.servos import Servo, Shaft
from miburi.robot import Array, Robot
from miburi.robot.specimens import Specimen
from miburi.safety.contact import Rule
from miburi.safety.profile import to_steps

#: The period of both the servos' control and the physics, in s.
_TURN = 0.001


class _Joint(Shaft):
    """A servo's shaft, simulated as a joint of the physics model."""

    def __init__(self, plant: Plant, motor: int, settings: JointSettings, step: float) -> None:
        super().__init__()
        self._plant, self._motor, self._settings, self._step = plant, motor, settings, step

    def position(self, servo: Servo, time: float) -> float:  # noqa: ARG002  (as Shaft has it)
        angle = float(self._plant.angles[self._motor])
        return self._settings.zero + self._settings.direction * angle / self._step

    def speed(self, servo: Servo, time: float) -> float:  # noqa: ARG002  (as Shaft has it)
        return self._settings.direction * float(self._plant.velocities[self._motor]) / self._step

    def drive(self, servo: Servo, time: float, angle: float, velocity: float) -> float | None:
        """Return the duty at which the servo drives the joint; None with torque off.

        ``angle`` and ``velocity`` are those of the joint, in rad and rad/s.
        """
        settings, step = self._settings, self._step
        place = settings.zero + settings.direction * angle / step
        duty = servo.drive(time, place, settings.direction * velocity / step)
        return None if duty is None else settings.direction * duty


class _World:
    """Keeps the physics in step with the card's clock."""

    def __init__(self, plant: Plant, servos: list[Servo], joints: list[_Joint]) -> None:
        self._plant, self._servos, self._joints = plant, servos, joints
        self.touch = Touch()  # what has touched the body since this was last replaced

    def advance(self, time: float) -> None:
        while (self._plant.time + _TURN) * 1e6 <= time:
            now = (self._plant.time + _TURN) * 1e6
            angles, velocities = self._plant.angles.tolist(), self._plant.velocities.tolist()
            duties = [
                joint.drive(servo, now, angle, velocity)
                for joint, servo, angle, velocity in zip(
                    self._joints, self._servos, angles, velocities, strict=True
                )
            ]
            driven = np.array([duty is not None for duty in duties])
            push = np.array([duty or 0.0 for duty in duties])
            self.touch = self.touch.then(self._plant.push(push, driven))


class EmulatedRobot(EmulatedCard):
    """A card whose servos move the joints of a simulated robot; it starts at neutral.

    Attributes
    ----------
    plant, world
        The physics, and the object that keeps it in step with the card's clock.
    """

    def __init__(
        self, robot: Robot, settings: CardSettings, specimen: Specimen | None = None
    ) -> None:
        true = specimen or Specimen(robot, start_delay=0.0, clock=1.0)
        self.plant = Plant(true.robot)
        self.plant.model.opt.timestep = _TURN
        joints = [
            _Joint(self.plant, motor, joint, robot.servo.step)
            for motor, joint in enumerate(settings.joints)
        ]
        servos = [
            Servo.new(of_joint.servo, shaft=joint, model=true.robot.servo.model)
            for of_joint, joint in zip(settings.joints, joints, strict=True)
        ]
        # The servos are configured as a card configures them, so that the body does not sag before
        # the emulated card starts.
        goals = to_steps(robot, self.plant.data.ctrl).tolist()
        for servo, joint, goal in zip(servos, settings.joints, goals, strict=True):
            servo.start_delay, servo.clock = true.start_delay * 1e6, true.clock
            servo.set("return_delay", 25)
            servo.set("operating_mode", 3)
            servo.set("position_p_gain", settings.general.p_gain)
            servo.set("position_d_gain", settings.general.d_gain)
            servo.set("goal_position", joint.zero + joint.direction * goal)
            servo.write(64, b"\x01", 0.0)
        self.world = _World(self.plant, servos, joints)
        super().__init__(Bus(servos), self.world)


class EmulatedBody(Card):
    """A card and eight servos in virtual time, awake and at neutral.

    ``rule`` is the card's contact rule, by default the robot's own. ``specimen`` is the actual
    robot, which may differ from its description; by default it does not.

    Raises
    ------
    BodyError
        The firmware or the emulated processor has not been built (``make firmware``).
    """

    def __init__(
        self, robot: Robot, rule: Rule | None = None, specimen: Specimen | None = None
    ) -> None:
        settings = CardSettings.of(robot, rule)
        self.emulation = EmulatedRobot(robot, settings, specimen)
        self._world, self._plant = self.emulation.world, self.emulation.plant
        super().__init__(lambda: self.emulation, robot, settings)
        self.step(1.0)  # the body sinks a little when the servos take its weight
        wake(self)
        self._due = self._exchange.now()
        self._history.start_clock(self._due)

    @property
    def touchable(self) -> "EmulatedBody":
        """Return the body itself, since a hand can be put in its way."""
        return self

    @property
    def touch(self) -> Touch:
        """What touched the body during the latest step."""
        touch = self._world.touch
        if touch.began is None:
            return touch
        return Touch(touch.force, touch.began - self._history.began, touch.part, touch.itself)

    @property
    def configuration(self) -> tuple[Array, Array]:
        """True joint angles, (8,) rad, and the hand's pose, (7,): position in m, and quaternion."""
        return self._plant.angles, self._plant.hand

    def place_hand(self, position: Array, along: Array) -> None:
        """Put the human hand somewhere; see :meth:`miburi.bodies.Touchable.place_hand`."""
        self._plant.place_hand(position, along)

    def remove_hand(self) -> None:
        """Take the human hand away."""
        self._plant.remove_hand()

    def step(self, dt: float) -> BodyState:
        """Let ``dt`` seconds pass."""
        self._world.touch = Touch()
        return super().step(dt)
