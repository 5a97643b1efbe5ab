"""Whether five readers hear of every stop, over restarts and outages, once each and with its time.

A partner runs as `miburi run` runs it. It is stopped again and again; in each phase either the
partner is started anew (every other time by kill -9), or all readers and the broker are away while
stops and hundreds of other events happen. The readers are written from docs/events.md, docs/home.md
and docs/agents.md alone: HTTP, server-sent events, WebSocket, MCP's own client, Paho's MQTT client.

python bench/events/measure.py --seed 1
"""

import argparse
import asyncio
import json
import os
import re
import shutil
import signal
import socket
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import httpx
import numpy as np
import paho.mqtt.client as paho
from mcp.client import Client
from mcp.client.streamable_http import streamable_http_client
from websockets.sync.client import connect as open_socket

MOSQUITTO = shutil.which("mosquitto", path=f"{os.environ['PATH']}:/usr/sbin") or "mosquitto"
#: s that a reader may take to hear of a stop after a phase.
PATIENCE = 90.0
CHATTER = 400  # other events in each outage: more than are kept in memory


class Reader:
    """Hears events by one door; keeps the id of the latest, and each stop's id and time."""

    def __init__(self, name: str) -> None:
        self.name, self.latest, self.stops = name, "", list[tuple[str, str]]()
        self.gaps, self.away = 0, threading.Event()

    def take(self, event: dict[str, object]) -> None:
        self.latest = str(event["id"])
        self.gaps += event["kind"] == "gap"
        if event["kind"] == "stop":
            self.stops.append((self.latest, str(event.get("wall", ""))))


class ByHttp(Reader):
    def look(self, url: str) -> None:
        for event in httpx.get(f"{url}/api/v1/log", params={"after": self.latest or "0"}).json():
            self.take(event)


class ByStream(Reader):
    def look(self, url: str) -> None:
        headers = {"Last-Event-ID": self.latest or "0"}
        with httpx.stream("GET", f"{url}/api/v1/events", headers=headers, timeout=2.0) as answer:
            for line in answer.iter_lines():
                if line.startswith("data: "):
                    self.take(json.loads(line[6:]))
                if self.away.is_set():
                    return


class BySocket(Reader):
    def look(self, url: str) -> None:
        address = f"{url.replace('http', 'ws')}/api/v1/live?rate=1&events={self.latest or '0'}"
        with open_socket(address) as line:
            while not self.away.is_set():
                told = json.loads(line.recv(2.0))
                if "event" in told:
                    self.take(told["event"])


class ByMcp(Reader):
    def look(self, url: str) -> None:
        async def ask() -> str:
            async with Client(streamable_http_client(url + "/mcp")) as client:
                answer = await client.call_tool("events", {"since": self.latest or "0"})
                return str(answer.content[0].text)

        for line in asyncio.run(ask()).splitlines():
            if found := re.match(r"([0-9a-f]{8}:\d+) \((.*?)\) (\w+)", line):
                self.take({"id": found[1], "wall": found[2], "kind": found[3]})


class ByMqtt(Reader):
    def __init__(self, name: str, port: int) -> None:
        super().__init__(name)
        self._client = paho.Client(paho.CallbackAPIVersion.VERSION2)
        self._client.on_connect = lambda client, *_: client.subscribe("miburi/kitchen/#", qos=1)
        self._client.on_message = self._hear
        self._client.reconnect_delay_set(1, 1)
        self._client.connect("127.0.0.1", port)
        self._client.loop_start()

    def _hear(self, _client: object, _data: object, message: paho.MQTTMessage) -> None:
        if message.topic.endswith(("/stops", "/gaps")):
            kind = "stop" if message.topic.endswith("/stops") else "gap"
            self.take({"kind": kind, **json.loads(message.payload)})

    def look(self, _url: str) -> None:
        time.sleep(0.2)


class Broker:
    """Mosquitto, which forgets everything when it is killed."""

    def __init__(self, folder: Path) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = int(probe.getsockname()[1])
        self._config = folder / "mosquitto.conf"
        self._config.write_text(f"listener {self.port} 127.0.0.1\nallow_anonymous true\n")
        self.begin()

    def begin(self) -> None:
        self._process = subprocess.Popen([MOSQUITTO, "-c", self._config], stderr=-3)

        def listens() -> bool:
            with suppress(OSError), socket.create_connection(("127.0.0.1", self.port), 1.0):
                return True
            return False

        until(listens)

    def kill(self) -> None:
        self._process.kill()
        self._process.wait()


