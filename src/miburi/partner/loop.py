"""The loop that joins the parts: feelings choose a gesture, kinematics solve it, a body moves.

A :class:`Partner` takes an emotional model and a body. Each ``step`` lets time pass in both, sends
the body its next move, and returns what happened as events.

The strongest emotion picks the movement function, and its mood sets the intensity (Fig. 6). A
body that meets something stops by itself; the partner reads that from the body's state. It then
lowers the mood by 20 %, waits, and lets the body go back to neutral (Section 4).

:mod:`miburi.partner.arbiter` decides what comes next, :mod:`miburi.partner.performance` orders the
key poses of a gesture, :mod:`miburi.partner.mover` sends them, and :mod:`miburi.partner.recovery`
decides when a stop may end.
"""

from collections.abc import Iterator, Sequence

from miburi import gestures
from miburi.bodies import Body, BodyState
from miburi.errors import BodyError
from miburi.feelings import FEELINGS, Expression, FeelingModel
from miburi.partner.arbiter import Arbiter
from miburi.partner.events import (
    Event,
    GestureEnded,
    GestureStarted,
    Lapse,
    Released,
    Stopped,
    WishDropped,
)
from miburi.partner.mover import Mover, Solve, solve_with
from miburi.partner.performance import Performance
from miburi.partner.recovery import Recovery
from miburi.partner.rest import Company
from miburi.safety.stop import Phase, Stop, StopReason

#: A wish waits at most this long, in s, for a stopped body: after that, a person who releases the
#: body no longer expects it. The first pauses after contacts, 1 s to 4 s, are shorter (our choice).
LAPSES = 8.0


