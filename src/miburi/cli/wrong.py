"""Explain errors in a command line."""

from typing import Any

from pydantic import ValidationError
from typer.core import TyperGroup

_NEEDED = {
    "float_parsing": "a number is needed, such as 0.5",
    "int_parsing": "a whole number is needed, such as 3",
}


class Explaining(TyperGroup):
    """The program's commands, with fuller parser errors."""

    def invoke(self, ctx: Any) -> Any:
        """Run a command."""
        try:
            return super().invoke(ctx)
        except Exception as error:
            _complete(error)
            raise

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments that stand before the command."""
        try:
            return super().parse_args(ctx, args)
        except Exception as error:
            self._place(error)
            raise

    def _place(self, error: Any) -> None:
        """If an option stands before its command, add to the error where it belongs."""
        option = getattr(error, "option_name", None)
        having = [
            name
            for name, command in self.commands.items()
            if any(option in param.opts for param in command.params)
        ]
        if having:
            example = "run" if "run" in having else having[0]
            error.possibilities = []
            error.message += f" here. It belongs after a command: miburi {example} {option} …"


def _takes_words(error: Any) -> bool:
    return any(param.param_type_name == "argument" for param in error.ctx.command.params)


def _complete(error: Any) -> None:
    cause, words = error.__cause__, getattr(error, "message", "")
    if isinstance(cause, ValidationError):
        first = cause.errors()[0]
        needed = _NEEDED.get(first["type"], words.removeprefix("Value error, ").rstrip("."))
        got = repr(first["input"])
        error.message = f"{needed}." if got in needed else f"{needed}; got {got}."
    elif "unexpected extra argument" in words and _takes_words(error):
        error.message += ". Put words that belong together in quotes."
    elif "requires" in words and words.endswith("arguments."):
        error.message += " Put spaces between them, such as 0.1 0 0.2."
