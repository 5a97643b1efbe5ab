"""Attack a live partner in every way at once, and see whether Stop, time and memory hold.

    python bench/studio/attack.py [--minutes 4] [--stops 1000]

Starts `miburi run` with 1,024 files at most and its folder on a disk of 500 kB. Then programs of
a lower priority (a stranger takes no processor time of ours; nor of the person's who presses Stop)
from the same address

- ask for pages, as fast as they come,
- hold as many slow connections as a process may open, and open those anew that are closed,
- poll and send commands, as fast as they are answered,
- send 200 MB of headers, and again,
- ask as pages of other sites do, over HTTP and for sockets,
- watch and send nonsense over WebSockets,
- record, until the disk is full, and again.

Meanwhile Stop is pressed so many times, in turns over a connection that stays open and over a new
one; the body is released after every tenth. Prints the times of Stop, the robot's time over real
time, the memory of all its processes, what it has lost, and the load of the machine.
"""

import argparse
import asyncio
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from http.client import HTTPConnection, HTTPException
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

import httpx
from measure import memories
from websockets.asyncio.client import connect as connect_async
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.sync.client import ClientConnection, connect

import miburi
from miburi.feelings import shipped_temperament
from miburi.live.memory import remembered
from miburi.live.recording.recorder import read

FILES, DISK, HEADERS = 1024, "500k", 200_000_000
FOREIGN = {"Origin": "https://evil.example", "Sec-Fetch-Site": "cross-site"}
COMMANDS = (("GET", "/state", None), ("GET", "/samples", None), ("GET", "/log", None),
            ("POST", "/stimulus", {"feeling": "thrill", "strength": 1.0}),
            ("POST", "/express", {"feeling": "happiness", "mood": 1.0}),
            ("POST", "/bodies", {"name": "marble"}))  # fmt: skip


async def hammer(url: str, headers: dict[str, str], what: tuple[tuple[str, str, object], ...],
                 lanes: int) -> None:  # fmt: skip
    """Ask for these in turn, as fast as they are answered."""

    async def lane() -> None:
        async with httpx.AsyncClient(base_url=url, headers=headers, timeout=5) as client:
            while True:
                for method, path, content in what:
                    with suppress(httpx.HTTPError):
                        await client.request(method, path, json=content)

    await asyncio.gather(*(lane() for _ in range(lanes)))


async def pages(url: str) -> None:
    await hammer(url, {}, (("GET", "/", None), ("GET", "/face", None)), 4)


async def polling(url: str) -> None:
    await hammer(url + "/api/v1", {}, COMMANDS, 8)


async def strangers(url: str) -> None:
    asked = (("POST", "/api/v1/stop", None), ("GET", "/", None), ("GET", "/static/live.js", None))
    await hammer(url, FOREIGN, asked, 4)


async def slow(url: str) -> None:
    where = urlsplit(url)

    async def hold() -> None:
        while True:
            with suppress(OSError):
                reader, writer = await asyncio.open_connection(where.hostname, where.port)
                writer.write(b"GET / HTTP/1.1\r\nHost: localhost\r\nX: ")
                with suppress(TimeoutError):
                    await asyncio.wait_for(reader.read(), 60)
                writer.close()
            await asyncio.sleep(0.5)  # it will be closed at once where there are too many

    await asyncio.gather(*(hold() for _ in range(FILES - 50)))


