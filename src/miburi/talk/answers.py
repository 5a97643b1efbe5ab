"""Small answers: what the partner says and does in reply to a remark.

It takes somebody's words, the impression that they make and the partner's own feeling, and returns
a short answer, chosen by the partner's seed. An intent is answered first ("what time is it?"), then
a feeling, then a topic. The sentences are in a language's ``talk.toml``. No sentence is repeated
within ``UNREPEATED`` turns, as long as there is something else to say.
"""

from collections import Counter, deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from miburi.languages import FALLBACK, Language, folders
from miburi.languages.abroad import says_stop
from miburi.senses.impression import Impression
from miburi.talk.cue import Cue, Do, Match, slots_in
from miburi.talk.meaning import about, gives_way, is_surer, named_in, sayable, settled
from miburi.talk.remembering import SIGNS, announces, is_short, told_before
from miburi.talk.script import Script, script

UNREPEATED = 20

#: After speaking of its own feeling, the partner does not do so again for this number of turns
#: (ours; judges of conversations found none of 12 such answers fitting).
_OF_OTHERS = 6
#: After an act was named, "do it" may refer to this act for this many remarks (our choice).
_NAMED = 3
#: The share of answers to a feeling that also mention the remark's topic (our choice).
_TAKES_UP = 0.5
#: A feeling less likely than ``_SPOKEN_OF`` changes the partner's state, but is not mentioned (our
#: choice): nearly half of the feelings heard at 0.4 to 0.6 are wrong (bench/words.txt). Joy is not
#: mentioned either if the remark also has bad news.
JOYS = ("happiness", "thrill")
_GLAD, _SPOKEN_OF = (*JOYS, "surprise"), 0.6
#: In a remark of more words than this, "supper" may be mentioned in passing, so the answer takes up
#: no topic except a person that the remark names (our choice).
_RAMBLES = 16


@dataclass(frozen=True)
class SmallAnswer:
    """An answer, and the act that accompanies it.

    Attributes
    ----------
    text, language
        What is said.
    cue
        The cue that matched, if any; it says what to perform.
    words
        The subject in somebody's own words: a name, or a fact to remember.
    quotes
        Whether the text contains somebody's own words.
    """

    text: str
    language: Language
    cue: Cue | None = None
    words: str | None = None
    quotes: bool = False

    @property
    def do(self) -> Do | None:
        """The act that accompanies the words."""
        return None if self.cue is None else self.cue.do


def wants_stop(said: str, language: Language, *, moving: bool = False) -> bool:
    """Whether somebody tells the body to stop; checked before anything else.

    While the body is ``moving``, words such as "That hurts" and "Pack it in" tell it to stop, too.
    """
    return any(script(language).intents_of(said, ("moving",) if moving else (), do="stop"))


def stops_in(said: str, language: Language, *, moving: bool = False) -> Language | None:
    """Return the language in which somebody tells the body to stop; None: in none.

    ``language`` is the one that they probably speak, but all are searched. Orders in a language
    without a folder are answered in ``FALLBACK``.
    """
    each = (language, *(other for other in folders() if other != language))
    abroad = FALLBACK if says_stop(said, moving=moving) else None
    return next((one for one in each if wants_stop(said, one, moving=moving)), abroad)


def _reworded(said: str, words: Script, known: Mapping[str, str]) -> str:
    """Return a remark as the patterns expect it."""
    foreign = words is script(FALLBACK) and says_stop(said, moving="moving" in known)
    return "Stop." if foreign else words.reword(said)


def is_needless(worry: str, wanted: Iterable[Match]) -> bool:
    """Whether words that may mean distress have a better reply than a question about distress.

    A better reply exists if somebody only wants to see or hear something ("And now just the left
    one"), or if the words have an answer and no particular kind of distress is suspected.
    """
    found = [match.cue for match in wanted]
    return any(cue.shows for cue in found) or (
        worry == "help" and any(not cue.broad for cue in found)
    )


