"""All errors that Miburi raises for mistakes that a person can fix.

Each message says what Miburi got, what is allowed, and how to fix it. Catch :class:`MiburiError` to
catch them all.
"""

from importlib.util import find_spec


class MiburiError(Exception):
    """The base of all errors; the message is written for people."""


class DescriptionError(MiburiError):
    """A file (robot, gesture, temperament, ...) cannot be read, or its content is wrong."""


class InputError(MiburiError, ValueError):
    """A caller passed a value that is not allowed."""


class BodyError(MiburiError):
    """The body cannot do this in its present state."""


class OutputError(MiburiError):
    """A result cannot be written where it belongs."""


def needs_extra(extra: str, error: ModuleNotFoundError) -> MiburiError:
    """Return the error for a missing library; it names the extra that installs the library."""
    library = str(error.name).partition(".")[0]
    return MiburiError(
        f"this needs {library}, which is not installed: pip install 'FILE[{extra}]', where FILE is "
        "the wheel or the folder that Miburi came from."
    )


def need(library: str, extra: str) -> None:
    """Raise the error of :func:`needs_extra` if a library is missing; it is not loaded."""
    if find_spec(library) is None:
        raise needs_extra(extra, ModuleNotFoundError(name=library))
