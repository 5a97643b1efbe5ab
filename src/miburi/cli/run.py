"""``miburi run``: parse the arguments and start the live partner."""

from pathlib import Path
from typing import Annotated

import typer

from miburi.cli.options import (
    CalibrationFile,
    GesturesFolder,
    RobotFile,
    ServoName,
    TemperamentName,
    repertoire_of,
    robot_of,
    rule_of,
    temperament_of,
)
from miburi.errors import InputError

__all__ = ["run"]


def run(
    body: Annotated[str, typer.Option(help="simulated, card or emulated-card.")] = "simulated",
    serial: Annotated[
        str | None, typer.Option(help="A card's serial port.", show_default=False)
    ] = None,
    host: Annotated[
        str, typer.Option(help="The address to listen on; 0.0.0.0 lets phones in, with a token.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="The port to listen on; 0 takes a free one.")] = 8080,
    headless: Annotated[bool, typer.Option("--headless", help="Do not open a browser.")] = False,
    agents: Annotated[bool, typer.Option("--agents", help="Let agents in at /mcp (MCP).")] = False,
    temperament: TemperamentName = "playful",
    robot: RobotFile = None,
    servo: ServoName = None,
    gestures: GesturesFolder = None,
    calibration: CalibrationFile = None,
    folder: Annotated[
        Path | None,
        typer.Option(
            help="Folder for token, feelings and recordings; default: ~/.local/state/miburi.",
            show_default=False,
        ),
    ] = None,
    forget: Annotated[
        bool, typer.Option("--forget", help="Forget the moods of last time.")
    ] = False,
    seed: Annotated[int, typer.Option(help="Varies the gestures; 0 or more.")] = 0,
) -> None:
    """Wake the live partner and open its studio."""
    from miburi.studio.server import Wish, serve

    if servo is not None and body != "simulated":
        raise InputError("--servo is for the simulated body; a card has servos of its own.")
    description = robot_of(robot, servo)
    serve(
        Wish(
            description,
            repertoire_of(description, gestures),
            temperament_of(temperament),
            rule_of(description, calibration, servo),
            body=body,
            port_of_body=serial,
            host=host,
            port=port,
            headless=headless,
            agents=agents,
            folder=folder,
            forget=forget,
            seed=seed,
        )
    )
