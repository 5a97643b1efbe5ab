"""Callbacks of options: check that an output path can be written before work begins."""

import os
import tempfile
from pathlib import Path

import typer

from miburi.errors import InputError, OutputError


def a_file(param: typer.CallbackParam, place: Path | None) -> Path | None:
    """Return the path if a file can be written there; otherwise raise InputError or OutputError."""
    if place is None:
        return None
    if os.path.isdir(place):  # noqa: PTH112  (pathlib raises without permission to look)
        raise InputError(f"{_name(param)}: {place} is a folder, and a file is needed.")
    if os.path.exists(place) and not os.path.isfile(place):  # noqa: PTH110, PTH113
        raise InputError(f"{_name(param)}: {place} is not a file that can be replaced.")
    _try(_name(param), place, place.parent)
    return place


def a_folder(param: typer.CallbackParam, place: Path | None) -> Path | None:
    """Return the path if a folder there can be written to, or can be made; see check_folder."""
    if place is not None:
        check_folder(_name(param), place)
    return place


def check_folder(option: str, place: Path) -> None:
    """Raise InputError if a path is a file; OutputError if it cannot be made or written to."""
    if os.path.exists(place) and not os.path.isdir(place):  # noqa: PTH110, PTH112
        raise InputError(f"{option}: {place} is a file, and a folder is needed.")
    _try(option, place, place)


def must_not_replace(out: Path | None, *read: Path | str | None) -> None:
    """Raise InputError if the file to write is one of the files to read."""
    if out is not None and out.resolve() in {Path(file).resolve() for file in read if file}:
        raise InputError(f"{out} is the file to read; choose another file to write.")


def must_replace_calibration(out: Path) -> None:
    """Raise InputError if the file to write a calibration to exists and holds something else."""
    if out.is_file() and "[rule]" not in out.read_text("utf-8", errors="replace").splitlines():
        raise InputError(f"{out} exists and is no calibration; choose another file to write.")


def _try(option: str, place: Path, folder: Path) -> None:
    try:
        nearest = folder.absolute()
        while not os.path.exists(nearest) and nearest != nearest.parent:  # noqa: PTH110
            nearest = nearest.parent
        with tempfile.TemporaryFile(dir=nearest):
            pass
    except OSError as error:
        raise OutputError(
            f"{option}: {place} cannot be written: {error.strerror}. Choose another place."
        ) from error


def _name(param: typer.CallbackParam) -> str:
    return next(iter(param.opts), str(param.name))
