"""Check the languages in a folder of the user's own before a partner uses them."""

import re
import tomllib
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import Any

from miburi.errors import DescriptionError
from miburi.languages import FALLBACK, Language, clues_of, folders, is_elsewhere
from miburi.languages.rhythm import rhythm_of
from miburi.senses.distress import features, judge_distress
from miburi.talk.care import agrees, denies, find_follow, goes_on, may_be_said, takes_back
from miburi.talk.script import script

#: What is missed in a language without a file.
_LACKING = {
    "distress.toml": "no cry for help is heard in this language",
    "care.toml": "somebody who needs help is answered in English",
}


def check_languages(own: Path) -> list[str]:
    """Read every language in a folder; return a warning for each file on which help depends.

    Raises DescriptionError if a file is missing, cannot be read, or is wrong; the message names it.
    """
    mine = [one for one in folders() if (own / one / "language.toml").is_file()]
    if FALLBACK in mine:
        for file in (resources.files("miburi.languages") / FALLBACK).iterdir():
            if not (own / FALLBACK / file.name).is_file():
                raise DescriptionError(
                    f"{own / FALLBACK}: {file.name} is missing; add it, because other languages "
                    "and pages fall back on these files."
                )
    for language in mine:
        folder = own / language
        try:
            _use(language)
        except re.error as error:
            raise DescriptionError(_wrong_pattern(folder, error)) from error
        except KeyError as error:
            name = f"{{{error.args[0]}}}"
            where = next((at for at, text in _texts(folder) if name in text), str(folder))
            raise DescriptionError(
                f"{where} has {name}, but this file has no part of that name; add it to [words], "
                "or to [parts] in language.toml."
            ) from error
    return [
        f"{own / language}: {name} is missing, so {lacks}."
        for language in mine
        for name, lacks in _LACKING.items()
        if not (own / language / name).is_file()
    ]


def _use(language: Language) -> None:
    """Use everything in a language's files, so that nothing fails when somebody needs help."""
    talk, said = script(language), "?"
    talk.asks(said)
    talk.tells(said)
    _ = [*talk.intents_of(said), *talk.topics_of(said), talk.reword(said), talk.asks_clearly(said)]
    for use in (clues_of, is_elsewhere, rhythm_of, features, agrees, denies, takes_back, goes_on):
        use(said, language)
    find_follow(said, "help", language)
    judge_distress(said, language)
    may_be_said(said)


def _texts(folder: Path) -> Iterator[tuple[str, str]]:
    """Yield every text in the files of a language, after its file and key."""
    for path in sorted(folder.glob("*.toml")):
        for key, text in _inside(tomllib.loads(path.read_text(encoding="utf-8-sig"))):
            yield f"{path}: {key}", text


def _inside(value: Any, key: str = "") -> Iterator[tuple[str, str]]:
    if isinstance(value, str):
        yield key, value
    elif isinstance(value, dict | list):
        for name, each in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _inside(each, f"{key}.{name}" if key else str(name))


def _wrong_pattern(folder: Path, error: re.error) -> str:
    """Return what is wrong with a pattern, with its file and its key, as it is written there."""
    for where, text in _texts(folder):
        try:
            re.compile(text)
        except re.error as own:
            if own.msg == error.msg:
                return f"{where} = {text!r}: this is no regular expression: {own}."
    return f"{folder}: {str(error.pattern)[:80]!r} is no regular expression: {error}."
