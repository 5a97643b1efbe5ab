"""``miburi template``: print a file that ships with Miburi, for a user to start from."""

from importlib import resources
from importlib.resources.abc import Traversable
from typing import Annotated

import typer

from miburi.errors import InputError

__all__ = ["template"]

#: Where the files of each kind are: a package and a folder in it.
_FOLDERS = {
    "feelings": ("miburi.feelings", "."),
    "gesture": ("miburi.gestures", "."),
    "robot": ("miburi.robot", "."),
    "servo": ("miburi.servos", "."),
    "temperament": ("miburi.feelings", "temperaments"),
}


def template(
    kind: Annotated[str, typer.Argument(help=", ".join(_FOLDERS) + ".")],
    name: Annotated[str | None, typer.Argument(help="Default: list the names.")] = None,
) -> None:
    """Print a file that ships with Miburi, to start your own from."""
    if kind not in _FOLDERS:
        raise InputError(f"the kind must be one of {', '.join(_FOLDERS)}, got {kind!r}.")
    files = _files(kind)
    if name is None:
        print("\n".join(files))
    elif name not in files:
        raise InputError(f"the {kind} must be one of {', '.join(files)}, got {name!r}.")
    else:
        print(files[name].read_text(encoding="utf-8"), end="")


def _files(kind: str) -> dict[str, Traversable]:
    package, folder = _FOLDERS[kind]
    found = (resources.files(package) / folder).iterdir()
    return {
        file.name.removesuffix(".toml"): file
        for file in sorted(found, key=lambda file: file.name)
        if file.name.endswith(".toml")
    }
