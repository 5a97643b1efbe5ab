"""Is Stop answered while twenty addresses hold all the connections that there are?

    python bench/studio/crowded.py [--stops 1000] > bench/studio/crowded.txt

Starts `miburi run` with 1,024 files. From twenty addresses come 2,000 connections, which ask for
the state again and again, say half a head, or nothing, and come again when they are closed. Stop is
pressed from another address over a new connection each time, and once more if that breaks.
"""

import argparse
import asyncio
import os
import re
import resource
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import suppress
from http.client import HTTPConnection, HTTPException
from urllib.parse import urlsplit

FILES, ADDRESSES, EACH = 1024, 20, 100
SAID = (b"GET /api/v1/state HTTP/1.1\r\nHost: localhost\r\n\r\n", b"GET / HTTP/1.1\r\nX: ", b"")


async def hold(host: str, port: int, number: int) -> None:
    said = SAID[number % len(SAID)]
    while True:
        with suppress(OSError):
            reader, writer = await asyncio.open_connection(
                host, port, local_addr=(f"127.0.1.{1 + number % ADDRESSES}", 0)
            )
            while True:
                writer.write(said)
                if not await reader.read(65_536):
                    break
            writer.close()
        await asyncio.sleep(0.2)  # it will be closed again


async def flood(host: str, port: int) -> None:
    await asyncio.gather(*(hold(host, port, number) for number in range(ADDRESSES * EACH)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stops", type=int, default=1000)
    wish = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_NOFILE, (4096, 4096))
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(
            ["prlimit", f"--nofile={FILES}", sys.executable, "-m", "miburi", "run", "--headless",
             "--port", "0", "--folder", folder, "--forget"], stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        try:
            assert process.stdout is not None
            found = re.search(r"http://[\d.:]+", process.stdout.readline())
            assert found
            where = urlsplit(found.group())
            assert where.hostname is not None
            assert where.port is not None
            run = flood(where.hostname, where.port)
            threading.Thread(target=asyncio.run, args=(run,), daemon=True).start()
            time.sleep(3.0)  # by then all have come
            took, again, lost = [], 0, 0
            for _ in range(wish.stops):
                begin = time.perf_counter()
                for attempt in (1, 2):
                    line = HTTPConnection(where.hostname, where.port, timeout=3)
                    with suppress(OSError, HTTPException):
                        line.request("POST", "/api/v1/stop")
                        if line.getresponse().status == 204:
                            took.append(time.perf_counter() - begin)
                            break
                    line.close()
                    again += attempt == 1
                else:
                    lost += 1
                line.close()
            took.sort()
        finally:
            process.kill()
            process.wait()
    print(f"answered: {len(took)} of {wish.stops}; sent a second time: {again}; lost: {lost}")
    print(f"median {1000 * took[len(took) // 2]:.0f} ms, longest {1000 * took[-1]:.0f} ms")
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


if __name__ == "__main__":
    main()
