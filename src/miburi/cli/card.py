"""The commands ``miburi card …``: parse the arguments, talk to a card, print the result."""

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from miburi.cli.by_hand import prepare, wait_for_enter
from miburi.cli.options import AsJson, RobotFile, robot_of
from miburi.cli.places import a_file, must_replace_calibration
from miburi.errors import BodyError, InputError

if TYPE_CHECKING:
    from miburi.bodies import BodyState
    from miburi.card.card import Card
    from miburi.card.transfer import Greeting
    from miburi.robot import Robot


app = typer.Typer(
    help="The robot's card, its controller board: an Arduino with the firmware.",
    no_args_is_help=True,
)

Port = Annotated[
    str, typer.Argument(metavar="PORT", help="The card's serial port, such as /dev/ttyACM0.")
]
_NOT_STORED = (
    "Its settings are not stored: the card forgets them when it is switched off. "
    "`miburi card calibrate` and `miburi card load` store them."
)
_NO_SETTINGS = (
    "It has no settings yet, so it does not know its servos. `miburi card calibrate` gives it "
    "some; with --robot FILE, this command lends it those of a robot until it is switched off."
)


@app.command("list")
def list_ports(as_json: AsJson = False) -> None:
    """List the serial ports of this computer."""
    from serial.tools.list_ports import comports

    ports = sorted(comports(), key=lambda port: (port.vid is None, port.device))
    if as_json:
        for port in ports:
            known = {"device": port.device, "what": port.description, "usb": port.vid is not None}
            print(json.dumps(known, ensure_ascii=False))
        return
    for port in ports:
        kind = port.description if port.description not in (None, "n/a") else "built in"
        print(f"{port.device}  {kind}{'' if port.vid is None else ' (USB)'}")
    if not any(port.vid for port in ports):
        print("None of them is a USB device." if ports else "There is no serial port.", end=" ")
        print("Plug the card in, or pair its Bluetooth module first.")


@app.command()
def info(port: Port, robot: RobotFile = None, as_json: AsJson = False) -> None:
    """Print the card's state, rule and servos; nothing moves, and no settings change."""
    with _look_at_card(port, robot) as card:
        has = card.has
        for _ in range(10 if has.complete else 0):  # it reads the servos' health twice a second
            card.step(0.2)
            if all(card.report.voltages):
                break
        found = _as_json(card, has)
        if as_json:
            print(json.dumps(found))
            return
        print(f"The body is {card.state.phase}{_why(card.state)}.")
        if not has.complete:
            print(_NO_SETTINGS)
            return
        print(f"Contact rule: p {found['period_s']:g} s, ratio {found['ratio']:g}.")
        print("Its settings are stored on the card." if has.stored else _NOT_STORED)
        for servo in found["servos"]:
            volts = servo["voltage_V"]
            health = f"{servo['temperature_C']} °C, {volts:.1f} V" if volts else "not measured yet"
            there = f"{servo['angle_rad']:+.3f} rad, {health}"
            if not servo["answers"]:
                there = "does not answer"
            print(f"{servo['joint']:>15}  servo {servo['servo']:3}  {there}")


def _as_json(card: "Card", has: "Greeting") -> dict[str, Any]:
    from miburi.robot import JOINTS

    state, report, rule = card.state, card.report, card.settings.general
    servos = [
        {
            "joint": name,
            "servo": joint.servo,
            "answers": bool(report.heard >> i & 1),
            "angle_rad": round(float(state.angles[i]), 6),
            "temperature_C": report.temperatures[i] if report.voltages[i] else None,
            "voltage_V": report.voltages[i] / 10 if report.voltages[i] else None,
        }
        for i, (name, joint) in enumerate(zip(JOINTS, card.settings.joints, strict=True))
    ]
    return {
        "phase": state.phase,
        "stop": state.stop.reason if state.stop else None,
        "period_s": rule.period / 1e6 if has.complete else None,
        "ratio": rule.ratio / 1e4 if has.complete else None,
        "stored": has.stored,
        "servos": servos if has.complete else [],
    }


