"""The one clock of a live partner.

A thread paces the partner's deterministic steps. Commands run between two steps, Stop before all
others (:mod:`miburi.live.commands`); viewers read the latest snapshot, which is never changed, and
so cannot make the loop wait.
"""

import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any

from miburi.bodies import Body
from miburi.errors import BodyError
from miburi.feelings import TEMPERAMENTS, Expression, FeelingModel, Stimulus, shipped_temperament
from miburi.feelings.temperament import RestLevel
from miburi.gestures import KeyPose, Repertoire, shipped_repertoire
from miburi.ground.log import log_once
from miburi.languages.rhythm import Rhythm
from miburi.live.archive import Archive
from miburi.live.bodies import check_port, make_body
from miburi.live.commands import STOP_SINCE, Commands
from miburi.live.events.log import History, Log
from miburi.live.events.model import LiveEvent
from miburi.live.events.store import EventStore
from miburi.live.gaze import Gaze
from miburi.live.hand import GuidedHand
from miburi.live.observer import Observer
from miburi.live.pace import STEP, Pace
from miburi.live.recording import Felt
from miburi.live.speaker import Speaker
from miburi.live.stage import Act
from miburi.live.state import MotorsOut, Sample, Snapshot, StopOut, Tune
from miburi.live.tape import Tape
from miburi.live.watchdog import USUAL, Lateness
from miburi.live.wishes import Wishes
from miburi.partner import Event, Partner, Solve, solve_with
from miburi.robot import Array, Robot, forward
from miburi.safety.contact import Rule
from miburi.safety.stop import StopReason
from miburi.senses import Impression, stimuli
from miburi.senses.happenings import notice
from miburi.serving.press import PRESSED, By, Hold, Press
from miburi.version import __version__

__all__ = ["SAMPLED", "STEP", "STEPPED", "Runner"]

