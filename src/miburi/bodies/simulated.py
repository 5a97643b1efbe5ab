"""The simulated body: MuJoCo simulates the physics, and the card's logic controls it.

The servos follow their commanded profile with a lag, limited torque and encoder steps. All parts
of the robot can collide, and a human hand can be put in the way. The
:class:`~miburi.safety.controller.Controller` decides from encoder positions alone when to stop; it
does not see the physics in :class:`~miburi.bodies.plant.Plant`.
"""

from collections import deque
from dataclasses import replace
from math import ceil

import numpy as np

from miburi.bodies.base import BodyState, Motor, Motors, Touch
from miburi.bodies.plant import Plant
from miburi.robot import JOINTS, Array, Robot
from miburi.robot.mjcf import TIMESTEP
from miburi.safety.contact import Rule, Window
from miburi.safety.controller import Controller
from miburi.safety.drive import aim
from miburi.safety.move import Course, Move
from miburi.safety.profile import FINE, SECOND, Steps, to_steps
from miburi.safety.stop import Phase

#: Physics steps between two readings of the encoders: 10 ms, as fast as a servo bus allows.
_SUBSTEPS = 5
#: Period of the encoders' readings, s.
READING = TIMESTEP * _SUBSTEPS
#: Number of readings over which velocities are measured: 50 ms.
_VELOCITY_READINGS = 5
#: Number of readings for which setpoints are computed at once.
_AHEAD = 20