async def headers(url: str) -> None:
    where = urlsplit(url)
    while True:
        sent = 0
        while sent < HEADERS:
            with suppress(OSError):
                _, writer = await asyncio.open_connection(where.hostname, where.port)
                writer.write(b"GET / HTTP/1.1\r\n")
                for number in range(HEADERS // 65_536):
                    writer.write(b"X-%d: " % number + b"x" * 65_536 + b"\r\n")
                    sent += 65_536
                    await writer.drain()
                writer.close()


async def sockets(url: str) -> None:
    address = "ws" + url.removeprefix("http") + "/api/v1/live?rate=30"

    async def viewer(number: int) -> None:
        while True:
            with suppress(Exception):  # it is shown out, and comes again
                async with connect_async(address) as live:
                    for _ in range(1000):
                        await live.recv()
                        nonsense = json.dumps({"do": "stimulus", "feeling": "x" * 100})
                        await live.send(nonsense if number % 2 else "[" * 1900)
            await asyncio.sleep(1.0)

    await asyncio.gather(*(viewer(number) for number in range(60)))


async def disk(url: str) -> None:
    async with httpx.AsyncClient(base_url=url + "/api/v1", timeout=10) as client:
        while True:
            with suppress(httpx.HTTPError):
                await client.post("/recordings", json={"on": True})
            await asyncio.sleep(1.0)


ATTACKS: dict[str, Callable[[str], Awaitable[None]]] = {
    one.__name__: one for one in (pages, polling, strangers, slow, headers, sockets, disk)
}


def prefer(nice: int) -> None:
    """Set the priority of this process, and of its session, where Linux groups by sessions."""
    with suppress(OSError):  # only root may
        os.nice(nice - os.nice(0))
        Path("/proc/self/autogroup").write_text(str(nice), encoding="utf-8")


class Look(NamedTuple):
    """When, s; the robot's time, s; the memory of each process, MB; the machine's load."""

    now: float
    time: float
    memories: list[float]
    load: float

    @property
    def memory(self) -> float:
        """Of all processes, MB; what they share is counted twice."""
        return sum(self.memories)


class Watch(threading.Thread):
    """Reads the robot's time over a WebSocket, and its memory."""

    def __init__(self, url: str, pid: int) -> None:
        super().__init__(daemon=True)
        self.url = "ws" + url.removeprefix("http") + "/api/v1/live?rate=2"
        self.socket: ClientConnection = connect(self.url)
        self.closed: list[str] = []
        self.pid = pid
        self.seen: list[Look] = []
        self.endings: set[str] = set()

    def release(self) -> None:
        """Let a stopped body go on."""
        with suppress(ConnectionClosed):
            self.socket.send('{"do": "release"}')

    def run(self) -> None:
        with suppress(OSError, InvalidHandshake):  # the partner has gone
            while True:
                self.read()
                self.socket = connect(self.url, open_timeout=30)

    def read(self) -> None:
        """Read states until the partner closes the connection, and note when and how it did."""
        try:
            for text in self.socket:
                state = json.loads(text)
                if "time" in state:
                    load = os.getloadavg()[0]
                    self.seen.append(
                        Look(time.monotonic(), state["time"], memories(self.pid), load)
                    )
                    if state["recording_end"]:
                        self.endings.add(state["recording_end"]["reason"])
        except ConnectionClosed:
            pass
        self.closed.append(f"{time.strftime('%H:%M:%S')} {self.socket.close_code}")


def press(url: str, count: int, seconds: float, release: Callable[[], None]) -> list[float]:
    """Press Stop so often in so many seconds; return how long each took, s."""
    took, kept = [], HTTPConnection(urlsplit(url).netloc, timeout=30)
    begin = time.monotonic()
    for number in range(count):
        due = begin + number * seconds / count
        time.sleep(max(0.0, due - time.monotonic()))  # presses are spread evenly over the time
        before = time.monotonic()
        if number % 2 == 0:
            kept.close()  # the next one opens it anew
        try:
            kept.request("POST", "/api/v1/stop", headers={"Miburi-By": "program"})
            answer = kept.getresponse()
            obeyed = answer.status == 204 and answer.read() == b""
        except (OSError, HTTPException):
            obeyed = False
            kept.close()
        took.append(time.monotonic() - before if obeyed else 99.0)
        if number % 10 == 9:
            release()
    kept.close()
    return took


def start(folder: Path) -> subprocess.Popen[str]:
    """Run a partner on a small disk; without the right to make one, with small files."""
    run = [sys.executable, "-m", "miburi", "run", "--headless", "--port", "0", "--folder",
           str(folder / "disk")]  # fmt: skip
    (folder / "disk").mkdir()
    mount = f"mount -t tmpfs -o size={DISK} tmpfs {folder / 'disk'}"
    small = ["unshare", "-rm", "sh", "-c", f'{mount} && exec "$@"', "sh"]
    may = subprocess.run([*small, "true"], capture_output=True, check=False).returncode == 0

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_NOFILE, (FILES, FILES))
        if not may:
            resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000))

    print("disk:", f"tmpfs of {DISK}" if may else "files of at most 1 MB")
    # A limit can only be set between fork and exec.
    return subprocess.Popen(
        [*small, *run] if may else run, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=limit,  # noqa: PLW1509  (no thread is running here yet)
    )  # fmt: skip


