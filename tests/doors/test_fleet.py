"""A fleet at a real Mosquitto: partners that report, partners that are lost, and Stop."""

import asyncio
import json
import re
import subprocess
import textwrap
from collections.abc import Awaitable, Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from tests.fixtures.broker import MOSQUITTO, Listener, Mosquitto, at_home

from miburi.client.remote import connect
from miburi.doors.broker import find_broker
from miburi.doors.fleet import Fleet, FleetOut, listening_to, stop_and_look
from miburi.doors.topics import HomeReport, Topics
from miburi.errors import InputError
from miburi.live.runner import Runner
from miburi.live.view import UnreachableError
from miburi.live.wishes import Release
from miburi.safety.stop import StopReason
from miburi.version import __version__


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
    """Nonsense is left out."""
    nonsense: list[tuple[str, str | bytes]] = [
        ("cellar/report", "{"),
        ("cellar/report", json.dumps({"feeling": "happiness"})),
        ("cellar/report", b"\xff"),
        ("<b>x/available", "online"),
        ("all/available", "online"),
        ("cellar", "online"),
    ]
    for topic, payload in nonsense:
        listener.say(f"miburi/{topic}", payload, retain=True)
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


def test_a_large_fleet_is_known_whole_and_has_its_bound(
    broker: Mosquitto, listener: Listener, monkeypatch: pytest.MonkeyPatch
) -> None:
    """More is kept for them than a broker, as it is installed, queues for a reader."""
    most = 600
    monkeypatch.setattr("miburi.doors.fleet.LARGEST", most)
    for number in range(most + 5):
        be(listener, f"p{number}")

    async def work(fleet: Fleet) -> None:
        async with asyncio.timeout(30):
            await fleet.greeted.wait()
        assert sum(one.report is not None for one in fleet.news.partners) == most
        assert fleet.overfull
        listener.say(Topics(fleet.news.partners[0].name).available, "offline", retain=True)
        news = await until(fleet, lambda news: any(one.lost for one in news.partners))
        assert len(news.partners) == most

    run(broker, work)


@pytest.mark.parametrize(("partners", "words"), [(0, "no partner"), (3, "more than 2 partners")])
def test_what_was_not_looked_at_is_no_success(
    broker: Mosquitto,
    listener: Listener,
    monkeypatch: pytest.MonkeyPatch,
    partners: int,
    words: str,
) -> None:
    monkeypatch.setattr("miburi.doors.fleet.LARGEST", 2)
    for number in range(partners):
        be(listener, f"p{number}", stopped=StopReason.ASKED, held=True)
    with pytest.raises(UnreachableError, match=words):
        asyncio.run(stop_and_look(find_broker(f"127.0.0.1:{broker.port}")))


def test_stop_reaches_a_living_partner_and_says_who_has_not_stopped(
    broker: Mosquitto, listener: Listener, live: Runner
) -> None:
    be(listener, "attic", "offline")
    be(listener, "hall", stopped="contact")  # it hears nothing, and soon goes on
    address = find_broker(f"127.0.0.1:{broker.port}")
    with at_home(live, address) as server, connect(server.url) as partner:
        listener.hear(Topics("kitchen").available, lambda text: text == "online")
        assert asyncio.run(stop_and_look(address, "kitchen")) == (["kitchen"], {}, [])
        assert partner.state.stop is not None
        assert asyncio.run(stop_and_look(address)) == (["kitchen"], {}, ["hall", "attic"])
        with pytest.raises(InputError, match="there are: attic, hall, kitchen"):
            asyncio.run(stop_and_look(address, "cellar"))


