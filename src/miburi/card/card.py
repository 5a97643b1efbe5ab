"""The robot on a card: an Arduino with the firmware, at the end of a serial line.

The card decides all that is about safety; this side asks, listens, and says in words what the
card said. It never resumes a motion by itself: after any loss the body is stopped, until released.
"""

import struct
from collections import deque
from collections.abc import Callable
from contextlib import suppress

import numpy as np

from miburi.bodies.base import BodyState, Motors, Touchable
from miburi.card.line import Line, SerialLine
from miburi.card.link import (
    ANSWER,
    VERSION,
    Frame,
    FrameError,
    Kind,
    Reason,
    Receiver,
    Report,
    Result,
    encode,
)
from miburi.card.report import PHASES, UNREADY, motors_of, stop_of, window_of
from miburi.card.settings import CardSettings, General, JointSettings, check_encoder, refusal
from miburi.errors import BodyError
from miburi.robot import JOINTS, Robot
from miburi.safety.contact import Window
from miburi.safety.controller import check_move
from miburi.safety.move import Move
from miburi.safety.profile import SECOND, to_steps
from miburi.safety.stop import Phase, Stop, StopReason

__all__ = ["Card"]

#: Seconds to wait for an answer, and how often to ask.
_PATIENCE, _TRIES = 0.25, 3
#: Seconds until a card that has just been reset by the opened line answers.
_START_UP = 4.0
#: Seconds without a report after which the card is lost; a busy computer may pause almost as long.
_SILENCE = 1.0
#: Seconds between two attempts to reach a lost card.
_RETRY = 1.0
#: Least ms between two reports: less than between two readings of the servos, so all are told.
_REPORT_PERIOD = 10
#: Seconds in which several reports come.
_LOOK = 0.1
#: Reports over which velocities are measured: 60 ms.
_VELOCITY_REPORTS = 4
_SETTINGS_PIECE = len(JOINTS)


