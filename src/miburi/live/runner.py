"""The one clock of a live partner.

A thread paces the partner's deterministic steps. Commands run between two steps, Stop before all
others (:mod:`miburi.live.commands`); viewers read the latest snapshot, which is never changed, and
so cannot make the loop wait.
"""

import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from miburi.bodies import Body
from miburi.errors import BodyError
from miburi.feelings import TEMPERAMENTS, Expression, FeelingModel, Stimulus, shipped_temperament
from miburi.gestures import KeyPose, Repertoire, shipped_repertoire
from miburi.ground.log import log_once
from miburi.live.archive import Archive
from miburi.live.bodies import check_port, make_body
from miburi.live.commands import STOP_SINCE, Commands
from miburi.live.gaze import Gaze
from miburi.live.hand import GuidedHand
from miburi.live.log import Log
from miburi.live.observer import Observer
from miburi.live.press import By, Hold
from miburi.live.recording import Felt, step_messages
from miburi.live.speaker import Speaker
from miburi.live.state import Entry, MotorsOut, Sample, Snapshot, Spoken
from miburi.live.watchdog import USUAL, Lateness, Watchdog
from miburi.partner import Event, Partner, Solve, solve_with
from miburi.robot import Array, Robot, forward
from miburi.safety.contact import Rule
from miburi.senses import Impression, stimuli
from miburi.senses.answers import shipped_answers
from miburi.senses.language import Language

__all__ = ["SAMPLED", "STEP", "Runner"]

#: The loop's period in s; the encoders are read twice in it.
STEP = 0.02
#: When the loop is further behind than this, in s, the robot's time waits instead of hurrying.
_PATIENCE = 0.2
#: A live partner answers sooner than the one of the experiment (ours), s.
_PERIOD = 0.5
#: Steps in a row that may fail before the loop is given up: a second.
_FAILURES = 50
#: Samples that are kept.
SAMPLED = 1200
_STEPS_PER_SAMPLE, _STEPS_PER_MOTORS = 5, 50


