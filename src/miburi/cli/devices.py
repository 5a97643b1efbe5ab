"""``miburi devices``: list the paired phones; forget one, or all."""

import json
import os
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from miburi.cli.options import AsJson
from miburi.errors import InputError

if TYPE_CHECKING:
    from miburi.serving.keys import Keys


devices_app = typer.Typer(
    help="Show the phones and computers that were paired; forget one that is lost.",
    invoke_without_command=True,
)

Folder = Annotated[
    Path | None,
    typer.Option(help="The folder that `miburi run` was given; default: ~/.local/state/miburi."),
]


@devices_app.callback()
def devices(context: typer.Context, folder: Folder = None, as_json: AsJson = False) -> None:
    """Show the paired phones and computers, the most recently seen first."""
    if context.invoked_subcommand is not None:
        context.obj = folder
        return
    found = _keys(folder).devices()
    if as_json:
        print(*(json.dumps(asdict(device)) for device in found), sep="\n", end="\n" * bool(found))
        return
    if not found:
        print("No device is paired. The Face page of the studio shows a code to scan.")
        return
    table = Table("name", "device", "paired", "last seen", box=None, pad_edge=False)
    for device in found:
        table.add_row(device.name, device.kind, _day(device.paired), _day(device.seen))
    Console(highlight=False).print(table)


@devices_app.command()
def forget(
    context: typer.Context,
    name: Annotated[
        str | None, typer.Argument(help="The device's name, as `miburi devices` shows it.")
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Forget all devices.")] = False,
    folder: Folder = None,
) -> None:
    """Lock out a lost device, or all, and make a new token; it takes effect within a second."""
    if (name is None) != every:
        raise InputError("name one device, or give --all; `miburi devices` lists them.")
    keys = _keys(folder or context.obj)
    count = keys.forget(name)
    print(f"Forgotten: {f'{count} in all' if every else name}.")
    print(f"Programs and new devices need the new token: {keys.token}")


def _keys(folder: Path | None) -> "Keys":
    from miburi.host.server import own_folder
    from miburi.serving.keys import Keys

    if folder is not None and not os.path.isdir(folder):  # noqa: PTH112
        raise InputError(f"--folder: there is no folder {folder}.")
    return Keys(folder or own_folder())


def _day(moment: float) -> str:
    return f"{datetime.fromtimestamp(moment).astimezone():%Y-%m-%d %H:%M}"
