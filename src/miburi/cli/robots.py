"""``miburi robot check``: what is known of a robot before anything moves."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from miburi.cli.options import (
    robot_of,
    warn_of_foreign_guards,
    warn_of_meetings,
    warn_of_misfits,
)
from miburi.errors import MiburiError

robot_app = typer.Typer(help="A robot of your own.", no_args_is_help=True)


@robot_app.command()
def check(
    file: Annotated[Path, typer.Argument(help="A robot description (….toml).")],
) -> None:
    """Check a robot's file: values, guards, the shipped gestures on its body, and the card."""
    from miburi.card.settings import CardSettings
    from miburi.gestures import shipped_functions

    robot, functions = robot_of(file), shipped_functions()
    warned = [
        warn_of_foreign_guards(robot),
        warn_of_misfits(robot, functions),
        warn_of_meetings(robot, functions, by_rule=True),
    ]
    try:
        CardSettings.of(robot)
    except MiburiError as error:
        print(f"miburi: {error}", file=sys.stderr)
        warned.append(True)
    if any(warned):
        raise typer.Exit(1)
    print(f"{file}: all is well. A printed body: `miburi hardware check`.")
