"""Serve a study until Ctrl-C or SIGTERM, on an address of its own."""

import signal
import socket
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import uvicorn

from miburi.errors import InputError
from miburi.feelings import Expression
from miburi.interface.access import is_loopback
from miburi.interface.http import configure
from miburi.studies.study.pages import make_app
from miburi.studies.study.plan import Study
from miburi.studies.study.store import Store

__all__ = ["serve_study"]


def serve_study(
    study: Study,
    store: Store,
    films: Mapping[str, Path],
    host: str,
    port: int,
    ready: Callable[[int], None],
    perform: Callable[[Expression], None] | None = None,
) -> None:
    """Serve a study's pages; ``ready`` is told the port once they can be opened.

    ``perform`` lets the robot in the room make a gesture.

    On a loopback address only this computer may ask. On any other, everybody who reaches it may
    take part.

    Raises
    ------
    InputError
        The address or the port cannot be used.
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
        app = make_app(study, store, films, local=is_loopback(host), perform=perform)
        _Server(configure(app)).run(sockets=[listener])


class _Server(uvicorn.Server):
    """Ctrl-C and SIGTERM are its good end; uvicorn would raise them again."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Take both signals while the server runs."""
        kept = {n: signal.signal(n, self.handle_exit) for n in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in kept.items():
                signal.signal(number, handler)