@app.command()
def upload(
    port: Port,
    firmware: Annotated[
        Path | None, typer.Option(help="A .hex file; default: what `make firmware` built.")
    ] = None,
) -> None:
    """Write the firmware to an Arduino Mega 2560, with avrdude."""
    from miburi.emulation.firmware import firmware_file

    image = firmware or firmware_file("miburi.hex")
    if not image.is_file():
        raise BodyError(f"There is no file {image}.")
    if shutil.which("avrdude") is None:
        raise BodyError("avrdude is missing; install it (Debian: apt install avrdude).")
    if port.startswith("/") and not Path(port).exists():
        raise BodyError(f"There is no port {port}; `miburi card list` lists those that exist.")
    done = subprocess.run(  # noqa: S603  (no shell reads these words)
        ["avrdude", "-p", "m2560", "-c", "wiring", "-P", port, "-b", "115200", "-D",  # noqa: S607  (from the user's PATH)
         "-U", f"flash:w:{image}:i"],
        check=False,
    )  # fmt: skip
    if done.returncode != 0:
        raise BodyError(f"avrdude could not write to {port}; its message is above.")


@app.command()
def monitor(
    port: Port,
    seconds: Annotated[
        float, typer.Option(help="How long to print the readings, in seconds.", min=0)
    ] = 60.0,
    robot: RobotFile = None,
) -> None:
    """Print the card's state five times a second; nothing moves, and no settings change."""
    with _look_at_card(port, robot) as card:
        if not card.has.complete:
            print(_NO_SETTINGS)
        for _ in range(round(seconds * 5)):
            state = card.step(0.2)
            angles = " ".join(f"{angle:+.2f}" for angle in state.angles)
            print(f"{state.time:8.2f}  {state.phase:9}  {angles}{_why(state)}", flush=True)


@app.command()
def calibrate(
    port: Port,
    out: Annotated[Path, typer.Option(help="The calibration file.", callback=a_file)] = Path(
        "calibration.toml"
    ),
    ids: Annotated[
        bool, typer.Option(help="Give new servos their ids; alone, nothing moves.")
    ] = False,
    zeros: Annotated[bool, typer.Option(help="Find zero poses and directions by hand.")] = False,
    built: Annotated[
        bool,
        typer.Option(
            help="A body of printed parts: move it by hand to find wrongly mounted servos."
        ),
    ] = False,
    robot: RobotFile = None,
) -> None:
    """Measure the servos in free motion; store their guards on the card and in a file."""
    from miburi.calibration.file import write_calibration
    from miburi.card.calibration import describe, measure
    from miburi.ground.files import whole_files
    from miburi.hardware.places import misfits

    must_replace_calibration(out)
    if built and zeros:
        raise InputError("--built and --zeros both say where the zeros are; give one of them.")
    description = robot_of(robot)
    if built and misfits(description):
        raise InputError(
            "--built is for a printed body, and this robot cannot be printed. Pass a printable "
            "robot's file with --robot (miburi template robot buildable makes one)."
        )
    with _open_card(port, description) as card, whole_files(out.parent) as draft:
        if not prepare(card, wait_for_enter, ids=ids, zeros=zeros, built=built):
            print("All servos have their ids. Mount them, then calibrate with --built or --zeros.")
            return
        typer.confirm("The robot will move now. Is the area around it clear?", abort=True)
        measured = measure(card, lambda what: print(f"{what} …"))
        lines = describe(measured)
        print("\n".join((*lines, *measured.words)))
        note = "\n".join(
            [
                f"Calibration of the {card.robot.name} on a card, {datetime.now():%Y-%m-%d %H:%M}, "
                f"from {measured.moves} free moves in {measured.seconds:.0f} s.",
                *lines,
                *measured.words,
            ]
        )
        settings, path = measured.settings, draft / out.name
        write_calibration(
            measured.robot, settings.rule, path, note, settings.mounting, measured.found,
            of=description,
        )  # fmt: skip
        print("storing …")
        card.save()
    print(f"Stored on the card, and in {out}.")


