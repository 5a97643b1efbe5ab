"""The languages that the partner hears and speaks: a folder of files for each.

    language.toml   rules that recognise its text and reduce it to plain words
    talk.toml       what people say to a partner, and its answers
    care.toml       words for somebody in distress, and words that are never said
    rhythm.toml     how fast it is spoken, and what is stressed (English rules if there is none)
    distress.toml   the model of distress (if there is none, no distress is heard)
    pages.toml      the words of the pages (if there is none, no page is in this language)

``abroad.toml`` has calls for help and orders to stop in languages without a folder.

A new language is a new folder, whose name is the language's code, such as ``fr``. It may lie
outside Miburi: name the folder around it in the environment variable ``MIBURI_LANGUAGES``, or call
``miburi run --languages FOLDER``, which sets the variable for all processes. Such a folder replaces
Miburi's folder of the same name.
"""

import re
import unicodedata
from collections.abc import Callable, Collection, Container, Iterable, Iterator, Mapping
from functools import cache
from typing import Literal

from miburi.languages.files import VARIABLE, Language, folders, read, texts_of
from miburi.languages.rules import APOSTROPHES, Clue, filled, rules_of

__all__ = [
    "FALLBACK",
    "VARIABLE",
    "Clue",
    "Language",
    "clues_in",
    "clues_of",
    "common_words",
    "compile_phrases",
    "find_phrase",
    "fits",
    "folders",
    "is_elsewhere",
    "is_spaced",
    "known_share",
    "language_of",
    "otherwise_named",
    "own_letters",
    "plain",
    "read",
    "same_words",
    "subjects_of",
    "whom_of",
    "with_whom",
    "words_of",
]

#: The language of a text that no other language claims.
FALLBACK: Language = "en"

_WORD = re.compile(rf"\w+[{APOSTROPHES}]?\w*")
_WORD_SIGNS = re.compile(r"[^\w]+|_+")
_POSSESSIVE = re.compile(rf"[{APOSTROPHES}]s\b")
_NAMED = re.compile(r"(?<=[^.!?] )(?!I\b)[A-Z]\w+")
#: If a text has at least this many of a language's commonest words, letters of another language in
#: it are a name or a quotation (our choice).
_SENTENCE = 2
#: A text is in a language other than the usual one if this share of its letters is in words of that
#: language; the second share is for two words or more. "Au!" has too few letters for any language
#: but the usual one (our choice).
_MOST, _MANY, _LEAST = 1 / 2, 1 / 3, 3


def language_of(text: str, usual: Language = FALLBACK) -> Language:
    """Return the language of a text: by its letters, else by its words.

    A text that no language claims, such as a name, counts as text in the language ``usual``. A name
    in other letters does not change a sentence's language.

    >>> [language_of(text) for text in ("Hello.", "こんにちは", "Je suis très triste.")]
    ['en', 'ja', 'fr']
    >>> language_of("I love you, 太郎"), language_of("Tanz mal!"), language_of("Tanz mal!", "fr")
    ('en', 'en', 'fr')
    """
    words = {language: plain(text, language).split() for language in folders()}
    hits = {each: len({*words[each]} & common_words(each)) for each in words}
    known = {each: known_share(words[each], words_of(each)) for each in words}
    best = max(words, key=lambda each: (known[each], hits[each], each == usual))
    enough = _MANY if len({*words[best]} & words_of(best)) > 1 else _MOST
    if known[best] < enough or sum(map(len, words[best])) < _LEAST:
        best = usual
    written = {each: own_letters(text, each) for each in words}
    script = max(written, key=lambda each: written[each])
    other = sum(map(str.isalpha, text)) - written[script]
    if written[script] and not (hits[best] >= _SENTENCE and other > written[script]):
        return script
    return best


def own_letters(text: str, language: Language) -> int:
    """Return how many letters of a text only this language has."""
    script = rules_of(language).script
    return len(re.findall(script, text)) if script else 0


def known_share(words: Collection[str], known: Container[str]) -> float:
    """Return the share of the letters of some words that are in known words.

    >>> known_share(["guten", "day"], {"day"})
    0.375
    """
    letters = sum(map(len, words))
    return sum(len(word) for word in words if word in known) / letters if letters else 0.0


@cache
def words_of(language: Language) -> frozenset[str]:
    """Return the words in a language's files, normalised; without spaces, the commonest only."""
    texts = texts_of(language) if is_spaced(language) else ""
    each = " ".join(set(_WORD.findall(texts)))  # each once, as they are hundreds of thousands
    return common_words(language).union(plain(each, language).split())


def is_spaced(language: Language) -> bool:
    """Return whether a language writes spaces between its words."""
    return rules_of(language).spaced


def common_words(language: Language) -> frozenset[str]:
    """Return a language's most common words, normalised; empty if its file lists none."""
    return rules_of(language).words


def same_words(language: Language) -> dict[str, str]:
    """Return a language's synonyms: each word, with the first word of its group."""
    return rules_of(language).first


def subjects_of(question: str, language: Language) -> list[str]:
    """Return the subjects of a question, in plain words.

    >>> subjects_of("What is my dog called?", "en")
    ['dog']
    """
    found = re.finditer(rules_of(language).subject, plain(question, language))
    names = _NAMED.findall(question) if is_spaced(language) else []
    return [match["it"] for match in found] + [plain(name, language) for name in names]


def otherwise_named(question: str, told: Iterable[str], language: Language) -> Iterator[str]:
    """Yield a question with a person's name in place of the relation, or the other way round.

    The sentences in ``told`` say what the person is called.

    >>> [*otherwise_named("When does my son come?", ["My son is Simon."], "en")]
    ['When does Simon come?']
    """
    found = (
        one
        for each in told
        for rule in rules_of(language).called
        for one in re.finditer(rule, each)
    )
    for one in found:
        for called, instead in ((one["who"], one["name"]), (one["name"], one["who"])):
            other = re.sub(rf"\b{re.escape(called)}\b", instead, question, flags=re.IGNORECASE)
            if other != question:
                yield other


