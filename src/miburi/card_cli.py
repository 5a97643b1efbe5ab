"""The commands ``miburi card …``: parse, call, print."""

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from miburi.errors import BodyError

if TYPE_CHECKING:
    from miburi.bodies.card import Card

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
    from miburi.bodies.calibration import in_words, measure
    from miburi.calibration_file import write_calibration
    from miburi.files import whole_files

    with _connected(port) as card, whole_files(out.parent) as draft:
        if ids:
            _give_ids(card)
        if zeros:
            _find_zeros(card)
        typer.confirm("The robot will move now. Is the space around it free?", abort=True)
        measured = measure(card, lambda what: print(f"{what} …"))
        lines = in_words(measured)
        print("\n".join(lines))
        note = "\n".join(
            [
                f"Calibration of the {card.robot.name} on a card, {datetime.now():%Y-%m-%d %H:%M}, "
                f"from {measured.moves} free moves.",
                *lines,
            ]
        )
        write_calibration(
            card.robot, measured.settings.rule, draft / out.name, note, measured.settings.mounting
        )
        print("storing …")
        card.save()
    print(f"Stored on the card, and in {out}.")


@app.command()
def load(
    port: Port,
    file: Annotated[Path, typer.Argument(help="From miburi card calibrate, or miburi tune.")],
) -> None:
    """Load a calibration file onto the card, and store it there; nothing moves."""
    from miburi.bodies.calibration import changes, loaded
    from miburi.calibration_file import read_calibration
    from miburi.robot import iphonoid

    calibration = read_calibration(iphonoid(), file)
    with _connected(port) as card:
        before = card.settings
        after = loaded(before, calibration)
        card.configure(after)
        said = changes(before, after)
        print("\n".join(said or ["The card had the same figures already."]))
        if said:
            step = card.robot.servo.step
            print(f"Angles are rounded to the servo's steps of {step:.6f} rad.")
        if calibration.servos is None:
            print("The file names no servos: their ids, directions and zeros stay as they were.")
        print("storing …")
        card.save()
    print("Stored on the card.")


def _give_ids(card: "Card") -> None:
    from miburi.robot import JOINTS

    for name, joint in zip(JOINTS, card.settings.joints, strict=True):
        _wait_for_enter(f"Connect only the servo of the {_spoken(name)}")
        while True:
            try:
                card.identify(1, joint.servo)
                break
            except BodyError as error:
                print(error)
                _wait_for_enter(f"Look at the {_spoken(name)}'s cable and supply")
        print(f"This servo is number {joint.servo} now.")
    _wait_for_enter("Connect all servos")


def _find_zeros(card: "Card") -> None:
    from miburi.bodies.calibration import find_zero
    from miburi.robot import JOINTS

    settings = card.settings
    card.relax()
    for motor, name in enumerate(JOINTS):
        joint = settings.joints[motor]
        while True:
            places = []
            for what in ("to its zero pose", "about 10° the positive way"):
                _wait_for_enter(f"Turn the {_spoken(name)} {what}")
                card.step(0.2)
                places.append(joint.zero + joint.direction * card.report.positions[motor])
            try:
                settings = find_zero(settings, motor, places[0], places[1], _TURN)
                break
            except BodyError as error:
                print(f"{error} Once more, please.")
    card.configure(settings)


def _spoken(joint: str) -> str:
    return joint.replace("_", " ")


def _wait_for_enter(what: str) -> None:
    typer.prompt(f"{what}, then press Enter", default="", show_default=False, prompt_suffix=" ")


@contextmanager
def _connected(port: str) -> Iterator["Card"]:
    """Reach the card; in the end, whatever it was, stop it and let go of the port."""
    from miburi.bodies.card import Card

    card = Card(port)
    try:
        yield card
    finally:
        card.close()


@app.command()
def emulate(
    seconds: Annotated[float, typer.Option(help="How long; 0 for ever.")] = 0.0,
) -> None:
    """Put an emulated card with eight servos on a pseudo-terminal, in real time."""
    from miburi.bodies.terminal import serve

    serve(seconds, print)
