"""``miburi run``: parse and call."""

from pathlib import Path
from typing import Annotated

import typer

from miburi.cli.options import (
    CalibrationFile,
    GesturesFolder,
    RobotFile,
    TemperamentName,
    repertoire_of,
    robot_of,
    rule_of,
    temperament_of,
)

__all__ = ["run"]


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
    temperament: TemperamentName = "playful",
    robot: RobotFile = None,
    gestures: GesturesFolder = None,
    calibration: CalibrationFile = None,
    folder: Annotated[
        Path | None,
        typer.Option(help="For token, feelings and recordings.", show_default=False),
    ] = None,
    forget: Annotated[bool, typer.Option("--forget", help="Start afresh; keep no mood.")] = False,
    seed: Annotated[int, typer.Option(help="Varies the gestures; 0 or more.")] = 0,
) -> None:
    """Wake the live partner and open its studio."""
    from miburi.studio.server import Wish, serve

    description = robot_of(robot)
    serve(
        Wish(
            description,
            repertoire_of(description, gestures),
            temperament_of(temperament),
            rule_of(description, calibration),
            body=body,
            port_of_body=serial,
            host=host,
            port=port,
            headless=headless,
            folder=folder,
            forget=forget,
            seed=seed,
        )
    )
