"""The card's logic in Python: take a move, watch the motors, stop on contact, return to neutral.

It takes moves, stops and releases and, at every reading of the encoders, the eight motors'
positions and the time. It gives the phase, any stop in force, and the setpoints for the servos. The
controller knows no more than a card does: encoder steps and a clock. The firmware's
``controller.h`` makes the same decisions::

    IDLE ──move──▶ MOVING ──goal reached──▶ IDLE
    MOVING ──another move──▶ MOVING
    MOVING or RETURNING ──contact──▶ STOPPED
    IDLE ──a motor is pushed away──▶ STOPPED
    any phase ──stop──▶ STOPPED
    STOPPED ──release──▶ RETURNING ──neutral reached──▶ IDLE

A new move replaces a running one: motors start it at their present speeds, and the rule keeps what
it has observed so far.

A stop latches: only a release ends it. A stop that somebody asked for holds the motors where they
are. After a contact the body first gives way, since a motor that holds where it was blocked goes
on pressing (all figures are ours):

1. All motors go back along their path until the motor that met something has gone back by
   ``GIVE_WAY``, 1.4°. No motor goes further than ``FURTHEST``, 4.2°.
2. After ``YIELD_AFTER``, 150 ms, a motor that somebody still holds away from its place stays there
   instead of pushing back. This happens only once for each contact; otherwise a load could pull the
   motor further and further.

A body at rest can be led by hand. If something holds a motor away from its resting place for
``YIELD_AFTER``, by more than the larger of its ``slack`` and its ``arrival``, the body stops with
the reason ``TOUCHED``. All motors then hold gently where they are. Every ``YIELD_AFTER``, they give
way to whatever displaces them; when the body is released, they return slowly. After yielding
``YIELDS`` times in a row, the motors yield no more until nothing displaces them. Without this
limit, a motor that turns the wrong way would turn for ever. If a limb has been led to a place where
its weight pulls harder, it sinks a little each time it yields.
"""

from dataclasses import dataclass, replace

import numpy as np

from miburi.errors import BodyError
from miburi.robot import JOINTS, Array, Robot
from miburi.safety.contact import Contact, Rule, Watch, Window
from miburi.safety.drive import aim, demand
from miburi.safety.move import Move
from miburi.safety.profile import FINE, SECOND, Steps, plan_profile, to_steps, whole
from miburi.safety.stop import Phase, Stop, StopReason

#: The speed on the return to neutral, in rad/s, of the motor that has furthest to go (our choice).
RETURN_SPEED = 0.8
#: After a contact, the motor that met something goes back by the first angle, and no motor by more
#: than the second (step 1 above), in rad (our choice).
GIVE_WAY, FURTHEST = 0.0245, 0.0736
#: A motor gives in once it has been held away from its place for this long, in µs (our choice).
YIELD_AFTER = 150_000
#: Travel of at most this, in steps, between two readings is noise (our choice).
MOVES = 2
#: A speed is computed from two readings only if the time between them, and the age of the latest
#: reading, are at most this, in µs (our choice).
TELLS = 60_000
#: The largest speed that is believed, in steps/s; if a speed is higher, the reading has jumped (our
#: choice).
SWINGS = 4000
#: How many times in a row a body that is led by hand yields, which takes 3 s (our choice).
YIELDS = 20


def return_speed(usual: int, *, led: bool) -> int:
    """Return the speed of the return: ``usual``, or 40 % of it after a touch (our choice)."""
    return usual * 2 // 5 if led else usual