class Partner:
    """A robot partner: an emotional model that moves a body.

    Parameters
    ----------
    body
        The body to move; it must be at neutral.
    feelings
        The emotional model; give stimuli to it directly.
    repertoire
        The gestures, by default those that ship with Miburi. If the body cannot reach a pose, it
        takes the nearest pose that it can reach.
    period
        A gesture starts at each multiple of this period (in s) if the body is at rest then (Section
        5: 2 s). A gesture that is longer than a period skips the multiples that it covers. With
        ``life``, a new emotion shows at once, in at most three gestures.
    solve
        The inverse kinematics: a function that takes the robot, the target of shape (9,) in m, and
        the present angles of shape (8,) in rad, and returns a solution.
    life, choices
        Seeds, or None. With ``life``, the partner breathes and looks around while it feels nothing
        (:mod:`miburi.partner.rest`), and varies each gesture; with None, it does neither, as in the
        paper's experiment. ``choices`` (or else ``life``, or 0) chooses among a feeling's gestures.
    """

    def __init__(
        self,
        body: Body,
        feelings: FeelingModel,
        *,
        repertoire: gestures.Repertoire | None = None,
        period: float = 2.0,
        solve: Solve | None = None,
        life: int | None = None,
        choices: int | None = None,
    ) -> None:
        self.body = body
        self.feelings = feelings
        self._period = period
        self._periods = -1  # number of the latest period that has begun
        self._lively = life is not None
        repertoire = repertoire or gestures.shipped_repertoire()
        self._arbiter = Arbiter(body.robot, feelings, repertoire, life, choices)
        #: The people around the partner. Update this object's attributes as people move, speak, or
        #: are in distress.
        self.company: Company = self._arbiter.company
        self._performance: Performance | None = None
        self._untold: list[Event] = []  # since the last step
        self._recovery = Recovery()
        self._mover = Mover(body, solve or solve_with(), lively=self._lively)
        self._resting = self._paused = False

    @property
    def expression(self) -> Expression | None:
        """What the body expresses now; None between gestures."""
        return self._performance.expression if self._performance else None

    @property
    def ahead(self) -> tuple[float, float]:
        """By how much, in rad, a moving head will still turn to the robot's left, and rise."""
        return self._mover.ahead

    @property
    def asked(self) -> bool:
        """Whether :meth:`perform` asked for the present gesture."""
        return self._performance is not None and self._performance.asked

    @property
    def held(self) -> bool:
        """Whether somebody has stopped the body, so that it waits for :meth:`release`."""
        return self._recovery.held

    @property
    def at_rest(self) -> bool:
        """Whether :meth:`rest` has been called and the body is back at neutral."""
        return self._resting and self._mover.home and self.body.state.phase is Phase.IDLE

    def rest(self) -> None:
        """Start no more gestures; after the present move, go to neutral and stay there.

        This does not release a body that somebody stopped.
        """
        self._resting = True

    def pause(self) -> None:
        """Go to neutral after the present move and wait there for :meth:`resume`.

        This does not release a body that somebody stopped.
        """
        self._paused = True
        self.drop("paused")

    def resume(self) -> None:
        """End a pause: gestures start again."""
        self._paused = False

    def gesticulate(self, strokes: Sequence[float]) -> None:
        """Accompany speech with arm beats, whose turning points fall on some of the ``strokes``.

        A feeling's first gesture takes precedence over beats; after it, the posture shows the
        feeling. There are no beats if the partner has no ``life``, rests, or is stopped. The
        strokes are times in seconds from now, and must ascend.
        """
        self._arbiter.speak(self.body.state.time, strokes)

    def perform(
        self,
        expression: Expression | None,
        poses: Sequence[gestures.KeyPose] | None = None,
        *,
        wish: str | None = None,
        interrupt: bool = False,
    ) -> None:
        """Perform a gesture once, as soon as the body is at rest, whatever the feelings are.

        If several wishes are waiting, only the latest counts. A wish that has waited :data:`LAPSES`
        seconds for a stopped body is dropped.

        Parameters
        ----------
        expression
            The feeling, and the mood. The mood is the intensity from the first key pose to the
            last. If ``expression`` is None, the poses show no feeling, and any later request
            replaces them.
        poses
            Key poses to perform instead of the feeling's own gesture, such as a blend of gestures.
        wish
            A name for this wish; the events that it causes carry it.
        interrupt
            Whether to cut the present gesture short: at its next key pose or, with ``life``, at
            once.

        Raises
        ------
        InputError
            There is neither a feeling nor a pose.
        """
        asked = self._arbiter.prepare(expression, poses, wish)
        self.drop("replaced")
        self._arbiter.ask(asked, self.body.state.time, interrupts=interrupt)

    def stop(self) -> None:
        """Stop the body because a person asks; it stays stopped until :meth:`release`.

        If a contact has stopped the body, this also cancels its release after a pause. Wishes that
        have not begun are dropped; later wishes wait for the release.
        """
        self.body.stop()
        self._recovery.held = True
        self.drop("stopped")

    def leave(self) -> list[Event]:
        """End what is going on, because another body takes over; return the events."""
        self.drop("body")
        return [*self._untold, *self._end(self.body.state.time, complete=False)]

    def drop(self, why: Lapse) -> None:
        """Drop the wish that has not begun, if any; the next step reports it."""
        asked, self._arbiter.asked = self._arbiter.asked, None
        if asked is not None:
            time = self.body.state.time
            self._untold.append(WishDropped(time, asked.expression, why, asked.wish))

    def succeed(self, other: "Partner") -> None:
        """Take over from a partner with another body: a stop or a pause of that partner goes on."""
        then, now = other.body.state.time, self.body.state.time
        if self._recovery.succeed(other._recovery, then, now):
            self.body.stop()

    def halt(self) -> None:
        """Stop the body because the loop does not respond; the body resumes after a pause.

        Any thread may call this while another uses the body. If the halt does not reach the body,
        :meth:`make_sure` stops it.
        """
        self._recovery.halted |= self.body.state.phase is not Phase.STOPPED
        self.body.halt()

    def make_sure(self) -> None:
        """Stop the body after a :meth:`halt`, if it has not stopped yet."""
        if self.body.state.phase is not Phase.STOPPED:
            self.body.stop()
            self._recovery.halted = True

    def release(self, *, by_person: bool = False) -> None:
        """Let a stopped body go back to neutral, then continue.

        ``by_person`` says that a person who sees the body asks for the release; only then may the
        pause after a contact be cut short.

        Raises
        ------
        UnsettledError
            The body has not come to rest yet.
        BodyError
            The body is not stopped, or is pausing after a contact.
        """
        if self.body.state.phase is Phase.STOPPED:
            self._recovery.check(self.body.state, by_person=by_person)
        self.body.release()
        self._recovery.forget_release()
        self._mover.is_released()
        self._arbiter.facing = 0.0

    def step(self, dt: float) -> list[Event]:
        """Let ``dt`` seconds pass, and return what happened in them as events."""
        self.feelings.step(dt)
        state = self.body.step(dt)
        begun = int((state.time + 1e-9) // self._period)
        due, self._periods = begun != self._periods, begun
        if state.phase is Phase.STOPPED:
            self._untold += self._while_stopped(state)
        elif state.phase is Phase.IDLE:
            # Events before an error are returned by the next step.
            self._untold.extend(self._while_idle(state, due=due))
        elif state.phase is Phase.MOVING and self._lively and not self._quiet:
            self._untold.extend(self._while_moving(state.time))
        events, self._untold = self._untold, []
        return events

    def _while_stopped(self, state: BodyState) -> Iterator[Event]:
        if state.stop is not None and self._recovery.notice(state.stop):
            yield from self._take_in(state.stop, state.time)
        stopped_at = 0.0 if state.stop is None else state.stop.time
        if state.time - max(self._arbiter.asked_at, stopped_at) > LAPSES:
            self.drop("lapsed")
        self._recovery.look(state)
        if self._recovery.is_due(state.time):
            try:
                self.release()
            except BodyError:  # a servo is not ready, or the card has just been lost
                self._recovery.retry(state.time)
            else:
                yield Released(state.time)

    def _take_in(self, stop: Stop, time: float) -> Iterator[Event]:
        """Break off the gesture because of a new stop; lower the mood if it was a contact."""
        shown = self.expression or self.feelings.express()
        before = self._mood_of(shown)
        stop = self._recovery.take_in(stop, time)
        if stop.reason is StopReason.CONTACT:
            self.feelings.contact()
        yield Stopped(time, stop, before, self._mood_of(shown))
        yield from self._end(time, complete=False)

    def _while_idle(self, state: BodyState, *, due: bool) -> Iterator[Event]:
        self._recovery.forget_stop()
        due = self._arbiter.hurries(state.time) or due
        if self._performance is None and due and not self._quiet:
            yield from self._begin(state.time)
        performance = self._performance
        if performance is not None and (
            performance.is_due(state.time)
            or self._quiet
            or self._arbiter.gives_way(performance, state.time)
        ):
            yield from self._go_on(performance, state.time)
        if self._performance is None and self._quiet and self._mover.go_home():
            self._arbiter.facing = 0.0

    def _while_moving(self, time: float) -> Iterator[Event]:
        """Interrupt the current move if something more urgent may begin before the move ends."""
        broken_off = self._arbiter.breaks_in(self._performance, time)
        if broken_off:
            yield from self._end(time, complete=False)
            yield from self._begin(time)
        if self._performance is not None and (broken_off or self._performance.passes(time)):
            yield from self._go_on(self._performance, time)

    def _begin(self, time: float) -> Iterator[Event]:
        """Begin the requested performance, else a gesture, else an act at rest."""
        begun = self._performance = self._arbiter.choose(time, self._mover.turned)
        if begun is not None and begun.tells:
            yield GestureStarted(time, begun.expression, begun.gesture, begun.wish)

    def _go_on(self, performance: Performance, time: float) -> Iterator[Event]:
        """Send the next key pose at the present mood, or end the performance."""
        if self._arbiter.gives_way(performance, time):
            yield from self._end(time, complete=False)
            return
        if not self._quiet:
            sent = self._mover.go_on(performance, self._mood_of(performance.expression), time)
            if sent is not None:
                yield from sent
                return
        yield from self._end(time, complete=performance.complete)

    def _end(self, time: float, *, complete: bool) -> Iterator[Event]:
        ended, self._performance = self._performance, None
        if complete:
            self._recovery.forget_encounters()
        if ended is not None and ended.tells:
            yield GestureEnded(time, ended.expression, complete, ended.wish)

    @property
    def _quiet(self) -> bool:
        return self._resting or self._paused

    def _mood_of(self, shown: Expression | None) -> float:
        return 0.0 if shown is None else float(self.feelings.mood[FEELINGS.index(shown.feeling)])
