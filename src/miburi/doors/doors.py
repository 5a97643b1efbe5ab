"""The doors: interfaces besides HTTP that a user can switch on.

A door's libraries come with an extra of the package, and are loaded when it is opened. Another
package may ship a door, too: a function that takes the application and the partner, as an entry
point of the group ``miburi.doors``.
"""

import logging
from dataclasses import dataclass, field
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from threading import Timer
from traceback import extract_tb
from typing import TYPE_CHECKING

from miburi.doors.broker import Broker
from miburi.doors.ros_network import RosNetwork
from miburi.errors import InputError, need
from miburi.live.view import LivePartner
from miburi.talk.care import Care
from miburi.talk.endpoint import Endpoint
from miburi.talk.synthesizer import Synthesizer

if TYPE_CHECKING:  # the process of the partner's loop needs no web library
    from fastapi import FastAPI


_LOG = logging.getLogger(__name__)
_OTHERS = "miburi.doors"
#: After this long, s, a door of another package that has not opened is named (our choice).
PATIENCE = 5.0


@dataclass(frozen=True)
class Doors:
    """The settings of the doors that are open."""

    agents: bool = False  # whether agents may connect (MCP)
    broker: Broker | None = None  # a home's broker, if any
    name: str = "miburi"  # the partner's name there
    talk: Endpoint | None = None  # the language model; None: built-in answers
    ros: RosNetwork | None = None  # the network of ROS 2 nodes, if any
    voice: Synthesizer | None = None  # None: the pages' devices speak
    care: Care = field(default_factory=Care)  # the words for somebody in distress
    origins: frozenset[str] = frozenset()  # other origins whose pages may use the interface
    seed: int = 0  # for choosing among built-in answers
    packages: tuple[str, ...] = ()  # the names of other packages' doors

    def need(self) -> None:
        """Check that the libraries of all open doors are installed.

        Raises InputError if no installed package ships one of the ``packages``' doors; MiburiError
        if a library is not installed.
        """
        shipped = {each.name: each.module for each in entry_points(group=_OTHERS)}
        for name in self.packages:
            if name not in shipped:
                known = ", ".join(sorted(shipped)) or "none"
                raise InputError(
                    f"--door: no installed package ships a door {name!r}; installed: {known}."
                )
            if find_spec(shipped[name].partition(".")[0]) is None:
                raise InputError(
                    f"--door {name}: its module {shipped[name]} is missing; install its package "
                    "again."
                )
        if self.agents:
            need("mcp", "mcp")
        if self.broker is not None:
            need("aiomqtt", "mqtt")
        if self.ros is not None:
            need("cyclonedds", "ros")

    def open(self, app: "FastAPI", partner: LivePartner, studio: str | None = None) -> None:
        """Add the doors to a partner's application; other devices reach its pages at ``studio``."""
        if self.voice is not None:
            from miburi.doors.voice import voice_router

            app.include_router(voice_router(partner, self.voice))
        if studio is not None and find_spec("zeroconf") is not None:
            from miburi.serving.announce import announce
            from miburi.serving.beside import live_beside

            live_beside(app, lambda: announce(self.name, studio))
        if self.agents:
            from miburi.doors.agents import add_agents

            add_agents(app)
        if self.broker is not None:
            from miburi.doors.home import add_home

            add_home(app, partner, self.broker, self.name, studio)
        if self.ros is not None:
            from miburi.doors.ros import add_ros

            add_ros(app, partner, self.ros)
        for name in dict.fromkeys(self.packages):
            _open_other(entry_points(group=_OTHERS)[name], app, partner)


def _open_other(door: EntryPoint, app: "FastAPI", partner: LivePartner) -> None:
    """Open another package's door; while it takes long, say so.

    Raises InputError if it fails; the message names the door, the line and the reason.
    """
    what = f"the door {door.name} ({door.value})"
    waiting = Timer(
        PATIENCE,
        _LOG.warning,
        ("waiting for %s, which has not returned yet; start a thread for long work", what),
    )
    waiting.daemon = True
    waiting.start()
    try:
        door.load()(app, partner)
    except Exception as error:
        last = extract_tb(error.__traceback__)[-1]
        at = "" if last.filename == __file__ else f" in {last.filename}, line {last.lineno}"
        raise InputError(
            f"{what} failed{at}: {type(error).__name__}: {error}. It must be a function that "
            "takes the application and the partner. Mend it, or leave --door out."
        ) from error
    finally:
        waiting.cancel()
