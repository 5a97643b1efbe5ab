"""Bodies by name: what a partner can be given to move."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec

from miburi.bodies.base import Body
from miburi.contact import Rule
from miburi.errors import BodyError, InputError
from miburi.robot import Robot


@dataclass(frozen=True)
class Kind:
    """A kind of body.

    Attributes
    ----------
    name
        What people call it.
    module
        Where it is made; a kind whose module is missing is not available.
    make
        Robot, port and contact rule to a body at neutral.
    needs_port
        Whether it must be told a serial port.
    """

    name: str
    module: str
    make: Callable[[Robot, str | None, Rule | None], Body]
    needs_port: bool = False

    @property
    def available(self) -> bool:
        """Whether this installation has it."""
        return find_spec(self.module) is not None


def _simulated(robot: Robot, _port: str | None, rule: Rule | None) -> Body:
    from miburi.bodies.simulated import Simulated

    return Simulated(robot, rule)


def _emulated_card(robot: Robot, _port: str | None, rule: Rule | None) -> Body:
    from miburi.bodies.emulated_card import EmulatedBody

    return EmulatedBody(robot, rule)


def _card(robot: Robot, port: str | None, _rule: Rule | None) -> Body:
    body: Body = import_module("miburi.bodies.card").Card(port, robot)
    return body


KINDS = {
    kind.name: kind
    for kind in (
        Kind("simulated", "miburi.bodies.simulated", _simulated),
        Kind("emulated-card", "miburi.bodies.emulated_card", _emulated_card),
        Kind("card", "miburi.bodies.card", _card, needs_port=True),
    )
}


def make_body(name: str, robot: Robot, port: str | None = None, rule: Rule | None = None) -> Body:
    """Make a body at neutral.

    Parameters
    ----------
    name
        One of ``KINDS``.
    robot
        The description.
    port
        The serial port of a card, such as ``/dev/ttyACM0``.
    rule
        The contact rule of a simulated body, by default the robot's own; a card has its own.

    Raises
    ------
    InputError
        There is no such kind, or it needs a port and none is given.
    BodyError
        This installation does not have it, or the body cannot be reached.
    """
    if name not in KINDS:
        raise InputError(f"the body must be one of {', '.join(KINDS)}, got {name!r}.")
    kind = KINDS[name]
    if not kind.available:
        there = ", ".join(other.name for other in KINDS.values() if other.available)
        raise BodyError(f"this installation has no {name} body; it has: {there}.")
    if kind.needs_port and not port:
        raise InputError(f"the {name} body needs a serial port, such as /dev/ttyACM0 (--serial).")
    return kind.make(robot, port, rule)
