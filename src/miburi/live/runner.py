"""The loop of a running partner; :mod:`miburi.live.pace` times its steps by the clock.

Requests are carried out between two steps, and a Stop before all of them
(:mod:`miburi.live.commands`). Viewers read the latest snapshot, which is immutable, so they never
hold up the loop.
"""

import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from miburi.bodies import Body
from miburi.errors import BodyError
from miburi.feelings import TEMPERAMENTS, FeelingModel
from miburi.gestures import Repertoire, shipped_repertoire
from miburi.ground.log import log_once
from miburi.live.bodies import make_body
from miburi.live.commands import Commands
from miburi.live.events.log import Log
from miburi.live.events.store import EventStore
from miburi.live.gaze import Gaze
from miburi.live.granting import Inside, command
from miburi.live.hand import GuidedHand
from miburi.live.observer import Observer
from miburi.live.pace import STEP, Pace
from miburi.live.recording.archive import Archive
from miburi.live.recording.tape import Tape
from miburi.live.speaker import Speaker
from miburi.live.state import Sample, Snapshot, StopOut
from miburi.live.view import LivePartner
from miburi.live.watchdog import USUAL, Lateness
from miburi.live.wishes import Granted, Release, Wish
from miburi.partner import Event, Partner, Solve, solve_with
from miburi.robot import Robot, forward
from miburi.safety.contact import Rule
from miburi.safety.stop import StopReason
from miburi.senses.happenings import notice
from miburi.serving.press import PRESSED, Hold, Press
from miburi.version import __version__

__all__ = ["STEP", "Runner"]

#: The ``period`` of a running :class:`Partner`, in s, and the time, in s, during which a repeated
#: refusal is logged only once (our choice).
_PERIOD, _REPEATS = 0.5, 60.0
_STEPS_PER_SAMPLE, _STEPS_PER_MOTORS = 5, 50


