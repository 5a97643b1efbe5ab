"""An emulated card on a pseudo-terminal: for people without hardware, a port like any other."""

import os
import pty
import tty
from collections.abc import Callable
from contextlib import suppress
from time import monotonic, sleep

from miburi.card.settings import CardSettings
from miburi.emulation.card import EmulatedCard
from miburi.emulation.servos import Bus, Servo
from miburi.robot import Robot

__all__ = ["pump", "serve", "servos"]

#: Seconds that card and clock on the wall may be apart.
_TICK = 0.005
#: A machine that is behind by more, in s, is too slow: then the card's time waits.
_PATIENCE = 0.05


def servos(robot: Robot) -> list[Servo]:
    """Return eight servos at neutral, as :meth:`CardSettings.of` the robot expects them."""
    joints = CardSettings.of(robot).joints
    return [Servo.new(j.servo, j.zero + j.direction * j.neutral) for j in joints]


def serve(robot: Robot, seconds: float, tell: Callable[[str], None]) -> None:
    """Run a card in real time on a pseudo-terminal; ``tell`` is given its name.

    Parameters
    ----------
    robot
        The description that its servos are mounted for.
    seconds
        How long; 0 for ever.

    Raises
    ------
    BodyError
        The firmware or the emulated processor has not been built.
    """
    card = EmulatedCard(Bus(servos(robot)))
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
    """Let the card run until ``until`` s, and carry bytes between it and a file descriptor."""
    with suppress(BlockingIOError):
        card.write(os.read(port, 4096))
    card.wait(until)
    said = card.read(until)
    if said:
        with suppress(BlockingIOError):  # nobody reads: as on a real line, it is lost
            os.write(port, said)
