"""The words of the pages, and of the feelings, by language."""

import re
import tomllib
from collections.abc import Iterable
from datetime import datetime
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from operator import itemgetter
from typing import Any

from miburi.errors import DescriptionError, InputError
from miburi.feelings.catalogue import CATALOGUE
from miburi.ground.placeholders import check_placeholders, placeholders
from miburi.languages import folders

Words = dict[str, dict[str, str]]

FALLBACK = "en"
_QUALITY = re.compile(r";\s*q\s*=\s*([01](?:\.\d*)?)\s*$")


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
    TOML, or has a key or a {placeholder} that the English one lacks, or a value that is no text.
    """
    own, sections = _read(language), _load(resources.files("miburi.languages") / FALLBACK)
    file, own = folders()[language] / "pages.toml", dict(own)
    own.pop("language", None)
    sections = {key: value for key, value in sections.items() if isinstance(value, dict)}
    if unknown := own.keys() - sections.keys():
        raise DescriptionError(f"{file}: {_not_known(unknown, sections)}")
    for section, texts in sections.items():
        told = own.get(section, {})
        if not isinstance(told, dict):
            raise DescriptionError(f"{file}: {section} = {told!r}: this must be a table.")
        if unknown := told.keys() - texts.keys():
            raise DescriptionError(f"{file}: {_not_known(unknown, texts, f'{section}.')}")
        for key, text in told.items():
            try:
                texts[key] = _checked(text, texts[key])
            except ValueError as error:
                raise DescriptionError(
                    f"{file}: {section}.{key}: {error}. The English text is {texts[key]!r}."
                ) from error
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


def _checked(text: object, english: str) -> str:
    if not isinstance(text, str):
        raise ValueError(f"{text!r} is no text; put it in quotes")
    return check_placeholders(text, {each.strip("{}"): 0 for each in placeholders(english)})


def _not_known(keys: Iterable[str], known: Iterable[str], table: str = "") -> str:
    names = ", ".join(f"{table}{each}" for each in sorted(keys))
    return f"{names}: not a known key here; the known ones are {', '.join(known)}."


def untranslated(language: str) -> int:
    """Return how many texts of the pages are still the English ones."""
    own = _read(language)
    english = _load(resources.files("miburi.languages") / FALLBACK)
    return sum(
        key not in own.get(section, {})
        for section, texts in english.items()
        if isinstance(texts, dict)
        for key in texts
    )


@cache
def own_name(language: str) -> str:
    """Return a language's name in that language."""
    return str(_read(language).get("language", language))


def preferred(*wishes: str | None) -> str:
    """Return the first language in these wishes for which there are pages.

    A wish is a language's name, or an ``Accept-Language`` header with its weights.
    """
    for wish in wishes:
        parts = [(part, _QUALITY.search(part)) for part in (wish or "")[:200].split(",")]
        weighed = [(part, float(found[1]) if found else 1.0) for part, found in parts]
        for part, quality in sorted(weighed, key=itemgetter(1), reverse=True):
            tag = part.split(";")[0].strip().lower()
            fitting = [
                name for name in page_languages() if name.lower() in (tag, tag.split("-")[0])
            ]
            if fitting and quality:
                return max(fitting, key=len)
    return FALLBACK
