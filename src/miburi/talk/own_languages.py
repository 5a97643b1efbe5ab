"""Check the languages in a folder of your own before a partner hears and speaks them."""

import re
from pathlib import Path

from miburi.errors import DescriptionError
from miburi.languages import Language, clues_of, folders, is_elsewhere
from miburi.languages.rhythm import rhythm_of
from miburi.senses.distress import hears_distress_in
from miburi.talk.care import agrees, denies, takes_back
from miburi.talk.script import script

__all__ = ["check_languages"]


def check_languages(own: Path) -> list[str]:
    """Read every language in a folder; return a warning for each that hears no distress.

    Raises
    ------
    DescriptionError
        A file is missing, cannot be read, or is wrong; the message names it.
    """
    mine = [one for one in folders() if (own / one / "language.toml").is_file()]
    for language in mine:
        try:
            _use(language)
        except re.error as error:
            raise DescriptionError(
                f"{own / language}: {str(error.pattern)[:80]!r} is no regular expression: {error}."
            ) from error
    return [
        f"{own / language}: distress.toml is missing, so no cry for help is heard in this language."
        for language in mine
        if not hears_distress_in(language)
    ]


def _use(language: Language) -> None:
    """Use every pattern of a language once, so that a wrong one fails to compile here."""
    talk, said = script(language), "?"
    talk.asks(said)
    talk.tells(said)
    _ = [*talk.intents_of(said), *talk.topics_of(said)]
    for use in (clues_of, is_elsewhere, rhythm_of, agrees, denies, takes_back):
        use(said, language)
    hears_distress_in(language)
