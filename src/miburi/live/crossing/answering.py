"""The partner's side of the pipes: it answers the requests from the server's process."""

import logging
import math
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

from miburi.errors import BodyError, MiburiError
from miburi.live.commands import STOP_SINCE
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
from miburi.live.runner import Runner
from miburi.live.state import MotorsOut
from miburi.live.watchdog import Watchdog
from miburi.live.wishes import Release
from miburi.serving.press import Press

#: How long the server, or the reception, may hang, s (our choice).
UNSERVED = 3.0
_SLOW_THREADS = 4
_LOG = logging.getLogger(__name__)


class Answering:
    """Answers the server in separate threads, until it disconnects.

    If the server hangs after its start, nobody can watch the body on a page. If the process that
    receives Stops (the reception) hangs, nobody can press Stop. When either has hung for 3 s, the
    body is stopped.

    Parameters
    ----------
    on_ready
        Called when the server listens and the reception takes Stops.
    on_hang
        Called when the server, or the reception, has hung for another 10 s.
    reception
        The partner's end of the pipe to a reception.
    """

    def __init__(
        self,
        runner: Runner,
        ends: Lanes,
        on_ready: Callable[[], None] = lambda: None,
        on_hang: Callable[[], None] = lambda: None,
        reception: Connection | None = None,
    ) -> None:
        self._runner, self._ends = runner, ends
        self._on_ready, self._on_hang = on_ready, on_hang
        self._awaited, self._arriving = {"server"}, threading.Lock()
        self._watchdog = Watchdog(UNSERVED, partial(self._stop, "server"), on_hang, apart=True)
        self._beats = 0
        self._over = threading.Event()
        self._pressed = -math.inf
        self._motors: MotorsOut | None = None
        self._open: dict[int, Future[Any]] = {}
        self._slow = ThreadPoolExecutor(_SLOW_THREADS, "slow")
        self._post = Post(ends.asking)
        self._post.send(
            Hello(
                runner.robot,
                runner.repertoire,
                runner.temperaments,
                runner.own_temperament,
                runner.recordings.limit,
                runner.history.boot,
                runner.history.first,
            )
        )
        works: list[Callable[[], None]] = [self._answer_all, partial(self._stop_all, ends.stopping)]
        if reception is not None:
            self._awaited.add("reception")
            works.append(partial(self._stop_all, reception))
        for work in works:
            threading.Thread(target=work, daemon=True).start()

    def _stop(self, who: str) -> None:
        self._runner.stop(Press("partner"))
        _LOG.error("the %s does not respond, so the body was stopped.", who)

    def _stop_all(self, stopping: Connection) -> None:
        """Stop the body at each message with a press of Stop; None is only a heartbeat."""
        watchdog = None

        def tell(_done: Future[None] | None = None) -> None:
            with suppress(OSError):
                stopping.send(None)

        with suppress(OSError, EOFError):
            while True:
                pressed = stopping.recv()
                if watchdog is not None:
                    watchdog.beat()
                if pressed is not None:
                    came, press = pressed
                    self._pressed = max(self._pressed, came)
                    self._runner.stop(press).add_done_callback(tell)
                    continue
                tell()
                if watchdog is None:
                    late = partial(self._stop, "reception")
                    watchdog = Watchdog(UNSERVED, late, self._on_hang, apart=True)
                    self._watch("reception", watchdog)

    def _watch(self, who: str, watchdog: Watchdog) -> None:
        """Watch a process that has started; the partner is ready once all have started."""
        threading.Thread(target=watchdog.watch, args=(self._over,), daemon=True).start()
        with self._arriving:
            self._awaited.discard(who)
            last = not self._awaited
        if last:
            self._on_ready()

    def _answer_all(self) -> None:
        with suppress(OSError, EOFError):
            while True:
                match self._ends.asking.recv():
                    case Look() as look:
                        if look.beats != self._beats:
                            self._beats = look.beats
                            self._watchdog.beat()
                        self._post.send(self._news(look))
                    case Ask() as ask:
                        self._begin(ask.number, partial(self._granted, ask))
                    case AskRecordings(number, what, with_):
                        method = getattr(self._runner.recordings, what)
                        self._begin(number, partial(self._slow.submit, method, *with_))
                    case Ready():
                        self._watchdog.beat()
                        self._watch("server", self._watchdog)
                    case Cancel(number):
                        # The runner may already be answering the request.
                        if (future := self._open.get(number)) is not None:
                            future.cancel()
        self._over.set()

    def _news(self, look: Look) -> Latest:
        runner, motors = self._runner, self._runner.motors
        new = None if motors is self._motors else motors
        self._motors = motors
        latest = runner.snapshot
        steps = [step for step in runner.steps_after(look.step) if step.serial < latest.serial]
        return Latest(
            latest.serial,
            latest.json,
            [(step.serial, step.json) for step in steps],
            runner.history.after(look.event),
            runner.samples_after(look.sample),
            new,
        )

    def _begin(self, number: int, ask: Callable[[], Future[Any]]) -> None:
        try:
            future = ask()
        except Exception as error:
            self._tell(number, None, error)
            return
        self._open[number] = future
        future.add_done_callback(partial(self._end, number))

    def _granted(self, ask: Ask) -> Future[Any]:
        wish, runner = ask.wish, self._runner
        # A Stop overtakes all else, so a release that came before it is outdated.
        if isinstance(wish, Release) and wish.seen is None and ask.came <= self._pressed:
            raise BodyError(STOP_SINCE)
        if wish.slow:
            return self._slow.submit(lambda: runner.ask(wish).result(LONG))
        return runner.ask(wish)

    def _end(self, number: int, future: Future[Any]) -> None:
        self._open.pop(number, None)
        if future.cancelled():
            return
        error = future.exception()
        self._tell(number, future.result() if error is None else None, error)

    def _tell(self, number: int, result: object, error: BaseException | None) -> None:
        """Send a result, or an error of a class that the other side knows."""
        if error is not None and not isinstance(error, MiburiError):
            error = MiburiError(f"{type(error).__name__}: {error}")
        self._post.send(Answer(number, result, error, self._runner.snapshot.serial))
