"""Check the languages in a folder of the user's own before a partner uses them."""

import re
from importlib import resources
from pathlib import Path

from miburi.errors import DescriptionError
from miburi.languages import FALLBACK, Language, clues_of, folders, is_elsewhere
from miburi.languages.rhythm import rhythm_of
from miburi.senses.distress import features, hears_distress_in
from miburi.senses.kinds import KINDS
from miburi.talk.care import Care, agrees, denies, takes_back, words_of_care
from miburi.talk.script import script


def check_languages(own: Path) -> list[str]:
    """Read every language in a folder; return a warning for each that hears no distress.

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
        try:
            _use(language)
        except re.error as error:
            raise DescriptionError(
                f"{own / language}: {str(error.pattern)[:80]!r} is no regular expression: {error}."
            ) from error
        except KeyError as error:
            raise DescriptionError(
                f"{own / language}: {error.args[0]!r} is missing in a file, or misspelt there."
            ) from error
        except (ValueError, IndexError) as error:
            raise DescriptionError(f"{own / language}: care.toml: {error}.") from error
    return [
        f"{own / language}: distress.toml is missing, so no cry for help is heard in this language."
        for language in mine
        if not hears_distress_in(language)
    ]


def _use(language: Language) -> None:
    """Use everything in a language's files, so that nothing fails when somebody needs help."""
    talk, said = script(language), "?"
    talk.asks(said)
    talk.tells(said)
    _ = [*talk.intents_of(said), *talk.topics_of(said)]
    for use in (clues_of, is_elsewhere, rhythm_of, features, agrees, denies, takes_back):
        use(said, language)
    care, words = Care(), words_of_care(language)
    for kind in KINDS:
        for turn in range(len(words.help[kind])):
            care.help(kind, language, turn)
    for kind, asked in words.ask.items():
        for turn in range(len(asked)):
            care.ask(kind, language, turn)
    for lines, say in (
        (words.after, care.stay), (words.misheard, care.give_way), (words.wonder, care.wonder)
    ):  # fmt: skip
        for turn in range(len(lines)):
            say(language, turn)
