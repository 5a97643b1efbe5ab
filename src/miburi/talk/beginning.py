"""Let the partner speak first: every few seconds it checks for a reason, and seldom speaks."""

import asyncio
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

from pydantic import ValidationError

from miburi.errors import MiburiError, OutputError
from miburi.ground.files import write_whole
from miburi.ground.log import log_once
from miburi.languages import FALLBACK, Language
from miburi.live.settle import granted
from miburi.live.view import LivePartner
from miburi.live.wishes import Speak
from miburi.people import Fact, Memory
from miburi.talk.answers import Answerer
from miburi.talk.initiative import Initiative, Manners, Presence
from miburi.talk.script import script

#: The time between two checks, in s, and how long the partner is quiet when asked to (our choice).
_LOOKS, _HUSHED = 5.0, timedelta(hours=1)


class Beginning:
    """Lets the partner speak first, within the limits that a person sets.

    Parameters
    ----------
    clock
        Returns the local time where the partner stands.
    path
        The file of the settings; if it is None, they are lost when the program ends.
    """

    def __init__(
        self,
        partner: LivePartner,
        memory: Memory,
        answerer: Answerer,
        clock: Callable[[], datetime],
        path: Path | None,
    ) -> None:
        self._partner, self._memory, self._answerer = partner, memory, answerer
        self._clock, self._path = clock, path
        self._initiative, self._presence = Initiative(_read(path)), Presence()
        self._language, self._hushed = FALLBACK, clock()
        self._spoken_of: set[Fact] = set()

    @property
    def manners(self) -> Manners:
        """The limits that a person has set."""
        return self._initiative.manners

    def behave(self, manners: Manners) -> None:
        """Replace the settings, and save them if there is a file.

        Raises OutputError if the file cannot be written.
        """
        if self._path is not None:
            try:
                write_whole(self._path, manners.model_dump_json(indent=1), private=True)
            except OSError as error:
                raise OutputError(f"{self._path}: cannot be written: {error.strerror}.") from error
        self._initiative.manners = manners

    def notice(self, language: Language | None = None) -> None:
        """Record that somebody is present, and in which language they spoke, if they did."""
        self._presence.notice(self._clock(), words=language is not None)
        self._language = language or self._language

    def hush(self) -> None:
        """Do not speak first for an hour."""
        self._hushed = self._clock() + _HUSHED

    async def live(self) -> None:
        """Check for a reason every few seconds, until cancelled."""
        while True:
            await asyncio.sleep(_LOOKS)
            try:
                await self.look()
            except MiburiError as error:
                log_once("the partner could not start a conversation", error)

    async def look(self) -> None:
        """Speak first if there is a reason; the log gives the reason with the sentence."""
        state, now = self._partner.snapshot.state, self._clock()
        busy = state.paused or state.stop is not None or state.distress is not None
        if busy or now < self._hushed:
            return
        due = self._memory.due(now, self._spoken_of)
        reason = self._initiative.look(now, self._presence, due is not None)
        if reason is None:
            return
        known = {} if self._memory.present is None else {"name": self._memory.present.name}
        if due is not None:
            known["told"] = due[1].text.rstrip(".。")
            if reason == "date":
                self._spoken_of.add(due[1])
        text = self._answerer.say(script(self._language).begin[reason], known)
        await granted(self._partner, Speak(text, "partner", why=reason))


def _read(path: Path | None) -> Manners:
    """Read the settings; without a valid file, the partner never speaks first."""
    if path is not None and path.exists():
        try:
            return Manners.model_validate_json(path.read_bytes())
        except (OSError, ValidationError) as error:
            log_once(f"{path} cannot be read, so the partner will not speak first", error)
    return Manners()
