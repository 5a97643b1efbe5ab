"""The fleet's page, and the command that shows it."""

import os
import re
import subprocess
import sys
from contextlib import suppress

import httpx
import pytest
from tests.fixtures.broker import Listener, Mosquitto
from tests.fixtures.live import own_environment, serving

from miburi.interface.access import Gate
from miburi.interface.broker import find_broker
from miburi.interface.fleet import Fleet
from miburi.interface.report import Topics
from miburi.studio.fleet_page import make_fleet_app


def test_the_page_speaks_both_languages_and_only_to_this_computer(
    broker: Mosquitto, listener: Listener
) -> None:
    fleet = Fleet(find_broker(f"127.0.0.1:{broker.port}"))
    listener.say(Topics("hall").available, "online", retain=True)
    with serving(Gate(make_fleet_app(fleet)), lifespan=True) as url:
        assert "Stop all" in httpx.get(url).text
        assert "すべて停止" in httpx.get(url, headers={"Accept-Language": "ja"}).text
        while not (news := httpx.get(url + "/api/v1/fleet").json())["partners"]:
            pass
        assert news["connected"]
        assert [one["name"] for one in news["partners"]] == ["hall"]
        assert httpx.post(url + "/api/v1/stop", json={"name": "hall"}).status_code == 204
        listener.hear(Topics("hall").stop)
        assert httpx.post(url + "/api/v1/stop", json={}).status_code == 204
        listener.hear(Topics("all").stop)
        cellar = httpx.post(url + "/api/v1/stop", json={"name": "cellar"})
        assert (cellar.status_code, cellar.json()["detail"].count("hall")) == (400, 1)
        evil = {"Origin": "https://evil.example"}
        assert httpx.post(url + "/api/v1/stop", json={}, headers=evil).status_code == 403
        assert httpx.get(url, headers={"Host": "evil.example"}).status_code == 403
        broker.kill()
        while httpx.get(url + "/api/v1/fleet").json()["connected"]:
            pass
        assert httpx.post(url + "/api/v1/stop", json={}).status_code == 503


def command(*options: str) -> list[str]:
    return [sys.executable, "-m", "miburi", "fleet", *options]


def test_the_table_in_the_terminal(broker: Mosquitto, listener: Listener) -> None:
    listener.say(Topics("hall").available, "online", retain=True)
    ours, terminal = os.openpty()
    with subprocess.Popen(
        command("--broker", f"127.0.0.1:{broker.port}", "--port", "0"),
        stdout=terminal, stderr=terminal, env={**own_environment(), "COLUMNS": "100"},
    ) as process:  # fmt: skip
        os.close(terminal)
        said = ""
        while "hall" not in said:
            said += os.read(ours, 4096).decode(errors="replace")
        page = re.search(r"http://[\w.]+:\d+", said)
        assert page
        assert httpx.get(page.group() + "/api/v1/fleet").json()["partners"]
        process.terminate()
        with suppress(OSError):  # the terminal has closed
            while text := os.read(ours, 4096).decode(errors="replace"):
                said += text
    os.close(ours)
    assert "stops today" in said
    assert "Traceback" not in said


@pytest.mark.parametrize(
    ("name", "code", "words"),
    [("hall", 1, "hall did not say so"), ("cellar", 2, "there are: hall")],
)
def test_stop_from_the_terminal_says_what_became_of_it(
    broker: Mosquitto, listener: Listener, name: str, code: int, words: str
) -> None:
    listener.say(Topics("hall").available, "online", retain=True)
    done = subprocess.run(
        command("--broker", f"127.0.0.1:{broker.port}", "--stop", name),
        capture_output=True, text=True, check=False, env=own_environment(),
    )  # fmt: skip
    assert done.returncode == code
    assert words in done.stderr
