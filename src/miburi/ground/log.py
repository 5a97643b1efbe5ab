"""Logging: every process of ours writes warnings, and tracebacks of what failed, to stderr."""

import logging
import os
import sys
import threading
from collections.abc import Callable

from miburi.errors import InputError

__all__ = ["LEVELS", "VARIABLE", "log_to_stderr", "logged"]

LEVELS = ("debug", "info", "warning", "error", "critical")
#: The environment variable with the level; processes that we start inherit it.
VARIABLE = "MIBURI_LOG"
_LOG = logging.getLogger(__name__)


def log_to_stderr(level: str | None = None) -> None:
    """Write log records of a level, and of those above, to stderr; a second call sets the level.

    Parameters
    ----------
    level
        One of :data:`LEVELS`; None: the environment's, or ``warning``.

    Raises
    ------
    InputError
        It is none.
    """
    level = level or os.environ.get(VARIABLE) or "warning"
    if level not in LEVELS:
        raise InputError(f"the log level must be one of {', '.join(LEVELS)}, got {level!r}.")
    os.environ[VARIABLE] = level
    logging.basicConfig(format="miburi: %(message)s")
    logging.getLogger().setLevel(level.upper())
    threading.excepthook = _note_thread


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
