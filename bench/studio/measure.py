"""What a live partner costs: processor, memory, and whether its loop keeps its period.

    python bench/studio/measure.py [--minutes 30]

Starts `miburi run`, then lets viewers come: programs that read the WebSocket at 30 Hz, and real
studio pages in headless Chromium. Prints one JSON line for each case: seconds of processor time
of the server per second (share of one core), resident memory in MB, and steps made per step due.
With --minutes, ten programs watch for so long, and memory is told every minute.
"""

import argparse
import asyncio
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
from playwright.sync_api import sync_playwright
from websockets.asyncio.client import connect

CHROMIUM = "/usr/bin/chromium"
FLAGS = ["--no-sandbox", "--disable-gpu", "--use-angle=swiftshader",
         "--enable-unsafe-swiftshader", "--no-first-run"]  # fmt: skip
TICKS = os.sysconf("SC_CLK_TCK")


@contextmanager
def partner() -> Iterator[tuple[str, int]]:
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "miburi",
                "run",
                "--headless",
                "--port",
                "0",
                "--folder",
                folder,
            ],
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert process.stdout
            yield re.search(r"http://[\d.:]+", process.stdout.readline()).group(), process.pid
        finally:
            process.terminate()
            process.wait()


def processor(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def memory(pid: int) -> float:
    status = Path(f"/proc/{pid}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+)", status).group(1)) / 1024


def serial(url: str) -> int:
    return int(httpx.get(url + "/api/v1/state").json()["serial"])


def keep_it_busy(url: str) -> None:
    httpx.post(url + "/api/v1/stimulus", json={"feeling": "happiness", "strength": 1.0})


def measure(url: str, pid: int, case: str, seconds: float) -> None:
    keep_it_busy(url)
    wall, cpu, steps = time.monotonic(), processor(pid), serial(url)
    time.sleep(seconds)
    wall = time.monotonic() - wall
    result = {
        "case": case,
        "core_share": round((processor(pid) - cpu) / wall, 3),
        "memory_mb": round(memory(pid), 1),
        "steps_made_of_due": round((serial(url) - steps) * 0.02 / wall, 3),
    }
    print(json.dumps(result), flush=True)


@contextmanager
def programs(url: str, count: int) -> Iterator[None]:
    """Viewers at 30 Hz, in a process of their own."""
    process = subprocess.Popen([sys.executable, __file__, "--watch", url, str(count)])
    time.sleep(2.0)
    try:
        yield
    finally:
        process.kill()
        process.wait()


async def watch(url: str, count: int) -> None:
    async def one() -> None:
        address = "ws" + url.removeprefix("http") + "/api/v1/live?rate=30"
        async for _ in await connect(address):
            pass

    await asyncio.gather(*(one() for _ in range(count)))


def pages(url: str, pid: int, count: int, seconds: float) -> None:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        for _ in range(count):
            page = browser.new_page(viewport={"width": 1180, "height": 500})
            page.goto(url + "/?quality=low", timeout=120_000)
        page.wait_for_timeout(5000)
        measure(url, pid, f"studio pages: {count}", seconds)
        browser.close()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--watch", nargs=2)
    wish = parser.parse_args()
    if wish.watch:
        asyncio.run(watch(wish.watch[0], int(wish.watch[1])))
        return
    with partner() as (url, pid):
        if wish.minutes:
            with programs(url, 10):
                for minute in range(wish.minutes + 1):
                    keep_it_busy(url)
                    print(json.dumps({"minute": minute, "memory_mb": round(memory(pid), 1)}),
                          flush=True)  # fmt: skip
                    time.sleep(60.0 if minute < wish.minutes else 0.0)
            return
        measure(url, pid, "nobody", wish.seconds)
        for count in (1, 10, 100):
            with programs(url, count):
                measure(url, pid, f"programs at 30 Hz: {count}", wish.seconds)
        for count in (1, 10):
            pages(url, pid, count, wish.seconds)


if __name__ == "__main__":
    main()
