"""The words of the pages: one file for each language, and the feelings' own words."""

import tomllib
from functools import cache
from importlib import resources

from miburi.errors import InputError
from miburi.feelings.catalogue import CATALOGUE

Words = dict[str, dict[str, str]]

#: The languages, by the names of their files.
LANGUAGES = tuple(
    sorted(
        file.name.removesuffix(".toml")
        for file in resources.files(__package__).iterdir()
        if file.name.endswith(".toml")
    )
)
FALLBACK = "en"


@cache
def words(language: str) -> Words:
    """Return a language's words, by section and key.

    Raises
    ------
    InputError
        There is no such language.
    """
    if language not in LANGUAGES:
        raise InputError(f"the language must be one of {', '.join(LANGUAGES)}, got {language!r}.")
    text = (resources.files(__package__) / f"{language}.toml").read_text(encoding="utf-8")
    sections = {key: value for key, value in tomllib.loads(text).items() if isinstance(value, dict)}
    feelings = {each.name: each.words.get(language, each.name) for each in CATALOGUE.feeling}
    return {**sections, "feeling": feelings}


@cache
def own_name(language: str) -> str:
    """Return a language's name in that language."""
    text = (resources.files(__package__) / f"{language}.toml").read_text(encoding="utf-8")
    return str(tomllib.loads(text)["language"])


def preferred(*wishes: str | None) -> str:
    """Return the available language that a visitor prefers most.

    A preference is a language's name, or an ``Accept-Language`` header.
    """
    for wish in wishes:
        for part in (wish or "")[:200].split(","):
            language = part.split(";")[0].strip().lower().split("-")[0]
            if language in LANGUAGES:
                return language
    return FALLBACK
