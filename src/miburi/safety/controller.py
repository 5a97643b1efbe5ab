"""The card in Python: takes moves, watches the motors by the contact rule, stops, returns.

It sees only what a card sees, encoder steps and a clock, and tells the servos one thing, their
commanded profile. The firmware is its twin.
"""

from dataclasses import dataclass

import numpy as np

from miburi.errors import BodyError
from miburi.robot import JOINTS, Robot
from miburi.safety.contact import Rule, Watch, Window
from miburi.safety.drive import aim, demand
from miburi.safety.move import Move
from miburi.safety.profile import FINE, SECOND, Steps, commanded, to_steps
from miburi.safety.stop import Phase, Stop, StopReason

__all__ = ["FURTHEST", "GIVE_WAY", "RETURN_SPEED", "YIELD_AFTER", "Controller", "check_move"]

#: Speed of the return to neutral after a stop, in rad/s of the motor with the longest way (ours).
RETURN_SPEED = 0.8
#: After a contact all motors go back the way they came, until the one that met something has
#: given way by so much, rad, but none further than the second figure: held where it stopped, the
#: robot would go on pressing (ours).
GIVE_WAY, FURTHEST = 0.0245, 0.0736
#: A motor that somebody still keeps from its place so long after a contact, in µs, stays where it
#: is: it must not push back. Once for each contact, so that no load can pull it further and
#: further (ours).
YIELD_AFTER = 150_000


def check_move(robot: Robot, phase: Phase, move: Move) -> None:
    """Refuse what no body may do.

    Raises
    ------
    BodyError
        The body is not idle, a joint limit is left, or a speed is above the servo's.
    """
    if phase is not Phase.IDLE:
        raise BodyError(f"The body is {phase}; only an idle body takes a move.")
    half_step = robot.servo.step / 2
    outside = (move.angles < robot.lower - half_step) | (move.angles > robot.upper + half_step)
    for motor in np.flatnonzero(outside):
        raise BodyError(
            f"{JOINTS[motor]} cannot go to {move.angles[motor]:.4f} rad; allowed is "
            f"{robot.lower[motor]} to {robot.upper[motor]}."
        )
    for motor in np.flatnonzero(move.speeds > robot.servo.max_speed):
        raise BodyError(
            f"{JOINTS[motor]} cannot turn at {move.speeds[motor]:.3f} rad/s; at most "
            f"{robot.servo.max_speed} is allowed."
        )


