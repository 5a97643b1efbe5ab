"""Steps done by hand before a card is calibrated: connect servos, and turn limp joints."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import typer

from miburi.errors import BodyError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from miburi.calibration.file import Mounting
    from miburi.card.card import Card


#: The smallest turn from which a direction is read, in encoder steps: 8.8° (our choice).
_TURN = 100
#: A servo's register with its number on the bus.
_ID = 7
_SHOULDER = (
    "with its elbow bent, the forearm hangs straight down",
    "the bent forearm swings forward",
)
_STRAIGHT = "straight out, in line with the upper arm"
_SILENT = (
    "Check cables and supply. Two servos with one number silence each other: number all servos "
    "again (--ids)."
)
#: Each joint's zero and positive direction, in words for the person who turns it.
_BY_HAND = {
    "waist": ("the chest faces straight ahead", "to the robot's own left"),
    "right_shoulder": _SHOULDER,
    "right_elbow": (_STRAIGHT, "the forearm goes down"),
    "right_fingertip": (_STRAIGHT, "the hand goes down"),
    "left_shoulder": _SHOULDER,
    "left_elbow": (_STRAIGHT, "the forearm goes up"),
    "left_fingertip": (_STRAIGHT, "the hand goes up"),
    "head": ("its link is level and points forwards", "the head goes up"),
}
#: For a printed body: the part to turn, its zero, and its positive direction.
_BUILT = {
    "waist": ("the torso", "FRONT over FRONT", "to the robot's own left"),
    "shoulder": (
        "the SIDE yoke", "its flat top faces up", "its top goes backwards, its underside forwards"
    ),
    "elbow": ("the SIDE upper arm, at the yoke,", "straight out to the side", "OUT"),
    "fingertip": ("the SIDE forearm", "in line with the upper arm", "OUT"),
    "head": ("the cradle", "bent down to its mechanical end", "upwards"),
}  # fmt: skip
_OUT = {"right": "downwards", "left": "upwards"}


def wait_for_enter(what: str) -> str:
    """Ask the person at the terminal to do something; return what was typed once it is done."""
    return str(
        typer.prompt(f"{what}, then press Enter", default="", show_default=False, prompt_suffix=" ")
    )


def prepare(
    card: "Card", wait: Callable[[str], object], *, ids: bool, zeros: bool, built: bool
) -> bool:
    """Do the requested steps by hand; return whether the robot may move then.

    ``wait`` asks the person for something and waits. With ``ids`` alone, servos may lie loose on
    the table, so nothing may move.
    """
    if ids:
        _give_ids(card, wait)
        if not (zeros or built):
            return False
        wait("Connect all servos")
    if zeros:
        find_zeros(card, wait)
    if built:
        from miburi.hardware.places import mounting

        find_faults(card, mounting(card.robot), wait)
        wait("Put the phone into the cradle and tighten the jaw; close the chest")
    return True


def _give_ids(card: "Card", wait: Callable[[str], object]) -> None:
    from miburi.robot import JOINTS

    for name, joint in zip(JOINTS, card.settings.joints, strict=True):
        only = f"connect only the servo of the {_in_words(name)}"
        wait(only.capitalize())
        while True:
            old = _number(card, joint.servo, only, wait)
            try:
                card.identify(old, joint.servo)
                break
            except BodyError:
                print("No new servo answers.")
                wait("Check its cable and the supply")
        print(f"This servo is number {joint.servo} now.")
        if name != JOINTS[-1]:  # else the next step would take it for a new one
            wait("Unplug it")
            while joint.servo in _answering(card):
                wait(f"Servo {joint.servo} still answers. Unplug it")


def _number(card: "Card", new: int, only: str, wait: Callable[[str], object]) -> int:
    """Return the number of the servo that is to get the number ``new``; a new servo has 1."""
    while others := (found := _answering(card)) - {1, new}:
        one = min(others)
        kept = f"or type {one} to give it the number {new} instead"
        said = wait(f"Unplug servo {one}, and {only}; {kept}")
        if said == str(one) and found == {one}:
            return one
    return new if new in found else 1


def _answering(card: "Card") -> set[int]:
    """Return the numbers of the joints' servos that answer."""
    from miburi.card.answers import NoAnswerError
    from miburi.card.bench_moves import peek

    found = set()
    for motor, joint in enumerate(card.settings.joints):
        try:
            peek(card, motor, _ID, 1)
        except NoAnswerError:
            raise
        except BodyError:
            continue
        found.add(joint.servo)
    return found


def find_zeros(card: "Card", wait: Callable[[str], object]) -> None:
    """Find each servo's zero and direction while a person turns the limp joints."""
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
                wait(f"Turn the {_in_words(name)} {what}")
                card.look()
                if not card.report.heard >> motor & 1:
                    raise BodyError(f"{name}: its servo does not answer. {_SILENT}")
                places.append(joint.zero + joint.direction * card.report.positions[motor])
            try:
                settings = find_zero(settings, motor, places[0], places[1], _TURN)
                break
            except BodyError as error:
                print(f"{error} Once more, please.")
    card.configure(settings)


def find_faults(card: "Card", built: "Mounting", wait: Callable[[str], object]) -> None:
    """Find wrongly mounted servos in a built robot, while a person turns the limp joints.

    A joint that seems wrong is turned once more.

    Raises BodyError if servos are mounted wrongly; the message has a line for each. Nothing has
    moved, and the card has its earlier settings.
    """
    from miburi.card.mounting import Turned, mounting_faults
    from miburi.robot import JOINTS

    before = card.settings
    card.configure(before.with_mounting(built))
    card.relax()
    print("The joints are limp. Turn each gently, by hand; nothing moves by itself.")
    lines = []
    for motor, name in enumerate(JOINTS):
        what, zero, onwards = _BUILT[name.partition("_")[2] or name]
        side = name.partition("_")[0]
        for tries in (1, 2):
            places = []
            for way in (f"to its zero: {zero}", f"by about 10°: {onwards}"):
                order = f"{_in_words(name)}, servo {built.id[motor]}: turn {what} {way}"
                wait(order.replace("SIDE", side).replace("OUT", _OUT.get(side, "")))
                places.append(_positions(card))
            faults = mounting_faults(built, [Turned(motor, places[0], places[1])])
            if not faults:
                break
            if tries == 1:
                print(f"{faults[0]} Once more, please.")
        lines += faults
    if lines:
        card.configure(before)
        raise BodyError("this robot is not assembled as designed:\n  " + "\n  ".join(lines))
    print("Every servo is where it belongs.")


def _positions(card: "Card") -> "NDArray[np.int64]":
    """Return the servos' positions, shape (8,), in encoder steps."""
    import numpy as np

    from miburi.robot import JOINTS

    card.look()
    silent = [name for motor, name in enumerate(JOINTS) if not card.report.heard >> motor & 1]
    if silent:
        named = ", ".join(map(_in_words, silent))
        raise BodyError(f"no answer from these joints' servos: {named}. {_SILENT}")
    counts = [
        joint.zero + joint.direction * place
        for joint, place in zip(card.settings.joints, card.report.positions, strict=True)
    ]
    return np.array(counts, dtype=np.int64)


def _in_words(joint: str) -> str:
    return joint.replace("_", " ")
