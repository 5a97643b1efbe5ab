"""Distress: whether somebody says that they, or somebody with them, need help now.

In goes a sentence in English or Japanese; out comes a kind of distress, or None. It is judged
before the feelings, on the plain words: signs and capitals, which no recogniser of speech writes,
change nothing.

Patterns written by hand (``distress-en.toml``, ``distress-ja.toml``) find the plainest words. A
small linear model (``distress.npz``, trained by ``tools/train_distress.py`` on sentences written
for it, ours and those of strangers) reads beside them: it hears what no pattern knows, and silences
a pattern that it is sure is wrong.
Neither was seen by an expert. This is no alarm and no medical device.
"""

import re
import tomllib
import unicodedata
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from itertools import pairwise
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from miburi.ground.tables import Table
from miburi.senses.kinds import KINDS, Distress
from miburi.senses.language import Language, language_of

__all__ = ["Heard", "compile_phrases", "features", "find_phrase", "hear_distress", "plain"]


#: Likelihoods above which the model alone reports distress, above which it does so even if the
#: words excuse or deny it, and below which it overrules a pattern. Ours: chosen on each stranger's
#: lines with a model trained on the others'. It then hears 76 % of the English and 69 % of the
#: Japanese distress, half of which names no emergency, at 1.5 % and 0.8 % false.
_FINDS, _SURE, _SILENCES = 0.65, 0.9, 0.3

_SHORT = {
    "im": "i am", "ive": "i have", "dont": "do not", "doesnt": "does not", "didnt": "did not",
    "cant": "can not", "cannot": "can not", "couldnt": "could not", "wont": "will not",
    "wouldnt": "would not", "shouldnt": "should not", "isnt": "is not", "arent": "are not",
    "aint": "is not", "wasnt": "was not", "werent": "were not", "hasnt": "has not",
    "havent": "have not", "hadnt": "had not", "hes": "he is", "shes": "she is", "its": "it is",
    "theres": "there is", "thats": "that is", "whats": "what is", "wheres": "where is",
    "theyre": "they are", "youre": "you are", "theyve": "they have", "weve": "we have",
    "gonna": "going to", "wanna": "want to", "gotta": "got to", "anymore": "any more",
    "everybodys": "everybody is", "everyones": "everyone is", "somebodys": "somebody is",
    "someones": "someone is", "nobodys": "nobody is", "lets": "let us", "gimme": "give me",
    "tryna": "trying to", "em": "them", "til": "until", "cuz": "because", "pls": "please",
    "percent": "%",
}  # fmt: skip
_APOSTROPHE = re.compile(r"(?<=\w) ?['’‘`´ʼ] ?(?=\w)|['’‘`´ʼ]")
_CUT_OFF = re.compile(r"\b(\w+) (m|s|t|re|ve)\b")
_SIGNS = re.compile(r"[^\w]+|_+")
_DENIED = re.compile(
    r"(?<!can )(?<!could )\b(not|never|no|without|nobody|hardly|nor)"
    r"(?: (?!(?:i|and|but|he|she|they|my|we|because|so|there)\b)\S+){0,2} ?$"
)
_NAME = re.compile(r"\{([a-z_]+)\}")
_DIGITS = {"nine one one": "911", "nine nine nine": "999", "one one two": "112"}


class _Patterns(Table):
    """What one language's file holds."""

    words: dict[str, str]
    spellings: dict[str, str] = Field(default_factory=dict)
    kinds: dict[Distress, list[str]]
    excuses: dict[str, list[str]]


@dataclass(frozen=True)
class Heard:
    """A distress that was heard, and the words that told it; empty where the model did."""

    kind: Distress
    words: str = ""


@cache
def _read(language: Language) -> _Patterns:
    file = resources.files(__package__) / f"distress-{language}.toml"
    return _Patterns.model_validate(tomllib.loads(file.read_text(encoding="utf-8")))


def compile_phrases(
    phrases: list[str], language: Language, words: Mapping[str, str] | None = None
) -> re.Pattern[str]:
    """Return one pattern of many, with their {names} filled in; English ones fit whole words."""

    def fill(phrase: str) -> str:
        while words and _NAME.search(phrase):
            phrase = _NAME.sub(lambda found: words[found.group(1)], phrase)
        return phrase.replace(" .. ", r"(?: \S+){0,4} ")

    whole = "|".join(f"(?:{fill(phrase)})" for phrase in phrases)
    return re.compile(rf"(?<!\S)(?:{whole})(?!\S)" if language == "en" else whole)


