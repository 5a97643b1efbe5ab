"""The words of the pages, and of the feelings, by language."""

import tomllib
from datetime import datetime
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from string import Formatter
from typing import Any

from miburi.errors import DescriptionError, InputError
from miburi.feelings.catalogue import CATALOGUE
from miburi.languages import folders

Words = dict[str, dict[str, str]]

FALLBACK = "en"


@cache
def page_languages() -> tuple[str, ...]:
    """Return the languages of the pages."""
    return tuple(name for name, each in folders().items() if (each / "pages.toml").is_file())


def _read(language: str) -> dict[str, Any]:
    if language not in page_languages():
        allowed = ", ".join(page_languages())
        raise InputError(f"the language must be one of {allowed}, got {language!r}.")
    return _load(folders()[language])


def _load(folder: Traversable) -> dict[str, Any]:
    file = folder / "pages.toml"
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except ValueError as error:  # TOML or UTF-8
        raise DescriptionError(f"{file}: this is not TOML: {error}.") from error


@cache
def words(language: str) -> Words:
    """Return a language's words, by section and key; missing ones are in English.

    Raises InputError if there are no pages in that language; DescriptionError if the file is not
    TOML, or has a value that is not a text, or a {placeholder} that is not in the English text.
    """
    own, sections = _read(language), _load(resources.files("miburi.languages") / FALLBACK)
    sections = {key: value for key, value in sections.items() if isinstance(value, dict)}
    for section, texts in sections.items():
        for key, english in texts.items():
            try:
                told = own.get(section, {}).get(key, english)
                unknown = _placeholders(told) - _placeholders(english)
            except (AttributeError, TypeError, ValueError):
                unknown = {"an unreadable text"}
            if unknown:
                raise DescriptionError(
                    f"{folders()[language] / 'pages.toml'}: {section}.{key} has "
                    f"{', '.join(sorted(unknown))}; the English text is {english!r}."
                )
            texts[key] = told
    feelings = {each.name: each.words.get(language, each.name) for each in CATALOGUE.feeling}
    return {**sections, "feeling": feelings}


def pressed_by(by: str, before: str | None, words: Words) -> str:
    """Say who pressed Stop.

    If Stop was pressed before this start, ``before`` is the time, and the text has the local time.
    """
    name, say = words["by"][by], words["log"]
    if before is None:
        return say["pressed"].format(by=name)
    when = f"{datetime.fromisoformat(before).astimezone():%Y-%m-%d %H:%M}"
    return say["pressed_before"].format(by=name, when=when)


def _placeholders(text: str) -> set[str]:
    return {f"{{{name}}}" for _, name, _, _ in Formatter().parse(text) if name is not None}


@cache
def own_name(language: str) -> str:
    """Return a language's name in that language."""
    return str(_read(language).get("language", language))


def preferred(*wishes: str | None) -> str:
    """Return the first language in these wishes for which there are pages.

    A wish is a language's name, or an ``Accept-Language`` header.
    """
    for wish in wishes:
        for part in (wish or "")[:200].split(","):
            language = part.split(";")[0].strip().lower().split("-")[0]
            if language in page_languages():
                return language
    return FALLBACK