class Answerer:
    """Chooses answers; with the same ``seed``, the same conversation gets the same answers."""

    def __init__(self, seed: int = 0) -> None:
        self._random = np.random.default_rng(seed)
        self._times: Counter[str] = Counter()  # of each sentence
        self._when: dict[str, int] = {}  # when each was last said, counted in sentences
        self._of_others = _OF_OTHERS  # turns since it spoke of itself
        self._last = ""
        self._stays: Match | None = None
        self._since = 0  # turns
        self._recalled: str | None = None  # what it has just recalled
        self._named: deque[Cue | None] = deque(maxlen=_NAMED)  # in the last remarks

    def wanted(
        self, said: str, language: Language, known: Mapping[str, str], *, guess: bool = True
    ) -> list[Match]:
        """Return the intents of a remark at this point of the talk, the most urgent first.

        If there are none, the model may ``guess`` at an order.
        """
        words = script(language)
        said = _reworded(said, words, known)
        filled = {"next", *known, *self._fun(), *self._further(said, words)}
        found = [self._refer(one, words, said) for one in words.intents_of(said, filled)]
        if asks := told_before(said, words)[1]:
            # An example: "Will you remember something for me, the milk is running low"
            found += words.intents_of(asks, filled, do="remember")
        guess = guess and not found and not words.fits("heavy", said)
        return list(words.orders_of(said)) if guess else found

    def _further(self, said: str, words: Script) -> dict[str, str]:
        """Return slots: ``itself`` if a remark is about the partner, ``told`` for a follow-up."""
        itself = {"itself": ""} if words.fits("itself", said) else {}
        if self._recalled and words.fits("further", said):
            return itself | {"told": self._recalled}
        return itself

    def _fun(self) -> list[str]:
        """Return the name of the slot for what the partner has lately done for fun, if anything."""
        return [] if self._stays is None else [f"after_{self._stays.cue.name}"]

    def answer(
        self,
        said: str,
        heard: Impression,
        felt: str | None,
        language: Language,
        now: datetime,
        known: Mapping[str, str] | None = None,
    ) -> SmallAnswer:
        """Return the answer to a remark.

        Parameters
        ----------
        said, heard
            Somebody's words, and the impression that they make.
        felt
            What the partner itself feels, if anything.
        language
            One of :func:`miburi.languages.folders`.
        now
            The local time where it stands.
        known
            What is known for the slots of sentences, such as the person's ``name``; ``before`` is
            the person's last remark, to which "remember that" refers.
        """
        words = script(language)
        said = _reworded(said, words, known or {})
        slots = _time(words, now) | {"last": self._last or "…"}
        slots |= self._further(said, words) | dict(known or {})
        match, glad = self._meant(said, words, slots)
        heavy = words.fits("heavy", said)
        felt = None if heavy and felt in _GLAD else felt  # no mention of its own joy then
        topics = sayable(words.topics_of(said), slots)
        rambles = len(said.split()) > _RAMBLES
        topic = next((one for one in topics if _suits(one, heavy=heavy, rambles=rambles)), None)
        told = topic is not None and not words.asks_clearly(said)
        feeling = heard.feeling
        if heard.strength < _SPOKEN_OF or (feeling in _GLAD and (heavy or not glad)):
            feeling = None
        shown = feeling is not None
        unknown = heard.topic == "unknown"
        if not unknown:  # the models would guess at words that they do not know
            match = settled(match, said, heard, words, slots, shown=shown, heavy=heavy, told=told)
        match = match and self._refer(match, words, said)
        self._named.append(named_in(said, words))
        kept_to = self._keep_to(match, words, said, felt=shown)
        again, match = kept_to is not match, kept_to
        text = echo = None
        if match is not None:
            back = match.cue.echo and not words.fits("grave", said)
            echo = words.turner.echo(said) if back else None
            lines = words.says_again(match.cue, said) if again else match.cue.say
            text = self._choose(lines, slots | about(match), always=True)
            text = f"{echo}{text}" if echo else text
        elif heard.topic == "asked":
            text = self._choose(words.feelings.lines("asked", felt), slots, always=True)
        elif unknown:
            text = self._choose(words.unknown, slots, always=True)
        elif feeling is not None:
            text = self._feel_with(words, feeling, felt, topic, slots)
        elif topic is not None:
            text = self._choose(topic.cue.say, slots | about(topic))
        if text is None:
            text = self._choose(words.gentle, slots, always=True) if heavy else None
        if text is None:
            # The partner does not interrupt a story, or a remark about people, with its own
            # feeling.
            idle = is_short(said, words) and not words.fits("people", said)
            text = self._remark(words, felt if idle else None, slots)
        cue = match.cue if match else None
        self._recalled = slots.get("told") if cue is not None and cue.do == "recall" else None
        if cue is None or cue.do != "repeat":
            self._last = text
        kept = _kept(match, said, slots)
        return SmallAnswer(text, language, cue, kept, quotes=bool(kept or echo))

    def _meant(self, said: str, words: Script, slots: dict[str, str]) -> tuple[Match | None, bool]:
        """Return the intent that patterns find, and whether the answer may mention joy.

        It adds slots for the words to remember, and for what the partner has lately done for fun.
        """
        told, asks, after = told_before(said, words)
        earlier = slots.pop("before", "").strip(SIGNS)
        if before := told or earlier or after:
            slots["before"] = before
        if after:
            slots["next"] = after
        slots.update(dict.fromkeys(self._fun(), ""))
        found = sayable(words.intents_of(said, slots), slots)
        match = next(found, None)
        if match is not None and (match.cue.broad or match.cue.aside):
            match = next((each for each in found if is_surer(each.cue, slots)), match)
        if match is not None and match.words and match.cue.within in self._fun():
            # "Can you remember a secret word if I tell you it?" "It is custard."
            about = self._stays.words if self._stays is not None else None
            if about:
                told_now = f"{about}: {match.words}"
                match = match._replace(words=told_now, it=words.turner.turn_round(told_now))
        if match is not None and match.cue.aside and words.tells_more(said):
            return None, False  # "Thank you. My husband is in hospital."
        if match is not None and match.cue.aside and (point := words.point_of(said, slots)):
            match = next(sayable(words.intents_of(point, slots), slots), None)
        keeps = match is None or match.cue.do == "remember"
        # "I was a cook. Remember that, will you?"
        if keeps and (told or (after and (not earlier or announces(asks, words)))):
            match = next(sayable(words.intents_of(asks, slots), slots), match)
        it = match.it if match is not None and keeps else None
        if match is not None and told and it and is_short(it, words):
            # "He rings at four, so remind me at ten to."
            whole = f"{told}, {match.words}"
            match = match._replace(words=whole, it=words.turner.turn_round(whole))
        return match, True

    def _refer(self, match: Match, words: Script, said: str) -> Match:
        """Return the match, or if it is "do it", the act that was named last."""
        lately = [named_in(said, words), *reversed(self._named)] if match.cue.refers else []
        named = next((cue for cue in lately if cue is not None), None)
        return match if named is None else Match(named, None, None)

    def _keep_to(
        self, match: Match | None, words: Script, said: str, *, felt: bool
    ) -> Match | None:
        """Return the match, or the match of an earlier turn if the words may refer to that turn."""
        acts = match is not None and match.cue.acts
        if (before := self._stays) is not None:
            if before.cue.stays == 1:
                about_it = match is not None and match.cue.within in self._fun()
                more = words.goes_on(said) and not (acts or felt or about_it)
            else:  # "again" in "When's my appointment, again?" asks for no repeat
                more = gives_way(match, self._fun()) and words.wants_more(said)
            match = before if more else match
        self._since += 1
        if match is not None and match.cue.stays:
            self._stays, self._since = match, 0
        elif acts or before is None or self._since >= before.cue.stays:
            self._stays = None
        return match

    def spoke(self, text: str) -> None:
        """Note a sentence that did not come from ``answer``, so that it can be repeated."""
        self._last = text

    def forget(self) -> None:
        """Forget the sentences and acts to which a remark could refer."""
        self._last, self._stays, self._recalled = "", None, None
        self._named.clear()

    def say(self, lines: Iterable[str], known: Mapping[str, str] | None = None) -> str:
        """Return one of several sentences, chosen in the same way as an answer."""
        self._last = self._choose(lines, dict(known or {}), always=True) or ""
        return self._last

    def _feel_with(
        self,
        words: Script,
        heard: str,
        felt: str | None,
        topic: Match | None,
        slots: dict[str, str],
    ) -> str | None:
        row = words.feelings.lines(heard, self._own(felt))
        text = self._choose(row, slots) or self._choose(words.feelings.lines(heard, None), slots)
        if text is None or topic is None or self._random.random() >= _TAKES_UP:
            return text
        # Only a question that names its subject may follow: not "That is sad. Do you like it?"
        naming = [line for line in topic.cue.say if "it" in slots_in(line)]
        more = self._choose(naming, slots | about(topic))
        return text if more is None else f"{text} {more}"

    def _remark(self, words: Script, felt: str | None, slots: dict[str, str]) -> str:
        text = self._choose(words.feelings.lines("none", self._own(felt)), slots)
        usual = words.feelings.lines("none", None)
        return text or self._choose(usual, slots, always=True) or "…"

    def _own(self, felt: str | None) -> str | None:
        """Return the partner's own feeling, or None if it has mentioned its feeling lately."""
        if felt is None or self._of_others < _OF_OTHERS:
            self._of_others += 1
            return None
        self._of_others = 0
        return felt

    def _choose(
        self, lines: Iterable[str], slots: Mapping[str, str], *, always: bool = False
    ) -> str | None:
        """Return the sentence that was said least often, but not lately; None if none is left."""
        known = [line for line in lines if slots_in(line) <= slots.keys()]
        now = self._times.total()
        recent = {line for line, when in self._when.items() if now - when <= UNREPEATED}
        fresh = [line for line in known if line not in recent]
        if not fresh and always and known:
            fresh = [min(known, key=lambda line: (self._times[line], self._when[line]))]
        if not fresh:
            return None
        fewest = min(self._times[line] for line in fresh)
        rarest = [line for line in fresh if self._times[line] == fewest]
        line = rarest[int(self._random.integers(len(rarest)))]
        self._when[line] = now
        self._times[line] += 1
        text = line.format(**slots)
        return text[:1].upper() + text[1:]


def _suits(topic: Match, *, heavy: bool, rambles: bool) -> bool:
    """Return whether the answer may take up this topic in a sad or long remark."""
    named = topic.it and any("it" in slots_in(line) for line in topic.cue.say)
    return (topic.cue.heavy or not heavy) and bool(named or not rambles)


def _kept(match: Match | None, said: str, slots: Mapping[str, str]) -> str | None:
    """Return the words that an answer refers to, or that the partner is to remember."""
    if match is None or match.cue.do == "amend":
        return None if match is None else said
    kept = "before" if match.cue.within is None else match.cue.within
    return match.words or (slots.get(kept) if match.cue.do == "remember" else None)


def _time(words: Script, now: datetime) -> dict[str, str]:
    """Return the slots ``clock``, ``date`` and ``tomorrow``, as the language writes them."""
    parts = {
        "hour": str(now.hour),
        "hour12": str((now.hour - 1) % 12 + 1),
        "minute": f"{now.minute:02}",
        "minutes": str(now.minute),
        "half": "am" if now.hour < 12 else "pm",
    }
    today, tomorrow = words.day_of(now), words.day_of(now + timedelta(days=1))
    return {"clock": words.clock.format(**parts), "date": today, "tomorrow": tomorrow}