@dataclass
class Controller:
    """One body's states and rule; positions are encoder steps (8,), times µs on its clock.

    Attributes
    ----------
    robot, rule
        The description, and the contact rule with its guards.
    origin
        The goal at which the motors are held when no profile runs.
    watch
        The commanded profile that runs, and the rule's view of it; a new one for each.
    ceiling
        (8,) N·m, the most that the motors may give for it; a stopped body holds with less.
    """

    robot: Robot
    rule: Rule
    origin: Steps

    def __post_init__(self) -> None:
        self.phase = Phase.IDLE
        self.latched: Stop | None = None
        #: What the rule compared at the latest reading; it outlives the move.
        self.window: Window | None = None
        self._began = 0
        self._yields_at: int | None = None
        self._sag = np.zeros_like(self.origin)
        self.watch = self._plan(self.origin, self.origin, np.ones(len(JOINTS), dtype=np.int64))

    def move(self, move: Move, positions: Steps, time: int) -> None:
        """Start ``move``.

        Raises
        ------
        BodyError
            The body is not idle, a joint limit is left, or a speed is above the servo's.
        """
        check_move(self.robot, self.phase, move)
        robot = self.robot
        self._start(
            Phase.MOVING,
            to_steps(robot, move.angles),
            to_steps(robot, move.speeds),
            positions,
            time,
        )

    def stop(self, positions: Steps, time: int, reason: StopReason = StopReason.ASKED) -> None:
        """Stop and hold where the motors are; a stop that holds already keeps its reason."""
        if self.phase is not Phase.STOPPED:
            self._hold(Stop(time / SECOND, reason), positions)

    def release(self, positions: Steps, time: int) -> None:
        """Start the slow return to neutral, with the rule on.

        Raises
        ------
        BodyError
            The body is not stopped.
        """
        if self.phase is not Phase.STOPPED:
            raise BodyError(f"The body is {self.phase}; only a stopped body can be released.")
        self.latched = None
        # A motor that has been held stays at its goal; one that somebody has moved starts from
        # where it is.
        here = positions + self._sag
        moved = np.abs(here - self.origin) > self.rule.guards.arrival
        self.origin = np.where(moved, here, self.origin)
        goal = to_steps(self.robot, aim(self.robot, self.robot.neutral))
        way = np.abs(goal - self.origin)
        fastest = round(RETURN_SPEED / self.robot.servo.step)
        self._start(Phase.RETURNING, goal, way * fastest // max(int(way.max()), 1), positions, time)

    def update(self, positions: Steps, time: int) -> None:
        """Look at the motors: judge them, notice when the goal is reached, yield when stopped."""
        if self.phase is Phase.STOPPED:
            self._yield(positions, time)
        if self.phase not in (Phase.MOVING, Phase.RETURNING):
            return
        elapsed = time - self._began
        contact = self.watch.look(positions, elapsed)
        self.window = self.watch.window or self.window
        if contact is not None:
            self._hold(
                Stop(
                    time / SECOND,
                    StopReason.CONTACT,
                    contact.name,
                    contact.sign.value,
                    contact.ratio,
                ),
                self._given_way(contact.motor, positions),
            )
            self._yields_at = time + YIELD_AFTER
        elif self.watch.arrived(positions, elapsed):
            self.origin = self._goal
            self._sag = self._hanging(positions)
            self.phase = Phase.IDLE
            self.watch = self._plan(self.origin, positions, np.ones_like(positions))

    def setpoint(self, time: Steps | int) -> Steps:
        """Where the servos' profiles are, in 1/256 steps: (8,), or (n, 8) for times (n, 1)."""
        travel = self.watch.profile.position(time - self._began)
        return self.origin * FINE + self.watch.direction * travel

    @property
    def _goal(self) -> Steps:
        return self.origin + self.watch.direction * self.watch.profile.distance

    def _given_way(self, motor: int, positions: Steps) -> Steps:
        """Return the positions to go back to after ``motor`` met something."""
        step, direction = self.robot.servo.step, self.watch.direction
        way = np.maximum((positions - self.watch.start) * direction, 0)
        # A common part of each motor's way, so that the body goes back along its path.
        part, whole = 1, 1
        for limit, longest in ((GIVE_WAY, int(way[motor])), (FURTHEST, int(way.max()))):
            steps = round(limit / step)
            if steps * whole < part * longest:
                part, whole = steps, longest
        back: Steps = positions - direction * (way * part // whole)
        return back

    def _hanging(self, positions: Steps) -> Steps:
        """Return how far motors at rest hang from their goals under their loads.

        When they are stopped their goals stay so much above them: else they would sink, onto whom
        they touch.
        """
        most = round(GIVE_WAY / self.robot.servo.step)
        sag: Steps = np.clip(self.origin - positions, -most, most)
        return sag

    def _yield(self, positions: Steps, time: int) -> None:
        """Let the motors that are kept from their places stay where they are."""
        if self._yields_at is None or time < self._yields_at:
            return
        self._yields_at = None
        here = positions + self._sag
        kept = np.abs(here - self.origin) > self.rule.guards.slack
        if kept.any():
            self._stay(np.where(kept, here, self.origin))

    def _start(self, phase: Phase, goal: Steps, speeds: Steps, positions: Steps, time: int) -> None:
        self.phase = phase
        self._began = time
        self._sag = self._hanging(positions)
        self.watch = self._plan(goal, positions, speeds)

    def _plan(self, goal: Steps, positions: Steps, speeds: Steps) -> Watch:
        profile, direction = commanded(self.robot, self.origin, goal, speeds)
        needs = demand(self.robot, positions, self.origin, profile, direction)
        self.ceiling = needs.ceiling
        return self.rule.watch(profile, positions, direction, needs.loading)

    def _hold(self, stop: Stop, positions: Steps) -> None:
        self.phase, self.latched, self._yields_at = Phase.STOPPED, stop, None
        self._stay(positions + self._sag)

    def _stay(self, goals: Steps) -> None:
        self.origin = goals
        self.watch = self._plan(goals, goals, np.ones_like(goals))
