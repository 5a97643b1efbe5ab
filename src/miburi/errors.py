"""The errors that Miburi raises for what a person can mend.

Each message says what was got, what is allowed, and how to mend it.
"""

__all__ = [
    "BodyError",
    "DescriptionError",
    "InputError",
    "MiburiError",
    "OutputError",
    "needs_extra",
]


class MiburiError(Exception):
    """Anything that Miburi refuses; the message is meant for people."""


class DescriptionError(MiburiError):
    """A file (robot, gesture, temperament) does not say what it must."""


class InputError(MiburiError, ValueError):
    """A value from a caller is outside what is allowed."""


class BodyError(MiburiError):
    """The body cannot do what was asked in the state that it is in."""


class OutputError(MiburiError):
    """A result cannot be written where it was asked for."""


def needs_extra(extra: str, error: ModuleNotFoundError) -> MiburiError:
    """Return the refusal of work for which a library of one of the package's extras is missing."""
    library = str(error.name).partition(".")[0]
    return MiburiError(
        f"this needs {library}, which is not installed: pip install 'miburi[{extra}]'."
    )
