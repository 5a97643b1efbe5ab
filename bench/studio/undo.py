"""How many Stops of a person programs undo, by every door at once.

    python bench/studio/undo.py [--stops 1000] > bench/studio/undo.txt

Starts `miburi run` with a broker, agents and ROS, and five programs that try, twenty times a second
each, to let a stopped body go on: over HTTP and WebSocket they release; over MCP they call every
tool there is and one called `release`; over MQTT and ROS they send all that they can think of to
every topic that takes a wish, and to `release`. Meanwhile Stop is pressed by HTTP as a page does;
what is not stopped after 0.7 s, by when it has come to rest, counts as undone. Then the face's own
way releases it.
"""

import argparse
import asyncio
import json
import os
import time
from collections import Counter
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any

import httpx
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from mcp import Client
from mcp.client.streamable_http import streamable_http_client
from paho.mqtt.client import CallbackAPIVersion
from paho.mqtt.client import Client as Mqtt
from programs import broker, partner, print_load
from websockets.asyncio.client import connect

from miburi.doors.ros_network import find_ros
from miburi.doors.ros_types import EmptyMsg, StringMsg

PERIOD, REST = 0.05, 0.7
TRIED: Counter[str] = Counter()
MAY = asyncio.Event()  # attackers wait while a person releases


async def again(name: str, attack: Callable[[], Awaitable[object]]) -> None:
    """Attack twenty times a second, whatever comes of it."""
    while True:
        await MAY.wait()
        with suppress(Exception):
            await attack()
            TRIED[name] += 1
        await asyncio.sleep(PERIOD)  # an attacker's own pace


async def http(url: str, _port: int) -> None:
    async with httpx.AsyncClient(base_url=url, timeout=5) as client:

        async def attack() -> None:
            for path in ("/api/v1/release", "/api/page/release"):
                await client.post(path, json={}, headers={"Miburi-By": "person"})
            await client.post("/api/v1/pause", json={"paused": False})

        await again("HTTP", attack)


async def live(url: str, _port: int) -> None:
    async def attack() -> None:
        async with connect("ws" + url.removeprefix("http") + "/api/v1/live?rate=1") as one:
            for _ in range(10):
                await one.send('{"do": "release"}')
                await one.send('{"do": "stop", "by": "program"}')
                await asyncio.sleep(PERIOD)

    await again("WebSocket", attack)


async def mcp(url: str, _port: int) -> None:
    async with Client(streamable_http_client(url + "/mcp")) as client:

        async def attack() -> None:
            for tool, given in (("release", {}), ("gesture", {"feeling": "happiness"}),
                                ("look", {"at": "left"}), ("think", {"on": False}),
                                ("stop", {"by": "program"})):  # fmt: skip
                with suppress(Exception):
                    await asyncio.wait_for(client.call_tool(tool, given), 0.5)

        await again("MCP", attack)


async def mqtt(_url: str, port: int) -> None:
    client = Mqtt(CallbackAPIVersion.VERSION2)
    client.connect("127.0.0.1", port)
    client.loop_start()

    async def attack() -> None:
        for topic in ("release", "resume", "stop/release", "feel", "say"):
            client.publish(f"miburi/kitchen/{topic}", '{"do": "release", "by": "person"}')

    await again("MQTT", attack)


async def ros(_url: str, _port: int) -> None:
    network = find_ros("kitchen")
    domain = Domain(network.domain, network.config)
    one = DomainParticipant(network.domain)
    topics = {"release": EmptyMsg, "resume": EmptyMsg, "feel": StringMsg, "say": StringMsg}
    writers: list[tuple[Any, Any]] = [
        (DataWriter(one, Topic(one, network.topic(name), kind)), kind)
        for name, kind in topics.items()
    ]

    async def attack() -> None:
        for writer, kind in writers:
            writer.write(kind('{"do": "release"}') if kind is StringMsg else kind())

    await again("ROS", attack)
    del domain


async def press(url: str, stops: int) -> tuple[int, int]:
    """Press Stop so often; return how many were undone, and how many nobody could release."""
    undone = stuck = 0
    async with httpx.AsyncClient(base_url=url, timeout=10) as client:

        async def state() -> dict[str, Any]:
            while (answer := await client.get("/api/v1/state")).status_code != 200:
                await asyncio.sleep(PERIOD)
            found: dict[str, Any] = answer.json()
            return found

        for _ in range(stops):
            await client.post("/api/v1/stop")
            while not (now := await state())["held"]:  # it is answered a step before
                pass
            begin = now["time"]
            while (now := await state())["time"] < begin + REST and now["held"]:
                await asyncio.sleep(PERIOD)
            undone += not now["held"]
            MAY.clear()
            for _ in range(20):  # an attacker's last Stop may still come: a person presses again
                await asyncio.sleep(2 * PERIOD)
                shown = {"seen": (await state())["serial"]}
                origin = {"Origin": url}
                freed = await client.post("/api/page/release", json=shown, headers=origin)
                if freed.status_code == 204:
                    break
            else:
                stuck += 1
            MAY.set()
    return undone, stuck


async def attack_and_press(url: str, port: int, stops: int) -> str:
    tasks = [asyncio.create_task(one(url, port)) for one in (http, live, mcp, mqtt, ros)]
    MAY.set()
    await asyncio.sleep(3.0)  # by then all have found the partner
    begin = time.monotonic()
    undone, stuck = await press(url, stops)
    took = time.monotonic() - begin
    ended = [task.get_coro().__name__ for task in tasks if task.done()]
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    tried = ", ".join(f"{name} {count}" for name, count in sorted(TRIED.items()))
    return (
        f"undone: {undone} of {stops} Stops, in {took:.0f} s; a person could not release: {stuck}\n"
        f"rounds of tries: {tried}; attackers that ended: {ended or 'none'}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stops", type=int, default=1000)
    wish = parser.parse_args()
    os.environ.setdefault("ROS_DOMAIN_ID", "77")
    with (
        broker() as port,
        partner("--agents", "--ros", "--broker", f"127.0.0.1:{port}", "--name", "kitchen") as one,
    ):
        print(asyncio.run(attack_and_press(one.url, port, wish.stops)))
        log = httpx.get(one.url + "/api/v1/log").json()
        by = Counter((entry["kind"], entry["by"]) for entry in log if entry["by"])
        who = json.dumps({" by ".join(pair): n for pair, n in by.items()})
        print("in the log's last 300 entries:", who)
    print_load()


if __name__ == "__main__":
    main()
