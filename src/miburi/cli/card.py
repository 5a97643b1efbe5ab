"""The commands ``miburi card …``: parse, call, print."""

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from miburi.cli.options import RobotFile, robot_of
from miburi.errors import BodyError

if TYPE_CHECKING:
    from miburi.bodies import BodyState
    from miburi.card.card import Card
    from miburi.robot import Robot

__all__ = ["Port", "app", "calibrate", "emulate", "info", "list_ports", "load", "monitor", "upload"]

app = typer.Typer(help="The robot's card: an Arduino with the firmware.", no_args_is_help=True)

Port = Annotated[
    str, typer.Argument(metavar="PORT", help="The card's serial port, such as /dev/ttyACM0.")
]
_TURN = 100
_SHOULDER = (
    "with its elbow bent, the forearm hangs straight down",
    "the bent forearm swings forward",
)
_STRAIGHT = "straight out, in line with the upper arm"
#: Each joint's zero, and which way is positive, for the hand that turns it (miburi.robot.forward).
_BY_HAND = {
    "waist": ("the chest faces straight ahead", "to the robot's own left"),
    "right_shoulder": _SHOULDER,
    "right_elbow": (_STRAIGHT, "the forearm goes down"),
    "right_fingertip": (_STRAIGHT, "the hand goes down"),
    "left_shoulder": _SHOULDER,
    "left_elbow": (_STRAIGHT, "the forearm goes up"),
    "left_fingertip": (_STRAIGHT, "the hand goes up"),
    "head": ("its link lies level, forwards", "the head goes up"),
}
_NOT_STORED = (
    "Its settings are not stored: it forgets them when it is switched off. "
    "`miburi card calibrate` and `miburi card load` store them."
)


@app.command("list")
def list_ports() -> None:
    """Name the serial ports of this computer."""
    from serial.tools.list_ports import comports

    ports = sorted(comports(), key=lambda port: (port.vid is None, port.device))
    for port in ports:
        told = port.description if port.description not in (None, "n/a") else "built in"
        print(f"{port.device}  {told}{'' if port.vid is None else ' (USB)'}")
    if not any(port.vid for port in ports):
        print("No USB device is among them." if ports else "No serial port is there.", end=" ")
        print("Plug the card in, or pair its Bluetooth module first.")


@app.command()
def info(port: Port, robot: RobotFile = None) -> None:
    """Say what the card knows and how its servos are; nothing moves."""
    from miburi.robot import JOINTS

    with _connected(port, robot_of(robot)) as card:
        for _ in range(10):  # the servos' health is looked at twice a second
            card.step(0.2)
            if all(card.report.voltages):
                break
        state, report = card.state, card.report
        print(f"The body is {state.phase}{_why(state)}.")
        rule = card.settings.general
        print(f"Contact rule: p {rule.period / 1e6:g} s, ratio {rule.ratio / 1e4:g}.")
        print("Its settings are stored on the card." if card.stored else _NOT_STORED)
        for i, (name, joint) in enumerate(zip(JOINTS, card.settings.joints, strict=True)):
            volts = report.voltages[i] / 10
            health = f"{report.temperatures[i]} °C, {volts:.1f} V" if volts else "not measured yet"
            there = f"{state.angles[i]:+.3f} rad, {health}"
            if not report.heard >> i & 1:
                there = "does not answer"
            print(f"{name:>15}  servo {joint.servo:3}  {there}")


@app.command()
def upload(
    port: Port,
    firmware: Annotated[
        Path | None, typer.Option(help="A .hex file; default: what `make firmware` built.")
    ] = None,
) -> None:
    """Write the firmware to an Arduino Mega 2560, with avrdude."""
    from miburi.emulation.card import built

    image = firmware or built("miburi.hex")
    if not image.is_file():
        raise BodyError(f"There is no file {image}.")
    if shutil.which("avrdude") is None:
        raise BodyError("avrdude is missing; install it (Debian: apt install avrdude).")
    if port.startswith("/") and not Path(port).exists():
        raise BodyError(f"There is no port {port}; `miburi card list` names those that are there.")
    # No shell reads these words, and avrdude is the one that the user's own path names.
    done = subprocess.run(  # noqa: S603
        ["avrdude", "-p", "m2560", "-c", "wiring", "-P", port, "-b", "115200", "-D",  # noqa: S607
         "-U", f"flash:w:{image}:i"],
        check=False,
    )  # fmt: skip
    if done.returncode != 0:
        raise BodyError(f"avrdude could not write to {port}; its words are above.")


