"""The studio's commands, mounted in :mod:`miburi.cli`."""

from pathlib import Path
from typing import Annotated

import typer


def run(
    body: Annotated[str, typer.Option(help="simulated, card or emulated-card.")] = "simulated",
    serial: Annotated[
        str | None, typer.Option(help="A card's serial port.", show_default=False)
    ] = None,
    host: Annotated[
        str, typer.Option(help="Where to listen; 0.0.0.0 lets phones in, with a token.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="0 takes any that is free.")] = 8080,
    headless: Annotated[bool, typer.Option("--headless", help="Open no browser.")] = False,
    temperament: Annotated[str, typer.Option(help="default, calm, lively, playful.")] = "playful",
    folder: Annotated[
        Path | None,
        typer.Option(help="For token, feelings and recordings.", show_default=False),
    ] = None,
    forget: Annotated[bool, typer.Option("--forget", help="Start afresh; keep no mood.")] = False,
    seed: Annotated[int, typer.Option(help="Varies the gestures; 0 or more.")] = 0,
    calibration: Annotated[
        Path | None,
        typer.Option(help="A file of miburi calibrate or tune.", show_default=False),
    ] = None,
) -> None:
    """Wake the live partner and open its studio."""
    from miburi.studio.server import Wish, serve

    serve(Wish(body, serial, host, port, headless, temperament, folder, forget, seed, calibration))