def test_a_partner_that_was_switched_off_is_not_lost_until_it_is_back(
    broker: Mosquitto, listener: Listener, live: Runner
) -> None:
    address = find_broker(f"127.0.0.1:{broker.port}")
    with at_home(live, address):
        listener.hear(Topics("kitchen").report, lambda text: __version__ in text)
    listener.hear(Topics("kitchen").available, lambda text: text == "offline")
    done = asyncio.run(stop_and_look(address))
    assert (done.held, [*done.off], done.unknown) == ([], ["kitchen"], [])
    assert not live.held, "it did not hear that"
    be(listener, "kitchen")
    be(listener, "kitchen", "offline")  # as its last will says

    async def work(fleet: Fleet) -> None:
        news = await until(fleet, lambda news: news.partners and news.partners[0].report)
        assert (news.partners[0].lost, news.partners[0].off) == (True, False)

    run(broker, work)


def test_a_partner_that_hangs_at_its_end_was_not_switched_off(
    broker: Mosquitto, listener: Listener, live: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    address = find_broker(f"127.0.0.1:{broker.port}")
    with at_home(live, address):
        listener.hear(Topics("kitchen").available, lambda text: text == "online")
        monkeypatch.setattr(type(live), "reachable", False)
    listener.hear(Topics("kitchen").available, lambda text: text == "offline")
    assert asyncio.run(stop_and_look(address)).unknown == ["kitchen"]


def test_a_group_is_a_fleet_of_its_own_and_all_is_all(
    broker: Mosquitto, listener: Listener, live: Runner
) -> None:
    """In one ward a partner lives; next door and in no ward others say that they do."""
    be(listener, "west/bath")
    be(listener, "hall")
    address = f"127.0.0.1:{broker.port}"
    ward = find_broker(address + "/east")
    with at_home(live, ward) as server, connect(server.url) as partner:
        listener.hear(Topics("east/kitchen").available, lambda text: text == "online")

        async def names(where: str) -> list[str]:
            fleet = Fleet(find_broker(where))
            async with listening_to(fleet):
                await until(fleet, lambda news: any("kitchen" in one.name for one in news.partners))
                return [one.name for one in fleet.news.partners]

        assert asyncio.run(names(address + "/east")) == ["kitchen"]
        assert asyncio.run(stop_and_look(ward)) == (["kitchen"], {}, [])
        listener.hear(Topics("east/all").stop)
        live.ask(Release(by_person=True)).result(60)
        stopped, _, others = asyncio.run(stop_and_look(find_broker(address)))
        assert (stopped, others) == (["east/kitchen"], ["hall", "west/bath"])
        assert partner.state.held


@pytest.mark.parametrize("wrong", ["/a/b", "/all", "/Ward", "/+", "/a%2Fb"])
def test_what_is_no_group_is_refused(wrong: str) -> None:
    with pytest.raises(InputError):
        find_broker("localhost" + wrong)


@pytest.mark.skipif(MOSQUITTO is None, reason="install the Debian package mosquitto")
def test_with_the_rights_on_the_page_a_stop_for_all_reaches_a_group(tmp_path: Path) -> None:
    page = Path(__file__).parents[2] / "docs" / "home.md"
    shown = re.search(
        r"^(    pattern .*\n)(    (pattern|user|topic) .*\n)+", page.read_text(), re.M
    )
    assert shown
    rights, passwords = tmp_path / "rights", tmp_path / "passwords"
    rights.write_text(textwrap.dedent(shown.group()))
    passwords.touch()
    for name in ("east", "everybody"):
        subprocess.run(["mosquitto_passwd", "-b", passwords, name, "secret"], check=True)
    broker = Mosquitto(
        tmp_path, f"user root\nallow_anonymous false\npassword_file {passwords}\nacl_file {rights}"
    )

    def at(name: str) -> Listener:
        return Listener(broker.port, lambda client: client.username_pw_set(name, "secret"))

    try:
        with closing(at("east")) as east, closing(at("everybody")) as everybody:
            # Kept by the broker, because a listener may subscribe later.
            east.say("miburi/east/kitchen/report", "here", retain=True)
            assert everybody.hear("miburi/east/kitchen/report") == "here"
            everybody.say("miburi/all/stop", "now", retain=True)
            assert east.hear("miburi/all/stop") == "now"
    finally:
        broker.kill()
