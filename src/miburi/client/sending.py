"""A thread that sends a program's wishes, so that the program need not wait for the answers."""

import logging
import queue
import threading
from collections.abc import Callable
from contextlib import suppress
from time import monotonic

from miburi.errors import MiburiError

#: How many wishes may wait to be sent by :meth:`RemotePartner.soon`.
WAITING = 32
#: How long the end of a connection waits for them, in s (our choice).
FAREWELL = 5.0
_LOG = logging.getLogger(__name__)


class Sender:
    """Sends wishes one after another; logs those that fail."""

    def __init__(self) -> None:
        self._wishes: queue.Queue[Callable[[], object] | None] = queue.Queue(WAITING)
        self._thread = threading.Thread(target=self._send_all, name="wishes", daemon=True)
        self._thread.start()

    def send(self, wish: Callable[[], object]) -> bool:
        """Queue a wish; return whether there was room for it."""
        try:
            self._wishes.put_nowait(wish)
        except queue.Full:
            return False
        return True

    def close(self, patience: float = FAREWELL) -> None:
        """Wait up to ``patience`` s until all is sent; drop what is left, and log how much."""
        end, left = monotonic() + patience, 0
        with suppress(queue.Full):
            self._wishes.put(None, timeout=patience)
            if threading.current_thread() is not self._thread:
                self._thread.join(max(end - monotonic(), 0.0))
        with suppress(queue.Empty):
            while True:
                left += self._wishes.get_nowait() is not None
        self._wishes.put(None)
        if left:
            _LOG.warning("not sent, because the partner took too long: the last %d wishes", left)

    def _send_all(self) -> None:
        while (wish := self._wishes.get()) is not None:
            try:
                wish()
            except MiburiError as error:
                _LOG.warning("a wish was not carried out: %s", error)
            except Exception:  # the program's mistake must not end this thread
                _LOG.exception("a wish was not carried out")
