"""Distress: whether somebody says that they, or somebody with them, need help now.

In goes a sentence; out comes a kind of distress, or None. It is judged before the feelings, on the
plain words: signs and capitals, which no recogniser of speech writes, change nothing.

Patterns written by hand (a language's ``distress.toml``) find the plainest words. For English and
Japanese a small linear model (``distress.npz``, trained by ``tools/train_distress.py`` on sentences
written for it, ours and those of strangers) reads beside them: it hears what no pattern knows, and
doubts a pattern that it takes to be wrong.
Neither was seen by an expert. This is no alarm and no medical device.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from itertools import pairwise
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

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
from miburi.senses.kinds import KINDS, Distress

__all__ = ["Heard", "features", "hear_distress", "judge_distress"]


#: Likelihoods above which the model alone reports distress, above which it does so even if the
#: words excuse or deny it, below which it doubts a pattern, and below which it overrules it. Ours:
#: chosen on our own lines, on everyday utterances and on talks by strangers, none of which are
#: those of bench/distress.py.
_FINDS, _SURE, _SILENCES, _SILENCES_FOR_SURE = 0.75, 0.9, 0.3, 0.15
#: Kinds of which a pattern is never overruled, only doubted.
_NEVER_SILENCED = ("suicide", "child", "fraud")
#: Likelihoods above which it is asked about: it may be distress (ours, chosen on writers whom the
#: model that was asked had not read). The second is for words that excuse or deny it.
_WONDERS, _WONDERS_STILL = 0.45, 0.75


class _Patterns(Table):
    """What one language's file holds."""

    words: dict[str, str]
    kinds: dict[Distress, list[str]]
    excuses: dict[str, list[str]]


@dataclass(frozen=True)
class Heard:
    """A distress that was heard.

    Attributes
    ----------
    kind
        One of ``KINDS``.
    words
        The words that told it; empty where the model did.
    doubtful
        Whether it may as well be none.
    """

    kind: Distress
    words: str = ""
    doubtful: bool = False


@cache
def _compiled(
    language: Language,
) -> tuple[dict[Distress, re.Pattern[str]], dict[str, re.Pattern[str]]] | None:
    written = read(language, "distress")
    if written is None:
        return None
    table = _Patterns.model_validate(written)
    kinds = {kind: compile_phrases(table.kinds[kind], language, table.words) for kind in KINDS}
    excuses = {
        name: compile_phrases(phrases, language, table.words)
        for name, phrases in table.excuses.items()
    }
    return kinds, excuses


def features(said: str, language: Language) -> list[int]:
    """Return the numbers of the groups of words and letters in plain words."""
    if not is_spaced(language):
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
def _model(language: Language) -> Callable[[str], NDArray[np.float64]] | None:
    with (resources.files(__package__) / "distress.npz").open("rb") as file:
        stored = dict(np.load(file))
    if f"{language}_keys" not in stored:
        return None
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


def hear_distress(text: str, usual: Language = FALLBACK) -> Heard | None:
    """Return the distress that somebody speaks of, as their own or as that of somebody present.

    Stories, what is past, what is denied, questions in general and turns of phrase are none. A
    text that could be of any language is of the ``usual`` one.
    """
    heard = judge_distress(text, usual)
    return None if heard is None or heard.doubtful else heard


def judge_distress(text: str, usual: Language = FALLBACK) -> Heard | None:
    """Return the distress that somebody speaks of, or may speak of: then it is ``doubtful``.

    Somebody who says it sideways ("I've been saving my tablets up"), and somebody who speaks of
    something else in like words: only a question tells. Only languages with a model doubt.
    """
    language = language_of(text, usual)
    said, compiled = plain(text, language), _compiled(language)
    if not said or compiled is None:
        return None
    kinds, excuses = compiled
    rest = excuses["idioms"].sub("#", said)
    excused = any(excuses[name].search(rest) for name in excuses if name != "idioms")
    found = (
        Heard(kind, phrase)
        for kind, pattern in kinds.items()
        if (phrase := find_phrase(pattern, rest, language)) is not None
    )
    model = _model(language)
    if model is None:
        return None if excused else next(found, None)
    likely = model(said)
    likeliest, distress = KINDS[int(likely[:-1].argmax())], 1 - likely[-1]
    first = None if excused else next(found, None)
    if first is not None:
        asks = distress >= _SILENCES_FOR_SURE or first.kind in _NEVER_SILENCED
        doubted = replace(first, doubtful=True) if asks else None
        return first if distress >= _SILENCES else doubted
    excused = excused or any(pattern.search(rest) for pattern in kinds.values())
    if distress <= (_WONDERS_STILL if excused else _WONDERS):
        return None
    if distress > (_SURE if excused else _FINDS):
        return Heard(likeliest)
    clear = likely[KINDS.index(likeliest)] > _WONDERS
    return Heard(likeliest if clear else "help", doubtful=True)
