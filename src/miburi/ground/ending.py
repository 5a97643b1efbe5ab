"""The signals by which a user or the system asks a program to end."""

import signal


def ending_signals() -> list[signal.Signals]:
    """Return Ctrl-C's, SIGTERM, and that of a closed terminal, unless ``nohup`` ignores it."""
    numbers = [signal.SIGINT, signal.SIGTERM]
    closed = getattr(signal, "SIGHUP", None)  # absent on Windows
    if closed is not None and signal.getsignal(closed) is not signal.SIG_IGN:
        numbers.append(closed)
    return numbers
