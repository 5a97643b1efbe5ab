"""The fleet's page: partners that need a person come first, Stop names them, axe-core passes."""

import json

import pytest
from playwright.sync_api import Page, expect
from tests.fixtures.broker import Listener, Mosquitto
from tests.fixtures.browser import PHONE, look_over
from tests.fixtures.live import serving

from miburi.doors.broker import find_broker
from miburi.doors.fleet import Fleet
from miburi.doors.topics import Topics
from miburi.serving.access import Gate
from miburi.studio.fleet_page import make_fleet_app

CALM = {"feeling": "happiness", "mood": 60, "paused": False, "stopped": None, "motor": None,
        "held": False, "stops_today": 0, "temperatures": {}}  # fmt: skip


def be(listener: Listener, name: str, available: str = "online", **more: object) -> None:
    """Act as a partner."""
    listener.say(Topics(name).report, json.dumps(CALM | more), retain=True)
    listener.say(Topics(name).available, available, retain=True)


@pytest.mark.proof("test_the_table_in_the_terminal")
def test_the_page_of_a_fleet(page: Page, broker: Mosquitto, listener: Listener) -> None:
    be(listener, "bath", studio="https://192.168.1.4:8081")
    be(listener, "attic", "offline")
    be(listener, "shed", "offline", ended=True)
    be(listener, "hall", stopped="contact", motor="waist")
    fleet = Fleet(find_broker(f"127.0.0.1:{broker.port}"))
    page.set_viewport_size(PHONE)
    with serving(Gate(make_fleet_app(fleet)), lifespan=True) as url:
        page.goto(url)
        names = page.locator("tbody tr td:first-child")
        expect(names).to_have_text(["hall", "attic", "bath", "shed"])
        expect(page.get_by_role("status")).to_have_text("4 partners, 1 stopped, 1 lost, 1 off.")
        expect(names.nth(2).get_by_role("link")).to_have_attribute(
            "href", "https://192.168.1.4:8081"
        )
        expect(page.get_by_role("button", name="Stop all")).to_be_in_viewport()
        found = look_over(page, "the fleet")
        page.get_by_role("searchbox").fill("BA")
        expect(names).to_have_text(["bath"])
        page.get_by_role("searchbox").fill("")
        page.get_by_role("button", name="Stop: bath").click()
        listener.hear(Topics("bath").stop)
        be(listener, "bath", stopped="asked", held=True)
        expect(page.get_by_role("status")).to_contain_text(
            "All partners that were to stop have stopped."
        )
        page.get_by_role("button", name="Stop all").click()
        expect(page.get_by_role("alert")).to_contain_text("stopped: hall, attic.", timeout=15_000)
        broker.kill()
        expect(page.get_by_role("alert")).to_contain_text("No connection to the broker")
        found += look_over(page, "without its broker")
        page.goto("about:blank")
    assert found == []
