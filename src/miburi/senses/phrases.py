"""Lists written by hand: questions, cries of alarm, smileys, and Japanese word stems.

A sentence in which one is found yields an impression, with the phrase or the stems on which it is
based. The lists are ``asked.toml``, ``alarms.toml``, ``smileys.toml`` and ``stems-ja.toml``, beside
this module.
"""

import re
import tomllib
import unicodedata
from functools import cache
from importlib import resources
from itertools import compress
from math import log
from typing import Annotated

from pydantic import Field

from miburi.feelings import FEELINGS
from miburi.feelings.catalogue import FeelingName
from miburi.feelings.temperament import Share
from miburi.ground.tables import Table
from miburi.languages import Language, is_elsewhere
from miburi.senses.impression import Brought, Impression
from miburi.senses.text import tokens

__all__ = [
    "Alarms",
    "Asked",
    "Smileys",
    "Stems",
    "alarm_in",
    "cut_elsewhere",
    "cut_questions",
    "cut_smileys",
    "smiley_weight",
    "smileys_alone",
    "stems_in",
]

_DENIED = re.compile(r"\b(not|never|no)( \S+){0,3}$")
_SENTENCE = re.compile(r"[^.!?;\n]+[.!?;\n]*")
_TONES = "\ufe0f\U0001f3fb-\U0001f3ff"  # characters that only change how an emoji is drawn


class Alarms(Table):
    """Cries that show fright: regular expressions over a sentence's words."""

    strength: Share
    cries: list[str]


class Asked(Table):
    """Questions about the partner's own feelings, by language, and greetings that go with them."""

    en: list[str]
    greetings: list[str]
    ja: list[str]


class Smileys(Table):
    """Smileys by feeling: the strength of one that stands alone, and its log-odds next to words."""

    alone: Share
    weight: Annotated[float, Field(gt=0, le=20)]
    signs: dict[FeelingName, list[str]]


class Stems(Table):
    """Parts of Japanese words by feeling, and what negates them."""

    strength: Share
    denial: str
    reach: Annotated[int, Field(ge=1, le=20)]
    stems: dict[FeelingName, list[str]]


@cache
def _alarms() -> tuple[float, re.Pattern[str]]:
    alarms = Alarms.model_validate(_read("alarms.toml"))
    return alarms.strength, _whole_words(alarms.cries)


@cache
def _compile_questions() -> tuple[re.Pattern[str], re.Pattern[str], re.Pattern[str]]:
    asked = Asked.model_validate(_read("asked.toml"))
    english, greetings, japanese = (
        re.compile("|".join(each)) for each in (asked.en, asked.greetings, asked.ja)
    )
    return english, greetings, japanese


@cache
def _smileys() -> tuple[Smileys, dict[str, str], re.Pattern[str]]:
    table = Smileys.model_validate(_read("smileys.toml"))
    feelings = {sign: feeling for feeling, signs in table.signs.items() for sign in signs}
    either = "|".join(
        (r"(?<!\w)" if sign[0].isalnum() else "")
        + re.escape(sign)
        + (r"(?!\w)" if sign[-1].isalnum() else "")
        for sign in sorted(feelings, key=len, reverse=True)
    )
    return table, feelings, re.compile(f"({either})[{_TONES}]*")


@cache
def _stems() -> Stems:
    return Stems.model_validate(_read("stems-ja.toml"))


def _read(name: str) -> dict[str, object]:
    return tomllib.loads((resources.files(__package__) / name).read_text(encoding="utf-8"))


def _whole_words(phrases: list[str]) -> re.Pattern[str]:
    either = "|".join(f"(?:{phrase})" for phrase in phrases)
    return re.compile(rf"(?<!\S)(?:{either})(?!\S)")


def alarm_in(text: str) -> Impression | None:
    """Return fright if a sentence cries out, warns or calls for help; None for any other."""
    strength, cries = _alarms()
    found = _find_undenied(cries, text)
    if found is None:
        return None
    why = Brought(found.group().strip(), round(_odds(strength), 2))
    return Impression("fright", strength, "speech", (why,))


