"""How many files a process may have open: each connection takes one or two."""

import logging

from miburi.errors import InputError

#: How many files each process needs besides its connections (our choice).
OWN = 64
#: To how many files the limit is raised, and with fewer than how many a warning is logged, and the
#: server does not start (our choice).
_WANTED, _ENOUGH, _LEAST = 4096, 1024, 128
_HOW = "Raise the limit: `ulimit -n 1024`, or LimitNOFILE=1024 in a systemd unit."
_LOG = logging.getLogger(__name__)


def may_open() -> int:
    """Return how many files this process may have open."""
    try:
        import resource
    except ModuleNotFoundError:  # Windows has no such limit
        return _WANTED
    soft = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    return _WANTED if soft == resource.RLIM_INFINITY else soft


def raise_limit() -> None:
    """Let this process, and those that it starts, open as many files as are wanted and allowed.

    Raises
    ------
    InputError
        So few are allowed that the server would answer nobody.
    """
    soft = may_open()
    if soft < _WANTED:
        import resource

        hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
        soft = _WANTED if hard == resource.RLIM_INFINITY else min(_WANTED, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    if soft < _LEAST:
        raise InputError(f"only {soft} files may be open here, and {_LEAST} are needed. {_HOW}")
    if soft < _ENOUGH:
        lasting = lasting_of(for_connections())
        _LOG.warning(
            "only %d files may be open here, so %d pages and streams at most can follow the "
            "partner at once. %s", soft, lasting, _HOW,
        )  # fmt: skip


def for_connections() -> int:
    """Return how many files this process may use for connections."""
    return may_open() - OWN


def lasting_of(files: int) -> int:
    """Return how many WebSockets and streams may be open with so many files for connections.

    Each takes two files, and a third of all is for the others: one of them may be a Stop.
    """
    return files // 3
