"""What is said to the partner: it hears the feeling of the words, feels with it, and answers."""

import asyncio
from collections import Counter
from contextlib import suppress
from dataclasses import asdict
from typing import TYPE_CHECKING

from miburi.errors import MiburiError
from miburi.feelings import Stimulus
from miburi.gestures import look
from miburi.interface.endpoint import Endpoint, OvertakenError
from miburi.interface.settle import done
from miburi.interface.wire import FeltOut, SayIn, SayOut, WhyOut
from miburi.live.view import LivePartner
from miburi.senses.care import Care
from miburi.senses.kinds import Distress
from miburi.senses.language import Language, language_of
from miburi.senses.tone import coloured

if TYPE_CHECKING:
    from miburi.interface.conversation import Conversation

__all__ = ["Speech"]

#: s without an answer after which it looks thoughtful, and s for which it does so at most (ours).
_THOUGHTFUL, _LONGEST_THOUGHT = 0.5, 30.0


class Speech:
    """Takes what is said to a partner, and lets it answer.

    Parameters
    ----------
    partner
        The partner.
    endpoint
        Who thinks of its answers; None: it answers by itself.
    care
        How it cares for somebody in distress.
    """

    def __init__(self, partner: LivePartner, endpoint: Endpoint | None, care: Care) -> None:
        self._partner, self._care = partner, care
        self._turns: Counter[str] = Counter()  # of help, by kind
        self._conversation = None if endpoint is None else _converse(endpoint)
        self._noted: tuple[str | None] | None = None  # of the conversation, in the log

    async def take(self, said: SayIn) -> SayOut:
        """Let the partner feel with what was said, and answer it.

        What was overtaken by another sentence gets no answer. Distress gets the help that fits;
        then, and for ten minutes after, no language model is asked and no small answer given.
        """
        from miburi.senses.words import hear

        heard = coloured(await asyncio.to_thread(hear, said.text), said.tone)
        grave, language = heard.distress is not None, language_of(said.text)
        if grave and self._conversation is not None:
            self._conversation.overtake()
        felt = await done(self._partner.take(heard, said.text))
        if grave or self._partner.snapshot.state.distress is not None:
            answer: str | None = self._comfort(heard.distress, language)
            await done(self._partner.speak(answer or "", "partner"))
        else:
            answer = await self._reply(said.text, felt)
        if answer is None:
            answer = (await done(self._partner.answer(heard, language))).text or ""
            if self._conversation is not None:
                self._conversation.answered(answer)
        return SayOut(
            feeling=heard.feeling,
            asked=heard.topic == "asked",
            distress=heard.distress,
            strength=heard.strength,
            why=[WhyOut.model_validate(asdict(part)) for part in heard.why],
            felt=[FeltOut.model_validate(asdict(stimulus)) for stimulus in felt],
            answer=answer,
            trouble=None if self._conversation is None else self._conversation.trouble,
        )

    def _comfort(self, kind: Distress | None, language: Language) -> str:
        """Return what is said to a distress, or after one."""
        turn = self._turns[kind or ""]
        self._turns[kind or ""] += 1
        if kind is None:
            return self._care.stay(language, turn)
        return self._care.help(kind, language, turn)

    async def _reply(self, said: str, felt: tuple[Stimulus, ...]) -> str | None:
        """Say what a conversation brings, and feel it; None if it brings nothing."""
        talk = self._conversation
        if talk is None:
            return None
        if self._noted is None:
            await self._note(talk)
        thinking = asyncio.create_task(self._look_thoughtful())
        try:
            reply = await talk.reply(said, felt, self._partner.snapshot.state)
        except OvertakenError:
            return ""
        finally:
            await self._look_back(thinking)
        if self._noted != (talk.trouble,):
            await self._note(talk)
        if reply is None:
            return None
        if self._partner.snapshot.state.distress is not None:
            return ""  # somebody has been in distress meanwhile
        if reply.stimulus is not None:
            await done(self._partner.stimulate(reply.stimulus, "partner"))
        await done(self._partner.speak(reply.text, "partner"))
        return reply.text

    async def _look_thoughtful(self) -> bool:
        """Look aside once an answer takes longer than people wait; return whether it does."""
        await asyncio.sleep(_THOUGHTFUL)
        state = self._partner.snapshot.state
        if state.asked or state.stop is not None:
            return False
        aside = look(self._partner.robot, "aside", _LONGEST_THOUGHT)
        await done(self._partner.perform(None, aside, "look", "partner"))
        return True

    async def _look_back(self, thinking: asyncio.Task[bool]) -> None:
        """Look at the person again, if it has looked aside."""
        if not thinking.done():
            thinking.cancel()
        elif thinking.exception() is None and thinking.result():
            ahead = look(self._partner.robot, "user", 0.0)
            with suppress(MiburiError):  # paused meanwhile
                await done(self._partner.perform(None, ahead, "look", "partner"))

    async def _note(self, talk: "Conversation") -> None:
        self._noted = (talk.trouble,)
        await done(self._partner.note_talk(str(talk.endpoint), talk.trouble))


def _converse(endpoint: Endpoint) -> "Conversation":
    from miburi.interface.conversation import Conversation  # the libraries of a client, only here

    return Conversation(endpoint)
