"""Is Stop answered on a kept connection while the server hangs, whenever it began to?

    python bench/studio/kept.py [--tries 10000] [--seed 1] > bench/studio/kept.txt

Each try sends a request, halts the server's process (SIGSTOP) at a drawn moment, and then presses
Stop on the same connection, whether the request has been answered or not. Half of the moments lie
within 20 ms of the request, half within 2 ms of its answer's arrival, where a connection changes
hands. Then the server goes on.
"""

import argparse
import os
import random
import select
import signal
import socket
import time
from pathlib import Path

from programs import partner, print_load

LOOK = b"GET /api/v1/state HTTP/1.1\r\nHost: localhost\r\n\r\n"
STOP = b"POST /api/v1/stop HTTP/1.1\r\nHost: localhost\r\nMiburi-By: program\r\n\r\n"
DONE = b"HTTP/1.1 204"
PATIENCE, LATE = 3.0, 0.1


def server_of(pid: int) -> int:
    """Return the process id of the server: the child with the most memory."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="utf-8").split()
    return int(max(children, key=lambda one: int(_statm(one).split()[1])))


def _statm(pid: str) -> str:
    return Path(f"/proc/{pid}/statm").read_text(encoding="utf-8")


def hear(line: socket.socket, until: float, wanted: bytes, heard: bytes = b"") -> bytes:
    """Read until something was heard, or until a time, s."""
    while wanted not in heard and (left := until - time.perf_counter()) > 0:
        if select.select([line], [], [], left)[0]:
            more = line.recv(65_536)
            if not more:
                break
            heard += more
    return heard


def attempt(line: socket.socket, server: int, rng: random.Random) -> tuple[bool, float | None]:
    """Halt the server once; return whether the request was answered by then, and Stop after, s."""
    begin = time.perf_counter()
    line.sendall(LOOK)
    if rng.random() < 0.5:
        heard = hear(line, begin + rng.uniform(0.0, 0.02), b"a word that never comes")
    else:
        heard = hear(line, begin + PATIENCE, b"}")
        moment = time.perf_counter() + rng.uniform(0.0, 0.002)
        while time.perf_counter() < moment:
            pass
    os.kill(server, signal.SIGSTOP)
    try:
        pressed = time.perf_counter()
        line.sendall(STOP)
        heard = hear(line, pressed + PATIENCE, DONE, heard)
        took = time.perf_counter() - pressed
    finally:
        os.kill(server, signal.SIGCONT)
    return b"HTTP/1.1 200" in heard, took if DONE in heard else None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tries", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    wish = parser.parse_args()
    rng = random.Random(wish.seed)
    took: list[float] = []
    unanswered = answered = 0
    with partner() as one:
        server, line = server_of(one.pid), None
        for _ in range(wish.tries):
            line = line or socket.create_connection(one.place)
            first, time_of_stop = attempt(line, server, rng)
            answered += first
            if time_of_stop is None:
                unanswered += 1
                line.close()
                line = None
            else:
                took.append(time_of_stop)
            time.sleep(0.02)  # the server catches up, and tells that it serves
    took.sort()
    some = {"median": len(took) // 2, "99 %": -1 - len(took) // 100, "longest": -1}
    words = ", ".join(f"{name} {1000 * took[index]:.1f} ms" for name, index in some.items())
    print(f"{wish.tries} Stops on kept connections; {answered} requests were answered before")
    print(f"no answer within {PATIENCE:g} s: {unanswered}")
    print(f"after more than {LATE:g} s: {sum(one > LATE for one in took)}; {words}")
    print_load()


if __name__ == "__main__":
    main()
