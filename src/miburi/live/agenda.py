"""Carry out requests to a partner, and record how they end.

A request is a *wish*: an event with an id records its arrival, and exactly one later event records
its end, such as ``gesture_ended``, ``speech_broken_off`` or ``wish_dropped``.
"""

from collections.abc import Callable

from miburi.feelings import Expression
from miburi.live.events.event import LiveEvent
from miburi.live.speaker import Speaker
from miburi.live.stage import Act, Play, Stage
from miburi.live.state import StopOut, Tune
from miburi.live.wishes import KeepTime, Perform, PerformActs, Speak
from miburi.partner import (
    Event,
    GestureEnded,
    GestureStarted,
    Lapse,
    Partner,
    Released,
    Stopped,
    WishDropped,
)
from miburi.safety.stop import Phase, StopReason
from miburi.serving.press import By


class Agenda:
    """The open wishes of one live partner; for the partner's loop only.

    ``note`` records an event of the given kind with its fields, and returns the event.
    """

    def __init__(self, note: Callable[..., LiveEvent], speaker: Speaker) -> None:
        self._note, self._speaker = note, speaker
        self._stage = Stage()
        self._open: dict[str, str] = {}  # the purpose of each open wish, by id
        self._interrupts = False  # whether the body's next act interrupts a gesture
        self._shown: dict[str, object] = {}  # the fields of the present gesture
        self._returns = False  # whether the body is returning to neutral
        #: When a Stop was pressed that was before this start and has not been noted yet.
        self.kept: str | None = None

    def perform(self, partner: Partner, asked: Perform) -> str:
        """Let the body perform a request once, in place of waiting ones; return the wish's id."""
        self.clear("replaced")
        wish = self._ask(asked.name, asked.by, asked.expression)
        partner.perform(asked.expression, asked.poses, wish=wish)
        return wish

    def act(self, partner: Partner, asked: PerformActs) -> str:
        """Queue a performance, or begin it now in place of all others; return the wish's id."""
        if not asked.queued:
            self.clear("replaced", partner)
        wish = self._ask("performance", asked.by)
        try:
            self._stage.add(Play(wish, tuple(asked.acts), asked.by))
        except Exception:
            self._end(wish, "wish_dropped", name="busy")
            raise
        if not asked.queued:
            self._begin(interrupts=True)
        return wish

    def say(self, partner: Partner, asked: Speak, felt: Expression | None) -> str:
        """Say a sentence in place of the present one; return the wish's id."""
        wish = self._ask("speech", asked.by)
        self._tell(partner, asked.text, felt, wish, asked.tune, asked.why, asked.by)
        return wish

    def keep_time(self, partner: Partner, asked: KeepTime) -> None:
        """Let the arms follow the sound of a sentence if it is still the latest one."""
        if self._speaker.sounds(asked.number, asked.rhythm):
            partner.gesticulate(self._speaker.beats())

    def _tell(
        self,
        partner: Partner,
        text: str,
        felt: Expression | None,
        wish: str | None,
        tune: Tune | None = None,
        why: str | None = None,
        by: By | None = None,
    ) -> None:
        if self._speaker.speaking:
            self._end_speech("speech_broken_off")
        spoken = self._speaker.say(text, felt, wish, tune, by)
        partner.gesticulate(self._speaker.beats())
        said = {"text": spoken.text, "feeling": spoken.feeling, "wish": wish}
        self._note("speech_begun", name=why, by=by, **said)

    def release(self, by: By | None) -> None:
        """Note that the body returns to neutral, after a release or by itself."""
        self._note("release_begun", by=by)
        self._returns = True

    def step(self, partner: Partner, felt: Expression | None, dt: float) -> None:
        """Advance by ``dt`` s: note which sentences have ended, and begin the acts that are due."""
        if self._speaker.step(dt):
            self._end_speech("speech_ended")
        phase = partner.body.state.phase
        if self._returns and phase is Phase.IDLE:
            self._end_return("release_ended")
        for play in self._stage.wait(dt, stopped=phase is Phase.STOPPED):
            self._end(play.wish, "wish_dropped", name="lapsed")
        free = partner.expression is None and not partner.asked
        if free and phase is not Phase.STOPPED:
            self._begin()
        for act in self._stage.step(dt):
            self._carry_out(act, partner, felt)
        if (ended := self._stage.finish()) is not None:
            self._end(ended, "performance_ended")

    def _carry_out(self, act: Act, partner: Partner, felt: Expression | None) -> None:
        play = self._stage.current
        wish, by = (None, None) if play is None else (play.wish, play.by)
        if act.words is not None:
            self._tell(partner, act.words, felt, wish, by=by)
            return
        partner.perform(act.expression, act.poses, wish=wish, interrupt=self._interrupts)
        self._interrupts = False

    def take(self, event: Event, stop: StopOut | None, limit: float) -> None:
        """Record an event of the partner, if its kind is reported.

        If it is a stop, ``stop`` is the body's report of it, and ``limit`` the limit of the contact
        rule.
        """
        match event:
            case GestureStarted(_, shown, name, wish):
                self._end_return("release_ended")  # this may begin within the step
                self._shown = {"name": name or self._open.get(wish or "", "poses"), "wish": wish}
                if shown is not None:
                    self._shown |= {"feeling": shown.feeling, "mood": shown.mood}
                self._note("gesture_begun", **self._shown)
                self._stage.begin_act(wish)
            case GestureEnded(_, _, complete, wish):
                self._note("gesture_ended" if complete else "gesture_broken_off", **self._shown)
                self._end_of_act(wish, complete=complete)
            case Stopped(_, reason):
                asked = reason.reason is StopReason.ASKED
                when, self.kept = (self.kept, None) if asked else (None, self.kept)
                self._note("stop", stop=stop, name=reason.reason, limit=limit, detail=when)
                self._end_return("release_broken_off")
            case Released():
                self.release(None)
            case WishDropped(_, shown, why, wish):
                feeling = shown and shown.feeling
                if wish is not None and self._is_performance(wish):
                    self._stage.current = None
                    self._end(wish, "performance_broken_off", name=why)
                elif wish in self._open:
                    self._end(wish, "wish_dropped", name=why, feeling=feeling)
            case _:
                pass

    def leave(self, partner: Partner) -> None:
        """End all acts and returns before another body takes over."""
        for event in partner.leave():
            self.take(event, None, 0.0)
        self.clear("body")
        self._end_return("release_broken_off")

    def _end_return(self, kind: str) -> None:
        if self._returns:
            self._returns = False
            self._note(kind)

    def _ask(self, name: str, by: By | None, shown: Expression | None = None) -> str:
        fields = {"feeling": shown.feeling, "mood": shown.mood} if shown else {}
        wish = self._note("wish", name=name, by=by, **fields).id
        self._open[wish] = name
        return wish

    def _end(self, wish: str, kind: str, **fields: object) -> None:
        if self._open.pop(wish, None) is not None:
            self._note(kind, wish=wish, **fields)

    def _end_speech(self, kind: str) -> None:
        wish = self._speaker.wish
        spoken = self._speaker.spoken
        self._note(kind, wish=wish, by=self._speaker.by, text=spoken and spoken.text)
        self._stage.end_act(wish, body=False)
        if wish is not None and not self._is_performance(wish):
            self._open.pop(wish, None)

    def _end_of_act(self, wish: str | None, *, complete: bool) -> None:
        if wish is None:
            return
        if not self._is_performance(wish):
            self._open.pop(wish, None)
        elif complete:
            self._stage.end_act(wish, body=True)
        else:
            self._stage.current = None
            self._end(wish, "performance_broken_off")

    def _is_performance(self, wish: str) -> bool:
        return self._open.get(wish) == "performance"

    def _begin(self, *, interrupts: bool = False) -> None:
        begun = self._stage.begin()
        if begun is not None:
            self._interrupts = interrupts
            self._note("performance_begun", wish=begun.wish)

    def clear(self, why: Lapse, partner: Partner | None = None) -> None:
        """End all performances, and drop the wishes that a given ``partner`` has not begun."""
        if partner is not None:
            partner.drop(why)
        current, waiting = self._stage.clear()
        if current is not None:
            self._end(current.wish, "performance_broken_off", name=why)
        for play in waiting:
            self._end(play.wish, "wish_dropped", name=why)
