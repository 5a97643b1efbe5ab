"""A language's script: what people say to a partner, and its answers."""

import re
from collections.abc import Container, Iterator
from functools import cache, cached_property
from typing import Annotated, get_args

from pydantic import Field

from miburi.errors import DescriptionError
from miburi.languages import Language, compile_phrases, folders, is_spaced, plain, read
from miburi.talk.asking import NOTHING, asked_for, tells_a_fact
from miburi.talk.calendar import Calendar
from miburi.talk.cue import Answers, Cue, Do, Line, Lines, Match, Openings, PlainLines
from miburi.talk.initiative import Reason
from miburi.talk.wording import Turner, as_written

#: The name of the intent that stands for all questions whose intent is not known.
OPEN = "open"

#: The model's guess at an intent counts from these likelihoods on: where the answer repeats what
#: was said, so that a wrong guess shows at once; for a wish that is not put as a question; for an
#: order that is not put as a question; and where the model must be sure (our choice).
_GUESSED, _WISHED, _ORDERED, _SURE = 0.25, 0.45, 0.5, 0.65
#: The fewest words, and in a language without spaces the fewest letters, of an order that matches
#: no pattern, or of a question that is answered without a known intent (our choice).
_WORDS, _LETTERS = 3, 6
#: How many characters are read; the rest seldom changes the intent (our choice).
_READ = 300
_SENTENCE, _CLAUSE = re.compile(r"[^.!?;。！？\n]+"), re.compile(r"[^,.!?;、。！？\n]+")
_WHOLE = re.compile(r"[^.!?。！？\n]+[.!?。！？]*")


