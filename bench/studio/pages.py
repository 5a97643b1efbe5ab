"""What a flood of pages costs the server's memory, and whether it stays.

    python bench/studio/pages.py [--floods 3] > bench/studio/pages.txt

From twenty addresses of this computer somebody asks for the studio's page for 40 s, as fast as it
is refused, and lets 60 s pass; and again. Prints the server's resident memory (MB) each time.
"""

import argparse
import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path
from urllib.parse import urlsplit

FLOOD, QUIET, ADDRESSES = 40.0, 60.0, 20
PAGE = b"GET / HTTP/1.1\r\nHost: localhost\r\nAccept: text/html\r\nConnection: close\r\n\r\n"


def memory(parent: int) -> int:
    """Return the resident memory of the largest child, MB."""
    children = Path(f"/proc/{parent}/task/{parent}/children").read_text(encoding="utf-8").split()
    pages = (
        int(Path(f"/proc/{one}/statm").read_text(encoding="utf-8").split()[1]) for one in children
    )
    return max(pages) * os.sysconf("SC_PAGE_SIZE") // 2**20


def ask(port: int, home: str, until: float, answers: Counter[str]) -> None:
    while time.perf_counter() < until:
        try:
            with socket.create_connection(("127.0.0.1", port), 5, (home, 0)) as line:
                line.sendall(PAGE)
                answers[line.recv(12)[9:12].decode() or "closed"] += 1
        except OSError as error:
            answers[type(error).__name__] += 1
        time.sleep(0.05)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--floods", type=int, default=3)
    wish = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(
            [sys.executable, "-m", "miburi", "run", "--headless", "--port", "0", "--folder",
             folder, "--forget"], stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        try:
            assert process.stdout is not None
            found = re.search(r"http://[\d.:]+", process.stdout.readline())
            assert found
            port = urlsplit(found.group()).port or 0
            print(f"before: {memory(process.pid)} MB")
            for _ in range(wish.floods):
                answers: Counter[str] = Counter()
                until, most = time.perf_counter() + FLOOD, 0
                askers = [
                    threading.Thread(target=ask, args=(port, f"127.0.1.{k}", until, answers))
                    for k in range(1, 1 + ADDRESSES)
                ]
                for one in askers:
                    one.start()
                while any(one.is_alive() for one in askers):
                    most = max(most, memory(process.pid))
                    time.sleep(0.5)
                time.sleep(QUIET)
                print(f"at most {most} MB, {QUIET:.0f} s later {memory(process.pid)} MB; "
                      f"answers: {dict(answers.most_common())}", flush=True)  # fmt: skip
        finally:
            process.terminate()
            process.wait()
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


if __name__ == "__main__":
    main()
