"""Start what the programs beside this file measure: a partner, and a broker."""

import os
import re
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit


class Partner(NamedTuple):
    """A running `miburi run`."""

    pid: int
    url: str

    @property
    def place(self) -> tuple[str, int]:
        """Host and port."""
        where = urlsplit(self.url)
        assert where.hostname
        assert where.port
        return where.hostname, where.port


def command(folder: Path | str, *options: str) -> list[str]:
    """Return the command that runs a partner on a free port."""
    own = ["--headless", "--port", "0", "--folder", str(folder), "--forget"]
    return [sys.executable, "-m", "miburi", "run", *own, *options]


@contextmanager
def partner(*options: str) -> Iterator[Partner]:
    """Run a partner with a folder of its own."""
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(command(folder, *options), stdout=subprocess.PIPE, text=True)
        try:
            assert process.stdout is not None
            found = re.search(r"http://[\d.:]+", process.stdout.readline())
            assert found
            yield Partner(process.pid, found.group())
        finally:
            process.terminate()
            process.wait()


@contextmanager
def broker() -> Iterator[int]:
    """Run Mosquitto without limits on its queues; yields its port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "mosquitto.conf"
        config.write_text(
            f"listener {port} 127.0.0.1\nallow_anonymous true\nmax_queued_messages 0\n",
            encoding="utf-8",
        )
        process = subprocess.Popen(["mosquitto", "-c", config], stderr=subprocess.DEVNULL)
        try:
            while not _listens(port):
                process.poll()
                assert process.returncode is None, "the broker has ended"
            yield port
        finally:
            process.terminate()
            process.wait()


def _listens(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), 1.0).close()
    except OSError:
        return False
    return True


def print_load() -> None:
    """Print how busy the machine was."""
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
