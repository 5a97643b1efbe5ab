"""Distress: whether somebody says that they, or somebody with them, need help now.

It takes a sentence and returns a kind of distress, or None. Distress is judged before the feelings,
on text without punctuation and capitals, which speech recognisers omit.

Hand-written patterns (a language's ``distress.toml``) match the plainest phrases of distress. Other
patterns match phrases which show that no distress is meant, and a few patterns match words that are
always worth a question. For English and Japanese there are two models. A small linear model
(``distress.npz``, trained by ``tools/train_distress.py`` on sentences that we and strangers wrote
for it) weighs the patterns together with groups of words and letters. A small network
(:mod:`miburi.senses.network`) weighs the words in their order. What counts is the geometric mean of
the two models' likelihoods. In other languages the patterns decide. No expert has reviewed the
patterns or the models. This is neither an alarm nor a medical device.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from importlib import resources
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, field_validator

from miburi.ground.tables import Table
from miburi.languages import (
    FALLBACK,
    Language,
    compile_phrases,
    find_phrase,
    is_spaced,
    language_of,
    plain,
    read,
)
from miburi.senses.kinds import KINDS, Distress, check_kinds
from miburi.senses.linear import groups_of, load_model, numbered
from miburi.senses.network import agreed, load_network

#: Thresholds for the likelihood of distress: above the first it is a slight sign; above the second
#: the partner asks the person. The numbers are ours; we chose them with sentences that were not
#: used to train the models.
_HINTS, _WONDERS = 0.45, 0.5
#: Above this likelihood, the question names the kind of distress (our choice).
_NAMES = 0.35
#: Thresholds, for asking and for reporting, for a death wish without any explicit word. Veiled
#: wishes look like small talk ("Give us a song before I go"). Of 2,138 remarks in strangers'
#: conversations, 8 were above 0.75 and none above 0.95, before the models were trained on them.
_WORRIES, _SURE = 0.75, 0.95
#: Thresholds for asking and for reporting in a long text without any explicit word. The part with
#: the highest score counts, and among many parts one scores high by chance. The third number says
#: from how many parts on the thresholds apply. They do not apply to Japanese: there, even a plain
#: sentence has several parts, and cries for help were lost (our choice).
_CHATTERS, _SURE_OF_CHATTER, _MANY = 0.65, 0.9, 5
#: The length of the longest text that is not split; the length of the parts of a longer text; and
#: the distance from one part's beginning to the next. First in words, then in characters (our
#: choice). In a minute's chatter, a cry for help has little weight.
_LONG_WORDS, _LONG_LETTERS = (24, 14, 4), (34, 24, 6)
_LATIN = re.compile(r"[A-Za-z][A-Za-z'’]*")
#: Each pattern that matches counts as this many features, since a single feature would hardly weigh
#: against a hundred groups of letters (our choice).
_MARKS = 3
#: Kinds of distress where somebody who says "he's fine" may be wrong.
_MISJUDGED = frozenset({"child", "breathing", "heart", "stroke", "poison"})
#: The words that matched, by kind, and the names of the excuses that matched.
_Fitting = tuple[dict[Distress, str], set[str]]


class _Patterns(Table):
    """One language's ``distress.toml``; above the likelihood ``finds``, distress is reported.

    ``read_as`` has harmless phrases with grave words in them, and what is read instead ("electric
    fire", "heater"); ``asks`` has words that are worth a question even if the models hear nothing.
    """

    finds: float = 0.66
    words: dict[str, str]
    read_as: dict[str, str] = Field(default_factory=dict)
    asks: dict[Distress, list[str]] = Field(default_factory=dict)
    kinds: Annotated[
        dict[Distress, Annotated[list[str], Field(min_length=1)]], AfterValidator(check_kinds)
    ]
    excuses: dict[str, Annotated[list[str], Field(min_length=1)]]

    @field_validator("excuses")
    @classmethod
    def _check_excuses(cls, excuses: dict[str, list[str]]) -> dict[str, list[str]]:
        if "idioms" not in excuses:
            raise ValueError("'idioms' is missing; add it")
        return excuses


class Doubt(IntEnum):
    """How uncertain it is that words mean distress."""

    NONE = 0
    #: It may be a false alarm; only asking the person can tell.
    WORTH_A_QUESTION = 1
    #: Only a second sign, soon after, is worth a question.
    SLIGHT_SIGN = 2


@dataclass(frozen=True)
class Heard:
    """Distress that was heard.

    Attributes
    ----------
    kind
        One of ``KINDS``.
    words
        The words that fit the kind's patterns; empty if only the model heard the distress.
    doubt
        How doubtful it is.
    """

    kind: Distress
    words: str = ""
    doubt: Doubt = Doubt.NONE


@cache
def _compiled(
    language: Language,
) -> tuple[dict[Distress, re.Pattern[str]], dict[str, re.Pattern[str]]] | None:
    table = read(_Patterns, language, "distress")
    if table is None:
        return None
    kinds = {kind: compile_phrases(table.kinds[kind], language, table.words) for kind in KINDS}
    excuses = {
        name: compile_phrases(phrases, language, table.words)
        for name, phrases in table.excuses.items()
    }
    return kinds, excuses


@cache
def _asked(language: Language) -> dict[Distress, re.Pattern[str]]:
    table = read(_Patterns, language, "distress")
    if table is None:
        return {}
    return {
        kind: compile_phrases(phrases, language, table.words)
        for kind, phrases in table.asks.items()
    }


@cache
def _read_as(language: Language) -> list[tuple[re.Pattern[str], str]]:
    table = read(_Patterns, language, "distress")
    if table is None:
        return []
    return [
        (compile_phrases([phrase], language, table.words), instead)
        for phrase, instead in table.read_as.items()
    ]


def features(said: str, language: Language) -> list[int]:
    """Return the hashed ids of groups of words and letters, and of the patterns that match."""
    return _features(said, language, _fitting(said, language))


def _features(said: str, language: Language, fitting: _Fitting) -> list[int]:
    found, excuses = fitting
    denied = "~" if excuses - {"idioms"} else ""
    marks = {f"~{name}" for name in excuses} | {f"={kind}{denied}" for kind in found}
    marks |= {f"={denied}"} if found else set()
    repeated = {f"6{k}{mark}" for mark in marks for k in range(_MARKS)}
    return numbered(groups_of(said, language) | repeated)


def _parts(said: str, language: Language) -> list[str]:
    """Split a long text, in which a cry for help would be lost, into overlapping parts."""
    spaced = is_spaced(language)
    longest, size, step = _LONG_WORDS if spaced else _LONG_LETTERS
    units = said.split() if spaced else list(said)
    if len(units) <= longest:
        return []
    begins = [*range(0, len(units) - size, step), len(units) - size]
    return [(" " if spaced else "").join(units[begin : begin + size]) for begin in begins]


@cache
def _model(language: Language) -> Callable[[str], Heard | None] | None:
    likelihoods = load_model(resources.files(__package__) / "distress.npz", language)
    if likelihoods is None:
        return None

    network = load_network("distress", language)
    table = read(_Patterns, language, "distress")
    finds = 1.0 if table is None else table.finds

    def weigh(said: str) -> NDArray[np.float64]:
        fitting = _fitting(said, language)
        linear = likelihoods(_features(said, language, fitting))
        # The network cannot tell what makes words harmless ("years ago I wanted to die", or an
        # idiom with nothing grave beside it), so the linear model decides alone there.
        excused = fitting[1] - ({"idioms"} if fitting[0] else set())
        return linear if network is None or excused else agreed(linear, network(said))

    def judge(said: str) -> Heard | None:
        parts = _parts(said, language)
        likely = min(map(weigh, (said, *parts)), key=lambda each: each[-1])
        best, distress = int(likely[:-1].argmax()), 1 - likely[-1]
        found, excuses = _fitting(said, language)
        misjudged = excuses == {"fine"} and not _MISJUDGED.isdisjoint(found)
        if misjudged and network is not None and distress <= _WONDERS:
            # An example: "She swallowed a battery, but she's fine."
            alone = network(said)
            if 1 - alone[-1] > finds:
                return Heard(KINDS[int(alone[:-1].argmax())], "", Doubt.WORTH_A_QUESTION)
        if distress <= _HINTS:
            return None
        words = found.get(KINDS[best], "")
        hidden = KINDS[best] == "suicide" and not words
        asks, reports = (_WORRIES, _SURE) if hidden else (_WONDERS, finds)
        least = _HINTS
        if is_spaced(language) and len(parts) >= _MANY and not found:
            least, reports = _CHATTERS, max(reports, _SURE_OF_CHATTER)
        if distress <= least:
            return None
        if distress <= reports:
            kind = KINDS[best] if likely[best] > _NAMES else "help"
            return Heard(kind, "", Doubt.WORTH_A_QUESTION if distress > asks else Doubt.SLIGHT_SIGN)
        return Heard(KINDS[best], words)

    return judge


def hear_distress(text: str, usual: Language = FALLBACK) -> Heard | None:
    """Return the distress that somebody speaks of: their own, or that of a person with them.

    Stories, past or denied distress, general questions and turns of phrase do not count. A
    text that could be in any language counts as ``usual``.
    """
    heard = judge_distress(text, usual)
    return None if heard is None or heard.doubt else heard


def judge_distress(text: str, usual: Language = FALLBACK) -> Heard | None:
    """Return the distress in somebody's words, and how doubtful it is.

    People may hint at distress ("I've been saving my tablets up"), or speak of something else in
    similar words; only a question can tell which. Without a model for the language, the patterns
    alone decide, and there is no doubt.
    """
    heard = [one for part in _by_language(text, usual) if (one := _judge(*part)) is not None]
    return min(heard, key=lambda one: one.doubt, default=None)


def _by_language(text: str, usual: Language) -> Iterator[tuple[str, Language]]:
    """Yield a text and its language; if it mixes two scripts, also the part in each script."""
    language = language_of(text, usual)
    yield text, language
    words, rest = _LATIN.findall(text), _LATIN.sub(" ", text)
    if words and not is_spaced(other := language_of(rest, language)):
        yield rest, other
        yield " ".join(words), FALLBACK


def _judge(text: str, language: Language) -> Heard | None:
    said = plain(text, language)
    for phrase, instead in _read_as(language):
        said = phrase.sub(instead, said)
    if not said:
        return None
    if (model := _model(language)) is not None:
        return _at_least_asked(model(said), said, language)
    found, excuses = _fitting(said, language)
    if excuses - {"idioms"}:
        return None
    return next((Heard(kind, words) for kind, words in found.items()), None)


def _at_least_asked(heard: Heard | None, said: str, language: Language) -> Heard | None:
    """Return what the models heard, or a question if the words are always worth a question.

    If the models heard distress, but no pattern matches its kind, those words determine the kind,
    unless the models heard distress about a child.
    """
    sure = heard is not None and heard.doubt is not Doubt.SLIGHT_SIGN
    if heard is not None and (heard.words or (sure and heard.kind == "child")):
        return heard
    kinds = (kind for kind, words in _asked(language).items() if find_phrase(words, said, language))
    kind = next(kinds, None)
    if kind is None or _fitting(said, language)[1] - {"idioms", "fine"}:
        return heard
    doubt = Doubt.NONE if heard is not None and not heard.doubt else Doubt.WORTH_A_QUESTION
    return Heard(kind, "", doubt)


def _fitting(said: str, language: Language) -> _Fitting:
    """Return the words outside idioms that fit each kind's patterns, and the excuses that fit."""
    compiled = _compiled(language)
    if compiled is None:
        return {}, set()
    kinds, excuses = compiled
    rest = excuses["idioms"].sub("#", said)
    excused = {name for name in excuses if name != "idioms" and excuses[name].search(rest)}
    if rest != said:
        excused.add("idioms")
    found = ((kind, find_phrase(pattern, rest, language)) for kind, pattern in kinds.items())
    return {kind: words for kind, words in found if words is not None}, excused
