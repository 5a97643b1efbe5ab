"""Choose which of the intents in a remark the partner answers."""

from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from operator import itemgetter

from miburi.languages import compile_phrases, plain
from miburi.senses.impression import Impression
from miburi.talk.cue import Cue, Match, slots_in
from miburi.talk.remembering import SIGNS, is_short
from miburi.talk.script import OPEN, Script


def settled(
    match: Match | None,
    said: str,
    heard: Impression,
    words: Script,
    slots: dict[str, str],
    *,
    shown: bool,
    heavy: bool,
    told: bool,
) -> Match | None:
    """Return the intent to answer: the patterns' match, or the model's guess.

    The model's guess is taken if the patterns find nothing, or if the model is surer. ``shown``
    tells whether a feeling was heard, and ``told`` whether a topic was. The function may add a slot
    with the words to remember.
    """
    how_are_you, found = heard.topic == "asked", match
    # The model may be sure that what looks like "How are you" asks something else ("May I be
    # angry?").
    asked = words.asked_of(said, match, felt=shown or how_are_you, told=told)
    asked = (each for each in asked if not (how_are_you and each.cue.name == OPEN))
    match = next(sayable(asked, slots), match)
    if (match is None or match.cue.aside or match.cue.broad) and not heavy:
        whole = {} if is_short(said, words) else {"next": said.strip(SIGNS)}
        match = next(sayable(words.orders_of(said), whole | slots), match)
        if match is not None:
            slots.update(whole | slots)
    if match is not None and match.cue.light and heavy:
        grave = words.asked_of(said, None, felt=shown, told=told)
        others = sayable(chain(words.intents_of(said, slots), grave), slots)
        match = next((one for one in others if not one.cue.light), None)
    # "How are you" does not ask how something is done, so a broad match is dropped.
    weak = match is not None and (match.cue.broad or match.cue.aside)
    return None if how_are_you and weak and match is found else match


def named_in(said: str, words: Script) -> Cue | None:
    """Return the act that a remark names last, if any."""
    text = plain(said, words.language)
    ends = [
        (found.end(), cue)
        for cue in words.intent
        if cue.named
        for found in compile_phrases([cue.named], words.language).finditer(text)
    ]
    return max(ends, key=itemgetter(0), default=(0, None))[1]


def sayable(matches: Iterable[Match], slots: dict[str, str]) -> Iterator[Match]:
    """Yield the matches with an answer whose slots are all known."""
    for match in matches:
        known = slots | about(match)
        if match.cue.fits(slots) and any(slots_in(line) <= known.keys() for line in match.cue.say):
            yield match


def is_surer(cue: Cue, slots: Mapping[str, str]) -> bool:
    """Return whether a cue takes precedence over a broad one that matched first."""
    return not (cue.broad or cue.aside) and (cue.do != "recall" or "surely" in slots)


def gives_way(match: Match | None, fun: list[str]) -> bool:
    """Return whether the words may be a request to repeat something, despite this match."""
    if match is None or match.cue.broad or match.cue.within in fun:
        return True
    return match.cue.acts and match.cue.do != "recall"


def about(match: Match) -> dict[str, str]:
    """Return the slots for an intent's subject."""
    return {} if not match.it or not match.words else {"it": match.it, "words": match.words}