class Script(Calendar):
    """One language's ``talk.toml``, with the fields of a calendar.

    A missing regular expression matches nothing, or anything where that is safer.

    Attributes
    ----------
    turned, echoed, echo
        The data of a :class:`Turner`, which by default echoes no question.
    intent, topic, feelings
        Requests to the partner, the most urgent first; topics of conversation; answers to a feeling
        that was heard.
    again, itself, further
        Regular expressions for words that refer to the previous remark, for a question about the
        partner, and for a question about the fact just recalled ("And which was it?").
    more, enough
        Regular expressions for requests to repeat something fun, and for remarks that want no more
        of it.
    repeated, altered, alters
        Answers when a movement or a song is repeated; answers when somebody wants it done another
        way; and the regular expression of such a wish ("again, but slower").
    rephrased
        Regular expressions and their replacements: "You like dogs?" becomes "Do you like dogs?".
    unwanted
        Regular expression for remarks that contain the words of an order but are none ("Why do you
        look up?", "Do not dance yet").
    grave, heavy, people, oneself
        Regular expressions for questions that may be grave, for words that rule out a ``light``
        answer, for remarks about people or calls ("Hello?"), and for words about the speaker.
    fact, question, belongs
        Regular expressions for facts, for questions, and for a sentence that belongs to the fact
        before it.
    begin, stopped, paused, gentle, unkept, unknown
        What the partner says when it speaks first, for each reason; when the body cannot move; in
        answer to ``heavy`` words that have no other answer; when the disk takes nothing of what it
        should keep; and in answer to words of an unknown language (the last two by default the
        usual answers).
    whys
        Why the body is stopped, by the name of a stop's reason; ``other`` stands for the rest.
    likely
        The least likelihood of a question's intent that only the model finds.
    """

    turned: dict[str, str] = Field(default_factory=dict)
    echoed: str = ""
    echo: str = "{it}? "
    again: str = "(?!)"
    itself: str = "(?!)"
    further: str = "(?!)"
    more: str = "(?!)"
    enough: str = ".*"
    repeated: list[Line] = Field(default_factory=list)
    altered: list[Line] = Field(default_factory=list)
    alters: str = "(?!)"
    rephrased: dict[str, str] = Field(default_factory=dict)
    unwanted: str = "(?!)"
    grave: str = "(?!)"
    heavy: str = "(?!)"
    people: str = ".*"
    oneself: str = ".*"
    fact: list[str]
    question: list[str]
    belongs: str = "(?!)"
    intent: list[Cue]
    topic: list[Cue]
    feelings: Answers
    begin: dict[Reason, Openings]
    stopped: PlainLines
    paused: PlainLines
    gentle: Lines = Field(default_factory=list)
    unkept: Lines = Field(default_factory=list)
    unknown: Lines = Field(default_factory=list)
    whys: dict[str, str] = Field(default_factory=dict)
    likely: Annotated[float, Field(gt=0, lt=1)] = 0.45

    @cached_property
    def _intents(self) -> list[tuple[Cue, re.Pattern[str]]]:
        return self._compile(self.intent)

    @cached_property
    def _doing(self) -> dict[Do, list[tuple[Cue, re.Pattern[str]]]]:
        return {do: [one for one in self._intents if one[0].do == do] for do in get_args(Do)}

    @cached_property
    def _topics(self) -> list[tuple[Cue, re.Pattern[str]]]:
        return self._compile(self.topic)

    def _compile(self, cues: list[Cue]) -> list[tuple[Cue, re.Pattern[str]]]:
        found = []
        for cue in (each for each in cues if each.when):
            # A group's name may occur only once in a pattern.
            own = [when.replace("(?P<it>", f"(?P<it{n}>") for n, when in enumerate(cue.when)]
            found.append((cue, compile_phrases(own, self.language, self.words)))
        return found

    def intents_of(
        self, said: str, filled: Container[str] = (), *, do: Do | None = None
    ) -> Iterator[Match]:
        """Yield the intents of a remark, the most urgent first.

        ``filled`` has the names of the slots that are filled: some intents need one to be filled,
        or to be empty. With ``do``, only intents with this act are found.
        """
        intents = self._doing[do] if do else self._intents
        return self._find([one for one in intents if one[0].fits(filled)], said)

    def topics_of(self, said: str) -> Iterator[Match]:
        """Yield the topics of a remark."""
        mine = self.fits("oneself", said)
        return self._find([one for one in self._topics if mine or not one[0].mine], said)

    def _find(self, cues: list[tuple[Cue, re.Pattern[str]]], said: str) -> Iterator[Match]:
        sentences, clauses = (
            [plain(each, self.language) for each in pattern.findall(said[:_READ])]
            for pattern in (_SENTENCE, _CLAUSE)
        )
        last = [*sentences, *clauses[-1:]]
        unwanted = {part for part in (*sentences, *clauses) if self._says("unwanted", part)}
        for cue, pattern in cues:
            # "Dance, I've had a long day": brief cues match any clause, "stop" only the last.
            parts = [*sentences, *clauses] if cue.brief else last if cue.do == "stop" else sentences
            for sentence in parts:
                if cue.orders and sentence in unwanted:
                    continue
                if (found := pattern.search(sentence)) is not None:
                    it = next((part for part in found.groupdict().values() if part), None)
                    words = it and as_written(it, said, self.language)
                    if cue.capital and not (words and words[0].isupper()):
                        continue
                    yield Match(cue, words, words and self.turner.turn_round(words))
                    break

    @cached_property
    def _single(self) -> dict[str, re.Pattern[str]]:
        """The compiled regular expressions outside of cues, by field."""
        one = "again itself further alters more enough unwanted grave heavy people oneself belongs"
        written = {name: [getattr(self, name)] for name in one.split()}
        written |= {"fact": self.fact, "question": self.question}
        return {
            name: compile_phrases(each, self.language, self.words) for name, each in written.items()
        }

    def fits(self, name: str, said: str) -> bool:
        """Return whether a remark fits the regular expression of a field, such as ``heavy``."""
        return self._says(name, plain(said[:_READ], self.language))

    def _says(self, name: str, words: str) -> bool:
        return bool(self._single[name].search(words))

    def asked_of(
        self, said: str, than: Match | None, *, felt: bool = False, told: bool = False
    ) -> Iterator[Match]:
        """Yield the intents of words that match no pattern, or only the broad pattern of ``than``.

        The model must be sure if a feeling was heard (``felt``), or if a topic was heard in a
        remark that is not clearly a question (``told``). A question without a known intent has the
        intent ``open``. If a question may be grave, the model is not asked, and the intent is
        ``grave``.
        """
        sentences = [*_WHOLE.findall(said[:_READ]), said[:_READ]]
        asking = [each for each in sentences if self.asks(each)]
        if not asking or (than is not None and not than.cue.broad):
            return
        plainly = not (felt or told)
        if self.fits("grave", said):
            yield from (Match(cue, None, None) for cue in self._named.get("grave", ()) if plainly)
            return
        found = [asked_for(each, self.language) for each in asking]
        name, likely = max(found, key=lambda each: each[1] * (each[0] != NOTHING))
        for cue in self._named.get(name, ()):
            wanted = not (cue.orders and self.fits("unwanted", said))
            guessed = cue.echo or {"told", "kept"} & {cue.within, cue.without}
            least = _GUESSED if guessed else _SURE if cue.light else self.likely
            if not plainly:
                least = _ORDERED if cue.wish else _SURE
            if wanted and likely > least:
                yield Match(cue, None, None)
        plainly = plainly or self.fits("itself", said)
        # "Twenty-seven patients, can you imagine" asks nothing.
        plainly = plainly and (not self.echoed or self.asks_clearly(said))
        if plainly and than is None and not _is_brief(said[:_READ], self.language):
            yield from (Match(cue, None, None) for cue in self._named.get(OPEN, ()))

    def orders_of(self, said: str) -> Iterator[Match]:
        """Yield the model's guesses at orders in words that match no pattern and ask no question.

        An example is "Lift your left one up slow for me".
        """
        text = said[:_READ]
        whole = [*_WHOLE.findall(text), text]
        parts = [*whole, *_CLAUSE.findall(text)]
        for each in parts:
            if self.asks(each) or self.fits("unwanted", each):
                continue
            name, likely = asked_for(each, self.language)
            # "I used to lift both arms" tells something, but orders nothing.
            tells = self.tells(next(iter(_CLAUSE.findall(each)), ""))
            short = _is_brief(each, self.language)
            for cue in self._named.get(name, ()):
                if likely > _least(cue, whole=each in whole, tells=tells, short=short):
                    yield Match(cue, None, None)

    @cached_property
    def _named(self) -> dict[str, list[Cue]]:
        named: dict[str, list[Cue]] = {}
        for cue in self.intent:
            named.setdefault(cue.name, []).append(cue)
        return named

    def asks(self, said: str) -> bool:
        """Return whether a remark is a question."""
        return _is_written_as_a_question(said) or self.fits("question", said)

    def asks_clearly(self, said: str) -> bool:
        """Return whether a remark ends with a question mark, or can be echoed as a question."""
        return _is_written_as_a_question(said) or self.turner.echo(said) is not None

    def reword(self, said: str) -> str:
        """Return a remark with the replacements of ``rephrased``."""
        for pattern, instead in self.rephrased.items():
            said = re.sub(pattern, instead, said, flags=re.IGNORECASE)
        return said

    def says_again(self, cue: Cue, said: str) -> list[str]:
        """Return the answers to a repeated request for this cue."""
        if not cue.shows or not self.repeated:
            return cue.say
        return self.altered if self.altered and self.fits("alters", said) else self.repeated

    def goes_on(self, said: str) -> bool:
        """Whether this is a question about the previous remark."""
        return self.asks(said[:_READ]) and self.fits("again", said)

    def point_of(self, said: str, filled: Container[str] = ()) -> str | None:
        """Return the last of several sentences that contains a question or a request."""
        sentences: list[str] = _WHOLE.findall(said[:_READ])
        for each in reversed(sentences if len(sentences) > 1 else []):
            if self.asks(each) or any(not one.cue.aside for one in self.intents_of(each, filled)):
                return each
        return None

    def tells_more(self, said: str) -> bool:
        """Return whether the last of several sentences has heavy words or a heavy topic."""
        sentences = _WHOLE.findall(said[:_READ])
        last = sentences[-1] if len(sentences) > 1 else ""
        return self.fits("heavy", last) or any(one.cue.heavy for one in self.topics_of(last))

    def wants_more(self, said: str) -> bool:
        """Return whether somebody only wants a repetition of something fun."""
        text = said[:_READ]
        each = [*_SENTENCE.findall(text), *_CLAUSE.findall(text), text]
        if any(self.fits("more", part) for part in each):
            return True
        name, likely = asked_for(said[:_READ], self.language)
        return name == "again" and likely > _ORDERED and not self.fits("enough", said)

    def told_in(self, said: str) -> list[str]:
        """Return a remark's sentences that ask nothing."""
        sentences = (found.strip() for found in _WHOLE.findall(said[:_READ]))
        return [each for each in sentences if each and not self.asks(each)]

    def tells(self, said: str) -> bool:
        """Return whether a sentence tells something about the person."""
        return self.fits("fact", said) or tells_a_fact(said, self.language)

    @cached_property
    def turner(self) -> Turner:
        """Turns somebody's words into the partner's, with this language's data."""
        return Turner(self.turned, self.echoed, self.echo, self.language)


@cache
def script(language: Language) -> Script:
    """Return a language's script.

    Raises DescriptionError if there is no ``talk.toml``, or it is wrong.
    """
    written = read(Script, language, "talk")
    if written is None:
        raise DescriptionError(f"{folders()[language]}: talk.toml is missing; add it.")
    numbers = {plain(word, language): number for word, number in written.numbers.items()}
    return written.model_copy(update={"language": language, "numbers": numbers})


def _is_brief(said: str, language: Language) -> bool:
    words = plain(said, language)
    return len(words.split()) < _WORDS if is_spaced(language) else len(words) < _LETTERS


def _is_written_as_a_question(said: str) -> bool:
    return said.rstrip().endswith(("?", "？"))


def _least(cue: Cue, *, whole: bool, tells: bool, short: bool) -> float:
    """Return the likelihood above which a cue counts outside questions; 1 rules the cue out."""
    if short:
        return _SURE if cue.wish and whole else 1.0
    if cue.wish:
        return _WISHED if whole and not tells else _ORDERED
    if cue.do == "remember":  # the fact may be written to the disk
        return _SURE
    if tells or not cue.orders:
        return 1.0
    return _SURE if cue.light or not whole else _ORDERED
