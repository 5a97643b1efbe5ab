"""The real robot as a body: it talks to an Arduino with the firmware, over a serial line.

A :class:`Card` implements :class:`~miburi.bodies.Body`: move, stop, release, step. It reports
states, stops and motor readings, and the errors that it raises say what is wrong. A conversation::

    the host sends                         the card answers
    HELLO                            ───▶  version, checksum of its settings
    STOP; settings, if they differ   ───▶
    STATUS                           ───▶  from now on a REPORT after each reading of the servos
    MOVE, STOP or RELEASE            ───▶  OK, or why not

The card alone decides about safety: it checks every move, judges the motors by the contact rule
and stops them. A card that sends no report for 1 s is lost: the body counts as stopped, and the
card is looked for every second. No motion resumes by itself; a stop lasts until it is released.
"""

import struct
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np

from miburi.bodies.base import BodyState, Motors, Touchable
from miburi.card.answers import (
    LOST,
    UNREADABLE,
    NoAnswerError,
    not_home,
)
from miburi.card.exchange import Exchange
from miburi.card.history import ReportHistory
from miburi.card.line import Line, SamePort
from miburi.card.link import FrameKind, Reason, Report
from miburi.card.order import Order, Underway
from miburi.card.reading import motors_of, window_of
from miburi.card.settings import CardSettings
from miburi.card.transfer import Greeting, greet, replace_settings, save_settings, stop_and_settle
from miburi.card.units import check_encoder
from miburi.errors import BodyError
from miburi.robot import JOINTS, Robot
from miburi.safety.contact import Window
from miburi.safety.controller import check_move
from miburi.safety.move import Course, Move
from miburi.safety.profile import FINE, SECOND, Steps, whole
from miburi.safety.stop import Phase, Stop, StopReason

#: Seconds to wait for an answer, and seconds that a card needs to start.
_PATIENCE, _START_UP = 0.25, 4.0
#: Seconds without a report after which the card is lost; a busy computer may pause for nearly 1 s.
_SILENCE = 1.0
#: Seconds between two attempts to reach a lost card.
_RETRY = 1.0
#: Seconds between heartbeats to an idle card; it stops after 30 s without one.
_LIFE = 5.0
#: The least time between two reports, in ms. It is shorter than the time between readings, so that
#: each reading is reported.
_REPORT_PERIOD = 10
#: How long to listen, in s, for several reports to arrive.
_LOOK = 0.1


