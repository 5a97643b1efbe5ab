"""200 partners at one broker: how many of their reports and stops reach a fleet, at what cost.

The partners have no bodies: each sends what a living one sends, a report that has changed and, in
every round, a stop. Mosquitto, the partners and the fleet have a process each; the fleet is the one
of ``miburi fleet``, and beside it Paho's client counts. Slow and quick rounds take turns.

    python bench/fleet/measure.py > bench/fleet/measure.txt
"""

import asyncio
import multiprocessing
import os
import queue
import statistics
import subprocess
import sys
import tempfile
import time
from datetime import UTC, datetime
from multiprocessing.synchronize import Event
from pathlib import Path

import paho.mqtt.client as paho

from miburi.interface.broker import Broker
from miburi.interface.fleet import Fleet, listening_to
from miburi.interface.report import HomeReport, StopNews, Topics
from miburi.safety.stop import StopReason

PARTNERS = 200
PORT = 18_833
BROKER = Broker("127.0.0.1", PORT)
#: Reports a second of each partner; a living one sends a sixth of the lower rate at most.
RATES = (1.0, 4.0)
ROUNDS, SECONDS = 4, 10.0


def report(mood: int) -> str:
    temperatures = {f"motor_{i}": 40.0 + i for i in range(8)}
    return HomeReport(
        feeling="happiness", mood=mood, paused=False, stopped=None, motor=None,
        held=False, stops_today=0, temperatures=temperatures,
    ).model_dump_json()  # fmt: skip


async def be_partner(number: int, rate: float, rounds: int) -> int:
    """Send reports for a round, and one stop in the middle; return how many reports."""
    topics = Topics(f"p{number}")
    async with BROKER.client(f"p{number}") as client:
        await client.publish(topics.available, "online", qos=1, retain=True)
        await asyncio.sleep(number / PARTNERS / rate)  # not all at once
        count = round(SECONDS * rate)
        for i in range(count):
            due = time.monotonic() + 1 / rate
            await client.publish(topics.report, report(i % 100), qos=1, retain=True)
            if i == count // 2:
                when, which = datetime.now(UTC), f"00000000:{rounds}"
                stop = StopNews(
                    event_type=StopReason.CONTACT, id=which, wall=when, motor="head", force=1
                )
                await client.publish(topics.stops, stop.model_dump_json(), qos=1)
            await asyncio.sleep(max(0.0, due - time.monotonic()))
        return count


def partners(rate: float, rounds: int, sent: "queue.Queue[tuple[int, float]]") -> None:
    async def all_of_them() -> list[int]:
        return await asyncio.gather(*(be_partner(i, rate, rounds) for i in range(PARTNERS)))

    began = time.monotonic()
    count = sum(asyncio.run(all_of_them()))
    sent.put((count, time.monotonic() - began))


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


def main() -> None:
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
    spawn = multiprocessing.get_context("spawn")
    results: dict[float, list[tuple[float, ...]]] = {rate: [] for rate in RATES}
    for number in range(ROUNDS * len(RATES)):
        rate = RATES[number % len(RATES)]
        heard.update(report=0, stops=0)
        ready, over = spawn.Event(), spawn.Event()
        known, sent = spawn.Queue(), spawn.Queue()
        watching = spawn.Process(target=fleet, args=(ready, over, known))
        watching.start()
        ready.wait()
        before = cpu(broker.pid), cpu(watching.pid)
        being = spawn.Process(target=partners, args=(rate, number, sent))
        being.start()
        reports, seconds = sent.get()
        being.join()
        time.sleep(1.0)  # what is still on its way arrives
        used = (cpu(broker.pid) - before[0]) / seconds, (cpu(watching.pid) - before[1]) / seconds
        over.set()
        results[rate].append(
            (reports / seconds, heard["report"] / reports, heard["stops"] / PARTNERS,
             known.get() / PARTNERS, *used)
        )  # fmt: skip
        watching.join()
    counter.loop_stop()
    broker.terminate()
    print(
        f"{PARTNERS} partners, {ROUNDS} rounds of {SECONDS:g} s at each rate; "
        "median (lowest–highest)"
    )
    names = ("reports sent a second", "reports that arrived", "stops that arrived",
             "partners known", "broker, cores", "fleet, cores")  # fmt: skip
    for rate, rows in results.items():
        print(f"\n{rate:g} a second each")
        for name, column in zip(names, zip(*rows, strict=True), strict=True):
            middle = statistics.median(column)
            print(f"{name:>24}  {middle:.3f} ({min(column):.3f}–{max(column):.3f})")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
