"""The helper processes and signal handlers that run beside the partner's loop."""

import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import Enum, auto
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from queue import SimpleQueue
from types import FrameType

from miburi.ground.ending import ending_signals
from miburi.ground.log import logged
from miburi.host.given import Pages
from miburi.host.process import serve_pages
from miburi.live.crossing.lanes import Lanes, lanes
from miburi.serving.passing import CAN_PASS
from miburi.serving.reception import receive

#: How long, in s, each helper process may take to exit.
_PATIENCE = 4.0

#: Length of one wait, s: on Windows, signals are handled only between two waits.
GLANCE = 0.5


class Moment(Enum):
    """An event that the partner's process waits for while its loop runs."""

    LISTENS = auto()
    SERVER_ENDED = auto()
    RECEPTION_ENDED = auto()
    HELPER_HANGS = auto()
    LOOP_GAVE_UP = auto()
    SIGNAL = auto()


@dataclass(frozen=True)
class Helpers:
    """The helper processes, and our ends of the pipes to them."""

    processes: tuple[BaseProcess, ...]
    server: Lanes
    reception: Connection | None

    def end(self) -> None:
        """End all helper processes."""
        for process in self.processes:
            process.terminate()
            process.join(_PATIENCE)
            process.kill()


def start_helpers(pages: Pages) -> Helpers:
    """Start the server and, where sockets can be passed on, the reception."""
    ours, theirs = lanes()
    if not CAN_PASS:
        server = _spawn(serve_pages, pages, theirs)
        theirs.close()
        return Helpers((server,), ours, None)
    (inside, outside), (stopping, stopped) = socket.socketpair(), Pipe()
    for end in (inside, outside):
        end.setblocking(False)
    plain, encrypted = pages.listeners.plain, pages.listeners.encrypted
    processes = (
        _spawn(serve_pages, replace(pages, passage=inside), theirs),
        _spawn(receive, plain, encrypted, outside, stopping, pages.reach.keys, pages.doors.origins),
    )
    # Close this process's copies of the helpers' pipe ends, so that each process notices when
    # another has ended.
    theirs.close()
    inside.close()
    outside.close()
    stopping.close()
    return Helpers(processes, ours, stopped)


def _spawn(work: Callable[..., None], *arguments: object) -> BaseProcess:
    spawn = get_context("spawn").Process
    process = spawn(target=logged, args=(work, *arguments), name=work.__name__)
    # Ctrl-C and a closed terminal reach the whole group of processes. Helpers ignore these signals,
    # as this process ends the helpers.
    ignored = [number for number in ending_signals() if number != signal.SIGTERM]
    kept = {number: signal.signal(number, signal.SIG_IGN) for number in ignored}
    try:
        process.start()
    finally:
        for number, handler in kept.items():
            signal.signal(number, handler)
    return process


def watch_process(process: BaseProcess, ended: "Moment", happenings: "SimpleQueue[Moment]") -> None:
    """Wait until a process has ended, then report that."""
    process.join()
    happenings.put(ended)


@contextmanager
def signals(happenings: "SimpleQueue[Moment]") -> Iterator[None]:
    """Turn the signals to end into events."""

    def take(_number: int, _frame: FrameType | None) -> None:
        happenings.put(Moment.SIGNAL)  # the only kind of queue that a signal handler may use

    kept = {number: signal.signal(number, take) for number in ending_signals()}
    try:
        yield
    finally:
        for number, handler in kept.items():
            signal.signal(number, handler)
