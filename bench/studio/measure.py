"""What a live partner costs: processor, memory, and whether its loop keeps its period.

    python bench/studio/measure.py [--seconds 20] [--minutes 30]

Starts `miburi run`, then lets viewers come: programs that read the WebSocket at 30 Hz, and studio
pages in headless Chromium. Ten pages that draw in 3D by software starve a small machine, so that
pages are measured without WebGL, too: the robot is not drawn then, and what the server sends and
is asked is the same. Prints one JSON line for each case: seconds of processor time of the server
per second (share of one core), resident memory in MB, steps made per step due, and the load of
the machine. With --minutes, ten programs and one page watch for so long, and memory is told
every minute.
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
PLAIN = ["--no-sandbox", "--disable-gpu", "--no-first-run"]
SOFTWARE = [*PLAIN, "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
WITHOUT = [*PLAIN, "--disable-3d-apis"]
TICKS = os.sysconf("SC_CLK_TCK")


@contextmanager
def partner(*options: str) -> Iterator[tuple[str, int]]:
    """Run a partner that knows nobody yet; yields its address and its process."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "miburi", "run", "--headless", "--port", "0",
                   "--folder", folder, *options]  # fmt: skip
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        try:
            assert process.stdout
            said = process.stdout.readline()
            found = re.search(r"http://[\d.:]+", said)
            assert found, said
            yield found.group(), process.pid
        finally:
            process.terminate()
            process.wait()


def processes(pid: int) -> list[int]:
    """Return a process and all its children."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="utf-8").split()
    return [pid, *(child for one in children for child in processes(int(one)))]


def processor(pid: int) -> float:
    """Return the processor time of a process and its children, s."""
    total = 0
    for one in processes(pid):
        fields = Path(f"/proc/{one}/stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()
        total += int(fields[11]) + int(fields[12])
    return total / TICKS


def memories(pid: int) -> list[float]:
    """Return the resident memory of a process and of each of its children, MB."""
    texts = [Path(f"/proc/{one}/status").read_text(encoding="utf-8") for one in processes(pid)]
    found = [re.search(r"VmRSS:\s+(\d+)", text) for text in texts]
    return [int(one.group(1)) / 1024 for one in found if one]


def memory(pid: int) -> float:
    """Return the resident memory of a process and its children, MB (what they share twice)."""
    return sum(memories(pid))


def serial(url: str) -> int:
    return int(httpx.get(url + "/api/v1/state").json()["serial"])


def keep_it_busy(url: str) -> None:
    httpx.post(url + "/api/v1/stimulus", json={"feeling": "happiness", "strength": 1.0})


def measure(url: str, pid: int, case: str, seconds: float) -> None:
    keep_it_busy(url)
    wall, cpu, steps = time.monotonic(), processor(pid), serial(url)
    time.sleep(seconds)  # what is measured is what passes meanwhile
    wall = time.monotonic() - wall
    result = {
        "case": case,
        "core_share": round((processor(pid) - cpu) / wall, 3),
        "memory_mb": round(memory(pid), 1),
        "steps_made_of_due": round((serial(url) - steps) * 0.02 / wall, 3),
        "load": round(os.getloadavg()[0], 1),
    }
    print(json.dumps(result), flush=True)


@contextmanager
def programs(url: str, count: int) -> Iterator[None]:
    """Let programs watch at 30 Hz, in a process of their own."""
    command = [sys.executable, __file__, "--watch", url, str(count)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE)
    try:
        assert process.stdout
        process.stdout.readline()  # all are connected
        yield
    finally:
        process.kill()
        process.wait()


async def watch(url: str, count: int) -> None:
    address = "ws" + url.removeprefix("http") + "/api/v1/live?rate=30"
    sockets = [await connect(address) for _ in range(count)]
    print("watching", flush=True)

    async def read(viewer: int) -> None:
        async for _ in sockets[viewer]:
            pass

    await asyncio.gather(*(read(viewer) for viewer in range(count)))


@contextmanager
def pages(url: str, count: int, flags: list[str]) -> Iterator[None]:
    """Open studio pages, each in a browser profile of its own."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=flags)
        for _ in range(count):
            page = browser.new_page(viewport={"width": 1180, "height": 700})
            page.goto(url + "/?quality=low", timeout=120_000)
            page.wait_for_function(
                "document.documentElement.dataset.connected === 'true'", timeout=120_000
            )
        yield
        browser.close()


def minutes(url: str, pid: int, count: int) -> None:
    """Tell the memory every minute, with ten programs and a page watching."""
    with programs(url, 10), pages(url, 1, WITHOUT):
        for minute in range(count + 1):
            keep_it_busy(url)
            told = {"minute": minute, "memory_mb": round(memory(pid), 1),
                    "load": round(os.getloadavg()[0], 1)}  # fmt: skip
            print(json.dumps(told), flush=True)
            time.sleep(60.0 if minute < count else 0.0)  # what is measured is what passes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--watch", nargs=2, help=argparse.SUPPRESS)
    wish = parser.parse_args()
    if wish.watch:
        asyncio.run(watch(wish.watch[0], int(wish.watch[1])))
        return
    with partner() as (url, pid):
        if wish.minutes:
            minutes(url, pid, wish.minutes)
            return
        measure(url, pid, "nobody", wish.seconds)
        for count in (1, 10, 100):
            with programs(url, count):
                measure(url, pid, f"programs at 30 Hz: {count}", wish.seconds)
        for name, flags in (("without WebGL", WITHOUT), ("software WebGL", SOFTWARE)):
            for count in (1, 10):
                with pages(url, count, flags):
                    measure(url, pid, f"studio pages, {name}: {count}", wish.seconds)


if __name__ == "__main__":
    main()
