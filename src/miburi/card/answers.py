"""A card's answer to a request: the bytes that were asked for, or an error in words."""

from miburi.card.link import VERSION, Frame, FrameKind, Result
from miburi.card.reading import PHASES, unready
from miburi.card.settings import CardSettings
from miburi.errors import BodyError
from miburi.robot import JOINTS
from miburi.safety.stop import Stop

#: Why a release is refused: the card is lost, or its saved settings are unreadable.
LOST = (
    "The card cannot be reached. Check its cable and power; Miburi looks for it every second. The "
    "body stays stopped until you release it."
)
UNREADABLE = (
    "The card's settings were saved by another version of the firmware, so the card cannot "
    "read them and does not know how its servos are mounted. Load its calibration "
    "(miburi card load), or calibrate it again (miburi card calibrate --zeros)."
)


def foreign(version: int, motors: int) -> str:
    """Report a firmware that does not match this version of Miburi."""
    return (
        f"The card's firmware speaks version {version} of the protocol and drives {motors} motors; "
        f"{VERSION} and {len(JOINTS)} are needed. Upload the firmware of this Miburi (miburi card "
        "upload)."
    )


def not_home(stop: Stop | None) -> str:
    """Say why a released body did not reach neutral."""
    why = "" if stop is None else f": {stop.reason.spoken}, {stop.motor or 'no single motor'}"
    return f"The body did not reach neutral{why}. Clear its way, then try again."


class NoAnswerError(BodyError):
    """The card did not answer."""


class OutOfRangeError(BodyError):
    """A value is outside what the card allows."""

    def __init__(self, kind: FrameKind, index: int) -> None:
        self.index = index
        motor = JOINTS[index % len(JOINTS)]
        if kind is FrameKind.LOADS:
            super().__init__(
                f"The card refuses the load of {motor}: it is more than the motor may hold. "
                "Look at the masses and the servo in the robot's description."
            )
            return
        what = f"the {'goal' if index < len(JOINTS) else 'speed'} of {motor}"
        named = what if kind is FrameKind.MOVE else f"value {index} of {kind.name.lower()}"
        super().__init__(f"The card refuses {named}: it is out of range.")


def read_answer(kind: FrameKind, answer: Frame, settings: CardSettings) -> bytes:
    """Return the payload of the answer to a request of ``kind``.

    Raises
    ------
    BodyError
        The card refused the request; the message says why, and what to do.
    """
    result, detail = answer.payload[0], answer.payload[1:]
    match result:
        case Result.OK:
            return detail
        case Result.PHASE:
            phase = PHASES[detail[0]]
            raise BodyError(f"The card refuses '{kind.name.lower()}' while it is {phase}.")
        case Result.SERVO:
            raise BodyError(unready(detail, settings))
        case Result.RANGE:
            raise OutOfRangeError(kind, detail[0])
        case Result.LOADS:
            raise BodyError("The card does not know the loads of this move; send the move again.")
        case Result.SETTINGS:
            raise BodyError("The card does not have all its settings; connect to it again.")
        case Result.VERSION:
            raise BodyError(
                f"The card's firmware speaks version {detail[0]} of the link; {VERSION} is "
                "needed. Upload the firmware of this Miburi (miburi card upload)."
            )
        case _:
            raise BodyError(
                f"The card did not understand '{kind.name.lower()}' ({result}). "
                "Flash the firmware again."
            )