@app.command("measure")
def measure_servos(
    port: Port,
    out: Annotated[Path, typer.Option(help="The report; an existing one is added to.")] = Path(
        "measured.toml"
    ),
    gestures: Annotated[
        int,
        typer.Option(
            help="How many gestures to watch for stops; half that number warm the servos first.",
            min=1,
        ),
    ] = 200,
    robot: RobotFile = None,
) -> None:
    """Measure constants that have not been checked on real servos; write a report to send in."""
    from miburi.card.bench import STEPS, Bench
    from miburi.card.bench_report import read_report, write_report

    description = robot_of(robot)
    report = read_report(description, out)
    with _open_card(port, description) as card:
        if not card.has.stored:
            print(_NOT_STORED)
        for number, step in enumerate(STEPS, 1):
            print(f"{number} of {len(STEPS)}: {step.what}")
            if step.name in report.measured:
                print("It is in the report already.")
                continue
            answer = typer.prompt("Enter to begin, s to skip, q to stop", "", show_default=False)
            if answer == "q":
                break
            if answer == "s":
                continue
            try:
                found = step.conduct(Bench(card, wait_for_enter, gestures))
            except BodyError as error:
                print(f"{error} Skipped; the next `miburi card measure` asks for it again.")
                continue
            for name, value in found.measured.items():
                print(f"  {name}: {value}")
            report = report.after(step.name, found)
            write_report(report, out)
    print(f"The report is in {out}." if out.exists() else "Nothing was measured.")


@app.command()
def load(
    port: Port,
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="A file that `card calibrate`, `calibrate` or `tune` wrote."
        ),
    ],
    robot: RobotFile = None,
) -> None:
    """Load a calibration file onto the card and store it there; nothing moves."""
    if port.endswith(".toml"):
        raise InputError(f"the port comes first, then the file; got {port} {file}.")
    from miburi.calibration.file import read_calibration
    from miburi.card.calibration import apply_calibration, changes

    description = robot_of(robot)
    calibration = read_calibration(description, file)
    with _open_card(port, description) as card:
        before = card.settings
        after = apply_calibration(before, calibration)
        card.configure(after)
        lines = changes(before, after)
        print("\n".join(lines or ["The card has these values already."]))
        if lines:
            step = card.robot.servo.step
            print(f"Angles are rounded to the servo's steps of {step:.6f} rad.")
        if not calibration.named:
            print("The file does not say which robot it fits: make sure that it is this one.")
        if calibration.servos is None:
            print("The file names no servos: their ids, directions and zeros stay as they were.")
        print("storing …")
        card.save()
    print("Stored on the card.")


def _why(state: "BodyState") -> str:
    from miburi.studio.words import FALLBACK, words

    stop = state.stop
    if stop is None:
        return ""
    reason = words(FALLBACK)["reason"][stop.reason]
    return f" ({reason}{'' if stop.motor is None else ', ' + stop.motor.replace('_', ' ')})"


@contextmanager
def _open_card(port: str, robot: "Robot") -> Iterator["Card"]:
    """Open the card; stop it and close the port at the end of the block."""
    from miburi.card.card import Card

    with closing(Card(port, robot)) as card:
        yield card


@contextmanager
def _look_at_card(port: str, file: Path | None) -> Iterator["Card"]:
    """Open the card, which keeps the settings that it has; without any, it gets the file's."""
    from miburi.card.card import Card
    from miburi.card.settings import CardSettings

    robot = robot_of(file)
    with closing(Card(port, robot, CardSettings.of(robot) if file else None, keep=True)) as card:
        yield card


@app.command()
def emulate(
    seconds: Annotated[
        float, typer.Option(help="How long, in seconds; 0: until Ctrl-C.", min=0)
    ] = 0.0,
    unplugged: Annotated[
        list[int] | None,
        typer.Option(help="To rehearse: the number of a servo that is unplugged.", min=1, max=8),
    ] = None,
    renumbered: Annotated[
        tuple[int, int] | None,
        typer.Option(
            help="To rehearse: a servo's number, and the wrong number that it has, such as 2 1."
        ),
    ] = None,
    robot: RobotFile = None,
) -> None:
    """Run an emulated card with eight servos in real time, and print its port."""
    if sys.platform == "win32":
        raise BodyError(
            "the emulated card's port is a pseudo-terminal, and Windows has none. Use Linux, macOS "
            "or WSL; a simulated body needs no card: `miburi run`."
        )
    from miburi.emulation.terminal import serve

    serve(robot_of(robot), seconds, print, unplugged or (), renumbered)