class Runner(LivePartner):
    """A live partner; all methods but :meth:`tick` may be called from any thread.

    Parameters
    ----------
    robot
        The robot's description.
    feelings
        The emotional model.
    body, port
        The kind of the first body, and the serial port of an Arduino card.
    seed
        Chooses the small variations of gestures.
    rule
        The contact rule of simulated bodies; by default the robot's own.
    repertoire, solve
        The gestures, and the inverse kinematics; by default those that ship with Miburi.
    lateness, hold
        ``lateness`` says how late a step may be before the watchdog stops the body. ``hold`` says
        who may end a Stop: by default, only a person may end a person's Stop, and a restart forgets
        the Stop.
    events, boot
        ``events`` is the store in which events survive a restart; by default there is no store.
        ``boot`` is the id of this run, 8 hex digits; by default it is a new one.
    """

    recordings: Archive

    def __init__(
        self,
        robot: Robot,
        feelings: FeelingModel,
        recordings: Archive,
        *,
        body: str = "simulated",
        port: str | None = None,
        seed: int = 0,
        rule: Rule | None = None,
        repertoire: Repertoire | None = None,
        solve: Solve | None = None,
        lateness: Lateness = USUAL,
        hold: Hold | None = None,
        events: EventStore | None = None,
        boot: str | None = None,
    ) -> None:
        super().__init__()
        self.robot, self.own_temperament = robot, feelings.temperament
        self.temperaments = [*dict.fromkeys((*TEMPERAMENTS, self.own_temperament.name))]
        self.repertoire, self.recordings = repertoire or shipped_repertoire(), recordings
        self._solve, self._seed = solve or solve_with(), seed
        self._inside = Inside(
            robot,
            rule,
            feelings,
            self.own_temperament,
            recordings,
            Log(events, boot),
            Speaker(),
            hold or Hold(),
            self._use,
            {port} if port else set(),
        )
        self._commands = Commands(self._inside.stop)
        self._pace, self._was_late, self._at_home = Pace(self, lateness), False, False
        self.history = self._inside.log.history
        self._tape = Tape(feelings, self.history, seed)
        self._use(body, port, make_body(body, robot, port, rule))
        self._inside.note("started", name=__version__)
        if self._inside.hold.before is not None:
            self._inside.stop(*self._inside.hold.before)

    @property
    def failure(self) -> str | None:
        """Why the loop was abandoned; None while it runs."""
        return self._pace.failure

    @property
    def reachable(self) -> bool:
        """Whether the loop is still running."""
        return self.failure is None

    @property
    def at_home(self) -> bool:
        """Whether :meth:`close` has brought the body back to neutral."""
        return self._at_home

    @property
    def held(self) -> bool:
        """Whether somebody has stopped the body, and nobody has released it."""
        return self._inside.partner.held

    @property
    def body(self) -> Body:
        """The present body."""
        return self._inside.partner.body

    @property
    def read_until(self) -> float:
        """The present time: within one process, there are no messages that may still be unread."""
        return time.monotonic()

    def ask(self, wish: Wish[Granted]) -> Future[Granted]:
        """Queue a request for the time between two steps; return a future for the answer.

        Raises BusyError if too many requests are waiting; BodyError or InputError if the request is
        refused at once.
        """
        run = command(wish, self._inside)
        if isinstance(wish, Release):
            return self._commands.ask_unless_stopped(run)
        return self._commands.ask(run)

    def stop(self, press: Press = PRESSED) -> Future[None]:
        """Stop the body until a :class:`Release`, before other commands; this is never refused."""
        return self._commands.stop(press)

    def feelings(self) -> Future[dict[str, Any]]:
        """Return the state of the feelings, as :meth:`FeelingModel.save` does."""
        return self._commands.ask(self._inside.feelings.save)

    def tick(self) -> None:
        """Run the waiting commands, then one step."""
        inside = self._inside
        if self._was_late:
            self._was_late = False
            inside.partner.make_sure()
        self._commands.run()
        partner = inside.partner
        inside.agenda.step(partner, inside.feelings.express(), STEP)
        spoken = inside.speaker.spoken if inside.speaker.speaking else None
        company = partner.company
        company.calm = inside.speaker.distress is not None
        company.attends = inside.attending.step(STEP, None if spoken is None else spoken.number)
        company.gaze = inside.gaze.turn(partner.body.state.time)
        inside.hand.step(partner.body.touchable, STEP)
        events: list[Event] = []
        try:
            events = partner.step(STEP)
        except BodyError as error:
            # A card may have stopped, or been lost, between its report and our command. Either way
            # the body is stopped, and the next state tells the cause.
            if not inside.log.holds("refused", str(error), seconds=_REPEATS):
                inside.note("refused", name=str(error))
        inside.serial += 1
        sampled = inside.serial % _STEPS_PER_SAMPLE == 0
        try:
            stopped = self._observer.take(events)
        except Exception as error:
            stopped = None
            self.excuse(error)
        if stopped and stopped.reason is StopReason.TOUCHED:
            inside.sense(notice("lead"))
        for event in events:
            inside.agenda.take(event, stopped, self.motors.rule.ratio)
        self._record(events, stopped, sampled)
        try:
            self._look()
            if sampled:
                self._samples.append((inside.serial, Sample.of(self.snapshot.state)))
        except Exception as error:
            self.excuse(error)
            self.snapshot = self.snapshot.at_least(
                inside.serial, partner.body.state, partner.held, self.history.number
            )
        self._steps.append(self.snapshot)
        self._commands.settle()

    def start(self, on_failure: Callable[[], None] = lambda: None) -> None:
        """Start the loop's and the watchdog's threads.

        ``on_failure`` is called once, from any thread, if the loop is abandoned (:attr:`failure`).
        """
        # Compile the solver now: this takes 20 s, and would later hold up the loop and any Stop.
        neutral = self.robot.neutral
        self._solve(self.robot, forward(self.robot, neutral), neutral)
        self._pace.start(on_failure)

    def close(self, patience: float = 6.0) -> None:
        """Return the body to neutral within ``patience`` s, end recording, and stop the threads.

        A body that somebody stopped stays where it is.
        """
        self._pace.end(patience)
        self.recordings.end()
        self._inside.log.close()
        self._inside.hold.close()
        if self.failure is None:  # otherwise the loop hung; closing the body might hang, too
            self._at_home = self._inside.partner.at_rest
            self._inside.partner.body.close()

    def rest(self) -> None:
        """Start the return to neutral; for the loop's thread only."""
        self._inside.partner.rest()

    @property
    def settled(self) -> bool:
        """Whether the body is at neutral, or somebody's Stop keeps it where it is."""
        return self._inside.partner.at_rest or self._inside.partner.held

    def halt(self) -> None:
        """Stop the body without the loop, and show that it is stopped; any thread may call this."""
        self._was_late = True
        self._inside.partner.halt()
        self.snapshot = self.snapshot.halted()
        self._commands.settle()

    def _use(self, name: str, port: str | None, body: Body) -> None:
        inside = self._inside
        inside.port = port
        inside.partner = Partner(
            body, inside.feelings, repertoire=self.repertoire, period=_PERIOD, solve=self._solve,
            life=self._seed,
        )  # fmt: skip
        if inside.paused:
            inside.partner.pause()
        inside.hand, inside.gaze = GuidedHand(), Gaze(rides=name == "card")
        self._observer = Observer(name, port, inside.partner, inside.feelings)
        self.motors = self._observer.motors()
        inside.serial += 1
        self._look()

    def _look(self) -> None:
        inside = self._inside
        if inside.serial % _STEPS_PER_MOTORS == 0:
            self.motors = self._observer.motors()
        state = self._observer.state(
            inside.serial,
            paused=inside.paused,
            recording=self.recordings.current,
            recording_end=self.recordings.ended and self.recordings.ended._asdict(),
            rule=self.motors.rule,
            hand_out=inside.hand.goal is not None,
            spoken=inside.speaker.spoken,
            distress=inside.speaker.distress,
            words=inside.log.words,
            boot=self.history.boot,
            latest=self.history.number,
        )
        self.snapshot = Snapshot(state)

    def _record(self, events: list[Event], stopped: StopOut | None, sampled: bool) -> None:
        """Pass the step to any recording; log recordings that began, ended or were deleted."""
        for kind, name, reason, detail in self.recordings.news():
            self._inside.note(kind, name=name, reason=reason, detail=detail or None)
        felt, self._inside.felt, partner = self._inside.felt, [], self._inside.partner
        self._tape.write(self.recordings, partner, events, felt, stopped, sampled=sampled)

    def excuse(self, error: Exception, kind: str = "trouble") -> None:
        """Log that an observer, or the loop itself, has failed; repeats are not logged."""
        name = f"{type(error).__name__}: {error}"
        if not self._inside.log.holds(kind, name):
            log_once(f"{name} in the partner's loop", error)
            self._inside.note(kind, name=name)
