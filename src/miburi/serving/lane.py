"""The path of a Stop: from the reception directly to the partner's process, not via the server."""

import math
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection

import h11

from miburi.ground.log import log_once
from miburi.serving.access import HEADERS, STOP, Gate
from miburi.serving.heads import RefusedError
from miburi.serving.press import BY, PRESS, Press, press
from miburi.serving.relay import Guest

#: The time between two heartbeats, and the time after which a Stop counts as undelivered, in s (our
#: choice).
BEAT, SILENCE = 1.0, 1.0
_WISHES = {b"upgrade", b"expect"}
_NO_ANSWER = "the partner cannot be reached; as soon as it can, its body will stop."


class Lane:
    """Checks Stops, and sends them one at a time.

    Parameters
    ----------
    partner
        The connection to the partner's process. A message is the time and the press of a Stop, or
        None, which is a heartbeat. The process sends None back once it has handled a message.
    gate
        Decides who may stop the partner.
    answer
        Answers a client with a status and a message.
    clock
        Returns the time in s, on a clock that all processes share.
    """

    def __init__(
        self,
        partner: Connection,
        gate: Gate,
        answer: Callable[[Guest, int, str], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._partner, self._gate, self._answer, self._clock = partner, gate, answer, clock
        self._waiting: list[Guest] = []
        self._press: Press | None = None  # presses since the last Stop was sent
        self._sent: list[Guest] = []
        self._asked = False  # whether the partner has yet to answer
        self._told = -math.inf  # so that the first heartbeat is due

    def lets_in(self, guest: Guest, head: bytes) -> bool:
        """Whether this is a Stop that the gate lets in; the server answers everything else."""
        reader = h11.Connection(h11.SERVER, HEADERS)
        try:
            reader.receive_data(head)
            request, end = reader.next_event(), reader.next_event()
        except h11.RemoteProtocolError:
            return False
        if not isinstance(request, h11.Request) or not isinstance(end, h11.EndOfMessage):
            return False  # it brings a body
        headers = [*request.headers]
        if request.http_version != b"1.1" or not _WISHES.isdisjoint(dict(headers)):
            return False  # more than a Stop
        guest.ends = reader.their_state is h11.MUST_CLOSE
        known = {name: value.decode("latin-1") for name, value in headers}
        guest.origin = self._gate.origin_of(STOP, known)
        came = press(known.get(BY.encode(), ""), known.get(PRESS.encode(), ""))
        try:
            self._gate.check(
                {
                    "type": "http",
                    "scheme": "http",
                    "method": "POST",
                    "path": STOP,
                    "headers": headers,
                    "client": guest.client,
                    "server": guest.line.getsockname(),
                }
            )
        except (RefusedError, OSError):
            return False
        except Exception as error:  # the reception must survive any error
            log_once("could not tell who pressed Stop", error)
            return False
        self._press = Press.both(self._press, came)
        return True

    def stop(self, guest: Guest) -> None:
        """Send a client's Stop.

        Stops that arrive before the partner's answer are sent together in the next message.
        """
        self._waiting.append(guest)
        self._send()

    def hear(self) -> bool:
        """Receive the acknowledgement of a message; return False if the process has ended."""
        try:
            self._partner.recv()
        except (OSError, EOFError):
            return False
        sent, self._sent, self._asked = self._sent, [], False
        for guest in sent:
            self._answer(guest, 204, "")
        self._send()
        return True

    def tidy(self, now: float) -> None:
        """Send a heartbeat, and answer clients that have waited too long."""
        if not self._asked and now - self._told >= BEAT:
            self._tell(None)
        for waiting in (self._sent, self._waiting):
            while waiting and now - waiting[0].since > SILENCE:
                self._answer(waiting.pop(0), 503, _NO_ANSWER)

    def _send(self) -> None:
        if self._press is not None and not self._asked:
            self._sent, self._waiting = self._waiting, []
            pressed, self._press = self._press, None
            self._tell((self._clock(), pressed))

    def _tell(self, what: tuple[float, Press] | None) -> None:
        self._asked, self._told = True, self._clock()
        with suppress(OSError):  # its end will be noticed
            self._partner.send(what)
