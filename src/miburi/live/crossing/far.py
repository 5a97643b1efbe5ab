"""The server's side of the crossing: a live partner whose loop runs in another process."""

import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from pathlib import Path
from selectors import EVENT_READ, DefaultSelector
from typing import Any, cast

from miburi.live.crossing.lanes import (
    LONG,
    Answer,
    Ask,
    AskRecordings,
    Cancel,
    Hello,
    Lanes,
    Latest,
    Look,
    Post,
    Ready,
)
from miburi.live.events.log import History
from miburi.live.events.store import EventStore
from miburi.live.pace import STEP
from miburi.live.recording.archive import Kept
from miburi.live.state import Snapshot
from miburi.live.view import LivePartner, UnreachableError
from miburi.live.wishes import Granted, Release, Wish
from miburi.serving.press import PRESSED, Press

#: The partner counts as unreachable after this time without an answer, in s (our choice).
SILENCE = 1.0
#: The partner counts as silent after this many waits in a row without news. If this process itself
#: has slept, as on a closed laptop, the whole sleep counts as one wait.
_WAITS = 10


class FarPartner(LivePartner):
    """A live partner in another process.

    Raises UnreachableError if the partner's process ended before its first message.

    Parameters
    ----------
    clock
        Returns the time in s, the same in all processes.
    open_store
        Opens the store of events once the partner runs; without a store, only the latest events
        are known.
    """

    def __init__(
        self,
        ends: Lanes,
        clock: Callable[[], float] = time.monotonic,
        open_store: Callable[[], EventStore | None] = lambda: None,
    ) -> None:
        super().__init__()
        self._ends, self._clock = ends, clock
        self._lock = threading.Lock()
        self._open: dict[int, Future[Any]] = {}
        self._number = self._beats = 0
        self._silent = False
        self._pressed = 0.0
        self._press: Press | None = None  # presses since the last Stop was sent
        self._ticks = deque([clock()], maxlen=2)
        self._sent_stop: Future[None] | None = None
        self._next_stop: Future[None] | None = None
        #: Set once the partner's process has ended.
        self.over = threading.Event()
        self._post = Post(ends.asking)
        try:
            hello: Hello = ends.asking.recv()
            store = open_store()
            if store is not None and store.end_of(hello.boot) is None:
                store = None  # the partner could not write there
            self.history = History(hello.boot, hello.first, store)
            self._look()
            self._take(ends.asking.recv())
        except (OSError, EOFError):
            raise UnreachableError from None
        self.robot, self.repertoire = hello.robot, hello.repertoire
        self.temperaments, self.own_temperament = hello.temperaments, hello.temperament
        self.recordings = _FarRecordings(self, hello.limit)
        threading.Thread(target=self._listen, name="listen", daemon=True).start()

    @property
    def reachable(self) -> bool:
        """Whether the partner's process lives and answers."""
        return not (self.over.is_set() or self._silent)

    @property
    def read_until(self) -> float:
        """The time of the last heartbeat but one; everything sent before it has been read."""
        return self._ticks[0]

    def stop(self, press: Press = PRESSED) -> Future[None]:
        """Stop the body before anything else is done.

        Only one Stop is sent at a time. Stops that arrive before its answer are sent together in
        the next message. So a flood of Stops cannot fill the pipe, and no Stop is lost.

        Raises UnreachableError if the partner does not answer; if it recovers later, it stops the
        body then.
        """
        with self._lock:
            self._pressed = self._clock()
            self._press = Press.both(self._press, press)
            if self._next_stop is None:
                self._next_stop = Future()
                self._next_stop.set_running_or_notify_cancel()  # now it cannot be cancelled
            future = self._next_stop
            if self._sent_stop is None:
                self._send_stop()
        self._need_reach()
        return future

    def ask(self, wish: Wish[Granted]) -> Future[Granted]:
        """Send the runner a request; return a future for the answer.

        Raises UnreachableError if the partner does not answer.
        """
        came = self._clock()
        if isinstance(wish, Release):
            came = self.read_until if wish.came is None else wish.came
        return self._send(lambda number: Ask(number, wish, came))

    def ask_recordings(self, what: str, *with_: str) -> Any:
        """Call a method of the recordings, and return its answer."""
        return self._send(lambda number: AskRecordings(number, what, with_)).result(LONG)

    def _send(self, message: Callable[[int], object]) -> Future[Any]:
        self._need_reach()
        future: Future[Any] = Future()
        with self._lock:
            self._number += 1
            number = self._number
            self._open[number] = future
        future.add_done_callback(partial(self._forget, number))
        self._post.send(message(number))
        return future

    def tell_ready(self) -> None:
        """Tell the partner's process that the server is listening."""
        self._post.send(Ready())

    def beat(self) -> None:
        """Record that the server is alive, for the partner's watchdog."""
        self._beats += 1
        self._ticks.append(self._clock())

    def _need_reach(self) -> None:
        if not self.reachable:
            raise UnreachableError

    def _forget(self, number: int, future: Future[Any]) -> None:
        with self._lock:
            self._open.pop(number, None)
        if future.cancelled():
            self._post.send(Cancel(number))

    def _send_stop(self) -> None:
        self._sent_stop, self._next_stop = self._next_stop, None
        with suppress(OSError):
            self._ends.stopping.send((self._pressed, self._press))
        self._press = None

    def _look(self) -> None:
        sample = self._samples[-1][0] if self._samples else 0
        step = self._steps[-1].serial if self._steps else -1
        self._post.send(Look(self.history.number, sample, step, self._beats))

    def _take(self, news: Latest) -> None:
        self.history.add(news.events)
        self._samples.extend(news.samples)
        latest = Snapshot(json=news.state, serial=news.serial)
        known = self._steps[-1].serial if self._steps else -1
        self._steps.extend(Snapshot(json=json, serial=serial) for serial, json in news.steps)
        if news.serial > known:
            self._steps.append(latest)
        self.snapshot = latest  # last, so that its readers find the entries above
        self._serial = news.serial
        if news.motors is not None:
            self.motors = news.motors

    def _listen(self) -> None:
        """Receive the partner's messages, and request news at every step.

        An answer is held back until the state that shows its effect has arrived.
        """
        asking, stopping = self._ends
        ends = DefaultSelector()
        asked = False  # whether requested news has not arrived yet
        due = time.monotonic()
        told: list[Answer] = []
        waits = 0  # in a row, without the requested news
        try:
            for end in self._ends:
                ends.register(end, EVENT_READ)
            while True:
                seen = [answer for answer in told if answer.serial <= self._serial]
                told = [answer for answer in told if answer.serial > self._serial]
                for answer in seen:
                    self._settle(answer.number, answer.result, answer.error)
                now = time.monotonic()
                if not asked and (told or now >= due):
                    self._look()
                    asked, due = True, now + STEP
                wait = SILENCE / _WAITS if asked else max(due - now, 0.0)
                there = ends.select(None if self._silent else wait)
                waits = waits + 1 if asked and not there else 0
                self._silent = waits >= _WAITS
                for key, _ in there:
                    if key.fileobj is stopping:
                        stopping.recv()
                        self._take_stopped()
                        continue
                    match asking.recv():
                        case Latest() as news:
                            self._take(news)
                            asked = False
                        case Answer() as answer:
                            told.append(answer)
        except (OSError, EOFError):
            pass  # the partner's process has ended
        finally:
            ends.close()
            self._lose()

    def _take_stopped(self) -> None:
        with self._lock:
            done, self._sent_stop = self._sent_stop, None
            if self._next_stop is not None:
                self._send_stop()
        if done is not None:
            done.set_result(None)

    def _settle(self, number: int, result: object, error: Exception | None) -> None:
        with self._lock:
            future = self._open.get(number)
        if future is None or not future.set_running_or_notify_cancel():
            return
        if error is None:
            future.set_result(result)
        else:
            future.set_exception(error)

    def _lose(self) -> None:
        """Fail all open requests because the partner has ended."""
        self.over.set()
        with self._lock:
            left = [*self._open]
            stops = [stop for stop in (self._sent_stop, self._next_stop) if stop is not None]
            self._sent_stop = self._next_stop = None
        for number in left:
            self._settle(number, None, UnreachableError())
        for stop in stops:
            stop.set_exception(UnreachableError())


class _FarRecordings:
    """The recordings of a far partner; see :class:`miburi.live.view.Recordings`."""

    def __init__(self, partner: FarPartner, limit: int) -> None:
        self.limit = limit
        self._partner = partner

    @property
    def current(self) -> str | None:
        return self._partner.snapshot.state.recording

    def kept(self) -> list[Kept]:
        return cast("list[Kept]", self._partner.ask_recordings("kept"))

    def find(self, name: str) -> Path:
        return cast("Path", self._partner.ask_recordings("find", name))

    def start(self) -> None:
        self._partner.ask_recordings("start")

    def end(self) -> None:
        self._partner.ask_recordings("end")

    def delete(self, name: str) -> None:
        self._partner.ask_recordings("delete", name)
