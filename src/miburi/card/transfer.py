"""Read or send a card's settings; its greeting tells which settings it already has.

Each function takes the card's ``ask``, which sends a request and returns the answer's bytes.
"""

import struct
from collections.abc import Callable
from contextlib import suppress
from typing import NamedTuple

from miburi.card.answers import OutOfRangeError, foreign
from miburi.card.link import VERSION, FrameKind
from miburi.card.settings import CardSettings, General, JointSettings, refusal
from miburi.errors import BodyError
from miburi.robot import JOINTS, Robot

Ask = Callable[[FrameKind, bytes], bytes]
#: A card's codes for settings that are stored, and for stored ones it cannot read (``memory.h``).
_STORED, _OTHER_LAYOUT = 1, 2


class Greeting(NamedTuple):
    """The checksum and the state of the settings that a card has."""

    crc: int
    complete: bool
    stored: bool  # they survive a loss of power
    unreadable: bool  # another firmware stored some


def greet(ask: Ask) -> Greeting:
    """Return a card's greeting.

    Raises
    ------
    BodyError
        The firmware has another version of the protocol.
    """
    version, *_, motors, complete, stored, crc = struct.unpack("<7BH", ask(FrameKind.HELLO, b""))
    if version != VERSION or motors != len(JOINTS):
        raise BodyError(foreign(version, motors))
    return Greeting(crc, bool(complete), stored == _STORED, stored == _OTHER_LAYOUT)


def read_settings(ask: Ask) -> CardSettings:
    """Read the settings of a card that has been configured."""
    pieces = [ask(FrameKind.READ, bytes((piece,))) for piece in range(len(JOINTS) + 1)]
    joints = tuple(JointSettings.unpack(piece) for piece in pieces[:-1])
    return CardSettings(General.unpack(pieces[-1]), joints)


def stop_and_settle(
    ask: Ask, has: Greeting, robot: Robot, wanted: CardSettings | None, *, keep: bool
) -> tuple[CardSettings, bool]:
    """Stop a card; unless it already has the settings that it should have, send them.

    ``has`` is the card's greeting. If ``wanted`` is None, the card should have the robot's own
    settings, with the calibration that the card has. With ``keep``, a card that has settings is
    sent none, and a card without settings is sent only ``wanted``, if given.

    Returns the card's present settings. Also returns whether these are defaults, used because the
    card cannot read settings that another firmware has saved.
    """
    ask(FrameKind.STOP, b"")
    settings = of_robot = CardSettings.of(robot)
    if keep and (has.complete or wanted is None):
        return read_settings(ask) if has.complete else of_robot, has.unreadable
    if wanted is not None:
        settings = wanted
    elif has.complete:
        settings = of_robot.with_calibration(read_settings(ask))
    if has.crc != settings.crc or not has.complete:
        _send(ask, settings)
    # A card that could not read its stored settings may already have been given the description's
    # settings by an earlier greeting.
    plain = not has.complete or has.crc == of_robot.crc
    return settings, has.unreadable and plain and wanted is None


def replace_settings(ask: Ask, settings: CardSettings, before: CardSettings) -> None:
    """Send settings to a stopped card; if it refuses them, send the previous ones again.

    Raises
    ------
    BodyError
        The card is not stopped, or a value is outside its safe range.
    """
    try:
        _send(ask, settings)
    except BodyError:
        with suppress(BodyError):
            _send(ask, before)
        raise


def save_settings(ask: Ask, wait: Callable[[float], object]) -> None:
    """Store a card's settings in its EEPROM, which takes about 4 s.

    ``wait`` lets time pass; its argument is in s.

    Raises
    ------
    BodyError
        The card did not store them.
    """
    ask(FrameKind.SAVE, b"")
    for _ in range(50):
        wait(0.2)
        if greet(ask).stored:
            return
    raise BodyError("The card did not store its settings; try again.")


def _send(ask: Ask, settings: CardSettings) -> None:
    pieces: list[JointSettings | General] = [*settings.joints, settings.general]
    # While two servos swap ids, both have the same id for a time: send the joints a second time.
    for _ in range(2):
        for piece, value in enumerate(pieces):
            index = b"" if isinstance(value, General) else bytes((piece,))
            kind = FrameKind.SETTINGS if isinstance(value, General) else FrameKind.JOINT
            try:
                ask(kind, index + value.pack())
            except OutOfRangeError as error:
                raise BodyError(refusal(settings, piece, error.index)) from None
        has = greet(ask)
        if has.complete and has.crc == settings.crc:
            return
    raise BodyError(
        "The card did not keep its settings, as two servos have the same id; change one."
    )
