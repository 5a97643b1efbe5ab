"""The commands ``miburi card …``: parse, call, print."""

import shutil
import subprocess
from pathlib import Path
from typing import Annotated

import typer

from miburi.errors import BodyError

app = typer.Typer(help="The robot's card: an Arduino with the firmware.", no_args_is_help=True)

Port = Annotated[str, typer.Argument(help="The card's serial port, such as /dev/ttyACM0.")]
_TURN = 100


@app.command("list")
def list_ports() -> None:
    """Name the serial ports of this computer."""
    from serial.tools.list_ports import comports

    ports = list(comports())
    for port in ports:
        print(f"{port.device}  {port.description}")
    if not ports:
        print("No serial port is there. Plug the card in, or pair its Bluetooth module first.")


@app.command()
def info(port: Port) -> None:
    """Say what the card knows and how its servos are; nothing moves."""
    from miburi.bodies.card import Card
    from miburi.robot import JOINTS

    card = Card(port)
    card.step(0.6)
    state, report = card.state, card.report
    reason = f" ({state.stop.reason})" if state.stop else ""
    print(f"{state.phase}{reason}; settings {card.settings.crc:04x}")
    for i, (name, joint) in enumerate(zip(JOINTS, card.settings.joints, strict=True)):
        there = (
            f"{state.angles[i]:+.3f} rad, {report.temperatures[i]} °C, "
            f"{report.voltages[i] / 10:.1f} V"
            if report.heard >> i & 1
            else "does not answer"
        )
        print(f"{name:>15}  servo {joint.servo:3}  {there}")
    card.close()


@app.command()
def upload(
    port: Port,
    firmware: Annotated[
        Path | None, typer.Option(help="A .hex file; default: what `make firmware` built.")
    ] = None,
) -> None:
    """Write the firmware to an Arduino Mega 2560, with avrdude."""
    from miburi.bodies.emulated import built

    if shutil.which("avrdude") is None:
        raise BodyError("avrdude is missing; install it (Debian: apt install avrdude).")
    image = firmware or built("miburi.hex")
    done = subprocess.run(  # noqa: S603
        ["avrdude", "-p", "m2560", "-c", "wiring", "-P", port, "-b", "115200", "-D",  # noqa: S607
         "-U", f"flash:w:{image}:i"],
        check=False,
    )  # fmt: skip
    if done.returncode != 0:
        raise BodyError(f"avrdude could not write to {port}; its words are above.")


@app.command()
def monitor(port: Port, seconds: Annotated[float, typer.Option(help="How long.")] = 60.0) -> None:
    """Print the card's state five times a second; nothing moves."""
    from miburi.bodies.card import Card

    card = Card(port)
    for _ in range(round(seconds * 5)):
        state = card.step(0.2)
        angles = " ".join(f"{angle:+.2f}" for angle in state.angles)
        stop = f"  {state.stop.reason} {state.stop.motor or ''}" if state.stop else ""
        print(f"{state.time:8.2f}  {state.phase:9}  {angles}{stop}")
    card.close()


@app.command()
def calibrate(
    port: Port,
    out: Annotated[Path, typer.Option(help="The calibration file.")] = Path("calibration.toml"),
    ids: Annotated[bool, typer.Option(help="Give new servos their ids first.")] = False,
    zeros: Annotated[bool, typer.Option(help="Find zero poses and directions by hand.")] = False,
) -> None:
    """Measure the servos in free motion and store their guards, on the card and in a file."""
    from miburi.bodies.calibration import calibrate as measure_all
    from miburi.bodies.calibration import find_zero, write_settings
    from miburi.bodies.card import Card
    from miburi.robot import JOINTS

    card = Card(port)
    settings = card.settings
    if ids:
        for name, joint in zip(JOINTS, settings.joints, strict=True):
            typer.prompt(f"Connect only the servo of {name}, then press Enter", default="")
            card.identify(1, joint.servo)
        typer.prompt("Connect all servos, then press Enter", default="")
    if zeros:
        card.relax()
        for motor, name in enumerate(JOINTS):
            places = []
            for what in ("to its zero pose", "about 10° the positive way"):
                typer.prompt(f"Turn {name} {what}, then press Enter", default="")
                card.step(0.2)
                joint = settings.joints[motor]
                places.append(joint.zero + joint.direction * card.report.positions[motor])
            settings = find_zero(settings, motor, places[0], places[1], _TURN)
        card.configure(settings)
    typer.confirm("The robot will move now. Is the space around it free?", abort=True)
    settings = measure_all(card, print)
    card.stop()
    card.configure(settings)
    card.save()
    write_settings(settings, out)
    card.close()
    print(f"Stored on the card, and in {out}.")


@app.command()
def emulate(
    seconds: Annotated[float, typer.Option(help="How long; 0 for ever.")] = 0.0,
) -> None:
    """Put an emulated card with eight servos on a pseudo-terminal, in real time."""
    from miburi.bodies.terminal import serve

    serve(seconds, print)