def fits(rule: Literal["everything", "naming", "own"], said: str, language: Language) -> bool:
    """Return whether a remark asks for all known facts, gives a name, or is about the speaker.

    >>> fits("everything", "So what do you know about me?", "en")
    True
    """
    return bool(re.search(getattr(rules_of(language), rule), plain(said, language)))


def clues_in(question: str, language: Language) -> tuple[dict[int, Clue], str]:
    """Return a question's clues by index, and its other words, normalised.

    >>> clues_in("When is my appointment?", "en")[1]
    'when is my'
    """
    words, found = plain(question, language), {}
    for number, clue in enumerate(rules_of(language).clues):
        rest, times = re.subn(clue.asks, " ", words)
        if times:
            found[number] = clue
            words = rest if clue.enough else words
    return found, " ".join(words.split())


def clues_of(told: str, language: Language) -> set[int]:
    """Return the indices of the clues that a statement answers."""
    words, named = plain(told, language), _NAMED.search(told)
    clues = enumerate(rules_of(language).told_clues)
    return {n for n, (tells, names) in clues if (names and named) or tells.search(words)}


def with_whom(told: str, earlier: Iterable[str], language: Language) -> str:
    """Return a statement, preceded by the person whom its "she" means if that person is known.

    ``earlier`` has the sentences before it, the newest first. If one of them names two people whom
    "she" may mean, no guess is made.

    >>> with_whom("Her name was Maureen.", ["My dear wife was a nurse."], "en")
    'my wife: Her name was Maureen.'
    >>> with_whom("Her name was Maureen.", ["My sister and my wife were nurses."], "en")
    'Her name was Maureen.'
    """
    own = _whom(told, earlier, language, re.match)
    return told if own is None else f"{own}: {told}"


def whom_of(question: str, earlier: Iterable[str], language: Language) -> str | None:
    """Return the person that "she" means in a question; None if unknown.

    >>> whom_of("And where does she live?", ["What is my daughter called?"], "en")
    'my daughter'
    """
    return _whom(question, earlier, language, re.search)


def _whom(
    said: str,
    earlier: Iterable[str],
    language: Language,
    find: Callable[[str, str], re.Match[str] | None],
) -> str | None:
    words = plain(said, language)
    meant = next((one for one in rules_of(language).whom if find(rf"\b{one.says}", words)), None)
    if meant is None or re.search(meant.means, words):
        return None
    for sentence in earlier:
        told = plain(_POSSESSIVE.sub("", sentence), language)
        named = {match["it"]: match for match in re.finditer(meant.means, told)}
        if named:
            it = next(iter(named))
            name = re.search(rf"\b{it}( [A-Z]\w+)", sentence)
            whom = f"{named[it]['own']} {it}{name.group(1) if name else ''}"
            return whom if len(named) == 1 else None
    return None


def is_elsewhere(sentence: str, language: Language) -> bool:
    """Return whether a sentence is about another person's feeling, or a past one.

    >>> is_elsewhere("My son is angry.", "en"), is_elsewhere("My son makes me angry.", "en")
    (True, False)
    """
    return _elsewhere(language).fullmatch(plain(sentence, language)) is not None


@cache
def _elsewhere(language: Language) -> re.Pattern[str]:
    rules = rules_of(language)
    return compile_phrases(rules.elsewhere or ["(?!)"], language, rules.parts)


def plain(text: str, language: Language) -> str:
    """Return a text's plain words: no punctuation or capitals, short forms written out.

    >>> plain("I CAN'T breathe!", "en")
    'i can not breathe'
    >>> plain("I'll be ill.", "en")
    'i will be ill'
    """
    rules = rules_of(language)
    text = unicodedata.normalize("NFKC", text).lower()
    if not rules.spaced:
        text = _WORD_SIGNS.sub("", text)
        for written, wanted in rules.spellings.items():
            text = text.replace(written, wanted)
        return text
    text = rules.spelt(text)
    if rules.apostrophes == "join":
        # Without its apostrophe, "I'll" is "ill".
        text = re.sub(rf"(?<=\w)[{APOSTROPHES}]ll\b", " will", text)
        text = re.sub(rf"(?<=\w) ?[{APOSTROPHES}] ?(?=\w)|[{APOSTROPHES}]", "", text)
        text = re.sub(r"\b(\w+) (m|s|t|re|ve)\b", r"\1\2", _WORD_SIGNS.sub(" ", text).strip())
    else:
        text = _WORD_SIGNS.sub(" ", text).strip()
    text = " ".join(text.split())
    return rules.respelled.sub(lambda found: rules.spellings[found.group()], text)


def compile_phrases(
    phrases: list[str], language: Language, words: Mapping[str, str] | None = None
) -> re.Pattern[str]:
    """Join patterns into one that matches whole words, with their {names} filled in."""
    rules = rules_of(language)
    whole = "|".join(f"(?:{rules.as_pattern(filled(phrase, words))})" for phrase in phrases)
    return re.compile(rf"(?<!\S)(?:{whole})(?!\S)" if rules.spaced else whole)


def find_phrase(pattern: re.Pattern[str], said: str, language: Language) -> str | None:
    """Return the first phrase in normalised text that is not negated, if any."""
    denied = rules_of(language).denied
    for match in pattern.finditer(said):
        if not re.search(denied, said[: match.start()].rstrip()):
            return match.group()
    return None
