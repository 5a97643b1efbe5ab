"""The kinds of body that a live partner can move."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from serial.tools.list_ports import comports

from miburi.bodies.base import Body
from miburi.emulation.firmware import is_built
from miburi.errors import InputError
from miburi.robot import Robot
from miburi.safety.contact import Rule


class LiveBody(Body, Protocol):
    """A body that may replace another one while the partner lives."""

    def go_on(self, time: float) -> None:
        """Let the new body's clock go on from ``time``, in s, where that of another body ended."""


@dataclass(frozen=True)
class BodyKind:
    """A kind of body, by its name in commands and requests.

    ``make`` creates a body in its neutral pose from a robot, a port and a contact rule.
    """

    name: str
    make: Callable[[Robot, str | None, Rule | None], LiveBody]
    needs_port: bool = False
    needs_firmware: bool = False  # which `make firmware` builds

    @property
    def available(self) -> bool:
        """Whether this installation has everything that this kind of body needs."""
        return is_built() or not self.needs_firmware


def _simulated(robot: Robot, _port: str | None, rule: Rule | None) -> LiveBody:
    from miburi.bodies.simulated import Simulated

    return Simulated(robot, rule)


def _emulated_card(robot: Robot, _port: str | None, rule: Rule | None) -> LiveBody:
    from miburi.emulation.body import EmulatedBody

    return EmulatedBody(robot, rule)


def _card(robot: Robot, port: str | None, _rule: Rule | None) -> LiveBody:
    from miburi.card.card import Card

    if not port:
        raise InputError(
            "a body on an Arduino card needs a serial port, such as /dev/ttyACM0 (--serial)."
        )
    return Card(port, robot)


KINDS = {
    kind.name: kind
    for kind in (
        BodyKind("simulated", _simulated),
        BodyKind("emulated-card", _emulated_card, needs_firmware=True),
        BodyKind("card", _card, needs_port=True),
    )
}


def check_port(port: str) -> None:
    """Accept only serial ports, so that requests cannot open other files.

    Raises InputError if the system does not list the port.
    """
    if port not in {one.device for one in comports()}:
        raise InputError(
            f"{port!r} is not a serial port that this computer lists; see `miburi card list`. "
            "Any other port must be given when the program is started (--serial)."
        )


def make_body(
    name: str, robot: Robot, port: str | None = None, rule: Rule | None = None
) -> LiveBody:
    """Make a body at neutral, of a kind in ``KINDS``.

    ``rule`` is the contact rule of a simulated body, by default the robot's own; a card has one in
    its firmware.

    Raises InputError if there is no such kind, or if it needs a port and none is given; BodyError
    if the firmware has not been built, or the body cannot be reached.
    """
    if name not in KINDS:
        raise InputError(f"the body must be one of {', '.join(KINDS)}, got {name!r}.")
    return KINDS[name].make(robot, port, rule)