def times(took: list[float]) -> str:
    """Put the times of Stop into words."""
    took = sorted(took)
    some = {"median": len(took) // 2, "99 %": -1 - len(took) // 100, "longest": -1}
    words = ", ".join(f"{name} {1000 * took[index]:.0f} ms" for name, index in some.items())
    return f"Stop within 0.1 s: {sum(one <= 0.1 for one in took)} of {len(took)}; {words}"


def times_by_connection(took: list[float]) -> str:
    """The same, and for each kind of connection."""
    new, kept = times(took[::2]), times(took[1::2])
    return f"{times(took)}\n  over a new connection: {new}\n  over an open one: {kept}"


def lost(folder: Path, pid: int) -> str:
    """Say what cannot be read any more: recordings, or the feelings."""
    inside = Path(f"/proc/{pid}/root{folder}")  # a tmpfs of its own is seen only from there
    broken = [path.name for path in inside.glob("recordings/*.mcap") if not [*read(path)]]
    kept = inside / "feelings.json"
    if not kept.exists():
        broken.append("feelings.json, which was never written")
    elif not remembered(kept, shipped_temperament("playful")):
        broken.append("feelings.json")
    return ", ".join(broken) or "nothing"


def tell_memory(before: Look, during: list[Look], after: Look) -> None:
    """Print the memory of all processes and of each, and how it grew."""
    most = max(one.memory for one in during)
    print(f"memory: {before.memory:.0f} MB before, {most:.0f} MB at most, "
          f"{after.memory:.0f} MB 10 s after")  # fmt: skip
    growths = zip(before.memories, after.memories, strict=False)
    print(f"of each process: {', '.join(f'{a:.0f} → {b:.0f} MB' for a, b in growths)}")
    quarters = [during[len(during) * part // 4 - 1].memory for part in range(1, 5)]
    print(f"after each quarter of it: {', '.join(f'{one:.0f} MB' for one in quarters)}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=4.0)
    parser.add_argument("--stops", type=int, default=1000)
    parser.add_argument("--nice", type=int, default=-10)
    parser.add_argument("--attack", nargs=2, help=argparse.SUPPRESS)
    wish = parser.parse_args()
    if wish.attack:
        resource.setrlimit(resource.RLIMIT_NOFILE, (FILES, FILES))
        prefer(0)
        asyncio.run(ATTACKS[wish.attack[0]](wish.attack[1]))
    prefer(wish.nice)
    with tempfile.TemporaryDirectory() as folder:
        process = start(Path(folder))
        assert process.stdout is not None
        said = process.stdout.readline()
        found = re.search(r"http://[\d.:]+", said)
        assert found, said
        url = found.group()
        for page in ("/", "/face"):
            httpx.get(url + page)
        with miburi.connect(url) as partner:
            partner.record()
        watch = Watch(url, process.pid)
        watch.start()
        time.sleep(5.0)  # what a calm partner needs is measured first
        calm = watch.seen[-1]
        calmly = press(url, 50, 5.0, lambda: None)
        commands = [[sys.executable, __file__, "--attack", name, url]
                    for name in ATTACKS]  # fmt: skip
        attackers = [subprocess.Popen(one, start_new_session=True) for one in commands]
        try:
            took = press(url, wish.stops, 60 * wish.minutes, watch.release)
        finally:
            alive = sum(one.poll() is None for one in attackers)
            for one in attackers:
                one.kill()
        last = watch.seen[-1]
        time.sleep(10.0)  # memory falls back once the attackers are gone
        after, closed = watch.seen[-1], watch.closed.copy()
        missing = lost(Path(folder) / "disk", process.pid)
        process.terminate()
        errors = process.communicate(timeout=60)[1].replace(folder, "FOLDER")
    during = [one for one in watch.seen if calm.now <= one.now <= last.now]
    print(f"attackers alive at the end: {alive} of {len(ATTACKS)}; {wish.minutes:g} minutes")
    print(f"before the attack: {times(calmly)}")
    print(f"in the attack: {times_by_connection(took)}")
    print(f"robot's time over real time: {(last.time - calm.time) / (last.now - calm.now):.4f}")
    tell_memory(calm, during, after)
    print(f"the watching connection was closed: {', '.join(closed) or 'never'}\n"
          f"recordings that ended: {', '.join(sorted(watch.endings)) or 'none'}")  # fmt: skip
    print(f"lost: {missing}; exit {process.returncode}, on stderr: {errors.strip() or 'nothing'}")
    loads = sorted(one.load for one in during)
    print(f"load: {loads[0]:.1f} to {loads[-1]:.1f} on {os.cpu_count()} cores")


if __name__ == "__main__":
    main()
