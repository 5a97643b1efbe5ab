"""How much memory a flood of pages costs the server, and whether it is freed.

    python bench/studio/pages.py [--floods 3] > bench/studio/pages.txt

From twenty addresses of this computer somebody asks for the studio's page for 40 s, as fast as it
is refused, and lets 60 s pass; and again. Prints the server's resident memory (MB) each time.
"""

import argparse
import os
import socket
import threading
import time
from collections import Counter
from pathlib import Path

from programs import partner, print_load

FLOOD, QUIET, ADDRESSES = 40.0, 60.0, 20
PAGE = b"GET / HTTP/1.1\r\nHost: localhost\r\nAccept: text/html\r\nConnection: close\r\n\r\n"


def memory(parent: int) -> int:
    """Return the resident memory of the largest child, MB."""
    children = Path(f"/proc/{parent}/task/{parent}/children").read_text(encoding="utf-8").split()
    pages = (
        int(Path(f"/proc/{one}/statm").read_text(encoding="utf-8").split()[1]) for one in children
    )
    return max(pages) * os.sysconf("SC_PAGE_SIZE") // 2**20


def ask(place: tuple[str, int], home: str, until: float, answers: Counter[str]) -> None:
    while time.perf_counter() < until:
        try:
            with socket.create_connection(place, 5, (home, 0)) as line:
                line.sendall(PAGE)
                answers[line.recv(12)[9:12].decode() or "closed"] += 1
        except OSError as error:
            answers[type(error).__name__] += 1
        time.sleep(0.05)  # a refusal costs little; so many threads are enough


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--floods", type=int, default=3)
    wish = parser.parse_args()
    with partner() as one:
        print(f"before: {memory(one.pid)} MB")
        for _ in range(wish.floods):
            answers: Counter[str] = Counter()
            until, most = time.perf_counter() + FLOOD, 0
            askers = [
                threading.Thread(target=ask, args=(one.place, f"127.0.1.{k}", until, answers))
                for k in range(1, 1 + ADDRESSES)
            ]
            for asker in askers:
                asker.start()
            while any(asker.is_alive() for asker in askers):
                most = max(most, memory(one.pid))
                time.sleep(0.5)  # between two looks
            time.sleep(QUIET)  # in which the server may let go
            print(f"at most {most} MB, {QUIET:.0f} s later {memory(one.pid)} MB; "
                  f"answers: {dict(answers.most_common())}", flush=True)  # fmt: skip
    print_load()


if __name__ == "__main__":
    main()
