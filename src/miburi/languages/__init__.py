"""The languages that the partner hears and speaks: a folder of files for each.

    language.toml   rules that recognise its text and reduce it to plain words
    talk.toml       what people say to a partner, and its answers
    care.toml       words for somebody in distress, and words that are never said
    rhythm.toml     how fast it is spoken, and what is stressed (English rules if there is none)
    distress.toml   the model of distress (if there is none, no distress is heard)
    pages.toml      the words of the pages (if there is none, no page is in this language)

A new language is a new folder, whose name is the language's code, such as ``fr``. It may lie
outside Miburi: name the folder around it in the environment variable ``MIBURI_LANGUAGES``, or call
``miburi run --languages FOLDER``, which sets the variable for all processes. Such a folder replaces
Miburi's folder of the same name.
"""

import os
import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, cached_property
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from miburi.errors import DescriptionError
from miburi.ground.tables import AnyTable, Table, load_table

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
    "language_of",
    "otherwise_named",
    "plain",
    "read",
    "same_words",
    "subjects_of",
    "whom_of",
    "with_whom",
]

#: The name of one of the :func:`folders`.
Language = str
#: The environment variable with the folder of the user's own languages.
VARIABLE = "MIBURI_LANGUAGES"
#: The language of a text that no other language claims.
FALLBACK: Language = "en"

_APOSTROPHES = "'’‘`´ʼ"
_WORD_SIGNS = re.compile(r"[^\w]+|_+")
_NAME = re.compile(r"\{([a-z_]+)\}")
_POSSESSIVE = re.compile(rf"[{_APOSTROPHES}]s\b")
_NAMED = re.compile(r"(?<=[^.!?] )(?!I\b)[A-Z]\w+")


class _Whom(Table):
    """Patterns for pronouns such as "she", and for whom they mean (groups ``own``, ``it``)."""

    says: str
    means: str


class Clue(Table):
    """A kind of question, and the statements that answer it, by regular expressions.

    With ``names``, a name in a statement is an answer, too. A clue that is not ``enough`` counts
    only if question and statement also share a word. A statement without a ``needed`` clue, such as
    a time for "when", is no answer.
    """

    asks: str
    tells: str = "(?!)"
    names: bool = False
    enough: bool = True
    needed: bool = False


class _Rules(Table):
    """One language's ``language.toml``."""

    script: str | None = None
    common: str = ""
    spaced: bool = True
    apostrophes: Annotated[str, Field(pattern="^(join|split)$")] = "join"
    accents: bool = True
    spellings: dict[str, str] = Field(default_factory=dict)
    denied: str = "(?!)"
    same: list[str] = Field(default_factory=list)
    subject: str = "(?!)"
    everything: str = "(?!)"
    own: str = ""
    naming: str = "(?!)"
    clues: list[Clue] = Field(default_factory=list)
    elsewhere: list[str] = Field(default_factory=list)
    whom: list[_Whom] = Field(default_factory=list)
    called: list[str] = Field(default_factory=list)
    parts: dict[str, str] = Field(default_factory=dict)

    @cached_property
    def words(self) -> frozenset[str]:
        return frozenset(self.common.split())

    @cached_property
    def first(self) -> dict[str, str]:
        groups = [group.split() for group in self.same]
        return {word: words[0] for words in groups for word in words}

    @cached_property
    def respelled(self) -> re.Pattern[str]:
        either = "|".join(re.escape(each) for each in self.spellings)
        return re.compile(rf"(?<!\S)(?:{either})(?!\S)" if either else r"(?!)")

    @cached_property
    def told_clues(self) -> list[tuple[re.Pattern[str], bool]]:
        """For each clue, the pattern of statements that answer, and whether a name does."""
        return [(re.compile(_filled(each.tells, self.parts)), each.names) for each in self.clues]


@cache
def folders() -> dict[Language, Traversable]:
    """Return each language's folder, in the order of the names.

    Raises
    ------
    DescriptionError
        Your own folder is not there, or has no language in it.
    """
    found = _folders_in(resources.files(__package__))
    if own := os.environ.get(VARIABLE):
        if not Path(own).is_dir():
            raise DescriptionError(f"{own}: there is no such folder.")
        mine = _folders_in(Path(own))
        if not mine:
            raise DescriptionError(
                f"{own}: no language is in this folder. Put a folder for each into it, such as "
                f"{Path(own) / 'it' / 'language.toml'}."
            )
        found |= mine
    return dict(sorted(found.items()))


def _folders_in(place: Traversable) -> dict[Language, Traversable]:
    return {one.name: one for one in place.iterdir() if (one / "language.toml").is_file()}


def read(model: type[AnyTable], language: Language, name: str) -> AnyTable | None:
    """Return a file of a language, such as ``talk``; None if it has no such file.

    Raises DescriptionError if the file cannot be read, or is wrong; the message names the file and
    every wrong key.
    """
    with resources.as_file(folders()[language] / f"{name}.toml") as path:
        return load_table(model, path) if path.is_file() else None


@cache
def _rules(language: Language) -> _Rules:
    return read(_Rules, language, "language") or _Rules()


#: If a text has at least this many of a language's commonest words, letters of another language in
#: it are a name or a quotation (our choice).
_SENTENCE = 2


