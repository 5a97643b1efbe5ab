"""Logging: each of Miburi's processes writes warnings and tracebacks to stderr."""

import logging
import os
import queue
import sys
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress
from logging.handlers import QueueHandler, QueueListener

from miburi.errors import InputError, MiburiError

LEVELS = ("debug", "info", "warning", "error", "critical")
#: The environment variable that sets the level; child processes inherit it.
VARIABLE = "MIBURI_LOG"
_LOG = logging.getLogger(__name__)
_FORMAT = "miburi: %(message)s"
#: How many records may wait for the terminal, and how many kinds of error are logged (our choice).
_WAITING, _KINDS = 1000, 100
_SEEN: set[tuple[object, ...]] = set()


def log_to_stderr(level: str | None = None, *, apart: bool = False) -> None:
    """Write log records at or above a level to stderr; a second call changes the level.

    ``level`` is one of :data:`LEVELS`; None means the level in the environment variable
    :data:`VARIABLE` or, without one, ``warning``. With ``apart``, a separate thread writes, so that
    a blocked terminal never blocks the caller; records that do not fit its queue are dropped.

    Raises
    ------
    InputError
        The level is unknown.
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
    """Hands records to another thread, and drops them when its queue is full."""

    def enqueue(self, record: logging.LogRecord) -> None:
        with suppress(queue.Full):
            self.queue.put_nowait(record)

    def prepare(self, record: logging.LogRecord) -> logging.LogRecord:
        return record  # the traceback is written by the other thread


def log_once(what: str, error: BaseException) -> None:
    """Log an error with its traceback, once for each type of error and line of code."""
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
    """Run a process's main function; if it raises, log the exception and exit with code 1.

    A :class:`MiburiError` is logged as its message, since that says all.
    """
    log_to_stderr()
    try:
        work(*arguments)
    except MiburiError as error:
        _LOG.critical("%s", error)
        sys.exit(1)
    except Exception:
        _LOG.exception("the process %s has failed", work.__name__)
        sys.exit(1)
