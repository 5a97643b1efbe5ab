"""Check the {placeholders} of a text in a file before the text is needed."""

from collections.abc import Callable, Mapping
from string import Formatter


def check_placeholders(text: str, examples: Mapping[str, object]) -> str:
    """Return a text that can be filled in with values such as these examples, by name.

    Raises ValueError if it has another placeholder, or cannot be filled in.

    >>> check_placeholders("{hour} Uhr {minuten}", {"hour": "9", "minute": "05"})
    Traceback (most recent call last):
    ...
    ValueError: '{hour} Uhr {minuten}' has {minuten}; allowed here: {hour}, {minute}
    """
    try:
        unknown = placeholders(text) - {f"{{{name}}}" for name in examples}
        if not unknown:
            text.format(**examples)
    except (ValueError, LookupError) as error:
        raise ValueError(f"{text!r} cannot be filled in: {error}") from error
    if unknown:
        allowed = ", ".join(f"{{{name}}}" for name in examples) or "none"
        raise ValueError(f"{text!r} has {', '.join(sorted(unknown))}; allowed here: {allowed}")
    return text


def placeholders(text: str) -> set[str]:
    """Return a text's placeholders, with their braces; ValueError if a brace stands alone."""
    return {f"{{{name}}}" for _, name, _, _ in Formatter().parse(text) if name is not None}


def filled_with(**examples: object) -> Callable[[str], str]:
    """Return :func:`check_placeholders` for these examples, as pydantic takes it."""
    return lambda text: check_placeholders(text, examples)
