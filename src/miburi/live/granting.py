"""The commands by which the loop of a live partner carries out wishes.

Each function is called in the thread that asks, not in the loop's; any slow work and early refusals
happen there. It returns the command that the loop runs between two steps.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime
from functools import singledispatch
from typing import Any

from miburi.bodies import Body
from miburi.errors import BodyError
from miburi.feelings import FeelingModel, Stimulus, Temperament, shipped_temperament
from miburi.live import wishes
from miburi.live.agenda import Agenda
from miburi.live.attention import Attending
from miburi.live.bodies import check_port, make_body
from miburi.live.commands import STOP_SINCE, Command
from miburi.live.events.event import LiveEvent
from miburi.live.events.log import Log
from miburi.live.gaze import Gaze
from miburi.live.hand import GuidedHand
from miburi.live.recording.archive import Archive
from miburi.live.recording.recorder import Felt
from miburi.live.speaker import Speaker
from miburi.partner import Partner
from miburi.robot import Robot
from miburi.safety.contact import Rule
from miburi.senses import Impression, stimuli
from miburi.serving.press import By, Hold


@dataclass
class Inside:
    """The state of the loop; wishes change it between steps.

    Attributes
    ----------
    robot, rule
        The robot's description, and the contact rule of simulated bodies.
    feelings, own_temperament
        The emotional model, and its first temperament.
    recordings, log, speaker, attending, agenda
        The recordings, the events, the present sentence, the turn in a conversation, and the open
        wishes.
    hold
        Decides who may end a stop.
    change_body
        Switches to another body, given its kind, its port and the body itself.
    partner, gaze, hand, port
        The partner with its present body, the bearing of a face, the simulated human hand, and the
        card's port.
    ports
        Ports that may be opened besides those that the system lists.
    serial, stop_seen_in
        The number of the present step, and that of the first state that shows the latest Stop.
    felt
        Stimuli since the last step.
    """

    robot: Robot
    rule: Rule | None
    feelings: FeelingModel
    own_temperament: Temperament
    recordings: Archive
    log: Log
    speaker: Speaker
    hold: Hold
    change_body: Callable[[str, str | None, Body], None]
    ports: set[str]
    agenda: Agenda = field(init=False)
    partner: Partner = field(init=False)
    gaze: Gaze = field(init=False)
    hand: GuidedHand = field(init=False)
    attending: Attending = field(default_factory=Attending)
    port: str | None = None
    paused: bool = False
    serial: int = 0
    stop_seen_in: int = 0
    felt: list[Felt] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.agenda = Agenda(self.note, self.speaker)

    def note(self, kind: str, **content: Any) -> LiveEvent:
        """Note an event at the body's present time."""
        return self.log.note(self.partner.body.state.time, kind, **content)

    def stop(self, by: By, before: datetime | None = None) -> None:
        """Stop the body for whoever pressed Stop.

        ``before`` is the time of the press if Stop was pressed before this start.
        """
        when = None if before is None else before.isoformat()
        if self.hold.press(by):
            self.note("pressed", by=by, detail=when)
        self.partner.stop()
        self.agenda.kept = when
        self.agenda.clear("stopped")
        self.stop_seen_in = self.serial + 1

    def feel(
        self, stimulus: Stimulus, impression: Impression | None = None, by: By | None = None
    ) -> LiveEvent:
        """Feel a stimulus, and note its origin."""
        self.feelings.stimulate(stimulus)
        self.felt.append(Felt(self.partner.body.state.time, stimulus, impression))
        return self.note(
            "stimulus",
            feeling=stimulus.feeling,
            strength=stimulus.strength,
            source=stimulus.source,
            detail=impression and impression.reason,
            why=impression and impression.why,
            by=by,
        )

    def sense(self, impression: Impression, by: By | None = None) -> tuple[Stimulus, ...]:
        """Convert an impression into stimuli, as the temperament says, and feel them."""
        for stimulus in (felt := stimuli(impression, self.feelings.temperament)):
            self.feel(stimulus, impression, by)
        return felt


@singledispatch
def command(wish: wishes.Wish[Any], _inside: Inside) -> Command:
    """Return the loop's command for a wish.

    Raises BodyError or InputError if the wish is refused before the loop runs it.
    """
    raise NotImplementedError(f"{type(wish).__name__} is not granted.")


@command.register
def _feel(wish: wishes.Feel, inside: Inside) -> Command:
    return lambda: inside.feel(wish.stimulus, by=wish.by).id


