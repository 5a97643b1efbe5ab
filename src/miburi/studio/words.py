"""The words of the pages, from the languages' folders, and the feelings' own words."""

import tomllib
from functools import cache
from typing import Any

from miburi.errors import InputError
from miburi.feelings.catalogue import CATALOGUE
from miburi.languages import folders

__all__ = ["FALLBACK", "Words", "own_name", "page_languages", "preferred", "words"]

Words = dict[str, dict[str, str]]

FALLBACK = "en"


@cache
def page_languages() -> tuple[str, ...]:
    """Return the languages in which there are pages."""
    return tuple(name for name, each in folders().items() if (each / "pages.toml").is_file())


@cache
def _read(language: str) -> dict[str, Any]:
    if language not in page_languages():
        allowed = ", ".join(page_languages())
        raise InputError(f"the language must be one of {allowed}, got {language!r}.")
    return tomllib.loads((folders()[language] / "pages.toml").read_text(encoding="utf-8"))


@cache
def words(language: str) -> Words:
    """Return a language's words, by section and key.

    Raises
    ------
    InputError
        There are no pages in that language.
    """
    sections = {key: value for key, value in _read(language).items() if isinstance(value, dict)}
    feelings = {each.name: each.words.get(language, each.name) for each in CATALOGUE.feeling}
    return {**sections, "feeling": feelings}


def own_name(language: str) -> str:
    """Return a language's name in that language."""
    return str(_read(language)["language"])


def preferred(*wishes: str | None) -> str:
    """Return the available language that a visitor prefers most.

    A preference is a language's name, or an ``Accept-Language`` header.
    """
    for wish in wishes:
        for part in (wish or "")[:200].split(","):
            language = part.split(";")[0].strip().lower().split("-")[0]
            if language in page_languages():
                return language
    return FALLBACK
