"""Serve a study until Ctrl-C or SIGTERM."""

import signal
import socket
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import FrameType

import uvicorn

from miburi.errors import InputError
from miburi.serving.heads import is_loopback
from miburi.serving.http import configure
from miburi.studies.study.live import Performer, show
from miburi.studies.study.pages import make_app
from miburi.studies.study.plan import Study
from miburi.studies.study.store import Store


def serve_study(
    study: Study,
    store: Store,
    films: Mapping[str, Path],
    host: str,
    port: int,
    ready: Callable[[int], None],
    robot: Performer | None = None,
) -> None:
    """Serve a study's pages; ``ready`` is called with the port when the pages can be opened.

    ``robot`` makes live gestures. On a loopback address only this computer can connect; on any
    other, anybody who can reach it may take part.

    Raises InputError if the address or the port cannot be used.
    """
    try:
        listener = socket.create_server((host, port))
    except OSError as error:
        raise InputError(
            f"cannot listen on {host} port {port}: {error.strerror or error}. Choose another "
            "--port, or a --host of this computer."
        ) from error
    with listener:
        ready(listener.getsockname()[1])
        ending = threading.Event()
        perform = None if robot is None else partial(show, robot, is_over=ending.is_set)
        app = make_app(study, store, films, local=is_loopback(host), perform=perform)
        _Server(configure(app), ending).run(sockets=[listener])


class _Server(uvicorn.Server):
    """Ends normally on Ctrl-C and SIGTERM, which uvicorn would raise again."""

    def __init__(self, config: uvicorn.Config, ending: threading.Event) -> None:
        super().__init__(config)
        self._ending = ending

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """End the server, and any wait for the robot's gesture."""
        self._ending.set()
        super().handle_exit(sig, frame)

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Handle both signals while the server runs."""
        kept = {n: signal.signal(n, self.handle_exit) for n in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in kept.items():
                signal.signal(number, handler)
