"""Lists written by hand: questions, cries of alarm, smileys, and Japanese word stems.

If an entry is found in a sentence, the sentence yields an impression based on that entry. The
lists, beside this module, are ``asked.toml``, ``alarms.toml``, ``smileys.toml`` and
``stems-ja.toml``.
"""

import re
import tomllib
import unicodedata
from functools import cache, cached_property
from importlib import resources
from math import log
from typing import Annotated

from pydantic import Field

from miburi.feelings import FEELINGS
from miburi.feelings.catalogue import FeelingName
from miburi.feelings.temperament import Share
from miburi.ground.tables import AnyTable, Table
from miburi.languages import Language, compile_phrases, is_elsewhere
from miburi.senses.impression import Brought, Impression
from miburi.senses.text import tokens

_DENIED = re.compile(r"\b(not|never|no)( \S+){0,3}$")
_SENTENCE = re.compile(r"[^.!?;\n]+[.!?;\n]*")
_TONES = "\ufe0f\U0001f3fb-\U0001f3ff"  # characters that only change how an emoji is drawn


class _Alarms(Table):
    """Cries that show fright: regular expressions over a sentence's words."""

    strength: Share
    cries: list[str]

    @cached_property
    def pattern(self) -> re.Pattern[str]:
        return compile_phrases(self.cries, "en")


class _Asked(Table):
    """Questions about the partner's own feelings, by language, and greetings that go with them."""

    en: list[str]
    greetings: list[str]
    ja: list[str]


class _Smileys(Table):
    """Smileys by feeling, the strength of a text of smileys only, and their weight beside words."""

    alone: Share
    weight: Annotated[float, Field(gt=0, le=20)]
    signs: dict[FeelingName, list[str]]

    @cached_property
    def feelings(self) -> dict[str, str]:
        return {sign: feeling for feeling, signs in self.signs.items() for sign in signs}

    @cached_property
    def pattern(self) -> re.Pattern[str]:
        """All signs, the longest first.

        If a sign begins or ends with a letter or digit, a word must begin or end there.
        """
        either = "|".join(
            (r"(?<!\w)" if sign[0].isalnum() else "")
            + re.escape(sign)
            + (r"(?!\w)" if sign[-1].isalnum() else "")
            for sign in sorted(self.feelings, key=len, reverse=True)
        )
        return re.compile(f"({either})[{_TONES}]*")


class _Stems(Table):
    """Stems of Japanese words by feeling, and a pattern for denials that may follow a stem."""

    strength: Share
    denial: str
    reach: Annotated[int, Field(ge=1, le=20)]
    stems: dict[FeelingName, list[str]]


def _shipped(table: type[AnyTable], name: str) -> AnyTable:
    shipped: AnyTable = _read(table, name)
    return shipped


@cache
def _read(table: type[AnyTable], name: str) -> AnyTable:
    text = (resources.files(__package__) / f"{name}.toml").read_text(encoding="utf-8")
    return table.model_validate(tomllib.loads(text))


def alarm_in(text: str) -> Impression | None:
    """Return fright if a sentence cries out, warns or calls for help; None for any other."""
    alarms, sentence = _shipped(_Alarms, "alarms"), _plain(text)
    for match in alarms.pattern.finditer(sentence):
        if not _DENIED.search(sentence[: match.start()].rstrip()):
            why = Brought(match.group().strip(), round(_odds(alarms.strength), 2))
            return Impression("fright", alarms.strength, "speech", (why,))
    return None


def smiley_weight() -> float:
    """Return the weight of a smiley beside words, as log-odds of its feeling against none."""
    return _shipped(_Smileys, "smileys").weight


def smileys_alone(text: str) -> Impression | None:
    """Return the feeling of the first smiley in a text of smileys only; None for other texts."""
    rest, smileys = cut_smileys(text)
    if not smileys or any(sign.isalnum() for sign in rest):
        return None
    sign, feeling = next(iter(smileys.items()))
    strength = _shipped(_Smileys, "smileys").alone
    return Impression(feeling, strength, "speech", (Brought(sign, round(_odds(strength), 2)),))


def cut_smileys(text: str) -> tuple[str, dict[str, str]]:
    """Return a text without its smileys and emoji, and the feeling of each of them.

    >>> cut_smileys("My cat is ill 😢")
    ('My cat is ill  ', {'😢': 'sadness'})
    """
    table, text = _shipped(_Smileys, "smileys"), unicodedata.normalize("NFKC", text)
    found = {sign: table.feelings[sign] for sign in table.pattern.findall(text)}
    return table.pattern.sub(" ", text), found


def cut_elsewhere(text: str, language: Language) -> str:
    """Return a text without its sentences about somebody else's feelings or past feelings.

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
    if language not in ("en", "ja"):
        return None
    table = _shipped(_Asked, "asked")
    if language == "ja":
        text = unicodedata.normalize("NFKC", text)
        rest = re.sub("|".join(table.ja), "", text)
        return None if rest == text else rest
    asked, greetings = "|".join(table.en), "|".join(table.greetings)
    sentences = [(each, _plain(each)) for each in _SENTENCE.findall(text)]
    unasked = [(each, said) for each, said in sentences if not re.fullmatch(asked, said)]
    if unasked == sentences:
        return None
    return "".join(each for each, said in unasked if not re.fullmatch(greetings, said)).strip()


def _plain(text: str) -> str:
    """Return a text's words in lower case, without punctuation."""
    return " ".join(word for word in tokens(text) if word[0].isalnum())


def stems_in(text: str) -> Impression:
    """Return the feeling that the stems and smileys of a Japanese sentence show."""
    (text, smileys), table = cut_smileys(text), _shipped(_Stems, "stems-ja")
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
