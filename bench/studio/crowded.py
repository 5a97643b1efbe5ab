"""Is Stop answered while twenty addresses hold all the connections that there are?

    python bench/studio/crowded.py [--stops 1000] > bench/studio/crowded.txt

Starts `miburi run --https` with 1,024 files. From twenty addresses come 2,000 connections, half of
them to each port. They ask for the state again and again, say half a head or half of a handshake,
or nothing, and come again when they are closed. Stop is pressed from another address over a new
connection each time, by http and by https in turn, and once more if that breaks.
"""

import argparse
import asyncio
import os
import re
import resource
import ssl
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import suppress
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from pathlib import Path
from urllib.parse import urlsplit

FILES, ADDRESSES, EACH = 1024, 20, 100
ASKS, HALF = b"GET /api/v1/state HTTP/1.1\r\nHost: localhost\r\n\r\n", b"GET / HTTP/1.1\r\nX: "
SAID = ((ASKS, HALF, b""), (b"\x16\x03\x01\x02\x00\x01", HALF, b""))
PLAIN, SAFE = 0, 1


async def hold(ports: tuple[int, int], number: int) -> None:
    kind = number // ADDRESSES % 2
    said = SAID[kind][number % 3]
    while True:
        with suppress(OSError):
            reader, writer = await asyncio.open_connection(
                "127.0.0.1", ports[kind], local_addr=(f"127.0.1.{1 + number % ADDRESSES}", 0)
            )
            while True:
                writer.write(said)
                if not await reader.read(65_536):
                    break
            writer.close()
        await asyncio.sleep(0.2)  # it will be closed again


async def flood(ports: tuple[int, int]) -> None:
    await asyncio.gather(*(hold(ports, number) for number in range(ADDRESSES * EACH)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stops", type=int, default=1000)
    wish = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_NOFILE, (4096, 4096))
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(
            ["prlimit", f"--nofile={FILES}", sys.executable, "-m", "miburi", "run", "--headless",
             "--https", "--port", "0", "--folder", folder, "--forget"],
            stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        try:
            assert process.stdout is not None
            said = ""
            while "On a phone" not in said:
                said += process.stdout.readline()
            threading.Thread(target=process.stdout.read, daemon=True).start()
            plain, safe = (
                urlsplit(re.findall(rf"{kind}://[\d.]+:\d+", said)[0]) for kind in ("http", "https")
            )
            assert plain.port is not None
            assert safe.port is not None
            assert safe.hostname is not None
            run = flood((plain.port, safe.port))
            threading.Thread(target=asyncio.run, args=(run,), daemon=True).start()
            time.sleep(3.0)  # by then all have come
            token = (Path(folder) / "token").read_text(encoding="utf-8").strip()
            trust = ssl.create_default_context(cafile=str(Path(folder) / "https" / "ca.pem"))
            took: tuple[list[float], list[float]] = ([], [])
            again, lost = [0, 0], [0, 0]
            for number in range(wish.stops):
                kind = number % 2
                begin = time.perf_counter()
                for attempt in (1, 2):
                    line = (
                        HTTPSConnection(safe.hostname, safe.port, timeout=3, context=trust)
                        if kind == SAFE
                        else HTTPConnection("127.0.0.1", plain.port, timeout=3)
                    )
                    with suppress(OSError, HTTPException):
                        own = {"Authorization": f"Bearer {token}"} if kind == SAFE else {}
                        line.request("POST", "/api/v1/stop", headers=own)
                        if line.getresponse().status == 204:
                            took[kind].append(time.perf_counter() - begin)
                            break
                    line.close()
                    again[kind] += attempt == 1
                else:
                    lost[kind] += 1
                line.close()
        finally:
            process.kill()
            process.wait()
    for kind, name in ((PLAIN, "http"), (SAFE, "https")):
        times = sorted(took[kind]) or [float("nan")]
        print(f"by {name}: answered {len(took[kind])} of {wish.stops // 2}; sent a second time: "
              f"{again[kind]}; lost: {lost[kind]}; median {1000 * times[len(times) // 2]:.0f} ms, "
              f"longest {1000 * times[-1]:.0f} ms")  # fmt: skip
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


if __name__ == "__main__":
    main()