class Simulated:
    """The robot in MuJoCo; a :class:`~miburi.bodies.Body` that is its own ``touchable``.

    ``rule`` is the contact rule, by default the robot's own, ``FreeRule.of(robot)``. To vary one of
    its numbers: ``replace(FreeRule.of(robot), ratio=9000)``, with ``dataclasses.replace`` and
    :class:`miburi.safety.free.FreeRule`. The guards of ``Rule.of(robot)`` are too narrow for
    :class:`~miburi.safety.contact.Rule`: it stops free moves. ``plant`` is the physics, at rest in
    the pose that the servos hold; by default it is a new plant, at rest in neutral.
    """

    def __init__(
        self, robot: Robot, rule: Rule | None = None, *, plant: Plant | None = None
    ) -> None:
        self._robot = robot
        self._plant = plant or Plant(robot)
        self._readings = 0
        self._wanted = 0.0
        goal = to_steps(robot, self._plant.data.ctrl)
        from miburi.safety.free import FreeRule  # it loads Numba

        self._controller = Controller(robot, rule or FreeRule.of(robot), goal)
        self._history: deque[Steps] = deque(maxlen=_VELOCITY_READINGS + 1)
        self._history.append(self._plant.encoders())
        gears = 1 - robot.servo.model.friction.motor_load
        self._hold_torque = robot.servo.hold_torque / gears
        self._planned: tuple[object, int, Array] = (None, 0, np.empty((0, 8)))
        self._state = (self._readings, self._measure())
        self.touch = Touch()

    @property
    def robot(self) -> Robot:
        """The robot's description."""
        return self._robot

    @property
    def state(self) -> BodyState:
        """The latest state, as the encoders measure it."""
        of, state = self._state
        controller = self._controller
        if of != self._readings:
            state = self._measure()
        elif state.phase is not controller.phase or state.stop is not controller.latched:
            state = replace(state, phase=controller.phase, stop=controller.latched)
        self._state = (self._readings, state)
        return state

    def _measure(self) -> BodyState:
        """Return the state at the latest reading; it is kept, because many callers ask for it."""
        step, span = self._robot.servo.step, (len(self._history) - 1) * READING
        angles = np.multiply(self._history[-1], step, dtype=np.float64)
        moved = np.multiply(self._history[-1] - self._history[0], step, dtype=np.float64)
        velocities = moved / max(span, READING)
        for shared in (angles, velocities):
            shared.flags.writeable = False
        controller = self._controller
        return BodyState(
            self._readings * READING, angles, velocities, controller.phase, controller.latched
        )

    @property
    def phase(self) -> Phase:
        """What the body is doing; faster to read than the whole state."""
        return self._controller.phase

    @property
    def encoders(self) -> Steps:
        """The latest reading, (8,) steps."""
        return self._history[-1]

    @property
    def window(self) -> Window | None:
        """The contact rule's figures at its latest reading; None before the first."""
        return self._controller.window

    @property
    def touchable(self) -> "Simulated":
        """The body itself."""
        return self

    def motors(self) -> Motors:
        """Return the rule and the motors; a simulated motor has no temperature, voltage or id."""
        return Motors(tuple(Motor() for _ in JOINTS), self._controller.rule)

    @property
    def configuration(self) -> tuple[Array, Array]:
        """True joint angles, (8,) rad, and the hand's pose, (7,): position in m, and quaternion."""
        return self._plant.angles, self._plant.hand

    def move(self, move: Move) -> None:
        """Start a move; see :meth:`miburi.bodies.Body.move`."""
        aimed = replace(move, angles=aim(self._robot, move.angles))
        self._controller.move(aimed, self.encoders, self._clock)

    def course(self) -> Course:
        """Return where the motors' profiles are now."""
        controller, now = self._controller, self._clock
        return Course.of(self._robot, controller.setpoint(now), controller.speed(now))

    def stop(self) -> None:
        """Stop all motors and hold softly until released."""
        self._controller.stop(self.encoders, self._clock)

    def halt(self) -> None:
        """Do nothing: time stands still here while nobody steps the body."""

    def release(self) -> None:
        """End a stop; see :meth:`miburi.bodies.Body.release`."""
        self._controller.release(self.encoders, self._clock)

    def place_hand(self, position: Array, along: Array) -> None:
        """Put the human hand somewhere; see :meth:`miburi.bodies.Touchable.place_hand`."""
        self._plant.place_hand(position, along)

    def remove_hand(self) -> None:
        """Take the human hand away."""
        self._plant.remove_hand()

    def step(self, dt: float) -> BodyState:
        """Advance by ``dt`` s.

        Encoders are read every 10 ms; a remainder carries over to the next call.
        """
        self._wanted += dt
        self.touch = Touch()
        while (self._readings + 1) * READING <= self._wanted + 1e-9:
            self.touch = self.touch.then(self._next_reading())
        return self.state

    def close(self) -> None:
        """Stop; there are no resources to free."""
        self.stop()

    def go_on(self, time: float) -> None:
        """Let the clock of a new body go on from ``time``, in s, or from the next reading."""
        later = ceil(time / READING - 1e-6)
        self._readings += later
        self._wanted += later * READING
        self._plant.data.time += later * READING

    def read(self) -> None:
        """Let one period of the readings pass; faster than :meth:`step`, but returns nothing."""
        self._wanted += READING
        self._next_reading()

    def _next_reading(self) -> Touch:
        controller = self._controller
        controller.update(self._history[-1], self._clock)
        stopped = controller.phase is Phase.STOPPED
        touch = self._plant.advance(
            self._setpoints(), self._hold_torque if stopped else controller.ceiling(self._clock)
        )
        self._readings += 1
        self._history.append(self._plant.encoders())
        return touch

    @property
    def _clock(self) -> int:
        return self._readings * _READING_US

    def _setpoints(self) -> Array:
        """Return the servos' setpoints until the next reading, (5, 8) rad."""
        plan, since, setpoints = self._planned
        row = (self._readings - since) * _SUBSTEPS
        if plan is not self._controller.watch or row >= len(setpoints):
            plan, since, row = self._controller.watch, self._readings, 0
            times = self._clock + _SUBTIMES
            fine = self._controller.setpoint(times)
            setpoints = np.multiply(fine, self._robot.servo.step / FINE, dtype=np.float64)
            self._planned = (plan, since, setpoints)
        return setpoints[row : row + _SUBSTEPS]


_READING_US = round(READING * SECOND)
_SUBTIMES = np.arange(1, _AHEAD * _SUBSTEPS + 1, dtype=np.int64)[:, None] * round(TIMESTEP * SECOND)
