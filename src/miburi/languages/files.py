"""The folders of languages, and the files in them."""

import os
import re
from collections.abc import Iterator
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

from miburi.errors import DescriptionError
from miburi.ground.tables import AnyTable, load_table

#: The name of one of the :func:`folders`.
Language = str
#: The environment variable with the folder of the user's own languages.
VARIABLE = "MIBURI_LANGUAGES"

_TAG = re.compile(r"[a-z]{2,3}(-[A-Za-z0-9]{2,8})*")
_COMMENT = re.compile(r"^\s*#.*$", re.MULTILINE)
#: A key with one text in double quotes is a name, such as ``do = "stop"``, or a format.
_NAMED = re.compile(r'^\w+ = "[^"\n]*"$', re.MULTILINE)
_QUOTED = re.compile(r"'([^'\n]*)'|\"([^\"]*)\"")
#: Parts of a pattern or a sentence that are no words: escapes, groups' names, placeholders.
_SIGNS = re.compile(r"\\.|\(\?P[<=]\w+|\{\w+\}")


@cache
def folders() -> dict[Language, Traversable]:
    """Return each language's folder, in the order of the names.

    Raises
    ------
    DescriptionError
        Your own folder is not there, or has no language in it, or one that is not named by its code
        or lacks ``language.toml``.
    """
    found = dict(_folders_in(resources.files(__package__)))
    if own := os.environ.get(VARIABLE):
        if not Path(own).is_dir():
            raise DescriptionError(f"{own}: there is no such folder.")
        for folder in Path(own).iterdir():
            _check(folder)
        mine = dict(_folders_in(Path(own)))
        if not mine:
            raise DescriptionError(
                f"{own}: no language is in this folder. Put a folder for each into it, such as "
                f"{Path(own) / 'it' / 'language.toml'}."
            )
        found |= mine
    return dict(sorted(found.items()))


def _folders_in(place: Traversable) -> Iterator[tuple[Language, Traversable]]:
    return ((one.name, one) for one in place.iterdir() if (one / "language.toml").is_file())


def _check(folder: Path) -> None:
    """Refuse a language's folder without ``language.toml``, or with a name that is no code."""
    if not folder.is_dir() or folder.name[0] in "._":
        return
    inside = [each.suffix for each in folder.iterdir()]
    if inside and ".toml" not in inside:
        return
    if not _TAG.fullmatch(folder.name):
        raise DescriptionError(
            f"{folder}: a language's folder is named by its code in small letters, such as 'de' "
            f"or 'pt-BR', got {folder.name!r}; rename it."
        )
    if not (folder / "language.toml").is_file():
        raise DescriptionError(f"{folder}: language.toml is missing; add it.")


def read(model: type[AnyTable], language: Language, name: str) -> AnyTable | None:
    """Return a file of a language, such as ``talk``; None if it has no such file.

    Raises DescriptionError if the file cannot be read, or is wrong; the message names the file and
    every wrong key.
    """
    with resources.as_file(folders()[language] / f"{name}.toml") as path:
        return load_table(model, path) if path.is_file() else None


def texts_of(language: Language) -> str:
    """Return what people and the partner say in a language: its files' patterns and sentences."""
    texts = []
    for name in ("language", "talk", "care", "distress"):
        if (file := folders()[language] / f"{name}.toml").is_file():
            written = file.read_bytes().decode("utf-8", errors="ignore")
            written = _NAMED.sub("", _COMMENT.sub("", written))
            texts += ["".join(either) for either in _QUOTED.findall(written)]
    return _SIGNS.sub(" ", "\n".join(texts))
