"""What half-closed connections cost the reception.

    python bench/studio/half_closed.py [--connections 1000] > bench/studio/half_closed.txt

From five addresses of this computer come connections that say `GET /` and close their half.
Prints the processor time of each process in ten seconds, and in ten quiet ones before.
"""

import argparse
import os
import select
import socket
import time
from pathlib import Path

from programs import partner, print_load

SECONDS = 10.0


def spent(pid: int) -> list[float]:
    """Return the processor time of a process and of its children, s."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="utf-8").split()
    fields = [
        Path(f"/proc/{one}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
        for one in (str(pid), *children)
    ]
    return [(int(one[11]) + int(one[12])) / os.sysconf("SC_CLK_TCK") for one in fields]


def shares(pid: int, before: list[float]) -> str:
    return ", ".join(f"{(b - a) / SECONDS:.3f}" for a, b in zip(before, spent(pid), strict=True))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--connections", type=int, default=1000)
    wish = parser.parse_args()
    with partner() as one:
        before = spent(one.pid)
        time.sleep(SECONDS)  # what it costs anyway
        print(f"cores (partner and its children), quiet: {shares(one.pid, before)}")
        before, lines = spent(one.pid), []
        for number in range(wish.connections):
            line = socket.create_connection(one.place, 10, (f"127.0.0.{2 + number % 5}", 0))
            line.sendall(b"GET /")
            line.shutdown(socket.SHUT_WR)
            lines.append(line)
        time.sleep(SECONDS)  # what is measured is what they cost meanwhile
        closed = sum(bool(select.select([line], [], [], 0)[0]) for line in lines)
        print(f"with {wish.connections} half-closed: {shares(one.pid, before)}; "
              f"{closed} were closed")  # fmt: skip
    print_load()


if __name__ == "__main__":
    main()