@cache
def _compiled(
    language: Language,
) -> tuple[dict[Distress, re.Pattern[str]], dict[str, re.Pattern[str]]]:
    table = _read(language)
    kinds = {kind: compile_phrases(table.kinds[kind], language, table.words) for kind in KINDS}
    excuses = {
        name: compile_phrases(phrases, language, table.words)
        for name, phrases in table.excuses.items()
    }
    return kinds, excuses


def plain(text: str, language: Language) -> str:
    """Return the plain words of a text: no signs, no capitals, short forms written out.

    >>> plain("I CAN'T breathe!", "en")
    'i can not breathe'
    """
    text = unicodedata.normalize("NFKC", text).lower()
    if language == "ja":
        text = _SIGNS.sub("", text)
        for written, wanted in _read("ja").spellings.items():
            text = text.replace(written, wanted)
        return text
    text = _SIGNS.sub(" ", _APOSTROPHE.sub("", text)).strip()
    text = _CUT_OFF.sub(r"\1\2", text)
    text = " ".join(_SHORT.get(word, word) for word in text.split())
    for spoken, written in _DIGITS.items():
        text = text.replace(spoken, written)
    return text


def features(said: str, language: Language) -> list[int]:
    """Return the numbers of the groups of words and letters in plain words."""
    if language == "ja":
        text = f"^{said}$"
        groups = {text[i : i + n] for n in range(1, 6) for i in range(len(text) - n + 1)}
    else:
        words = ["^", *said.split(), "$"]
        groups = {f"1{word}" for word in words}
        groups |= {f"2{a} {b}" for a, b in pairwise(words)}
        groups |= {f"3{' '.join(words[i : i + 3])}" for i in range(len(words) - 2)}
        for gap in (2, 3):
            groups |= {f"4{a} {b}" for a, b in zip(words, words[gap:], strict=False)}
        for word in words[1:-1]:
            edged = f"^{word}$"
            groups |= {f"5{edged[i : i + n]}" for n in (3, 4, 5) for i in range(len(edged) - n + 1)}
    return sorted({crc32(group.encode()) for group in groups})


@cache
def _model(language: Language) -> Callable[[str], NDArray[np.float64]]:
    with (resources.files(__package__) / "distress.npz").open("rb") as file:
        stored = dict(np.load(file))
    keys, weights = stored[f"{language}_keys"], stored[f"{language}_weights"]
    scale, bias = stored[f"{language}_scale"], stored[f"{language}_bias"]

    def likely(said: str) -> NDArray[np.float64]:
        numbers = np.array(features(said, language), dtype=np.uint32)
        place = np.minimum(np.searchsorted(keys, numbers), len(keys) - 1)
        place = place[keys[place] == numbers]
        score = bias + weights[place].sum(axis=0) * scale / np.sqrt(max(len(numbers), 1))
        odds = np.exp(score - score.max())
        return np.asarray(odds / odds.sum(), dtype=np.float64)

    return likely


def hear_distress(text: str) -> Heard | None:
    """Return the distress that somebody speaks of, as their own or as that of somebody present.

    Stories, what is past, what is denied, questions in general and turns of phrase are none.
    """
    language = language_of(text)
    said = plain(text, language)
    if not said:
        return None
    kinds, excuses = _compiled(language)
    rest = excuses["idioms"].sub("#", said)
    likely = _model(language)(said)
    likeliest, distress = KINDS[int(likely[:-1].argmax())], 1 - likely[-1]
    if any(excuses[name].search(rest) for name in excuses if name != "idioms"):
        return Heard(likeliest) if distress > _SURE else None
    for kind, pattern in kinds.items():
        if (phrase := find_phrase(pattern, rest, language)) is not None:
            return Heard(kind, phrase) if distress >= _SILENCES else None
    denied = any(pattern.search(rest) for pattern in kinds.values())
    return Heard(likeliest) if distress > (_SURE if denied else _FINDS) else None


def find_phrase(pattern: re.Pattern[str], said: str, language: Language) -> str | None:
    """Return the first phrase in plain words that no English denial stands before, if any."""
    for match in pattern.finditer(said):
        if language == "ja" or not _DENIED.search(said[: match.start()].rstrip()):
            return match.group()
    return None
