"""Many partners at one broker: what reaches a fleet, at what cost, and how soon all are stopped.

The partners have no bodies: each sends what a living one sends, a report that has changed and, in
every round, a stop; and each says that it is stopped when all are. Mosquitto, as it is installed,
the partners and the fleet have a process each; the fleet is the one of ``miburi fleet``, and beside
it Paho's client counts. Slow and quick rounds take turns.

    python bench/fleet/measure.py --rounds 2 > bench/fleet/measure.txt
    python bench/fleet/measure.py --rounds 2 --partners 2000 --rates 0.2 1 >> \\
        bench/fleet/measure.txt
"""

import argparse
import asyncio
import contextlib
import multiprocessing
import os
import queue
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from datetime import UTC, datetime
from multiprocessing.synchronize import Event
from pathlib import Path

import paho.mqtt.client as paho

from miburi.doors.broker import Broker
from miburi.doors.fleet import Fleet, listening_to, stop_and_look
from miburi.doors.topics import ALL, HomeReport, StopNews, Topics
from miburi.safety.stop import StopReason

PORT = 18_833
BROKER = Broker("127.0.0.1", PORT)
ROUNDS, SECONDS = 4, 10.0
#: s between two partners that connect.
APART = 0.002


def report(mood: int, stopped: StopReason | None = None) -> str:
    temperatures = {f"motor_{i}": 40.0 + i for i in range(8)}
    return HomeReport(
        feeling="happiness", mood=mood, paused=False, stopped=stopped, motor=None,
        held=stopped is not None, stops_today=0, temperatures=temperatures,
    ).model_dump_json()  # fmt: skip


async def be_partner(number: int, begin: float, rate: float, which: int) -> int:
    """Send reports for a round, one stop in the middle, and stop when all do; how many reports."""
    topics, stopped = Topics(f"p{number}"), asyncio.Event()
    await asyncio.sleep(APART * number)
    async with BROKER.client(f"p{number}") as client:
        await client.subscribe(Topics(ALL).stop, qos=1)
        await client.publish(topics.available, "online", qos=1, retain=True)
        await client.publish(topics.report, report(0), qos=1, retain=True)

        async def obey() -> None:
            async for _ in client.messages:
                await client.publish(topics.report, report(0, StopReason.ASKED), 1, retain=True)
                stopped.set()

        obeying = asyncio.create_task(obey())
        count = round(SECONDS * rate)
        offset = (number % 100) / 100 / rate  # not all at once
        for i in range(count):
            await asyncio.sleep(begin + offset + i / rate - time.monotonic())
            await client.publish(topics.report, report(i % 99 + 1), qos=1, retain=True)
            if i == count // 2:
                when, event = datetime.now(UTC), f"00000000:{which}"
                stop = StopNews(
                    event_type=StopReason.CONTACT, id=event, wall=when, motor="head", force=1
                )
                await client.publish(topics.stops, stop.model_dump_json(), qos=1)
        await stopped.wait()
        await asyncio.sleep(2.0)  # whoever looks has seen it
        obeying.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await obeying
        await client.publish(topics.available, "offline", qos=1, retain=True)
        return count


def partners(number: int, begin: float, rate: float, which: int, sent: "queue.Queue[int]") -> None:
    async def all_of_them() -> list[int]:
        ones = (be_partner(i, begin, rate, which) for i in range(number))
        return await asyncio.gather(*ones)

    sent.put(sum(asyncio.run(all_of_them())))


def fleet(ready: Event, over: Event, known: "queue.Queue[int]") -> None:
    """Be the fleet until the round is over; say how many partners it knew."""

    async def listen() -> int:
        watched = Fleet(BROKER)
        async with listening_to(watched):
            ready.set()
            while not over.is_set():
                await asyncio.sleep(0.1)
            return sum(not one.lost for one in watched.news.partners)

    known.put(asyncio.run(listen()))


def cpu(pid: int) -> float:
    """CPU seconds that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def one_round(
    number: int, rate: float, which: int, broker: int, heard: dict[str, int]
) -> tuple[float, ...]:
    """Let so many partners live for a round, then stop them all; what came of it."""
    spawn = multiprocessing.get_context("spawn")
    ready, over, known, sent = spawn.Event(), spawn.Event(), spawn.Queue(), spawn.Queue()
    watching = spawn.Process(target=fleet, args=(ready, over, known))
    watching.start()
    ready.wait()
    begin = time.monotonic() + 4 + APART * number
    being = spawn.Process(target=partners, args=(number, begin, rate, which, sent))
    being.start()
    time.sleep(begin - time.monotonic())
    heard.update(report=0, stops=0)
    before = cpu(broker), cpu(watching.pid)
    time.sleep(SECONDS + 1 / rate)
    used = (cpu(broker) - before[0]) / SECONDS, (cpu(watching.pid) - before[1]) / SECONDS
    reports, stops = heard["report"], heard["stops"]
    over.set()
    asked = time.monotonic()
    stopped = asyncio.run(stop_and_look(BROKER)).held
    took = time.monotonic() - asked
    due = sent.get()
    being.join()
    watching.join()
    return (due / SECONDS, reports / due, stops / number, known.get() / number,
            len(stopped) / number, took, *used)  # fmt: skip


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--partners", type=int, default=200)
    options.add_argument(
        "--rates", type=float, nargs="+", default=[1.0, 4.0],
        help="reports a second of each; a living one sends 0.17 at most",
    )  # fmt: skip
    options.add_argument("--rounds", type=int, default=ROUNDS)
    given = options.parse_args()
    resource.setrlimit(resource.RLIMIT_NOFILE, (20_000, 20_000))
    folder = Path(tempfile.mkdtemp())
    config = folder / "mosquitto.conf"
    config.write_text(f"listener {PORT} 127.0.0.1\nallow_anonymous true\n")
    broker = subprocess.Popen(["mosquitto", "-c", config], stderr=subprocess.DEVNULL)
    time.sleep(1)  # until the broker listens
    heard = {"report": 0, "stops": 0}

    def count(_client: object, _data: object, message: paho.MQTTMessage) -> None:
        kind = message.topic.rsplit("/", 1)[1]
        if kind in heard and not message.retain:
            heard[kind] += 1

    counter = paho.Client(paho.CallbackAPIVersion.VERSION2)
    counter.on_message = count
    counter.connect("127.0.0.1", PORT)
    counter.subscribe("miburi/#", qos=1)
    counter.loop_start()
    results: dict[float, list[tuple[float, ...]]] = {rate: [] for rate in given.rates}
    for number in range(given.rounds * len(given.rates)):
        rate = given.rates[number % len(given.rates)]
        results[rate].append(one_round(given.partners, rate, number, broker.pid, heard))
    counter.loop_stop()
    broker.terminate()
    print(
        f"{given.partners} partners, {given.rounds} rounds of {SECONDS:g} s at each rate; "
        "median (lowest–highest)"
    )
    names = ("reports sent a second", "reports that arrived", "stops that arrived",
             "partners known", "said that they stopped", "s that took", "broker, cores",
             "fleet, cores")  # fmt: skip
    for rate, rows in results.items():
        print(f"\n{rate:g} a second each")
        for name, column in zip(names, zip(*rows, strict=True), strict=True):
            middle = statistics.median(column)
            print(f"{name:>24}  {middle:.3f} ({min(column):.3f}–{max(column):.3f})")
    print()
    sys.stdout.flush()


if __name__ == "__main__":
    main()
