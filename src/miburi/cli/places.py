"""Look at a place to write to before the work begins; these are callbacks of options."""

import tempfile
from pathlib import Path

import typer

from miburi.errors import InputError, OutputError

__all__ = ["a_file", "a_folder"]


def a_file(param: typer.CallbackParam, place: Path | None) -> Path | None:
    """Return a file's place if it can be written there.

    Raises
    ------
    InputError
        It is a folder.
    OutputError
        Nothing can be written there.
    """
    if place is not None and place.is_dir():
        raise InputError(f"{_name(param)}: {place} is a folder, and a file is needed.")
    return None if place is None else _tried(param, place, place.parent)


def a_folder(param: typer.CallbackParam, place: Path | None) -> Path | None:
    """Return a folder's place if it can be written there, or made there.

    Raises
    ------
    InputError
        It is a file.
    OutputError
        Nothing can be written there.
    """
    if place is not None and place.exists() and not place.is_dir():
        raise InputError(f"{_name(param)}: {place} is a file, and a folder is needed.")
    return None if place is None else _tried(param, place, place)


def _tried(param: typer.CallbackParam, place: Path, folder: Path) -> Path:
    nearest = folder.absolute()
    while not nearest.exists():
        nearest = nearest.parent
    try:
        with tempfile.TemporaryFile(dir=nearest):
            return place
    except OSError as error:
        raise OutputError(
            f"{_name(param)}: {place} cannot be written: {error.strerror}. Choose another place."
        ) from error


def _name(param: typer.CallbackParam) -> str:
    return next(iter(param.opts), str(param.name))
