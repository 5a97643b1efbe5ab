"""Find the words that the partner is to remember: those around a request, or facts in a remark."""

import re

from miburi.languages import is_spaced
from miburi.talk.asking import tells_a_fact
from miburi.talk.script import Script

#: The punctuation around a sentence; a pattern for the text after the first sentence; and a pattern
#: for a clause with its punctuation.
SIGNS = " ,.;!?、。！？"
_REST = re.compile(r"(?<=[.!?。！？]).+$", re.DOTALL)
#: One-word sentences, such as "Right.", at the beginning of a fact.
_INTERJECTED = re.compile(r"^(?:[^\W\d_]+[.!] )+(?=\S+ )")
_CLAUSE = re.compile(r"[^,.;!?、。！？]+[,.;!?、。！？]*")


def told_before(said: str, words: Script) -> tuple[str, str, str]:
    """Return the words before the clause "remember this", this clause, and the words after it.

    The words after the clause are further sentences, or the rest of the sentence after an
    announcement ("Remember one thing for me, ..."), unless they ask something. If the words before
    or after the clause tell too little, they are left empty; if both are empty, so is the clause.
    """
    clauses = _CLAUSE.findall(said)
    places = [n for n, clause in enumerate(clauses) if _asks_to_remember(clause, words)]
    if not places:
        return "", "", ""
    before = "".join(clauses[: places[0]]).strip(SIGNS)
    later = _REST.search("".join(clauses[places[0] :]))
    after = later.group().strip(SIGNS) if later else ""
    announced = announces(clauses[places[0]], words)
    if not after and announced:
        after = "".join(clauses[places[0] + 1 :]).strip(SIGNS)
    polite = any(match.cue.aside for match in words.intents_of(after))
    heavy = words.fits("heavy", after) and not announced
    if polite or words.asks(after) or heavy or is_short(after, words):
        after = ""
    before = "" if is_short(before, words) else _INTERJECTED.sub("", before)
    return before, clauses[places[0]] if before or after else "", after


def facts_in(said: str, words: Script) -> list[str]:
    """Return the sentences that tell something about the person, and ask nothing.

    If no single sentence tells something, but all sentences together do, they are returned as one.
    """
    sentences = words.told_in(said)
    facts: list[str] = []
    last = False  # whether the sentence before this one is a fact
    for each in sentences:
        if last and words.fits("belongs", each):
            facts[-1] += f" {each}"
        elif last := words.tells(each):
            facts.append(each)
    whole = (" " if is_spaced(words.language) else "").join(sentences)
    if not facts and len(sentences) > 1 and tells_a_fact(whole, words.language):
        return [whole]
    return facts


def is_short(told: str, words: Script) -> bool:
    """Return whether there are too few words for a fact."""
    spaced = is_spaced(words.language)
    return len(told.split()) < 4 if spaced else len(told) < 6


def announces(said: str, words: Script) -> bool:
    """Return whether somebody announces something to remember."""
    remembers = words.intents_of(said, {"next"}, do="remember")
    return any(match.cue.within == "next" for match in remembers)


def _asks_to_remember(said: str, words: Script) -> bool:
    return any(words.intents_of(said, {"next"}, do="remember"))
