"""Offer an emulated card at a serial port, for people without hardware.

The port is a pseudo-terminal, which programs open as they open a real card's port.
"""

import os
import pty
import tty
from collections.abc import Callable, Collection
from contextlib import suppress
from time import monotonic, sleep

from miburi.card.settings import CardSettings
from miburi.emulation.body import EmulatedRobot
from miburi.emulation.firmware import EmulatedCard
from miburi.robot import Robot

#: Seconds between two updates of the card.
_TICK = 0.005
#: The most time, in s, by which the card's clock advances in one update; on a slow machine the
#: clock lags.
_PATIENCE = 0.05


def serve(
    robot: Robot,
    seconds: float,
    tell: Callable[[str], None],
    unplugged: Collection[int] = (),
    renumbered: tuple[int, int] | None = None,
) -> None:
    """Run a card in real time on a pseudo-terminal; call ``tell`` with a sentence that names it.

    The card drives ``robot`` for ``seconds``, or for ever if ``seconds`` is 0. The servos with the
    numbers in ``unplugged`` are silent. The servo with the first number in ``renumbered`` gets the
    second number instead.

    Raises
    ------
    BodyError
        The firmware or the emulated processor has not been built.
    """
    card = EmulatedRobot(robot, CardSettings.of(robot))
    for servo in card.bus.servos:
        servo.dead = servo.get("id") in unplugged
        if renumbered is not None and servo.get("id") == renumbered[0]:
            servo.set("id", renumbered[1])
    ours, theirs = pty.openpty()
    try:
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        tell(f"The card is at {os.ttyname(theirs)} (Ctrl-C ends it)")
        began = last = monotonic()
        while not seconds or last - began < seconds:
            now = monotonic()
            pump(card, ours, card.now() + min(now - last, _PATIENCE))
            last = now
            sleep(_TICK)
    finally:
        os.close(ours)
        os.close(theirs)
        card.close()


def pump(card: EmulatedCard, port: int, until: float) -> None:
    """Run the card until ``until`` s, and carry bytes between it and a file descriptor."""
    with suppress(BlockingIOError):
        card.write(os.read(port, 4096))
    card.wait(until)
    data = card.read(until)
    if data:
        with suppress(BlockingIOError):  # if nobody reads, bytes are lost, as on a real line
            os.write(port, data)