@app.command()
def monitor(
    port: Port,
    seconds: Annotated[float, typer.Option(help="How long.")] = 60.0,
    robot: RobotFile = None,
) -> None:
    """Print the card's state five times a second; nothing moves."""
    with _connected(port, robot_of(robot)) as card:
        for _ in range(round(seconds * 5)):
            state = card.step(0.2)
            angles = " ".join(f"{angle:+.2f}" for angle in state.angles)
            print(f"{state.time:8.2f}  {state.phase:9}  {angles}{_why(state)}", flush=True)


@app.command()
def calibrate(
    port: Port,
    out: Annotated[Path, typer.Option(help="The calibration file.")] = Path("calibration.toml"),
    ids: Annotated[bool, typer.Option(help="Give new servos their ids first.")] = False,
    zeros: Annotated[bool, typer.Option(help="Find zero poses and directions by hand.")] = False,
    robot: RobotFile = None,
) -> None:
    """Measure the servos in free motion and store their guards, on the card and in a file."""
    from miburi.calibration.file import write_calibration
    from miburi.card.calibration import in_words, measure
    from miburi.ground.files import whole_files

    with _connected(port, robot_of(robot)) as card, whole_files(out.parent) as draft:
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
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="From miburi card calibrate, or miburi tune.")
    ],
    robot: RobotFile = None,
) -> None:
    """Load a calibration file onto the card, and store it there; nothing moves."""
    from miburi.calibration.file import read_calibration
    from miburi.card.calibration import changes, loaded

    description = robot_of(robot)
    calibration = read_calibration(description, file)
    with _connected(port, description) as card:
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


def _why(state: "BodyState") -> str:
    from miburi.studio.words import FALLBACK, words

    stop = state.stop
    if stop is None:
        return ""
    reason = words(FALLBACK)["reason"][stop.reason]
    return f" ({reason}{'' if stop.motor is None else ', ' + _spoken(stop.motor)})"


def _give_ids(card: "Card") -> None:
    from miburi.robot import JOINTS

    for name, joint in zip(JOINTS, card.settings.joints, strict=True):
        _wait_for_enter(f"Connect only the servo of the {_spoken(name)}")
        while True:
            try:
                card.identify(1, joint.servo)
                break
            except BodyError:
                print("No new servo answers.")
                _wait_for_enter("Look at its cable and at the supply")
        print(f"This servo is number {joint.servo} now.")
    _wait_for_enter("Connect all servos")


def _find_zeros(card: "Card") -> None:
    from miburi.card.calibration import find_zero
    from miburi.robot import JOINTS

    settings = card.settings
    card.relax()
    print("The joints are limp now. Turn each gently, by hand.")
    for motor, name in enumerate(JOINTS):
        joint, (zero, onwards) = settings.joints[motor], _BY_HAND[name]
        while True:
            places = []
            for what in (f"to its zero: {zero}", f"by about 10°: {onwards}"):
                _wait_for_enter(f"Turn the {_spoken(name)} {what}")
                card.look()
                if not card.report.heard >> motor & 1:
                    raise BodyError(f"{name}: its servo does not answer. Look at cable and supply.")
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
def _connected(port: str, robot: "Robot") -> Iterator["Card"]:
    """Reach the card; in the end, whatever it was, stop it and let go of the port."""
    from miburi.card.card import Card

    card = Card(port, robot)
    try:
        yield card
    finally:
        card.close()


@app.command()
def emulate(
    seconds: Annotated[float, typer.Option(help="How long; 0 for ever.")] = 0.0,
    robot: RobotFile = None,
) -> None:
    """Put an emulated card with eight servos on a pseudo-terminal, in real time."""
    from miburi.emulation.terminal import serve

    serve(robot_of(robot), seconds, print)