def language_of(text: str, usual: Language = FALLBACK) -> Language:
    """Return the language of a text: by its letters, else by its commonest words.

    A text that no language claims, such as a name, is in the ``usual`` one. A name in other letters
    does not change a sentence's language.

    >>> [language_of(text) for text in ("Hello.", "こんにちは", "Je suis très triste.")]
    ['en', 'ja', 'fr']
    >>> language_of("I love you, 太郎")
    'en'
    """
    hits, written = {}, {}
    for language in folders():
        rules = _rules(language)
        written[language] = len(re.findall(rules.script, text)) if rules.script else 0
        hits[language] = sum(word in rules.words for word in plain(text, language).split())
    best = max(hits, key=lambda language: (hits[language], language == usual))
    script = max(written, key=lambda language: written[language])
    other = sum(map(str.isalpha, text)) - written[script]
    if written[script] and not (hits[best] >= _SENTENCE and other > written[script]):
        return script
    return best


def is_spaced(language: Language) -> bool:
    """Return whether a language writes spaces between its words."""
    return _rules(language).spaced


def common_words(language: Language) -> frozenset[str]:
    """Return a language's most common words, normalised; empty if its file lists none."""
    return _rules(language).words


def same_words(language: Language) -> dict[str, str]:
    """Return a language's synonyms: each word, with the first word of its group."""
    return _rules(language).first


def subjects_of(question: str, language: Language) -> list[str]:
    """Return the subjects of a question, in plain words.

    >>> subjects_of("What is my dog called?", "en")
    ['dog']
    """
    found = re.finditer(_rules(language).subject, plain(question, language))
    names = _NAMED.findall(question) if is_spaced(language) else []
    return [match["it"] for match in found] + [plain(name, language) for name in names]


def otherwise_named(question: str, told: Iterable[str], language: Language) -> Iterator[str]:
    """Yield a question with somebody's name for the relation, or the reverse, as it was told.

    >>> [*otherwise_named("When does my son come?", ["My son is Simon."], "en")]
    ['When does Simon come?']
    """
    found = (
        one for each in told for rule in _rules(language).called for one in re.finditer(rule, each)
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
    return bool(re.search(getattr(_rules(language), rule), plain(said, language)))


def clues_in(question: str, language: Language) -> tuple[dict[int, Clue], str]:
    """Return a question's clues by index, and its other words, normalised.

    >>> clues_in("When is my appointment?", "en")[1]
    'when is my'
    """
    words, found = plain(question, language), {}
    for number, clue in enumerate(_rules(language).clues):
        rest, times = re.subn(clue.asks, " ", words)
        if times:
            found[number] = clue
            words = rest if clue.enough else words
    return found, " ".join(words.split())


def clues_of(told: str, language: Language) -> set[int]:
    """Return the indices of the clues that a statement answers."""
    words, named = plain(told, language), _NAMED.search(told)
    clues = enumerate(_rules(language).told_clues)
    return {n for n, (tells, names) in clues if (names and named) or tells.search(words)}


def with_whom(told: str, earlier: Iterable[str], language: Language) -> str:
    """Return a statement, preceded by the person that its "she" means, if known.

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
    meant = next((one for one in _rules(language).whom if find(rf"\b{one.says}", words)), None)
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
    rules = _rules(language)
    return compile_phrases(rules.elsewhere or ["(?!)"], language, rules.parts)


def plain(text: str, language: Language) -> str:
    """Return a text's plain words: no punctuation or capitals, short forms written out.

    >>> plain("I CAN'T breathe!", "en")
    'i can not breathe'
    >>> plain("I'll be ill.", "en")
    'i will be ill'
    """
    rules = _rules(language)
    text = unicodedata.normalize("NFKC", text).lower()
    if not rules.spaced:
        text = _WORD_SIGNS.sub("", text)
        for written, wanted in rules.spellings.items():
            text = text.replace(written, wanted)
        return text
    if not rules.accents:
        apart = unicodedata.normalize("NFD", text)
        text = "".join(one for one in apart if unicodedata.category(one) != "Mn")
    if rules.apostrophes == "join":
        # Without its apostrophe, "I'll" is "ill".
        text = re.sub(rf"(?<=\w)[{_APOSTROPHES}]ll\b", " will", text)
        text = re.sub(rf"(?<=\w) ?[{_APOSTROPHES}] ?(?=\w)|[{_APOSTROPHES}]", "", text)
        text = re.sub(r"\b(\w+) (m|s|t|re|ve)\b", r"\1\2", _WORD_SIGNS.sub(" ", text).strip())
    else:
        text = _WORD_SIGNS.sub(" ", text).strip()
    text = " ".join(text.split())
    return rules.respelled.sub(lambda found: rules.spellings[found.group()], text)


def compile_phrases(
    phrases: list[str], language: Language, words: Mapping[str, str] | None = None
) -> re.Pattern[str]:
    """Join patterns into one that matches whole words, with their {names} filled in."""
    whole = "|".join(f"(?:{_filled(phrase, words)})" for phrase in phrases)
    return re.compile(rf"(?<!\S)(?:{whole})(?!\S)" if _rules(language).spaced else whole)


def _filled(phrase: str, words: Mapping[str, str] | None) -> str:
    while words and _NAME.search(phrase):
        phrase = _NAME.sub(lambda found: words[found.group(1)], phrase)
    return phrase.replace(" .. ", r"(?: \S+){0,4} ")


def find_phrase(pattern: re.Pattern[str], said: str, language: Language) -> str | None:
    """Return the first phrase in normalised text that is not negated, if any."""
    denied = _rules(language).denied
    for match in pattern.finditer(said):
        if not re.search(denied, said[: match.start()].rstrip()):
            return match.group()
    return None