class Runner:
    """A live partner; all methods but :meth:`tick` may be called from any thread.

    Parameters
    ----------
    robot
        The description.
    feelings
        The emotional model.
    body, port
        The kind of body to begin with, and a card's serial port.
    recordings
        Where recordings are kept.
    seed
        Chooses the small variations of gestures.
    rule
        The contact rule of simulated bodies; by default the robot's own.
    repertoire, solve
        The gestures, and the inverse kinematics; by default those that ship with Miburi.
    lateness, hold
        How late a step may be until the watchdog stops the body; who may end a Stop: by default a
        person's is ended by a person alone.
    """

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
    ) -> None:
        self.robot = robot
        self.repertoire, self.recordings = repertoire or shipped_repertoire(), recordings
        #: Ports that may be opened besides those that the system lists.
        self.ports = {port} if port else set[str]()
        self._feelings = feelings
        self._own_temperament = feelings.temperament
        self._seed, self._rule, self._solve = seed, rule, solve or solve_with()
        self._hold = hold or Hold()
        self._commands, self._log = Commands(self._stop), Log()
        self._thread: threading.Thread | None = None
        self._ending, self._over = threading.Event(), threading.Event()
        self._watchdog = Watchdog(STEP, self._halt, lambda: self._give_up("hangs"), lateness)
        self._was_late, self._failures, self._patience = False, 0, 0.0
        self._snapshot: Snapshot
        self._on_failure: Callable[[], None] = lambda: None
        #: Why the loop had to be given up; None while it lives.
        self.failure: str | None = None
        self._felt: list[Felt] = []  # since the last step
        self._samples: deque[tuple[int, Sample]] = deque(maxlen=SAMPLED)
        self._speaker, self._paused, self._at_home = Speaker(seed), False, False
        self._serial = self._stop_seen_in = 0  # the latter is of the first state with the last Stop
        self._use(body, port, make_body(body, robot, port, rule))

    # What viewers read.

    @property
    def reachable(self) -> bool:
        """Whether the loop lives."""
        return self.failure is None

    @property
    def snapshot(self) -> Snapshot:
        """The latest state."""
        return self._snapshot

    @property
    def body_name(self) -> str:
        """The kind of body that moves now."""
        return self._observer.name

    @property
    def motors(self) -> MotorsOut:
        """How the motors are, at most a second old."""
        return self._motors

    @property
    def at_home(self) -> bool:
        """Whether :meth:`close` has brought the body back to neutral."""
        return self._at_home

    @property
    def held(self) -> bool:
        """Whether somebody has stopped the body, and nobody has released it."""
        return self._partner.held

    @property
    def body(self) -> Body:
        """The body that moves now."""
        return self._partner.body

    @property
    def temperaments(self) -> list[str]:
        """The temperaments to choose from: those that ship, and the one that it began with."""
        return [*dict.fromkeys((*TEMPERAMENTS, self._own_temperament.name))]

    @property
    def read_until(self) -> float:
        """Now: nothing waits here."""
        return time.monotonic()

    def log(self, after: int = 0) -> list[Entry]:
        """Return the latest entries whose number is above ``after``."""
        return self._log.after(after)

    def samples(self) -> list[Sample]:
        """Return the last two minutes, ten samples a second."""
        return [sample for _, sample in self.samples_after(0)]

    def samples_after(self, serial: int) -> list[tuple[int, Sample]]:
        """Return the samples that were taken after a step, with the serials of their steps."""
        return [taken for taken in self._samples.copy() if taken[0] > serial]

    # What the outside asks for: each runs between two steps.

    def stimulate(self, stimulus: Stimulus) -> Future[None]:
        """Let the partner feel something."""
        return self._commands.ask(lambda: self._feel(stimulus))

    def take(self, heard: Impression, words: str | None = None) -> Future[tuple[Stimulus, ...]]:
        """Let the partner take what somebody showed, as its temperament does; the log says why."""

        def run() -> tuple[Stimulus, ...]:
            if heard.distress is not None:
                self._speaker.attend(self._note("distress", name=heard.distress, detail=words))
            calm = self._speaker.distress is not None and heard.source == "speech"
            felt = () if calm else stimuli(heard, self._feelings.temperament)
            for stimulus in felt:
                self._feel(stimulus, heard)
            return felt

        return self._commands.ask(run)

    def see(self, x: float | None) -> Future[None]:
        """Let the partner turn to a face at ``x``, 0 to 1 of a picture's width; None: to none."""
        return self._commands.ask(lambda: self._gaze.see(x, self._partner.body.state))

    def answer(self, heard: Impression, language: Language) -> Future[str]:
        """Let the partner answer what it heard with a small answer of its own, aloud."""
        shipped_answers(language)  # they are read here, not in the loop
        answer, felt = self._speaker.answer, self._feelings.express
        return self._commands.ask(lambda: self._tell(answer(heard, language, felt())))

    def speak(self, text: str) -> Future[str]:
        """Let the partner say something aloud, coloured by what it feels; the latest wish wins."""
        say, felt = self._speaker.say, self._feelings.express
        return self._commands.ask(lambda: self._tell(say(text, felt())))

    def perform(
        self, expression: Expression | None, poses: list[KeyPose] | None = None
    ) -> Future[None]:
        """Perform a gesture once; refused while the partner rests."""

        def run() -> None:
            if self._paused:
                raise BodyError("the partner is paused; resume it first.")
            self._partner.perform(expression, poses)

        return self._commands.ask(run)

    def stop(self, by: By = "person") -> Future[None]:
        """Stop the body until :meth:`release`; never refused, and before any other command."""
        return self._commands.stop(by)

    def release(
        self,
        *,
        by_person: bool = False,
        came: float | None = None,  # noqa: ARG002  # here Stops and wishes are in order anyway
        seen: int | None = None,
    ) -> Future[None]:
        """Let a stopped body go back to neutral as soon as it has come to rest, and go on.

        A person (``by_person``) may end any stop; a program neither a person's Stop nor the pause
        after a contact; nobody one where Stop was pressed since the state that was ``seen``.
        """

        def run() -> None:
            if seen is not None and not self._stop_seen_in <= seen <= self._serial:
                raise BodyError(STOP_SINCE)
            self._hold.check(by_person=by_person)
            self._partner.release(by_person=by_person)
            self._note("released", by=self._hold.end(by_person=by_person))

        return self._commands.ask_unless_stopped(run)

    def pause(self, paused: bool) -> Future[None]:
        """Rest at neutral, or go on."""

        def run() -> None:
            if paused != self._paused:
                self._paused = paused
                (self._partner.pause if paused else self._partner.resume)()
                self._note("paused" if paused else "resumed")

        return self._commands.ask(run)

    def hand(self, position: Array | None, along: Array) -> Future[None]:
        """Let the simulated human hand go somewhere, or away (None).

        Raises
        ------
        BodyError
            The body is no simulation.
        InputError
            The direction has no length.
        """
        guide = self._hand.guide
        return self._commands.ask(lambda: guide(self._partner.body.touchable, position, along))

    def temperament(self, name: str) -> Future[None]:
        """Go on with another of the :attr:`temperaments`."""
        own = self._own_temperament
        chosen = own if name == own.name else shipped_temperament(name)

        def run() -> None:
            self._feelings.temperament = chosen
            self._note("temperament", name=name)

        return self._commands.ask(run)

    def feelings(self) -> Future[dict[str, Any]]:
        """Return the state of the feelings, as :meth:`FeelingModel.save` does."""
        return self._commands.ask(self._feelings.save)

    def use(self, name: str, port: str | None = None) -> Future[None]:
        """Move another body from now on; it is made in the caller's thread.

        Raises
        ------
        InputError, BodyError
            There is no such body here; see :func:`miburi.live.bodies.make_body`.
        """
        if port is not None and port == self._observer.port:
            again = "a lost one is found again by itself"
            raise BodyError(f"the card at {port} is this body already; {again}.")
        if port is not None and port not in self.ports:
            check_port(port)
        body = make_body(name, self.robot, port, self._rule)

        def run() -> None:
            before = self._partner
            before.body.close()  # it stops; the next one may be at the same port
            self._use(name, port, body)
            self._partner.succeed(before)
            self._note("body", name=name)

        return self._commands.ask(run)

    # The loop.

    def tick(self) -> None:
        """Run the waiting commands, then let one step pass."""
        if self._was_late:
            self._was_late = False
            self._partner.make_sure()
        self._commands.run()
        self._partner.calm = self._speaker.step(STEP)
        self._hand.step(self._partner.body.touchable, STEP)
        self._partner.gaze = self._gaze.turn(self._partner.body.state.time)
        events: list[Event] = []
        try:
            events = self._partner.step(STEP)
        except BodyError as error:
            # A card may have stopped, or been lost, between its report and our command: it is
            # stopped then, and the next state says why. What repeats is said once.
            if self._log.latest != str(error):
                self._note("refused", name=str(error))
        self._serial += 1
        sampled = self._serial % _STEPS_PER_SAMPLE == 0
        try:
            stopped = self._observer.take(events)
        except Exception as error:
            stopped = None
            self._excuse(error)
        for event in events:
            self._log.take(event, self._partner.body.state.time, stopped, self._motors.rule.ratio)
        self._record(events, sampled)
        try:
            self._look()
            if sampled:
                self._samples.append((self._serial, Sample.of(self._snapshot.state)))
        except Exception as error:
            self._excuse(error)
            body, held = self._partner.body.state, self._partner.held
            self._snapshot = self._snapshot.at_least(self._serial, body, held, self._log.number)
        self._commands.settle()

    def start(self, on_failure: Callable[[], None] = lambda: None) -> None:
        """Start the thread that paces the steps, and the watchdog's.

        ``on_failure`` is called once, from any thread, when :attr:`failure` says why it ended.
        """
        # A solver that is still to be compiled would hold up the loop, and Stop with it, for 20 s.
        neutral = self.robot.neutral
        self._solve(self.robot, forward(self.robot, neutral), neutral)
        self._on_failure = on_failure
        self._watchdog.beat()
        self._thread = threading.Thread(target=self._pace, name="partner", daemon=True)
        self._thread.start()
        threading.Thread(target=self._watchdog.watch, args=(self._over,), daemon=True).start()

    def close(self, patience: float = 6.0) -> None:
        """Bring the body home in at most ``patience`` s, end recording, and stop the thread.

        A body that somebody stopped stays where it is.
        """
        if self._thread is not None:
            self._patience = patience
            self._ending.set()
            self._thread.join(None if self.failure is None else 1.0)
            self._over.set()
        if self.failure is not None:
            self.recordings.end()
            return  # the body was stopped; whoever hangs at it must not hang us
        self._thread = None
        self.recordings.end()
        self._at_home = self._partner.at_rest
        self._partner.body.close()

    def _pace(self) -> None:
        due = time.monotonic()
        give_up = None
        while True:
            if self._ending.is_set() and give_up is None:
                give_up = time.monotonic() + self._patience
                self._partner.rest()
            self._watchdog.beat()
            try:
                self.tick()
                self._failures = 0
            except Exception as error:
                self._fail(error)
            if self.failure is not None:
                return
            over = give_up is not None and time.monotonic() > give_up
            if give_up is not None and (over or self._partner.at_rest or self._partner.held):
                return
            due += STEP
            ahead = due - time.monotonic()
            if ahead > 0:
                time.sleep(ahead)  # the one place where the partner's time meets the clock
            elif ahead < -_PATIENCE:
                due = time.monotonic()

    def _fail(self, error: Exception) -> None:
        """Stop the body, and begin anew with the next step; give up when all of them fail."""
        self._halt()
        self._excuse(error, "loop_failed")
        self._failures += 1
        if self._failures >= _FAILURES:
            self._give_up(f"fails at every step ({type(error).__name__}: {error})")

    def _halt(self) -> None:
        """Stop the body without the loop, and show it to everybody; any thread may call this."""
        self._was_late = True
        self._partner.halt()
        self._snapshot = self._snapshot.halted()
        self._commands.settle()

    def _give_up(self, why: str) -> None:
        self.failure = f"the partner's loop {why}; the body has been stopped where it was."
        self._on_failure()

    def note_talk(self, where: str, failure: str | None = None) -> Future[Entry]:
        """Note where what is said to it goes from now on, or why no reply came from there."""
        kind, name = ("talk", where) if failure is None else ("talk_failed", failure)
        return self._commands.ask(lambda: self._note(kind, name=name))

    def _stop(self, by: By) -> None:
        if self._hold.press(by):
            self._note("pressed", by=by)
        self._partner.stop()
        self._stop_seen_in = self._serial + 1

    def _feel(self, stimulus: Stimulus, impression: Impression | None = None) -> None:
        self._feelings.stimulate(stimulus)
        felt = Felt(self._partner.body.state.time, stimulus, impression)
        self._log.feel(felt)
        self._felt.append(felt)

    def _tell(self, spoken: Spoken) -> str:
        self._note("spoken", name=spoken.text, feeling=spoken.feeling)
        self._partner.gesticulate(self._speaker.time(spoken))
        return spoken.text

    def _use(self, name: str, port: str | None, body: Body) -> None:
        self._partner = Partner(
            body,
            self._feelings,
            repertoire=self.repertoire,
            period=_PERIOD,
            solve=self._solve,
            life=self._seed,
        )
        if self._paused:
            self._partner.pause()
        self._hand, self._gaze = GuidedHand(), Gaze(rides=name == "card")
        self._observer = Observer(name, port, self._partner, self._feelings)
        self._motors = self._observer.motors()
        self._serial += 1
        self._look()

    def _look(self) -> None:
        """Renew what viewers see."""
        if self._serial % _STEPS_PER_MOTORS == 0:
            self._motors = self._observer.motors()
        state = self._observer.state(
            self._serial,
            paused=self._paused,
            recording=self.recordings.current,
            recording_end=self.recordings.ended and self.recordings.ended._asdict(),
            rule=self._motors.rule,
            hand_out=self._hand.goal is not None,
            spoken=self._speaker.spoken,
            distress=self._speaker.distress,
            latest=self._log.number,
        )
        self._snapshot = Snapshot(state)

    def _record(self, events: list[Event], sampled: bool) -> None:
        """Hand the step to the recording, if one is on; note what became of recordings."""
        for kind, name, reason, detail in self.recordings.news():
            self._note(kind, name=name, reason=reason, detail=detail or None)
        feelings, felt = (self._feelings if sampled else None), self._felt
        self._felt = []
        state = self._partner.body.state
        self.recordings.write(lambda: step_messages(state, feelings, events, felt))

    def _excuse(self, error: Exception, kind: str = "trouble") -> None:
        """Note that what only looks on, or the loop, has failed; what repeats is noted once."""
        name = f"{type(error).__name__}: {error}"
        if not self._log.holds(kind, name):
            log_once(f"{name} in the partner's loop", error)
            self._note(kind, name=name)

    def _note(self, kind: str, **content: Any) -> Entry:
        return self._log.note(self._partner.body.state.time, kind, **content)