class Card:
    """A :class:`~miburi.bodies.Body` driven by a card.

    Parameters
    ----------
    port
        The serial port's name, or a function that opens a :class:`Line`.
    robot
        The description. The card uses its limits and speeds.
    settings
        The card's settings; by default the robot's, with any calibration stored on the card.
    keep
        Only look: the card keeps the settings that it has; a card without any gets ``settings``.

    Attributes
    ----------
    robot, settings
        The description, and the settings that the card has.
    underway
        The latest move, or return to neutral; None before the first.
    on_report
        A function that is called with every report, for recorders and tests.

    Raises
    ------
    BodyError
        No card answers, its firmware has another version of the protocol, or the robot's encoders
        are not those of the card's servos.
    """

    def __init__(
        self,
        port: str | Callable[[], Line],
        robot: Robot,
        settings: CardSettings | None = None,
        *,
        keep: bool = False,
    ) -> None:
        self.robot = robot
        self._keep = keep
        check_encoder(robot)
        self._requested_settings = settings
        self._own_stop: Stop | None = None
        self.underway: Underway | None = None
        self._connected = False
        self._guessed = False  # whether defaults replace what another firmware saved
        self.settings = settings or CardSettings.of(self.robot)
        self.on_report: Callable[[Report], None] = lambda _: None
        try:
            self._exchange = Exchange(SamePort(port) if isinstance(port, str) else port, self._take)
        except OSError as error:
            cause = error.strerror or error
            raise BodyError(f"The card cannot be reached: {cause}.") from error
        try:
            self._due = self._exchange.now()
            self._history = ReportHistory(robot.servo.step, self._due)
            self.go_on = self._history.go_on  # see LiveBody
            self._greet(_START_UP)
        except BaseException:
            self._exchange.close()
            raise

    @property
    def goals(self) -> Steps:
        """Goals of the latest move or return, (8,) steps; empty before the first."""
        return np.array([], dtype=np.int64) if self.underway is None else self.underway.order.goals

    @property
    def report(self) -> Report:
        """The card's latest report, with temperatures and voltages."""
        return self._history.latest

    @property
    def touchable(self) -> Touchable | None:
        """None: only a simulated body can be touched by a program."""
        return None

    def motors(self) -> Motors:
        """Return the state of the motors from the latest report; unknown while the card is lost."""
        return motors_of(self.report if self._connected else None, self.settings)

    @property
    def window(self) -> Window | None:
        """The rule's figures for the motor whose contact keeps the body stopped, or None."""
        share = np.full(len(JOINTS), FINE) if self.underway is None else self.underway.share
        return None if self._own_stop else window_of(self.report, self.settings, share)

    @property
    def state(self) -> BodyState:
        """The latest state; while the card is lost, the body counts as stopped."""
        state = self._history.state()
        if self._own_stop is not None:
            return replace(state, phase=Phase.STOPPED, stop=self._own_stop)
        return state

    def move(self, move: Move, driven: Robot | None = None) -> None:
        """Start a move; see :meth:`miburi.bodies.Body.move`.

        If ``driven`` is given, the motors are driven as the motors of that robot would be.
        """
        check_move(self.robot, self.state.phase, move)
        here, (origin, velocity) = np.array(self.report.positions), self._motion_now()
        asked = driven or self.robot
        self.start(Order.of(asked, self.settings, here, whole(origin), move, velocity))

    def start(self, order: Order) -> None:
        """Start a move with its own loads or duty limits; raise BodyError if it is refused."""
        self._begin(order, *self._motion_now(), FrameKind.MOVE, order.pack())

    def course(self) -> Course:
        """Return the motors' commanded positions and velocities, as the host estimates them."""
        return Course.of(self.robot, *self._motion_now())

    def _motion_now(self) -> tuple[Steps, Steps]:
        """Return positions and velocities on the profiles, (8,) 1/256 steps and 1/256 steps/s."""
        if self.underway is None or self.state.phase is not Phase.MOVING:
            return self.goals * FINE, np.zeros_like(self.goals)
        since = round((self._exchange.now() - self._history.heard) * SECOND)
        return self.underway.motion.at(self.report.time + since - self.underway.began)

    def _begin(
        self, order: Order, place: Steps, velocity: Steps, kind: FrameKind, payload: bytes = b""
    ) -> None:
        underway = Underway.of(order, self.settings, place, velocity)
        self.ask(FrameKind.LOADS, order.pack_loads())
        (began,) = struct.unpack("<q", self.ask(kind, payload))
        self.underway = underway._replace(began=began)
        self._own_stop = None
        self._await_phase()

    def stop(self) -> None:
        """Stop all motors and hold softly until released."""
        if self._connected:
            self.ask(FrameKind.STOP)
            self._await_phase()

    def halt(self) -> None:
        """Send a stop without waiting for an answer; see :meth:`miburi.bodies.Body.halt`."""
        with suppress(OSError):
            self._exchange.send(FrameKind.STOP)

    def release(self) -> None:
        """End a stop; see :meth:`miburi.bodies.Body.release`. Torque comes on if it was off.

        Raises
        ------
        BodyError
            The body is not stopped, the card is lost, or a servo is not ready.
        """
        phase = self.state.phase
        if phase is not Phase.STOPPED:
            raise BodyError(f"The body is {phase}; only a stopped body can be released.")
        if not self._connected:
            raise BodyError(LOST)
        if self._guessed:
            raise BodyError(UNREADABLE)
        here, led = np.array(self.report.positions), self.report.reason == Reason.TOUCHED
        order = Order.home(self.robot, self.settings, here, led=led)
        self._begin(order, here * FINE, np.zeros_like(here), FrameKind.RELEASE)

    def relax(self) -> None:
        """Switch a stopped body's torque off, so that it can be moved by hand."""
        self.ask(FrameKind.RELAX)

    def identify(self, old: int, new: int) -> None:
        """Set the id, speed and mode of the only servo on the bus; ``old`` is its id until now."""
        self.ask(FrameKind.IDENTIFY, bytes((old, new)), patience=2.0)

    def configure(self, settings: CardSettings) -> None:
        """Send settings to a stopped card; see :func:`~miburi.card.transfer.replace_settings`."""
        replace_settings(self.ask, settings, self.settings)
        self.settings, self._guessed = settings, False

    @property
    def has(self) -> Greeting:
        """Which settings the card has, and whether they are stored."""
        return greet(self.ask)

    def save(self) -> None:
        """Store the settings in the card's EEPROM; this takes about 4 s."""
        save_settings(self.ask, self.step)

    def step(self, dt: float) -> BodyState:
        """Listen for ``dt`` seconds; if the card is lost, look for it."""
        # Time spent on requests counts as part of the step. A long pause before the call does not.
        now = self._exchange.now()
        # Late steps are shortened, unless the card is lost: attempts to reach it outlast a step.
        late = self._connected and now - self._due < _SILENCE
        self._due = (self._due if late else now) + dt
        if self._connected:
            self._hear(self._exchange.now())
            if (
                self.state.phase is Phase.IDLE
                and self._exchange.now() - self._exchange.asked > _LIFE
            ):
                with suppress(NoAnswerError):
                    self.ask(FrameKind.STATUS, struct.pack("<H", _REPORT_PERIOD))
        while self._exchange.now() < self._due:
            if self._connected:
                self._hear(self._due)
            else:
                self._reconnect()
        return self.state

    def look(self) -> BodyState:
        """Return the present state, even if no report was read for a long time."""
        self._due = self._exchange.now()
        return self.step(_LOOK)

    def close(self) -> None:
        """Stop the card if it can be reached, and close the line."""
        with suppress(BodyError):
            self.stop()
        self._exchange.close()

    # --- requests --------------------------------------------------------------------------------

    def ask(self, kind: FrameKind, payload: bytes = b"", patience: float = _PATIENCE) -> bytes:
        """Send a request at most three times; return the payload of the card's answer.

        Raises
        ------
        NoAnswerError
            No answer came within ``patience`` s, or the line is broken: the card is lost.
        BodyError
            The card refused; the message says why.
        """
        try:
            return self._exchange.ask(kind, payload, patience, self.settings)
        except NoAnswerError:
            self._lose()
            raise

    def _greet(self, patience: float) -> None:
        """Connect: stop the card, send settings if it needs them, and ask for reports."""
        self._exchange.start_again()
        until = self._exchange.now() + patience
        while True:
            try:
                has = greet(self.ask)
                break
            except NoAnswerError:
                if self._exchange.now() >= until:
                    raise
        self.settings, self._guessed = stop_and_settle(
            self.ask, has, self.robot, self._requested_settings, keep=self._keep
        )
        self.ask(FrameKind.STATUS, struct.pack("<H", _REPORT_PERIOD))
        self._connected = True
        self._history.expect_another_clock(self._exchange.now())
        self._await_phase(2)  # the card trusts a servo from the second reading on

    def _take(self, report: Report) -> None:
        self._history.add(report, self._exchange.now())
        self.on_report(report)

    def _hear(self, until: float) -> None:
        """Listen; after a broken line or a long silence, the card is lost."""
        try:
            self._exchange.listen(until)
        except OSError:
            self._lose()
        if self._exchange.now() - self._history.heard > _SILENCE:
            self._lose()

    def _await_phase(self, reports: int = 1) -> None:
        """Wait for the first reports after the latest answer."""
        before = self.report.time if self._history else None
        until = self._exchange.now() + _SILENCE
        while self._connected and reports > 0 and self._exchange.now() < until:
            self._hear(until)
            if self._history and self.report.time != before:
                before, reports = self.report.time, reports - 1
        if not self._history:
            raise BodyError("The card sends no reports; press its reset button and try again.")

    # --- a lost card -----------------------------------------------------------------------------

    def _lose(self) -> None:
        if self._connected:
            self._connected = False
            self._retry_at = self._exchange.now()
            self._reopen_at = self._retry_at + _START_UP
            self._own_stop = Stop(self._retry_at - self._history.began, StopReason.LINE_LOST)

    def _reconnect(self) -> None:
        """Try to reach the card, at most once a second; when it answers, it is stopped."""
        if self._exchange.now() < self._retry_at:
            self._exchange.wait(min(self._retry_at, self._due))
            return
        self._retry_at = self._exchange.now() + _RETRY
        try:
            self._greet(0.0)
            if self.report.reason == Reason.STARTED:
                self._own_stop = None  # the card reports its own stop
        except BodyError:
            # Opening the port restarts the card, which then needs time to answer.
            if self._exchange.broken or self._exchange.now() >= self._reopen_at:
                self._exchange.reopen()
                self._reopen_at = self._exchange.now() + _START_UP


def wake(card: Card) -> None:
    """Release a stopped body and wait until it rests at neutral.

    Raises
    ------
    BodyError
        The body did not reach neutral; the message says why.
    """
    card.release()
    while card.state.phase is Phase.RETURNING:
        card.step(0.02)
    if card.state.phase is not Phase.IDLE:
        raise BodyError(not_home(card.state.stop))
