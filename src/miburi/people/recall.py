"""Recall: find the fact that answers a question.

The answer is the fact that shares most of the question's rare words, if any. It must mention the
subject of the question, such as "my dog". Words are compared by their beginnings, and synonyms,
such as "tablets" and "pills", count as one. Text in a language without spaces is compared by pairs
of characters. For some questions a clue counts as a shared word: "I was a cook for ten years"
answers "What was my job?"
"""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, pairwise
from math import log

from miburi.languages import (
    Language,
    clues_in,
    clues_of,
    common_words,
    is_spaced,
    plain,
    same_words,
    subjects_of,
    whom_of,
)

#: The share of a question's weight that an answer must match by default (our choice).
ENOUGH = 0.45
#: How many letters of a word are compared, and the relative weight of a word that no fact contains
#: (our choice).
_STEM, _UNTOLD = 6, 0.3
#: The sentences of a remark that are written as questions.
_ASKED = re.compile(r"[^.!?。！？]+[?？]")
#: For a language without spaces: a run of characters other than hiragana, which mostly spell
#: endings; and a single ideogram, which is a word or a part of a word.
_WRITTEN, _IDEOGRAM = re.compile(r"[^\s\u3040-\u309f]+"), re.compile(r"[\u4e00-\u9fff]")
#: The ending of a word, which may differ between question and fact.
_ENDING = re.compile(r"(?<=\w{4})(ing|ed|es|e|s)$|(?<=\w{2})s$")
#: The last clause of a question. The clause is itself taken for a question if it has more words
#: than this number (our choice).
_LAST = re.compile(r"(?<=[,、])[^,、.!?。！？]+[?？]?\s*$")
_SOME = 4


def recall(
    question: str,
    told: Sequence[str],
    language: Language,
    enough: float = ENOUGH,
    *,
    corrects: bool = False,
) -> str | None:
    """Return the fact that answers a question, the most recent on a tie; None if no fact does.

    It must match at least the share ``enough`` of the question's weight. If the words are a
    correction ("Not on the third, on the fourth"), the fact need not mention every subject in them.

    >>> told = ["My daughter Anna comes on Sunday.", "I take my tablets at eight."]
    >>> recall("When does Anna come?", told, "en")
    'My daughter Anna comes on Sunday.'
    """
    wanted, rest = clues_in(question, language)
    asked = _stems(rest, language) | {f"#{number}" for number in wanted}
    known = [
        _stems(each, language)
        | {f"#{number}" for number in clues_of(each, language) & wanted.keys()}
        for each in told
    ]
    needed = {f"#{n}" for n, clue in wanted.items() if clue.needed and not corrects}
    weak = {f"#{n}" for n, clue in wanted.items() if not clue.enough}
    often = Counter(stem for stems in known for stem in stems)
    weight = {
        stem: log(1 + len(known) / (1 + often[stem])) * (1.0 if often[stem] else _UNTOLD)
        for stem in asked
    }
    whole = sum(weight.values())
    subjects = [
        _stems(each, language)
        for each in subjects_of(question, language)
        if not wanted or set(each.split()) <= set(rest.split())
    ]
    words = set(plain(question, language).split())
    best: tuple[float, int] = (enough * whole, len(words))
    found = None
    for each, stems in zip(told, known, strict=True):
        shared = sum(weight[stem] for stem in asked & stems)
        same = len(words & set(plain(each, language).split()))  # "born" rather than "birthday"
        known_of = [bool(subject & stems) for subject in subjects if subject]
        several = any(known_of) and len(asked & stems) > 1
        about = corrects or all(known_of) or (len(known_of) > 1 and several)
        about = about and (weak >= asked or not asked & stems <= weak)
        if about and needed <= stems and shared > 0 and (shared, same) >= best:
            best, found = (shared, same), each
    return found


def ways_to_ask(question: str, earlier: Iterable[str], language: Language) -> Iterator[str]:
    """Yield a question in several forms, from the whole question to its last clause.

    The second form names the person whom the question means. The next are single sentences with a
    question mark. ``earlier`` has the sentences before the question, the newest first.
    """
    yield question
    if whom := whom_of(question, earlier, language):
        yield f"{question} {whom}"
    yield from _ASKED.findall(question)
    clause = _LAST.search(question)
    if clause and (subjects_of(clause.group(), language) or len(clause.group().split()) > _SOME):
        yield clause.group()


def _stems(text: str, language: Language) -> set[str]:
    words, same = plain(text, language), same_words(language)
    common = common_words(language)
    if not is_spaced(language):
        runs = _WRITTEN.findall(words)
        pairs = ("".join(pair) for run in runs for pair in pairwise(run))
        either = chain(pairs, _IDEOGRAM.findall(words))
        return {same.get(each, each) for each in either if each not in common}
    rare = (word for word in words.split() if word not in common)
    short = ((word, _ENDING.sub("", word)) for word in rare)
    return {(same.get(word) or same.get(stem, stem))[:_STEM] for word, stem in short}