class Partner:
    """`miburi run`, started and ended."""

    def __init__(self, folder: Path, port: int) -> None:
        self._command = [
            sys.executable, "-m", "miburi", "run", "--headless", "--port", "0", "--agents",
            "--folder", str(folder), "--broker", f"127.0.0.1:{port}", "--name", "kitchen",
        ]  # fmt: skip
        self.begin()

    def begin(self) -> None:
        self._process = subprocess.Popen(self._command, stdout=subprocess.PIPE, text=True)
        assert self._process.stdout is not None
        found = re.search(r"http://[\d.:]+", self._process.stdout.readline())
        assert found
        self.url = found.group()

    def end(self, how: signal.Signals) -> None:
        self._process.send_signal(how)
        self._process.wait()

    def stop(self) -> None:
        """Stop it, see that it is stopped, and release it again."""
        head = {"Miburi-By": "program"}
        httpx.post(f"{self.url}/api/v1/stop", headers=head).raise_for_status()
        until(lambda: self.state["stop"])
        until(lambda: httpx.post(f"{self.url}/api/v1/release", headers=head).status_code == 204)
        until(lambda: self.state["phase"] in ("idle", "moving"))

    def chatter(self) -> None:
        """Let much else happen: it feels something again and again."""
        for _ in range(CHATTER):
            wish = {"feeling": "happiness", "strength": 0.1}
            until(lambda wish=wish: httpx.post(f"{self.url}/api/v1/stimulus", json=wish).is_success)

    @property
    def state(self) -> dict[str, object]:
        return dict(httpx.get(f"{self.url}/api/v1/state").json())


def until(wanted: Callable[[], object]) -> None:
    over = time.monotonic() + PATIENCE
    while not wanted():
        assert time.monotonic() < over, "it took too long"
        time.sleep(0.03)


def follow(reader: Reader, partner: Partner, over: threading.Event) -> None:
    while not over.is_set():
        if not reader.away.is_set():
            with suppress(Exception):  # the partner is away: look again
                reader.look(partner.url)
        time.sleep(0.05)


def kept(folder: Path) -> list[str]:
    with sqlite3.connect(folder / "events.sqlite") as file:
        rows = file.execute("SELECT content FROM events ORDER BY number").fetchall()
    events = [json.loads(content) for (content,) in rows]
    return [f"{e['boot']}:{e['number']}" for e in events if e["kind"] == "stop"]


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--phases", type=int, default=20, help="restarts, and as many outages")
    options.add_argument("--stops", type=int, default=5, help="in each phase")
    given = options.parse_args()
    draw, over, caused = np.random.default_rng(given.seed), threading.Event(), 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        broker = Broker(folder)
        partner = Partner(folder, broker.port)
        readers = [ByHttp("HTTP"), ByStream("SSE"), BySocket("WebSocket"), ByMcp("MCP"),
                   ByMqtt("MQTT", broker.port)]  # fmt: skip
        for reader in readers:
            threading.Thread(target=follow, args=(reader, partner, over), daemon=True).start()
        time.sleep(3.0)
        for phase in draw.permutation(2 * given.phases):
            outage = phase < given.phases
            for reader in readers if outage else []:
                reader.away.set()
            if outage:
                broker.kill()
                partner.chatter()
            for _ in range(given.stops):
                partner.stop()
                caused += 1
            if outage:
                broker.begin()
                for reader in readers:
                    reader.away.clear()
            else:
                partner.end(signal.SIGKILL if phase % 2 else signal.SIGTERM)
                partner.begin()
        truth = kept(folder)
        until(lambda: all(len(reader.stops) >= len(truth) for reader in readers))
        over.set()
        partner.end(signal.SIGTERM)
        broker.kill()
    print(
        f"{caused} stops over {given.phases} restarts (half by kill -9) and {given.phases} outages"
    )
    print(f"{len(truth)} stops in the partner's file")
    for reader in readers:
        ids = [event for event, _ in reader.stops]
        missed, twice = set(truth) - set(ids), len(ids) - len(set(ids))
        undated = sum(not wall for _, wall in reader.stops)
        told = f"{len(set(ids))} heard, {len(missed)} missed, {twice} told twice"
        print(f"{reader.name:10} {told}, {undated} without a time, {reader.gaps} gaps")


if __name__ == "__main__":
    main()
