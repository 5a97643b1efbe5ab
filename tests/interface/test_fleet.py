"""A fleet at a real Mosquitto: partners that report, partners that are lost, and Stop."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from tests.fixtures.broker import Listener, Mosquitto, at_home

from miburi.errors import InputError
from miburi.interface.broker import find_broker
from miburi.interface.client import connect
from miburi.interface.fleet import LARGEST, Fleet, FleetOut, listening_to, stop_and_look
from miburi.interface.report import HomeReport, Topics
from miburi.live.runner import Runner
from miburi.live.view import UnreachableError
from miburi.safety.stop import StopReason


def report(**more: Any) -> str:
    calm: dict[str, Any] = {
        "feeling": "happiness", "mood": 60, "paused": False, "stopped": None,
        "motor": None, "held": False, "stops_today": 0, "temperatures": {},
    }  # fmt: skip
    return HomeReport.model_validate(calm | more).model_dump_json()


def be(listener: Listener, name: str, available: str = "online", **more: Any) -> None:
    """Act as a partner."""
    listener.say(Topics(name).report, report(**more), retain=True)
    listener.say(Topics(name).available, available, retain=True)


async def until(fleet: Fleet, wanted: Callable[[FleetOut], object]) -> FleetOut:
    async with asyncio.timeout(30):
        while not wanted(fleet.news):
            await asyncio.sleep(0.01)
    return fleet.news


def run(broker: Mosquitto, work: Callable[[Fleet], Awaitable[None]]) -> None:
    async def working() -> None:
        fleet = Fleet(find_broker(f"127.0.0.1:{broker.port}"))
        async with listening_to(fleet):
            await work(fleet)

    asyncio.run(working())


def test_all_partners_are_there_with_what_they_say(broker: Mosquitto, listener: Listener) -> None:
    be(listener, "kitchen", temperatures={"waist": 41.5, "head": 39.0})
    be(listener, "attic", "offline")
    be(listener, "hall", stopped="contact", motor="right_elbow", stops_today=3)

    async def work(fleet: Fleet) -> None:
        news = await until(fleet, lambda news: [one.lost for one in news.partners] == [0, 1, 0])
        hall, attic, kitchen = news.partners
        assert (attic.name, attic.lost) == ("attic", True)
        assert hall.report is not None
        assert (hall.report.stopped, hall.report.stops_today) == (StopReason.CONTACT, 3)
        assert (kitchen.hottest, hall.hottest) == (41.5, None)
        listener.say(Topics("attic").available, "", retain=True)  # nobody needs it any more
        await until(fleet, lambda news: [one.name for one in news.partners] == ["hall", "kitchen"])

    run(broker, work)


@pytest.mark.parametrize(
    ("topic", "payload"),
    [
        ("miburi/kitchen/report", "{"),
        ("miburi/kitchen/report", json.dumps({"feeling": "happiness"})),
        ("miburi/kitchen/report", b"\xff"),
        ("miburi/<b>x/available", "online"),
        ("miburi/all/available", "online"),
        ("miburi/kitchen", "online"),
    ],
)
def test_what_makes_no_sense_is_left_out(
    broker: Mosquitto, listener: Listener, topic: str, payload: str | bytes
) -> None:
    listener.say(topic, payload, retain=True)
    be(listener, "hall")

    async def work(fleet: Fleet) -> None:
        news = await until(fleet, lambda news: any(not one.lost for one in news.partners))
        assert [one.name for one in news.partners] == ["hall"]

    run(broker, work)


def test_a_broker_that_is_gone_makes_all_look_lost_until_it_is_back(
    broker: Mosquitto, listener: Listener
) -> None:
    be(listener, "hall")

    async def work(fleet: Fleet) -> None:
        await until(fleet, lambda news: news.partners and not news.partners[0].lost)
        broker.kill()
        news = await until(fleet, lambda news: not news.connected)
        assert news.partners[0].lost
        with pytest.raises(UnreachableError, match="switches"):
            await fleet.stop()
        broker.start()
        news = await until(fleet, lambda news: news.connected)
        assert news.partners[0].lost  # it has not spoken again

    run(broker, work)


def test_no_more_partners_than_a_fleet_may_have(broker: Mosquitto, listener: Listener) -> None:
    for number in range(LARGEST + 5):
        listener.say(Topics(f"p{number}").available, "online", retain=True)

    async def work(fleet: Fleet) -> None:
        await until(fleet, lambda news: len(news.partners) == LARGEST)
        listener.say(Topics("p0").available, "offline", retain=True)
        news = await until(fleet, lambda news: any(one.lost for one in news.partners))
        assert len(news.partners) == LARGEST

    run(broker, work)


@pytest.mark.parametrize(("partners", "words"), [(0, "no partner"), (3, "more than 2 partners")])
def test_what_was_not_looked_at_is_no_success(
    broker: Mosquitto,
    listener: Listener,
    monkeypatch: pytest.MonkeyPatch,
    partners: int,
    words: str,
) -> None:
    monkeypatch.setattr("miburi.interface.fleet.LARGEST", 2)
    for number in range(partners):
        be(listener, f"p{number}", stopped=StopReason.ASKED)
    with pytest.raises(UnreachableError, match=words):
        asyncio.run(stop_and_look(find_broker(f"127.0.0.1:{broker.port}")))


@pytest.mark.parametrize("name", ["kitchen", "all"])
def test_stop_reaches_a_living_partner_and_says_who_has_not_stopped(
    broker: Mosquitto, listener: Listener, live: Runner, name: str
) -> None:
    be(listener, "attic", "offline")
    be(listener, "hall")  # it says that it moves, and goes on saying so
    address = find_broker(f"127.0.0.1:{broker.port}")
    with at_home(live, address) as server, connect(server.url) as partner:
        listener.hear(Topics("kitchen").available, lambda text: text == "online")
        stopped, others = asyncio.run(stop_and_look(address, name))
        assert stopped == ["kitchen"]
        assert others == ([] if name == "kitchen" else ["attic", "hall"])
        assert partner.state.stop is not None


def test_who_is_not_there_cannot_be_stopped(broker: Mosquitto, listener: Listener) -> None:
    be(listener, "hall")
    with pytest.raises(InputError, match="there are: hall"):
        asyncio.run(stop_and_look(find_broker(f"127.0.0.1:{broker.port}"), "cellar"))
