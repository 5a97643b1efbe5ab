"""A queue of commands, which the loop runs between two steps.

Any thread may ask; only the loop calls :meth:`Commands.run`. Callers are answered at the end of the
step (:meth:`Commands.settle`), so the next state that they read shows the effect.

Stop bypasses the queue: it is accepted even if the queue is full, runs first, is answered at once,
and cannot be cancelled.
"""

import queue
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from typing import Any, TypeVar

from miburi.errors import BodyError, MiburiError
from miburi.ground.log import log_once
from miburi.partner import UnsettledError
from miburi.serving.press import By, Press

#: How many commands may wait for the next step.
WAITING = 256
#: How many ids of Stops are kept, so that a second copy of a Stop is recognised (our choice).
NAMED = 64
#: Why a release older than the latest Stop is refused.
STOP_SINCE = "Stop was pressed after that release; release the body again to go on."

Result = TypeVar("Result")
Command = Callable[[], Any]


class BusyError(MiburiError):
    """Too many commands are waiting."""


class Commands:
    """The waiting commands; ``stop`` stops the body, and is told who pressed Stop."""

    def __init__(self, stop: Callable[[By], None]) -> None:
        self._stop = stop
        self._waiting: queue.Queue[tuple[Command, Future[Any]]] = queue.Queue(WAITING)
        self._lock = threading.Lock()
        self._next_stop: Future[None] | None = None
        self._press = Press()
        self._known: deque[str] = deque(maxlen=NAMED)
        self._stops = 0
        self._early: list[tuple[Command, Future[Any]]] = []
        self._done: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()

    def ask(self, command: Callable[[], Result]) -> Future[Result]:
        """Let the loop run a command; return a future for the result or the error.

        Raises BusyError if too many are waiting.
        """
        future: Future[Result] = Future()
        try:
            self._waiting.put_nowait((command, future))
        except queue.Full:
            message = f"{WAITING} commands are waiting already; ask again in a moment."
            raise BusyError(message) from None
        return future

    def ask_unless_stopped(self, command: Callable[[], Result]) -> Future[Result]:
        """Let the loop run a command, unless a Stop arrives before it runs."""
        stops = self._stops

        def run() -> Result:
            if self._stops != stops:
                raise BodyError(STOP_SINCE)
            return command()

        return self.ask(run)

    def stop(self, press: Press) -> Future[None]:
        """Stop the body before any other command runs.

        Stops that arrive before the body has been stopped share one future.

        A second copy of a Stop has no effect, and does not cancel a release.
        """
        with self._lock:
            copy = press.names is not None and press.names.issubset(self._known)
            if self._next_stop is not None:
                self._press = Press.both(self._press, press)
            elif copy:
                done: Future[None] = Future()
                done.set_result(None)
                return done
            else:
                self._next_stop = Future()
                self._next_stop.set_running_or_notify_cancel()  # now it cannot be cancelled
                self._press = press
            if not copy:
                self._stops += 1
                self._known.extend(press.names or ())
            return self._next_stop

    def run(self) -> None:
        """Stop the body if requested, then run the waiting commands.

        A command that fails because the stopped body is not at rest yet runs again at the next
        call.
        """
        with self._lock:
            stop, press, self._next_stop = self._next_stop, self._press, None
        if stop is not None:
            _run(partial(self._stop, press.by), stop)()
        waiting, self._early = self._early, []
        with suppress(queue.Empty):
            waiting += [self._waiting.get_nowait() for _ in range(self._waiting.qsize())]
        for command, future in waiting:
            if future.cancelled():
                continue
            try:
                self._done.put(_run(command, future))
            except UnsettledError:
                self._early.append((command, future))

    def settle(self) -> None:
        """Answer the commands that have run; any thread may call this, such as the watchdog."""
        with suppress(queue.Empty):
            while True:
                self._done.get_nowait()()


def _run(command: Command, future: Future[Any]) -> Callable[[], None]:
    """Run a command; return a function that delivers the result or the error."""
    try:
        answer = partial(future.set_result, command())
    except UnsettledError:
        raise
    except Exception as error:
        if not isinstance(error, MiburiError):
            log_once("a wish has failed", error)
        answer = partial(future.set_exception, error)

    def tell() -> None:
        if future.running() or future.set_running_or_notify_cancel():
            answer()

    return tell