@command.register
def _sense(wish: wishes.Sense, inside: Inside) -> Command:
    heard = wish.impression

    def run() -> tuple[Stimulus, ...]:
        told = wish.words if inside.log.words else None
        grave = heard.distress is not None or inside.speaker.distress is not None
        calm = grave and heard.source == "speech"
        if heard.source == "speech":
            feeling = None if calm else heard.feeling
            strength = None if feeling is None else heard.strength
            inside.note("heard", feeling=feeling, strength=strength, text=told, by=wish.by)
            inside.attending.begin("thinking")
        if heard.distress is not None:
            noted = inside.note("distress", name=heard.distress, text=told, by=wish.by)
            inside.speaker.attend(noted)
        return () if calm else inside.sense(heard, wish.by)

    return run


@command.register
def _lean(wish: wishes.Lean, inside: Inside) -> Command:
    return lambda: inside.feelings.lean(wish.leaning)


@command.register
def _see(wish: wishes.See, inside: Inside) -> Command:
    return lambda: inside.gaze.see(wish.x, inside.partner.body.state)


@command.register
def _attend(wish: wishes.Attend, inside: Inside) -> Command:
    return lambda: inside.attending.begin(wish.turn)


@command.register
def _note_talk(wish: wishes.NoteTalk, inside: Inside) -> Command:
    kind = "talk" if wish.failure is None else "talk_failed"
    return lambda: inside.note(kind, name=wish.failure or wish.where)


@command.register
def _note_trouble(wish: wishes.NoteTrouble, inside: Inside) -> Command:
    return lambda: inside.note("trouble", name=wish.what)


@command.register
def _speak(wish: wishes.Speak, inside: Inside) -> Command:
    return lambda: inside.agenda.say(inside.partner, wish, inside.feelings.express())


@command.register
def _keep_time(wish: wishes.KeepTime, inside: Inside) -> Command:
    return lambda: inside.agenda.keep_time(inside.partner, wish)


@command.register
def _perform(wish: wishes.Perform, inside: Inside) -> Command:
    return _while_awake(inside, lambda: inside.agenda.perform(inside.partner, wish))


@command.register
def _perform_acts(wish: wishes.PerformActs, inside: Inside) -> Command:
    return _while_awake(inside, lambda: inside.agenda.act(inside.partner, wish))


def _while_awake(inside: Inside, perform: Callable[[], str]) -> Command:
    def run() -> str:
        if inside.paused:
            raise BodyError("the partner is paused; resume it first.")
        return perform()

    return run


@command.register
def _allow_words(wish: wishes.AllowWords, inside: Inside) -> Command:
    inside.log.allow_words(wish.allowed)

    def run() -> LiveEvent:
        if not wish.allowed:
            inside.speaker.forget_words()
        return inside.note("words", name="on" if wish.allowed else "off")

    return run


@command.register
def _release(wish: wishes.Release, inside: Inside) -> Command:
    def run() -> None:
        if wish.seen is not None and not inside.stop_seen_in <= wish.seen <= inside.serial:
            raise BodyError(STOP_SINCE)
        inside.hold.check(by_person=wish.by_person)
        inside.partner.release(by_person=wish.by_person)
        inside.agenda.release(inside.hold.end(by_person=wish.by_person))

    return run


@command.register
def _pause(wish: wishes.Pause, inside: Inside) -> Command:
    def run() -> None:
        if wish.paused != inside.paused:
            inside.paused = wish.paused
            (inside.partner.pause if wish.paused else inside.partner.resume)()
            inside.agenda.clear("paused")
            inside.note("paused" if wish.paused else "resumed", by=wish.by)

    return run


@command.register
def _move_hand(wish: wishes.MoveHand, inside: Inside) -> Command:
    return lambda: inside.hand.guide(inside.partner.body.touchable, wish.position, wish.along)


@command.register
def _change_temperament(wish: wishes.ChangeTemperament, inside: Inside) -> Command:
    own = inside.own_temperament
    chosen = own if wish.name == own.name else shipped_temperament(wish.name)
    chosen = chosen.model_copy(update={"at_rest": wish.rest or chosen.at_rest})

    def run() -> None:
        inside.feelings.temperament = chosen
        inside.note("temperament", name=wish.name)

    return run


@command.register
def _change_body(wish: wishes.ChangeBody, inside: Inside) -> Command:
    name, port = wish.name, wish.port
    if port is not None and port == inside.port:
        raise BodyError(
            f"the card at {port} is in use already; if it is lost, the partner reconnects to it."
        )
    if port is not None and port not in inside.ports:
        check_port(port)
    body = make_body(name, inside.robot, port, inside.rule)

    def run() -> None:
        before = inside.partner
        inside.agenda.leave(before)
        before.body.close()  # the old body stops; the new one may use the same port
        body.go_on(before.body.state.time)
        inside.change_body(name, port, body)
        inside.partner.succeed(before)
        inside.note("body", name=name)

    return run
