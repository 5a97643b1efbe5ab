"""Logging: each of Miburi's processes writes warnings and tracebacks to stderr.

In a file or a pipe each has its time; on a terminal, somebody sees when it comes.
"""

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
_FORMAT, _TIME = "miburi: %(message)s", "%Y-%m-%dT%H:%M:%S%z"
#: How many records may wait for the terminal, and how many kinds of error are logged (our choice).
_WAITING, _KINDS = 1000, 100
_SEEN: set[tuple[object, ...]] = set()


def log_to_stderr(level: str | None = None, *, apart: bool = False) -> Callable[[], None]:
    """Write log records at or above a level to stderr; a second call changes the level.

    ``level`` is one of :data:`LEVELS`; None means the level in the environment variable
    :data:`VARIABLE` or, without one, ``warning``. With ``apart``, a separate thread writes, so that
    a blocked terminal never blocks the caller; records that do not fit its queue are dropped.
    Return what ends this thread once it has written what waits.

    Raises
    ------
    InputError
        The level is unknown.
    """
    level = (level or os.environ.get(VARIABLE) or "warning").lower()
    if level not in LEVELS:
        raise InputError(f"the log level must be one of {', '.join(LEVELS)}, got {level!r}.")
    os.environ[VARIABLE] = level
    form = _FORMAT if sys.stderr.isatty() else f"%(asctime)s {_FORMAT}"
    logging.basicConfig(format=form, datefmt=_TIME)
    end: Callable[[], None] = logging.getLogger().handlers[0].flush
    if apart:
        waiting: queue.Queue[logging.LogRecord] = queue.Queue(_WAITING)
        writer = logging.StreamHandler()
        writer.setFormatter(logging.Formatter(form, _TIME))
        listener = QueueListener(waiting, writer)
        listener.start()  # its thread is a daemon
        end = listener.stop
        logging.basicConfig(handlers=[_Dropping(waiting)], force=True)
    logging.getLogger().setLevel(level.upper())
    threading.excepthook = _note_thread
    return end


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
    end = log_to_stderr(apart=True)
    try:
        work(*arguments)
    except MiburiError as error:
        _LOG.critical("%s", error)
        sys.exit(1)
    except Exception:
        _LOG.exception("the process %s has failed", work.__name__)
        sys.exit(1)
    finally:
        with suppress(queue.Full):  # a blocked terminal
            end()
