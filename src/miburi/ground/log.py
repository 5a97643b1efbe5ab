"""Logging: every process of ours writes warnings, and tracebacks of what failed, to stderr."""

import logging
import os
import queue
import sys
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress
from logging.handlers import QueueHandler, QueueListener

from miburi.errors import InputError

__all__ = ["LEVELS", "VARIABLE", "log_once", "log_to_stderr", "logged"]

LEVELS = ("debug", "info", "warning", "error", "critical")
#: The environment variable with the level; processes that we start inherit it.
VARIABLE = "MIBURI_LOG"
_LOG = logging.getLogger(__name__)
_FORMAT = "miburi: %(message)s"
#: Records that may wait for the terminal, and kinds of errors that are told once each (ours).
_WAITING, _KINDS = 1000, 100
_SEEN: set[tuple[object, ...]] = set()


def log_to_stderr(level: str | None = None, *, apart: bool = False) -> None:
    """Write log records of a level, and of those above, to stderr; a second call sets the level.

    Parameters
    ----------
    level
        One of :data:`LEVELS`; None: the environment's, or ``warning``.
    apart
        Write in a thread of its own, so that a terminal that takes nothing holds up nobody; what
        does not fit its queue is dropped.

    Raises
    ------
    InputError
        It is none.
    """
    level = (level or os.environ.get(VARIABLE) or "warning").lower()
    if level not in LEVELS:
        raise InputError(f"the log level must be one of {', '.join(LEVELS)}, got {level!r}.")
    os.environ[VARIABLE] = level
    logging.basicConfig(format=_FORMAT)
    if apart:
        waiting: queue.Queue[logging.LogRecord] = queue.Queue(_WAITING)
        writer = logging.StreamHandler()
        writer.setFormatter(logging.Formatter(_FORMAT))
        QueueListener(waiting, writer).start()  # its thread is a daemon
        logging.basicConfig(handlers=[_Dropping(waiting)], force=True)
    logging.getLogger().setLevel(level.upper())
    threading.excepthook = _note_thread


class _Dropping(QueueHandler):
    """Hands records to another thread, and drops what its queue does not take."""

    def enqueue(self, record: logging.LogRecord) -> None:
        with suppress(queue.Full):
            self.queue.put_nowait(record)

    def prepare(self, record: logging.LogRecord) -> logging.LogRecord:
        return record  # the traceback is written by the other thread


def log_once(what: str, error: BaseException) -> None:
    """Log an error with its traceback, unless one of its type came from the same line before."""
    place = traceback.extract_tb(error.__traceback__)[-1:]
    key = (type(error).__name__, *((place[0].filename, place[0].lineno) if place else ()))
    if key not in _SEEN and len(_SEEN) < _KINDS:
        _SEEN.add(key)
        _LOG.error("%s", what, exc_info=error)


def _note_thread(failed: threading.ExceptHookArgs) -> None:
    if failed.exc_value is not None and not isinstance(failed.exc_value, SystemExit):
        name = "?" if failed.thread is None else failed.thread.name
        _LOG.error("the thread %s has failed", name, exc_info=failed.exc_value)


def logged(work: Callable[..., None], *arguments: object) -> None:
    """Do a process's work; what it raises is logged, and ends the process with code 1."""
    log_to_stderr()
    try:
        work(*arguments)
    except Exception:
        _LOG.exception("the process %s has failed", work.__name__)
        sys.exit(1)