def smiley_weight() -> float:
    """Return the evidence of a smiley beside words: log-odds of each feeling against none."""
    return _smileys()[0].weight


def smileys_alone(text: str) -> Impression | None:
    """Return the feeling of the first smiley in a text of smileys only; None for other texts."""
    rest, smileys = cut_smileys(text)
    if not smileys or any(sign.isalnum() for sign in rest):
        return None
    sign, feeling = next(iter(smileys.items()))
    strength = _smileys()[0].alone
    return Impression(feeling, strength, "speech", (Brought(sign, round(_odds(strength), 2)),))


def cut_smileys(text: str) -> tuple[str, dict[str, str]]:
    """Return a text without its smileys and emoji, and the feeling of each of them.

    >>> cut_smileys("My cat is ill 😢")
    ('My cat is ill  ', {'😢': 'sadness'})
    """
    _, feelings, pattern = _smileys()
    text = unicodedata.normalize("NFKC", text)
    found = {match.group(1): feelings[match.group(1)] for match in pattern.finditer(text)}
    return pattern.sub(" ", text), found


def cut_elsewhere(text: str, language: Language) -> str:
    """Return a text without its sentences about somebody else's feelings or about past ones.

    >>> cut_elsewhere("My son is angry. I am sad.", "en")
    'I am sad.'
    """
    sentences = _SENTENCE.findall(text)
    return "".join(each for each in sentences if not is_elsewhere(each, language)).strip()


def cut_questions(text: str, language: Language) -> str | None:
    """Return a text without its questions about the partner's feelings; None if it asks none.

    A greeting next to such a question is removed, too: "Hello! How are you?" shows nothing.

    >>> cut_questions("Hello! How are you? I am sad.", "en")
    'I am sad.'
    """
    english, greetings, japanese = _compile_questions()
    if language not in ("en", "ja"):
        return None
    if language == "ja":
        text = unicodedata.normalize("NFKC", text)
        rest = japanese.sub("", text)
        return None if rest == text else rest
    sentences = _SENTENCE.findall(text)
    said = [_plain(each) for each in sentences]
    asked = [english.fullmatch(each) is not None for each in said]
    if not any(asked):
        return None
    beside = [
        not asks and not greetings.fullmatch(each) for each, asks in zip(said, asked, strict=True)
    ]
    return "".join(compress(sentences, beside)).strip()


def _find_undenied(phrases: re.Pattern[str], text: str) -> re.Match[str] | None:
    """Return the first phrase that stands in a sentence without being negated."""
    sentence = _plain(text)
    for match in phrases.finditer(sentence):
        if not _DENIED.search(sentence[: match.start()].rstrip()):
            return match
    return None


def _plain(text: str) -> str:
    """Return a text's words in lower case, without punctuation."""
    return " ".join(word for word in tokens(text) if word[0].isalnum())


def stems_in(text: str) -> Impression:
    """Return the feeling that the stems and smileys of a Japanese sentence show."""
    (text, smileys), table = cut_smileys(text), _stems()
    denial = re.compile(table.denial)
    places: dict[str, dict[int, str]] = {}
    for feeling, stems in table.stems.items():
        for stem in (unicodedata.normalize("NFKC", stem) for stem in stems):
            for match in re.finditer(re.escape(stem), text):
                after = text[match.end() : match.end() + table.reach]
                if stem.endswith("ない") or not denial.match(after):
                    places.setdefault(feeling, {})[match.start()] = stem
    for number, (sign, feeling) in enumerate(smileys.items(), 1):
        places.setdefault(feeling, {})[-number] = sign
    if not places:
        return Impression(None, 0.0, "speech")
    most = max(places, key=lambda feeling: (len(places[feeling]), -FEELINGS.index(feeling)))
    strength = 1 - (1 - table.strength) ** len(places[most])
    told = dict.fromkeys(places[most].values())
    weight = round(_odds(table.strength), 2)
    return Impression(most, strength, "speech", tuple(Brought(stem, weight) for stem in told))


def _odds(share: float) -> float:
    return log(share / (1 - share))