class Card:
    """A body on a card; a :class:`~miburi.bodies.Body`.

    Parameters
    ----------
    port
        The serial port's name, or a function that opens a :class:`Line`.
    robot
        The description. Its limits and speeds are the card's.
    settings
        What the card is to know; by default its calibration is the one that the card has, or else
        :meth:`CardSettings.of` the robot.

    Raises
    ------
    BodyError
        No card answers, it speaks another version of the link, or the robot's encoders are not
        those of the card's servos.
    """

    def __init__(
        self,
        port: str | Callable[[], Line],
        robot: Robot,
        settings: CardSettings | None = None,
    ) -> None:
        self._open: Callable[[], Line] = (
            (lambda: SerialLine(port)) if isinstance(port, str) else port
        )
        self._robot = robot
        check_encoder(robot)
        self._asked_settings = settings
        self._receiver = Receiver()
        self._sequence = 0
        self._answers: list[Frame] = []
        self._history: deque[Report] = deque(maxlen=_VELOCITY_REPORTS)
        self._own_stop: Stop | None = None
        self._offset = 0.0
        #: Where the latest move or return goes, steps, and when it began, µs on the card's clock.
        self.goals: tuple[int, ...] = ()
        self.move_began = 0
        self._connected = self._fresh = False
        self._settings = settings or CardSettings.of(self._robot)
        #: Called with every report, for recorders and tests.
        self.on_report: Callable[[Report], None] = lambda _: None
        try:
            self._line = self._open()
            self._began = self._due = self._heard = self._line.now()
        except OSError as error:
            said = error.strerror or error
            raise BodyError(f"The card cannot be reached: {said}.") from error
        try:
            self._greet(_START_UP)
        except BaseException:
            self._line.close()
            raise

    @property
    def robot(self) -> Robot:
        """The description."""
        return self._robot

    @property
    def settings(self) -> CardSettings:
        """What the card knows of the body."""
        return self._settings

    @property
    def report(self) -> Report:
        """The card's latest report, with temperatures and voltages."""
        return self._history[-1]

    @property
    def touchable(self) -> Touchable | None:
        """None: what a hand does to a real robot, the robot alone feels."""
        return None

    def motors(self) -> Motors:
        """Return how the motors are, as the latest report says; of a lost card nothing is known."""
        return motors_of(self.report if self._connected else None, self._settings)

    @property
    def window(self) -> Window | None:
        """What the rule compared when it saw the contact that holds now; of its motor alone."""
        return None if self._own_stop else window_of(self.report, self._settings)

    @property
    def state(self) -> BodyState:
        """The latest state; a card that cannot be reached is a stopped body."""
        latest, first = self._history[-1], self._history[0]
        step = self._robot.servo.step
        span = (latest.time - first.time) / SECOND
        moved = np.subtract(latest.positions, first.positions) * step
        phase, stop = PHASES[latest.phase], stop_of(latest, self._time_of(latest.stop_time))
        if self._own_stop is not None:
            phase, stop = Phase.STOPPED, self._own_stop
        return BodyState(
            time=self._time_of(latest.time),
            angles=np.multiply(latest.positions, step, dtype=np.float64),
            velocities=moved / span if span > 0 else np.zeros(len(JOINTS)),
            phase=phase,
            stop=stop,
        )

    def move(self, move: Move) -> None:
        """Start a move; see :meth:`miburi.bodies.Body.move`."""
        check_move(self._robot, self.state.phase, move)
        lower, upper = (
            to_steps(self._robot, self._robot.lower),
            to_steps(self._robot, self._robot.upper),
        )
        goals = np.clip(to_steps(self._robot, move.angles), lower, upper)
        speeds = np.minimum(to_steps(self._robot, move.speeds), self._settings.general.max_speed)
        answer = self._ask(Kind.MOVE, struct.pack("<8h8H", *goals.tolist(), *speeds.tolist()))
        self.goals, self.move_began = tuple(goals.tolist()), struct.unpack("<q", answer)[0]
        self._await_phase()

    def stop(self) -> None:
        """Stop all motors and hold softly until released."""
        if self._connected:
            self._ask(Kind.STOP)
            self._await_phase()

    def release(self) -> None:
        """End a stop; see :meth:`miburi.bodies.Body.release`. Torque goes on here, if it was off.

        Raises
        ------
        BodyError
            The body is not stopped, the card is not there, or a servo is not ready.
        """
        phase = self.state.phase
        if phase is not Phase.STOPPED:
            raise BodyError(f"The body is {phase}; only a stopped body can be released.")
        if not self._connected:
            raise BodyError(
                "The card cannot be reached. Look at its cable and power; it is looked for again "
                "every second, and stays stopped until you release it."
            )
        answer = self._ask(Kind.RELEASE)
        self._own_stop = None
        self.goals = tuple(joint.neutral for joint in self._settings.joints)
        self.move_began = struct.unpack("<q", answer)[0]
        self._await_phase()

    def wake(self) -> None:
        """Release a stopped body and wait until it rests at neutral.

        Raises
        ------
        BodyError
            It did not get there; the message says why.
        """
        self.release()
        while self.state.phase is Phase.RETURNING:
            self.step(0.02)
        if self.state.phase is not Phase.IDLE:
            stop = self.state.stop
            said = (
                "" if stop is None else f": {stop.reason.spoken}, {stop.motor or 'no single motor'}"
            )
            raise BodyError(f"The body did not reach neutral{said}. Look what is in its way.")

    def relax(self) -> None:
        """Take torque off a stopped body, to move it by hand."""
        self._ask(Kind.RELAX)

    def identify(self, old: int, new: int) -> None:
        """Give the only servo on the bus another id, and the bus's speed and mode."""
        self._ask(Kind.IDENTIFY, bytes((old, new)), patience=1.0)

    def configure(self, settings: CardSettings) -> None:
        """Tell a stopped card what it must know: all of it, or what it knew before.

        Raises
        ------
        BodyError
            The card is not stopped, or a value is outside its safe range.
        """
        try:
            self._tell(settings)
        except BodyError:
            with suppress(BodyError):
                self._tell(self._settings)
            raise
        self._settings = settings

    def _tell(self, settings: CardSettings) -> None:
        pieces: list[JointSettings | General] = [*settings.joints, settings.general]
        # Ids may change places: send the joints twice where the first time two were alike.
        for _ in range(2):
            for piece, value in enumerate(pieces):
                index = b"" if isinstance(value, General) else bytes((piece,))
                kind = Kind.SETTINGS if isinstance(value, General) else Kind.JOINT
                try:
                    self._ask(kind, index + value.pack())
                except _OutOfRangeError as error:
                    raise BodyError(refusal(settings, piece, error.index)) from None
            crc, complete, _ = self._hello()
            if complete and crc == settings.crc:
                return
        raise BodyError("The card did not keep its settings: each servo needs an id of its own.")

    @property
    def stored(self) -> bool:
        """Whether the card would still know its settings after a loss of power."""
        return self._hello()[2]

    def save(self) -> None:
        """Store the settings in the card's EEPROM; takes about 4 s."""
        self._ask(Kind.SAVE)
        for _ in range(50):
            self.step(0.2)
            if self.stored:
                return
        raise BodyError("The card did not store its settings; try again.")

    def step(self, dt: float) -> BodyState:
        """Wait ``dt`` seconds, listening; a lost card is looked for again."""
        # Time that a conversation took is made up for; a long sleep is not.
        now = self._line.now()
        self._due = (self._due if now - self._due < _SILENCE else now) + dt
        if self._connected:
            self._hear(self._line.now())
        while self._line.now() < self._due:
            if self._connected:
                self._hear(self._due)
            else:
                self._find_again()
        return self.state

    def look(self) -> BodyState:
        """Return the state as it is now, however long nobody listened."""
        self._due = self._line.now()
        return self.step(_LOOK)

    def close(self) -> None:
        """Stop, if the card is there, and let go of the line."""
        with suppress(BodyError):
            self.stop()
        self._line.close()

    # --- the conversation ------------------------------------------------------------------------

    def _greet(self, patience: float) -> None:
        """Say hello, make sure that the card knows the body, and that it is stopped."""
        self._receiver = Receiver()
        until = self._line.now() + patience
        while True:
            try:
                crc, complete, _ = self._hello()
                break
            except _NoAnswerError:
                if self._line.now() >= until:
                    raise
        self._ask(Kind.STOP)
        wanted = self._asked_settings or self._wanted_settings(complete)
        self._settings = wanted
        if crc != wanted.crc or not complete:
            self.configure(wanted)
        self._ask(Kind.STATUS, struct.pack("<H", _REPORT_PERIOD))
        self._fresh = self._connected = True
        self._heard = self._line.now()
        self._await_phase()

    def _wanted_settings(self, complete: bool) -> CardSettings:
        of_robot = CardSettings.of(self._robot)
        if not complete:
            return of_robot
        joints = [JointSettings.unpack(self._read_piece(i)) for i in range(len(JOINTS))]
        general = General.unpack(self._read_piece(_SETTINGS_PIECE))
        return of_robot.with_calibration(CardSettings(general, tuple(joints)))

    def _read_piece(self, piece: int) -> bytes:
        return self._ask(Kind.READ, bytes((piece,)))

    def _hello(self) -> tuple[int, bool, bool]:
        """Return the check sum of the card's settings, whether complete, whether stored."""
        answer = self._ask(Kind.HELLO)
        version, *_, motors, complete, stored, crc = struct.unpack("<7BH", answer)
        if version != VERSION or motors != len(JOINTS):
            raise BodyError(
                f"The card's firmware speaks version {version} of the link and has {motors} "
                f"motors; {VERSION} and {len(JOINTS)} are needed. Upload this version's firmware "
                "(miburi card upload)."
            )
        return crc, bool(complete), bool(stored)

    def _ask(self, kind: Kind, payload: bytes = b"", patience: float = _PATIENCE) -> bytes:
        """Send a request until it is answered; return the answer, or raise what it says."""
        self._sequence = self._sequence % 255 + 1
        data = encode(Frame(kind, self._sequence, payload))
        for _ in range(_TRIES):
            self._answers.clear()
            try:
                self._line.write(data)
                until = self._line.now() + patience
                while self._line.now() < until:
                    self._listen(until)
                    for answer in self._answers:
                        if answer.kind == kind + ANSWER and answer.sequence == self._sequence:
                            return self._result(kind, answer)
                        if answer.kind == Kind.REFUSED + ANSWER and answer.payload[:1] == bytes(
                            (Result.VERSION,)
                        ):
                            return self._result(kind, answer)
                    self._answers.clear()
            except OSError as error:
                self._lose()
                raise _NoAnswerError(f"The line to the card is broken: {error}.") from error
        self._lose()
        raise _NoAnswerError(
            "The card does not answer. Check cable and power, and that it has Miburi's firmware "
            "(miburi card upload)."
        )

    def _result(self, kind: Kind, answer: Frame) -> bytes:
        result, detail = answer.payload[0], answer.payload[1:]
        match result:
            case Result.OK:
                return detail
            case Result.PHASE:
                phase = PHASES[detail[0]]
                raise BodyError(f"The card is {phase}; it does not take {kind.name.lower()} now.")
            case Result.SERVO:
                motor = f"{JOINTS[detail[0]]}: " if detail[0] < len(JOINTS) else "The "
                raise BodyError(f"{motor}{UNREADY[Reason(detail[1])]}. Then try again.")
            case Result.RANGE:
                raise _OutOfRangeError(kind, detail[0])
            case Result.SETTINGS:
                raise BodyError("The card has not been told all that it must know of the body.")
            case Result.VERSION:
                raise BodyError(
                    f"The card's firmware speaks version {detail[0]} of the link, this side "
                    f"{VERSION}. Upload this version's firmware (miburi card upload)."
                )
            case _:
                raise BodyError(f"The card did not understand {kind.name.lower()} ({result}).")

    def _listen(self, until: float) -> None:
        """Take in what the card says next; reports are noted, answers kept. May raise OSError."""
        for frame in self._receiver.add(self._line.read(until)):
            if frame.kind != Kind.REPORT:
                self._answers.append(frame)
                continue
            try:
                report = Report.of(frame.payload)
            except FrameError:
                continue
            self._heard = self._line.now()
            if self._fresh:
                # Its clock may have begun anew: the body's goes on.
                self._fresh = False
                self._history.clear()
                self._offset = self._heard - self._began - report.time / SECOND
            self._history.append(report)
            self.on_report(report)

    def _hear(self, until: float) -> None:
        """Listen; a broken line, or a long silence, is a lost card."""
        try:
            self._listen(until)
        except OSError:
            self._lose()
        if self._line.now() - self._heard > _SILENCE:
            self._lose()

    def _await_phase(self) -> None:
        """Wait for a report from after the latest answer."""
        before = self._history[-1].time if self._history else None
        until = self._line.now() + _SILENCE
        while self._connected and self._line.now() < until:
            self._hear(until)
            if self._history and self._history[-1].time != before:
                return
        if not self._history:
            raise BodyError("The card sends no reports; press its reset button and try again.")

    # --- a lost card -----------------------------------------------------------------------------

    def _lose(self) -> None:
        if self._connected:
            self._connected = False
            self._retry_at = self._line.now()
            self._own_stop = Stop(self._line.now() - self._began, StopReason.LINE_LOST)

    def _find_again(self) -> None:
        """Try once in a while to reach the card; then it is stopped, and says so."""
        if self._line.now() < self._retry_at:
            self._line.wait(min(self._retry_at, self._due))
            return
        self._retry_at = self._line.now() + _RETRY
        try:
            self._greet(0.0)
            if self.report.reason == Reason.STARTED:
                self._own_stop = None  # the card says so itself
        except BodyError:
            try:
                self._line.close()
                self._line = self._open()
            except OSError:
                pass

    def _begin_clock(self) -> None:
        """Let the body's clock begin at 0 now."""
        now = self._line.now()
        self._offset -= now - self._began
        self._began = self._due = now

    @property
    def _epoch(self) -> float:
        """The line's time at which the body's clock began, s."""
        return self._began

    def _time_of(self, micros: int) -> float:
        return micros / SECOND + self._offset


class _NoAnswerError(BodyError):
    """Nothing came back."""


class _OutOfRangeError(BodyError):
    """A value is outside what the card allows."""

    def __init__(self, kind: Kind, index: int) -> None:
        self.index = index
        motor = JOINTS[index % len(JOINTS)]
        what = f"the {'goal' if index < len(JOINTS) else 'speed'} of {motor}"
        named = what if kind is Kind.MOVE else f"value {index} of {kind.name.lower()}"
        super().__init__(f"The card refuses {named}: out of range.")
