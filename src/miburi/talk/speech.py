"""Respond to words: recognise their feeling, share it, and answer."""

import asyncio
import threading
from collections.abc import Callable
from dataclasses import asdict, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from miburi.feelings import Expression, Stimulus
from miburi.gestures import KeyPose, look
from miburi.languages import FALLBACK, Language, folders, language_of
from miburi.live.settle import done, granted
from miburi.live.view import LivePartner
from miburi.live.wishes import Feel, Lean, NoteTalk, NoteTrouble, Perform, Sense, Speak
from miburi.people import Memory
from miburi.robot import Array, Robot
from miburi.safety.stop import StopReason
from miburi.senses import Impression
from miburi.senses.tone import Tone, coloured
from miburi.serving.press import Press, who
from miburi.talk.answers import JOYS, Answerer, SmallAnswer, stops_in
from miburi.talk.beginning import Beginning
from miburi.talk.body import slots_of
from miburi.talk.care import Care, may_be_said, words_of_care
from miburi.talk.comfort import Comfort
from miburi.talk.cue import Cue
from miburi.talk.dates import away, date_of, due_of
from miburi.talk.endpoint import Endpoint, OvertakenError
from miburi.talk.moves import move
from miburi.talk.remembering import facts_in
from miburi.talk.said import FeltOut, SayOut, WhyOut
from miburi.talk.script import script
from miburi.talk.sums import sum_of

if TYPE_CHECKING:
    from miburi.talk.conversation import Conversation


#: How long a requested look lasts, in s, and the mood of a requested gesture (our choice).
_LOOKED, _SHOWN = 2.0, 0.8
#: How long the partner waits, in s, before it loads the data of answers (our choice).
_SETTLED = 2.0
#: Joy in a sentence that also has heavy words counts from this likelihood on (our choice).
_SURE_OF_JOY = 0.9