#: The period of a live partner, and in how many s a refusal is noted once (ours); s.
_PERIOD, _REPEATS = 0.5, 60.0
#: Samples and states that are kept.
SAMPLED, STEPPED = 1200, 250
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
    events, boot
        Where events outlast the partner, by default nowhere; and the id of this start, 8 hex
        digits, by default a new one.
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
        events: EventStore | None = None,
        boot: str | None = None,
    ) -> None:
        self.robot = robot
        self.repertoire, self.recordings = repertoire or shipped_repertoire(), recordings
        #: Ports that may be opened besides those that the system lists.
        self.ports = {port} if port else set[str]()
        self._feelings, self.own_temperament = feelings, feelings.temperament
        self._rule, self._solve = rule, solve or solve_with()
        self._move: Callable[[Body], Partner] = lambda body: Partner(
            body, feelings, repertoire=self.repertoire, period=_PERIOD, solve=self._solve,
            life=seed,
        )  # fmt: skip
        self._hold = hold or Hold()
        self._commands, self._log = Commands(self._stop), Log(events, boot)
        self._pace, self._was_late = Pace(self, lateness), False
        self._snapshot: Snapshot
        self._felt: list[Felt] = []  # since the last step
        self._steps: deque[Snapshot] = deque(maxlen=STEPPED)
        self._samples: deque[tuple[int, Sample]] = deque(maxlen=SAMPLED)
        self._speaker, self._paused, self._at_home = Speaker(), False, False
        self._wishes = Wishes(self._note, self._speaker)
        self._tape = Tape(feelings, self.history, seed)
        self._serial = self._stop_seen_in = 0  # the latter is of the first state with the last Stop
        self._use(body, port, make_body(body, robot, port, rule))
        self._note("started", name=__version__)

    @property
    def failure(self) -> str | None:
        """Why the loop had to be given up; None while it lives."""
        return self._pace.failure

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
        return [*dict.fromkeys((*TEMPERAMENTS, self.own_temperament.name))]

    @property
    def read_until(self) -> float:
        """Now: nothing waits here."""
        return time.monotonic()

    @property
    def history(self) -> History:
        """What has happened, over restarts."""
        return self._log.history

    def steps_after(self, serial: int) -> list[Snapshot]:
        """Return the states after one, the oldest first; at most those of the last five seconds."""
        return [step for step in self._steps.copy() if step.serial > serial]

    def samples_after(self, serial: int) -> list[tuple[int, Sample]]:
        """Return the samples of the last two minutes after a step, with their steps' serials."""
        return [taken for taken in self._samples.copy() if taken[0] > serial]

    def stimulate(self, stimulus: Stimulus, by: By = "person") -> Future[str]:
        """Let the partner feel something; returns the event's id."""
        return self._commands.ask(lambda: self._feel(stimulus, by=by).id)

    def take(self, heard: Impression, words: str | None = None) -> Future[tuple[Stimulus, ...]]:
        """Let the partner take what somebody showed, as its temperament does; the log says why."""

        def run() -> tuple[Stimulus, ...]:
            told = words if self._log.words else None
            if heard.source == "speech":
                strength = None if heard.feeling is None else heard.strength
                self._note("heard", feeling=heard.feeling, strength=strength, text=told)
            if heard.distress is not None:
                self._speaker.attend(self._note("distress", name=heard.distress, text=told))
            calm = self._speaker.distress is not None and heard.source == "speech"
            return () if calm else self._sense(heard)

        return self._commands.ask(run)

    def lean(self, leaning: Array | None) -> Future[None]:
        """Let moods rest (n,) off the temperament's while a person is there; None: no more."""
        return self._commands.ask(lambda: self._feelings.lean(leaning))

    def see(self, x: float | None) -> Future[None]:
        """Let the partner turn to a face at ``x``, 0 to 1 of a picture's width; None: to none."""
        return self._commands.ask(lambda: self._gaze.see(x, self._partner.body.state))

    def speak(
        self,
        text: str,
        by: By | None = "person",
        tune: Tune | None = None,
        why: str | None = None,
    ) -> Future[str]:
        """Let the partner say something aloud, coloured by what it feels; the latest wish wins."""
        felt = self._feelings.express
        return self._commands.ask(
            lambda: self._wishes.say(self._partner, text, felt(), by, tune, why)
        )

    def keep_time(self, number: int, rhythm: Rhythm) -> Future[None]:
        """Beat to the sound of a sentence, by its number, which is known now and soon heard."""
        return self._commands.ask(lambda: self._wishes.keep_time(self._partner, number, rhythm))

    def perform(
        self,
        expression: Expression | None,
        poses: Sequence[KeyPose] | None = None,
        name: str = "gesture",
        by: By = "person",
    ) -> Future[str]:
        """Perform a gesture once; refused while the partner rests."""
        return self._ask_awake(
            lambda: self._wishes.perform(self._partner, expression, poses, name, by)
        )

    def act(self, acts: Sequence[Act], queued: bool, by: By = "person") -> Future[str]:
        """Perform acts in their order, after what waits or instead of what is on."""
        return self._ask_awake(lambda: self._wishes.act(self._partner, acts, by, queued=queued))

    def allow_words(self, allowed: bool) -> Future[LiveEvent]:
        """Let events tell what is said to the partner from now on, or forget what was said."""
        self._log.allow_words(allowed)  # the disk is waited for here, not in the loop
        return self._commands.ask(lambda: self._note("words", name="on" if allowed else "off"))

    def _ask_awake(self, run: Callable[[], str]) -> Future[str]:
        def unless_paused() -> str:
            if self._paused:
                raise BodyError("the partner is paused; resume it first.")
            return run()

        return self._commands.ask(unless_paused)

    def stop(self, press: Press = PRESSED) -> Future[None]:
        """Stop the body until :meth:`release`; never refused, and before any other command."""
        return self._commands.stop(press)

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
            self._wishes.release(self._hold.end(by_person=by_person))

        return self._commands.ask_unless_stopped(run)

    def pause(self, paused: bool) -> Future[None]:
        """Rest at neutral, or go on."""

        def run() -> None:
            if paused != self._paused:
                self._paused = paused
                (self._partner.pause if paused else self._partner.resume)()
                self._wishes.pause()
                self._note("paused" if paused else "resumed")

        return self._commands.ask(run)

    def hand(self, position: Array | None, along: Array) -> Future[None]:
        """Let the simulated human hand go somewhere, or away (None).

        BodyError: the body is no simulation. InputError: the direction has no length.
        """
        guide = self._hand.guide
        return self._commands.ask(lambda: guide(self._partner.body.touchable, position, along))

    def temperament(self, name: str, rest: RestLevel | None = None) -> Future[None]:
        """Go on with another of the :attr:`temperaments`, or with one that rests in another way."""
        own = self.own_temperament
        chosen = own if name == own.name else shipped_temperament(name)
        chosen = chosen.model_copy(update={"at_rest": rest or chosen.at_rest})

        def run() -> None:
            self._feelings.temperament = chosen
            self._note("temperament", name=name)

        return self._commands.ask(run)

    def feelings(self) -> Future[dict[str, Any]]:
        """Return the state of the feelings, as :meth:`FeelingModel.save` does."""
        return self._commands.ask(self._feelings.save)

    def use(self, name: str, port: str | None = None) -> Future[None]:
        """Move another body from now on; it is made in the caller's thread.

        Raises what :func:`miburi.live.bodies.make_body` does where there is no such body here.
        """
        if port is not None and port == self._observer.port:
            raise BodyError(f"the card at {port} moves already; lost, it is found again by itself.")
        if port is not None and port not in self.ports:
            check_port(port)
        body = make_body(name, self.robot, port, self._rule)

        def run() -> None:
            before = self._partner
            self._wishes.leave(before)
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
        self._wishes.step(self._partner, self._feelings.express(), STEP)
        self._partner.calm = self._speaker.distress is not None
        self._hand.step(self._partner.body.touchable, STEP)
        self._partner.gaze = self._gaze.turn(self._partner.body.state.time)
        events: list[Event] = []
        try:
            events = self._partner.step(STEP)
        except BodyError as error:
            # A card may have stopped, or been lost, between its report and our command: it is
            # stopped then, and the next state says why. What repeats is said once.
            if not self._log.holds("refused", str(error), seconds=_REPEATS):
                self._note("refused", name=str(error))
        self._serial += 1
        sampled = self._serial % _STEPS_PER_SAMPLE == 0
        try:
            stopped = self._observer.take(events)
        except Exception as error:
            stopped = None
            self.excuse(error)
        if stopped and stopped.reason is StopReason.TOUCHED:
            self._sense(notice("lead"))
        for event in events:
            self._wishes.take(event, stopped, self._motors.rule.ratio)
        self._record(events, stopped, sampled)
        try:
            self._look()
            if sampled:
                self._samples.append((self._serial, Sample.of(self._snapshot.state)))
        except Exception as error:
            self.excuse(error)
            body, held = self._partner.body.state, self._partner.held
            self._snapshot = self._snapshot.at_least(self._serial, body, held, self.history.number)
        self._steps.append(self._snapshot)
        self._commands.settle()

    def start(self, on_failure: Callable[[], None] = lambda: None) -> None:
        """Start the thread that paces the steps, and the watchdog's.

        ``on_failure`` is called once, from any thread, when :attr:`failure` says why it ended.
        """
        # A solver that is still to be compiled would hold up the loop, and Stop with it, for 20 s.
        neutral = self.robot.neutral
        self._solve(self.robot, forward(self.robot, neutral), neutral)
        self._pace.start(on_failure)

    def close(self, patience: float = 6.0) -> None:
        """Bring the body home in at most ``patience`` s, end recording, and stop the thread.

        A body that somebody stopped stays where it is.
        """
        self._pace.end(patience)
        self.recordings.end()
        self._log.close()
        if self.failure is None:  # else the body was stopped; whoever hangs at it must not hang us
            self._at_home = self._partner.at_rest
            self._partner.body.close()

    def rest(self) -> None:
        """Begin to come home; only the thread that paces calls this, and :meth:`halt`."""
        self._partner.rest()

    @property
    def settled(self) -> bool:
        """Whether the body is home, or somebody holds it where it is."""
        return self._partner.at_rest or self._partner.held

    def halt(self) -> None:
        """Stop the body without the loop, and show it to everybody; any thread may call this."""
        self._was_late = True
        self._partner.halt()
        self._snapshot = self._snapshot.halted()
        self._commands.settle()

    def note_talk(self, where: str, failure: str | None = None) -> Future[LiveEvent]:
        """Note where what is said to it goes from now on, or why no reply came from there."""
        kind = "talk" if failure is None else "talk_failed"
        return self._commands.ask(lambda: self._note(kind, name=failure or where))

    def _stop(self, by: By) -> None:
        if self._hold.press(by):
            self._note("pressed", by=by)
        self._partner.stop()
        self._wishes.stop()
        self._stop_seen_in = self._serial + 1

    def _feel(
        self, stimulus: Stimulus, impression: Impression | None = None, by: By | None = None
    ) -> LiveEvent:
        self._feelings.stimulate(stimulus)
        self._felt.append(Felt(self._partner.body.state.time, stimulus, impression))
        return self._note(
            "stimulus",
            feeling=stimulus.feeling,
            strength=stimulus.strength,
            source=stimulus.source,
            detail=impression and impression.reason,
            why=impression and impression.why,
            by=by,
        )

    def _sense(self, heard: Impression) -> tuple[Stimulus, ...]:
        for stimulus in (felt := stimuli(heard, self._feelings.temperament)):
            self._feel(stimulus, heard)
        return felt

    def _use(self, name: str, port: str | None, body: Body) -> None:
        self._partner = self._move(body)
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
            words=self._log.words,
            boot=self.history.boot,
            latest=self.history.number,
        )
        self._snapshot = Snapshot(state)

    def _record(self, events: list[Event], stopped: StopOut | None, sampled: bool) -> None:
        """Hand the step to the recording, if one is on; note what became of recordings."""
        for kind, name, reason, detail in self.recordings.news():
            self._note(kind, name=name, reason=reason, detail=detail or None)
        felt, self._felt, body = self._felt, [], self._partner.body
        self._tape.write(self.recordings, body, events, felt, stopped, sampled=sampled)

    def excuse(self, error: Exception, kind: str = "trouble") -> None:
        """Note that what only looks on, or the loop, has failed; what repeats is noted once."""
        name = f"{type(error).__name__}: {error}"
        if not self._log.holds(kind, name):
            log_once(f"{name} in the partner's loop", error)
            self._note(kind, name=name)

    def _note(self, kind: str, **content: Any) -> LiveEvent:
        return self._log.note(self._partner.body.state.time, kind, **content)
