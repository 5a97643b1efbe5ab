"""The partner's side of the crossing: answers what the server's process asks of the runner."""

import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from typing import Any

from miburi.errors import BodyError, MiburiError
from miburi.live.crossing import LONG, Answer, Ask, Cancel, Hello, Lanes, Latest, Look, Post, Ready
from miburi.live.runner import Runner
from miburi.live.state import MotorsOut
from miburi.live.watchdog import Watchdog

__all__ = ["UNSERVED", "answer"]

#: s that the server may serve nobody (ours).
UNSERVED = 3.0
_SLOW_THREADS = 4


def answer(
    runner: Runner,
    ends: Lanes,
    on_ready: Callable[[], None] = lambda: None,
    on_hang: Callable[[], None] = lambda: None,
) -> None:
    """Answer the server from now on, in threads of their own, until it has gone.

    While a server that listened serves nobody, nobody can press Stop: after 3 s the body is
    stopped.

    Parameters
    ----------
    runner
        The partner.
    ends
        The partner's ends of the pipes.
    on_ready
        Called when the server listens.
    on_hang
        Called when it has served nobody for another 10 s.
    """
    side = _Answering(runner, ends, on_ready, on_hang)
    for work in (side.answer_all, side.stop_all):
        threading.Thread(target=work, name=work.__name__, daemon=True).start()


class _Answering:
    def __init__(
        self,
        runner: Runner,
        ends: Lanes,
        on_ready: Callable[[], None],
        on_hang: Callable[[], None],
    ) -> None:
        self._runner, self._ends, self._on_ready = runner, ends, on_ready
        self._watchdog = Watchdog(UNSERVED, self._stop, on_hang)
        self._beats = 0
        self._over = threading.Event()
        self._stops = 0
        self._motors: MotorsOut | None = None
        self._open: dict[int, Future[Any]] = {}
        self._slow = ThreadPoolExecutor(_SLOW_THREADS, "slow")
        recordings = runner.recordings
        self._quick: dict[str, Callable[..., Future[Any]]] = {
            "stimulate": runner.stimulate,
            "take": runner.take,
            "answer": runner.answer,
            "note_talk": runner.note_talk,
            "speak": runner.speak,
            "perform": runner.perform,
            "pause": runner.pause,
            "hand": runner.hand,
            "temperament": runner.temperament,
        }
        self._waiting: dict[str, Callable[..., Any]] = {
            "use": lambda name, port: runner.use(name, port).result(LONG),
            "kept": recordings.kept,
            "find": recordings.find,
            "start": recordings.start,
            "end": recordings.end,
            "delete": recordings.delete,
        }
        self._post = Post(ends.asking)
        self._post.send(
            Hello(runner.robot, runner.repertoire, runner.temperaments, recordings.limit)
        )

    def _stop(self) -> None:
        print("miburi: the server hangs, so the body was stopped.", file=sys.stderr)
        self._runner.stop()

    def stop_all(self) -> None:
        """Stop the body whenever the server says so."""
        with suppress(OSError, EOFError):
            while True:
                self._stops = self._ends.stopping.recv()
                self._runner.stop().add_done_callback(self._tell_of_stop)

    def _tell_of_stop(self, _done: Future[None]) -> None:
        with suppress(OSError):
            self._ends.stopping.send(None)

    def answer_all(self) -> None:
        """Take what the server says, in its turn."""
        with suppress(OSError, EOFError):
            while True:
                match self._ends.asking.recv():
                    case Look(entry, sample, beats):
                        if beats != self._beats:
                            self._beats = beats
                            self._watchdog.beat()
                        self._post.send(self._news(entry, sample))
                    case Ask() as ask:
                        self._begin(ask)
                    case Ready():
                        self._watchdog.beat()
                        watch = self._watchdog.watch
                        threading.Thread(target=watch, args=(self._over,), daemon=True).start()
                        self._on_ready()
                    case Cancel(number):
                        if number in self._open:
                            self._open[number].cancel()
        self._over.set()

    def _news(self, entry: int, sample: int) -> Latest:
        runner, motors = self._runner, self._runner.motors
        new = None if motors is self._motors else motors
        self._motors = motors
        return Latest(runner.snapshot.json, runner.log(entry), runner.samples_after(sample), new)

    def _begin(self, ask: Ask) -> None:
        try:
            if ask.what in self._waiting:
                future: Future[Any] = self._slow.submit(self._waiting[ask.what], *ask.with_)
            elif ask.what == "release":
                future = self._release(ask)
            else:
                future = self._quick[ask.what](*ask.with_)
        except MiburiError as error:
            self._post.send(Answer(ask.number, None, error))
            return
        self._open[ask.number] = future
        future.add_done_callback(partial(self._end, ask.number))

    def _release(self, ask: Ask) -> Future[None]:
        if ask.stops < self._stops:  # a Stop overtakes all else, so this release is the older one
            raise BodyError("Stop has been pressed since; release the body again to go on.")
        (by_person,) = ask.with_
        return self._runner.release(by_person=by_person)

    def _end(self, number: int, future: Future[Any]) -> None:
        self._open.pop(number, None)
        if future.cancelled():
            return
        error = future.exception()
        if error is None:
            self._post.send(Answer(number, future.result(), None))
        elif isinstance(error, MiburiError):
            self._post.send(Answer(number, None, error))
        else:
            words = f"{type(error).__name__}: {error}"
            self._post.send(Answer(number, None, MiburiError(words)))