class Speech:
    """Lets a partner respond to words.

    Parameters
    ----------
    endpoint
        The language model that thinks of the partner's answers; with None, the partner answers by
        itself.
    care
        Chooses the words for somebody in distress.
    clock
        Returns the local time where the partner stands.
    seed
        The seed for choosing among the partner's own answers.
    folder
        The folder for what the partner knows about people; without a folder, the partner forgets
        people when the program ends.
    """

    def __init__(
        self,
        partner: LivePartner,
        endpoint: Endpoint | None,
        care: Care,
        clock: Callable[[], datetime],
        seed: int = 0,
        folder: Path | None = None,
    ) -> None:
        self._partner, self._clock = partner, clock
        self.memory = Memory(folder and folder / "people.json", partner.own_temperament, clock)
        self._answerer = Answerer(seed)
        self._language: Language | None = None  # of the talk so far
        self.beginning = Beginning(
            partner, self.memory, self._answerer, clock, folder and folder / "manners.json"
        )
        self._comfort = Comfort(care, clock)
        self._conversation = None if endpoint is None else _converse(endpoint)
        self._noted: tuple[str | None] | None = None  # the conversation's trouble, as logged
        self._unkept: str | None = None  # the memory's trouble, as logged
        self._counted = partner.history.number
        self._leaning: Array | None = None
        self._body: dict[str, str] = {}  # what the body did when the last remark came, as slots
        self._deleted = 0  # the memory's count of deletions, when last checked
        self._changing = asyncio.Lock()  # else a slow disk would hold all threads

    async def live(self) -> None:
        """Load the data of answers, then check for reasons to speak first, until cancelled."""
        await asyncio.sleep(_SETTLED)
        # Ctrl-C does not wait for a daemon.
        threading.Thread(target=self.get_ready, name="get ready", daemon=True).start()
        await self.beginning.live()

    def get_ready(self) -> None:
        """Load the data of answers, so that the first words do not wait for it.

        The first words may be a cry for help. Loading takes about 1.5 s, and several times as long
        on a small computer.
        """
        from miburi.senses.words import hear

        said = "Are you there?"
        language = self._language or FALLBACK
        Answerer().answer(said, hear(said, language), None, language, self._clock())
        words_of_care(language)
        for each in folders():  # any of them may have to stop the body
            stops_in(said, each)

    async def take(
        self,
        said: str,
        *,
        tone: Tone = "plain",
        by: str = "person",
        usual: Language | None = None,
    ) -> SayOut:
        """Respond to a remark in feelings and words; return the result.

        "Stop" stops the body before anything else. A newer remark cancels a model's pending answer.
        Distress is answered with the help that fits. During distress, and for ten minutes
        afterwards, no language model is asked, and the partner does not mention its own feelings.
        :class:`Comfort` handles possible distress and slight signs of it.

        Parameters
        ----------
        tone
            The tone of voice, which may weaken the feeling of the words, or change it.
        by
            The speaker, as for :func:`miburi.serving.press.who`.
        usual
            The language to assume at first if the words show none, such as the page's.
        """
        from miburi.senses.words import hear

        self._forget_deleted()
        language = await self._listen(said, by, usual)
        heard = coloured(await asyncio.to_thread(hear, said, language), tone)
        heard = self._comfort.confirm(heard, said, language)
        grave = heard.distress is not None
        known = self._known(said, language)
        unknown = heard.topic == "unknown"
        wanted = self._answerer.wanted(said, language, known, guess=not unknown)
        after = self._partner.snapshot.state.distress is not None
        heard = self._comfort.weigh(heard, said, language, wanted, after=after)
        acts = any(match.cue.acts for match in wanted)
        doubtful = heard.feeling in JOYS and heard.strength < _SURE_OF_JOY
        # An order shows no feeling; "Great, I've got cancer" must not please it.
        ordered = acts and not grave and heard.worry is None
        if ordered or (doubtful and script(language).fits("heavy", said)):
            heard = Impression(None, 0.0, "speech")
        if (grave or heard.worry is not None) and self._conversation is not None:
            self._conversation.overtake()
        felt = await granted(self._partner, Sense(heard, said, who(by)))
        answer = self._comfort.answer(heard, said, language, wanted, after=after)
        wants = script(language).asks(said) or script(language).wants_more(said)
        idle = self._conversation is None and not wants and all(one.cue.broad for one in wanted)
        if answer is None and heard.hint is not None and idle:
            answer = self._comfort.wonder(heard.hint, language)
        meant = None
        if answer is not None:
            await granted(self._partner, Speak(answer, "partner"))
        await self.count(felt)  # after the words of care: this waits for the disk
        if answer is None:
            alone = acts or any(match.cue.own for match in wanted)
            answer, meant = await self._answer(said, heard, language, felt, acts=alone)
            if meant == "repeat":
                self._comfort.keep_open()
        self._answerer.spoke(answer)
        await self._note_unkept()
        if self.memory.deleted == self._deleted:
            # "Remember that" never stores words of distress, or the remark before them.
            plain = "" if grave or heard.worry is not None or unknown else said
            words = script(language)
            told = [] if any(match.cue.shows for match in wanted) else words.told_in(plain)
            more = bool(told) and words.fits("belongs", told[0])
            self.memory.note(plain, told, language, more=more)
        if after and heard.feeling is not None:
            heard = replace(heard, feeling=None, strength=0.0, why=())
        return SayOut(
            feeling=heard.feeling,
            asked=heard.topic == "asked",
            meant=meant,
            distress=heard.distress,
            worry=heard.worry,
            strength=heard.strength,
            why=[WhyOut.model_validate(asdict(part)) for part in heard.why],
            felt=[FeltOut.model_validate(asdict(stimulus)) for stimulus in felt],
            answer=answer,
            trouble=None if self._conversation is None else self._conversation.trouble,
        )

    async def _listen(self, said: str, by: str, usual: Language | None) -> Language:
        """Stop the body if a remark says so in any language; return the remark's language."""
        page = usual if usual in folders() else FALLBACK
        language = language_of(said, self._language or page)
        self._body = slots_of(self._partner.snapshot.state, language)
        stop = stops_in(said, language, moving="moving" in self._body)
        if stop is not None:
            await done(self._partner.stop(Press(who(by))))
            language = stop
        self._language = language
        self.beginning.notice(language)
        return language

    def _forget_deleted(self) -> None:
        if self._deleted != self.memory.deleted:
            self._deleted = self.memory.deleted
            self._answerer.forget()
            if self._conversation is not None:
                self._conversation.forget()

    async def _answer(
        self,
        said: str,
        heard: Impression,
        language: Language,
        felt: tuple[Stimulus, ...],
        *,
        acts: bool,
    ) -> tuple[str, str | None]:
        """Answer a remark without distress, by a model or alone; return words and intent."""
        distress = self._partner.snapshot.state.distress is not None
        if not (acts or distress):
            reply = await self._reply(said, felt)
            if reply is not None:
                return reply, None
        own = self._partner.snapshot.state.felt
        feels = None if own is None else own.feeling
        known = self._known(said, language)
        answer = self._answerer.answer(said, heard, feels, language, self._clock(), known)
        async with self._changing:
            if answer.cue is not None or heard.topic != "unknown":
                await asyncio.to_thread(self._remember, answer, said)
        text = await self._perform(answer)
        tune = None if answer.cue is None else answer.cue.tune
        await granted(self._partner, Speak(text, "partner", tune))
        if self._conversation is not None and not acts:
            self._conversation.answered(text)
        return text, None if answer.cue is None else answer.cue.name

    async def count(self, felt: tuple[Stimulus, ...]) -> None:
        """Add stimuli, and the contacts since the last call, to the present person's attachment."""
        events = self._partner.history.after(self._counted)
        self._counted = self._partner.history.number
        contacts = sum(one.kind == "stop" and one.name == StopReason.CONTACT for one in events)
        if self.memory.present is not None:
            async with self._changing:
                await asyncio.to_thread(self.memory.hear, felt, contacts)
        if self._leaning is not (leaning := self.memory.leaning):
            self._leaning = leaning
            await granted(self._partner, Lean(leaning))

    def _known(self, said: str, language: Language) -> dict[str, str]:
        present, told = self.memory.present, self.memory.recall(said, language)
        latest = self.memory.remarks.last_told()
        known = {
            "name": None if present is None else present.name,
            "told": told,
            "surely": self.memory.recall(said, language, surely=True),
            "away": away(said, told, language, self._clock()),
            "day": date_of(said, latest, language, self._clock()),
            "ahead": away("", latest, language, self._clock()),
            "sum": sum_of(said, language),
            "latest": self.memory.kept(language, 1),
            "kept": self.memory.kept(language),
            "corrected": self.memory.corrected(said, language),
            "lately": latest,
            "model": None if self._conversation is None else "",
            "before": self.memory.remarks.latest_told(),
        }
        return {slot: text for slot, text in known.items() if text is not None} | self._body

    def _remember(self, answer: SmallAnswer, said: str) -> None:
        """Store a name or a fact, as the answer says."""
        words, memory, now = answer.words, self.memory, self._clock()
        if answer.do == "name" and words:
            memory.meet(words[:1].upper() + words[1:])
        elif answer.do == "remember" and words:
            fact = memory.with_whom(words, answer.language)
            memory.remember(fact, answer.language, due_of(fact, answer.language, now), asked=True)
        elif answer.do == "amend" and words:
            memory.amend(words, answer.language, due_of(words, answer.language, now))
        elif answer.do == "forget":
            memory.forget_noted()
        elif answer.cue is not None and answer.cue.name == "quiet":
            self.beginning.hush()
        elif answer.cue is None or answer.cue.aside:  # "Good morning, the dog was ill all night."
            for told in facts_in(said, script(answer.language)):
                fact = memory.with_whom(told, answer.language)
                memory.remember(fact, answer.language, due_of(fact, answer.language, now))

    async def _perform(self, answer: SmallAnswer) -> str:
        """Perform an answer's act; return what to say, which differs if the body cannot move."""
        cue, words = answer.cue, script(answer.language)
        unkept = answer.do in ("remember", "amend") and self.memory.trouble is not None
        if unkept or (answer.quotes and not await asyncio.to_thread(may_be_said, answer.text)):
            own = words.unkept if unkept else words.gentle
            return self._answerer.say(own or words.feelings.lines("none", None))
        if cue is None or not (cue.move or cue.show or cue.look):
            return answer.text
        state = self._partner.snapshot.state
        if state.paused:
            return self._answerer.say(words.paused)
        if state.stop is not None:
            return self._answerer.say(words.stopped)
        shown = None if cue.show is None else Expression(cue.show, _SHOWN)
        poses = _poses(self._partner.robot, cue)
        await granted(self._partner, Perform(shown, poses, "gesture", "partner"))
        return answer.text

    async def _reply(self, said: str, felt: tuple[Stimulus, ...]) -> str | None:
        """Say the language model's reply, apply its feeling, and return it; None without one."""
        talk = self._conversation
        if talk is None:
            return None
        if self._noted is None:
            await self._note(talk)
        try:
            reply = await talk.reply(said, felt, self._partner.snapshot.state)
        except OvertakenError:
            return ""
        if self._noted != (talk.trouble,):
            await self._note(talk)
        if reply is None:
            return None
        if self._partner.snapshot.state.distress is not None:
            return ""  # somebody has been in distress meanwhile
        if reply.feeling and reply.strength > 0:
            stimulus = Stimulus(reply.feeling, reply.strength, "talk")
            await granted(self._partner, Feel(stimulus, "partner"))
        await granted(self._partner, Speak(reply.text, "partner"))
        return reply.text

    async def _note_unkept(self) -> None:
        trouble, self._unkept = self._unkept, self.memory.trouble
        if self._unkept not in (None, trouble):
            await granted(self._partner, NoteTrouble(self._unkept))

    async def _note(self, talk: "Conversation") -> None:
        self._noted = (talk.trouble,)
        await granted(self._partner, NoteTalk(str(talk.endpoint), talk.trouble))


def _converse(endpoint: Endpoint) -> "Conversation":
    # The import loads an HTTP client's libraries.
    from miburi.talk.conversation import Conversation

    return Conversation(endpoint)


def _poses(robot: Robot, cue: Cue) -> list[KeyPose] | None:
    """Return the key poses of a cue's move or look, if it has one."""
    if cue.move is not None:
        return move(robot, cue.move)
    return None if cue.look is None else look(robot, cue.look, _LOOKED)