def check_move(robot: Robot, phase: Phase, move: Move) -> None:
    """Refuse a move that is not allowed.

    Raises
    ------
    BodyError
        The body is stopped or returning, an angle is outside the joint limits, or a speed is above
        the servo's limit.
    """
    if phase not in (Phase.IDLE, Phase.MOVING):
        raise BodyError(f"The body is {phase}; it takes a move only at rest or during a move.")
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
    """The phases and the contact rule of one body.

    Positions are encoder steps, (8,); times are µs on the body's clock.

    Attributes
    ----------
    robot, rule
        The description, and the contact rule with its guards.
    origin
        Where the commanded profile starts; the motors hold there when no profile runs.
    watch
        The commanded profile that is running, and the rule's watch over it; each profile has its
        own watch.
    """

    robot: Robot
    rule: Rule
    origin: Steps

    def __post_init__(self) -> None:
        self.phase = Phase.IDLE
        self.latched: Stop | None = None
        #: What the rule compared at its latest reading; it is kept after the move.
        self.window: Window | None = None
        #: When the present profile began, in µs.
        self.began = 0
        self._seen, self._seen_at = self.origin, -TELLS - 1
        self._moved, self._gap = np.zeros_like(self.origin), TELLS + 1
        self._yields_at: int | None = None
        # Since when a motor at rest has been away from its place, in µs; None if no motor is.
        self._kept_since: int | None = None
        self._sag = np.zeros_like(self.origin)
        self._rest: Steps | None = None  # where the motors came to rest
        self._yields = 0  # how many times it may still yield; reset once nothing displaces it
        self.watch = self._plan(self.origin, self.origin, np.ones(len(JOINTS), dtype=np.int64))
        # Compile the rule now: later, compiling would hold up the first move and any Stop.
        self.watch.expected_travel(SECOND)

    def move(self, move: Move, positions: Steps, time: int) -> None:
        """Start ``move``, even while another move runs; raise the errors of :func:`check_move`."""
        if self.phase is Phase.MOVING:
            self.update(positions, time)  # so that this reading is not lost
        check_move(self.robot, self.phase, move)
        self.note(positions, time)
        goal, speeds = to_steps(self.robot, move.angles), to_steps(self.robot, move.speeds)
        self.start(Phase.MOVING, goal, speeds, positions, time)

    def stop(self, positions: Steps, time: int, reason: StopReason = StopReason.ASKED) -> None:
        """Stop and hold the motors where they are; a stopped body keeps its first reason.

        A touch is the exception: the partner would release it by itself, so any other reason
        replaces it.
        """
        if self.phase is not Phase.STOPPED:
            self._hold(Stop(time / SECOND, reason), positions)
        elif self._is_led:
            self.latched, self._yields_at = Stop(time / SECOND, reason), None

    def release(self, positions: Steps, time: int) -> None:
        """Start the slow return to neutral, with the rule on.

        Raises
        ------
        BodyError
            The body is not stopped.
        """
        if self.phase is not Phase.STOPPED:
            raise BodyError(f"The body is {self.phase}; only a stopped body can be released.")
        self.note(positions, time)
        led = self._is_led
        self.latched = None
        # A motor starts from its goal, or from where it is if somebody has moved it.
        here = positions + self._sag
        moved = np.abs(here - self.origin) > self.rule.guards.arrival
        self.origin = np.where(moved, here, self.origin)
        goal = to_steps(self.robot, aim(self.robot, self.robot.neutral))
        distance = np.abs(goal - self.origin)
        fastest = return_speed(round(RETURN_SPEED / self.robot.servo.step), led=led)
        speeds = distance * fastest // max(int(distance.max()), 1)
        self.start(Phase.RETURNING, goal, speeds, positions, time)

    def update(self, positions: Steps, time: int) -> None:
        """Judge a reading of the encoders: stop on contact, end at the goal, yield when pushed."""
        self.note(positions, time)
        if self.phase is Phase.STOPPED:
            self._yield(positions, time)
        elif self.phase is Phase.IDLE:
            self._feel(positions, time)
        if self.phase not in (Phase.MOVING, Phase.RETURNING):
            return
        elapsed = time - self.began
        contact = self.watch.look(positions, elapsed)
        self.window = self.watch.window or self.window
        if contact is not None:
            seen = contact.name, contact.sign.value, contact.ratio
            stop = Stop(time / SECOND, StopReason.CONTACT, *seen)
            self._hold(stop, self._retreat(contact, positions))
            self._yields_at, self._yields = time + YIELD_AFTER, 1
        elif self.watch.arrived(positions, elapsed):
            self.origin = self._goal
            self._sag = self._measure_sag(positions)
            self.phase, self._kept_since, self._rest = Phase.IDLE, None, positions
            self.watch = self._plan(self.origin, positions, np.ones_like(positions))

    def setpoint(self, time: Steps | int) -> Steps:
        """Return the positions on the profiles, in 1/256 steps.

        Their shape is (8,), or (n, 8) for times of shape (n, 1).
        """
        travel = self.watch.profile.position(time - self.began)
        return self.origin * FINE + self.watch.direction * travel

    def speed(self, time: int) -> Steps:
        """Return the velocities on the profiles, (8,) in 1/256 steps/s."""
        velocity: Steps = self.watch.direction * self.watch.profile.velocity(time - self.began)
        return velocity

    def ceiling(self, time: int) -> Array:
        """Return the motors' torque limits, (8,) in N·m; a stopped body has lower limits."""
        needs = self._needs
        return needs.ceiling if time - self.began < needs.eases_at else needs.cruise

    def note(self, positions: Steps, time: int) -> None:
        """Record a reading without judging it; two consecutive ones give the motors' speeds."""
        if time > self._seen_at:
            self._moved, self._gap = positions - self._seen, time - self._seen_at
            self._seen, self._seen_at = positions, time

    def drift(self, positions: Steps, direction: Steps, time: int) -> tuple[Steps, Steps]:
        """Return the motors' speeds, and how far they have travelled since the latest reading.

        Both are 0 for motors that do not start from the position in that reading. Speeds and
        distances have the shape (8,), count along ``direction``, and are in the units of
        :class:`~miburi.safety.contact.Loading`.
        """
        age = time - self._seen_at
        if max(age, self._gap) > TELLS:
            return np.zeros_like(self._moved), np.zeros_like(self._moved)
        fast = np.abs(self._moved) * FINE * SECOND // self._gap
        told = (np.abs(self._moved) > MOVES) & (fast <= SWINGS * FINE) & (positions == self._seen)
        way = np.where(told, np.sign(self._moved) * direction, 0)
        return way * fast, way * (fast * age // SECOND)

    def start(self, phase: Phase, goal: Steps, speeds: Steps, positions: Steps, time: int) -> None:
        """Start towards ``goal``, in steps, at ``speeds`` in steps/s; nothing is checked here."""
        before, began = self.watch, self.began
        goes_on = self.phase is Phase.MOVING
        velocity = None
        if goes_on:
            velocity = self.speed(time)
            self.origin = whole(self.setpoint(time))
        else:
            self._sag = self._measure_sag(positions)
        self.phase, self.began = phase, time
        self.watch = self._plan(goal, positions, speeds, time, velocity)
        if goes_on:
            self.watch.go_on(before, self._seen_at - began, time - began)

    @property
    def _is_led(self) -> bool:
        return self.latched is not None and self.latched.reason is StopReason.TOUCHED

    @property
    def _goal(self) -> Steps:
        return self.origin + self.watch.direction * self.watch.profile.distance

    def _retreat(self, contact: Contact, positions: Steps) -> Steps:
        """Return the positions to which the motors go back after one has met something."""
        step, direction, motor = self.robot.servo.step, self.watch.direction, contact.motor
        travel = np.maximum((positions - self.watch.start) * direction + self.watch.came, 0)
        most = round(GIVE_WAY / step)
        if self.watch.turned[motor] and travel[motor] < most:
            # The motor has hardly come back yet: the obstacle is further along the model's path.
            stays = positions.copy()
            way = most if contact.measured < contact.expected else -most
            stays[motor] -= direction[motor] * way
            return stays
        # All motors go back by the same share of their travel, so that the body keeps to its path.
        part, whole = 1, 1
        for limit, longest in ((GIVE_WAY, int(travel[motor])), (FURTHEST, int(travel.max()))):
            steps = round(limit / step)
            if steps * whole < part * longest:
                part, whole = steps, longest
        back: Steps = positions - direction * (travel * part // whole)
        return back

    def _measure_sag(self, positions: Steps) -> Steps:
        """Return how far motors at rest sag below their goals under their loads.

        The goals of stopped motors stay this far above their positions; otherwise the motors would
        sink onto the person they touch.
        """
        most = round(GIVE_WAY / self.robot.servo.step)
        sag: Steps = np.clip(self.origin - positions, -most, most)
        return sag

    def _feel(self, positions: Steps, time: int) -> None:
        """Stop a body at rest if something keeps a motor away from its place."""
        if self._rest is None:
            self._rest = positions
        beyond = np.abs(positions - self._rest) - self.rule.at_rest
        motor = int(beyond.argmax())
        if beyond[motor] <= 0:
            self._kept_since = None
        elif self._kept_since is None:
            self._kept_since = time
        elif time - self._kept_since >= YIELD_AFTER:
            self._sag = self._measure_sag(self._rest)  # a body that never moved has none yet
            self._hold(Stop(time / SECOND, StopReason.TOUCHED, JOINTS[motor]), positions)
            self._yields_at, self._yields = time + YIELD_AFTER, YIELDS

    def _yield(self, positions: Steps, time: int) -> None:
        """Leave motors where they are if something holds them away from their places."""
        if self._yields_at is None or time < self._yields_at:
            return
        self._yields_at = time + YIELD_AFTER if self._is_led else None
        robot, here = self.robot, positions + self._sag
        # A motor counts as displaced if it is off by more than half its slack or, while the body is
        # led by hand, by more than a step.
        most = 2 if self._is_led else self.rule.guards.slack
        blocked = 2 * np.abs(here - self.origin) > most
        if not blocked.any():
            self._yields = YIELDS
        elif self._yields > 0:
            self._yields -= 1
            goals = np.where(blocked, here, self.origin)
            if self._is_led:
                goals = np.clip(goals, to_steps(robot, robot.lower), to_steps(robot, robot.upper))
            self._stay(goals)

    def _plan(
        self,
        goal: Steps,
        positions: Steps,
        speeds: Steps,
        time: int | None = None,
        velocity: Steps | None = None,
    ) -> Watch:
        before = 1 if velocity is None else self.watch.direction
        profile, direction = plan_profile(self.robot, self.origin, goal, speeds, velocity, before)
        needs = demand(self.robot, positions, self.origin, profile, direction)
        self._needs, loading = needs, needs.loading
        if time is not None and velocity is None:
            drift, gone = self.drift(positions, direction, time)
            loading = replace(loading, velocity=drift, gone=gone)
        return self.rule.watch(profile, positions, direction, loading)

    def _hold(self, stop: Stop, positions: Steps) -> None:
        self.phase, self.latched = Phase.STOPPED, stop
        self._yields_at = self._kept_since = None
        self._stay(positions + self._sag)

    def _stay(self, goals: Steps) -> None:
        self.origin = goals
        self.watch = self._plan(goals, goals, np.ones_like(goals))
