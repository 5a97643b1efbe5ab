"""The fleet's page, and the command that shows it."""

import os
import re
import subprocess
from contextlib import suppress

import pytest
from tests.doors.test_fleet import be
from tests.fixtures.broker import Listener, Mosquitto
from tests.fixtures.command import COMMAND, miburi
from tests.fixtures.live import serving
from tests.fixtures.program import own_environment
from tests.fixtures.waiting import get, post, until

from miburi.doors.broker import find_broker
from miburi.doors.fleet import Fleet
from miburi.doors.topics import Topics
from miburi.serving.access import Gate
from miburi.studio.fleet_page import make_fleet_app


def test_the_page_speaks_both_languages_and_only_to_this_computer(
    broker: Mosquitto, listener: Listener
) -> None:
    fleet = Fleet(find_broker(f"127.0.0.1:{broker.port}"))
    listener.say(Topics("hall").available, "online", retain=True)
    with serving(Gate(make_fleet_app(fleet)), lifespan=True) as url:
        assert "Stop all" in get(url).text
        assert "すべて停止" in get(url, headers={"Accept-Language": "ja"}).text
        news = until(lambda: get(url + "/api/v1/fleet").json(), lambda news: news["partners"])
        assert news["connected"]
        assert [one["name"] for one in news["partners"]] == ["hall"]
        assert post(url + "/api/v1/stop", json={"name": "hall"}).status_code == 204
        listener.hear(Topics("hall").stop)
        assert post(url + "/api/v1/stop", json={}).status_code == 204
        listener.hear(Topics("all").stop)
        cellar = post(url + "/api/v1/stop", json={"name": "cellar"})
        assert (cellar.status_code, cellar.json()["detail"].count("hall")) == (400, 1)
        evil = {"Origin": "https://evil.example"}
        assert post(url + "/api/v1/stop", json={}, headers=evil).status_code == 403
        assert get(url, headers={"Host": "evil.example"}).status_code == 403
        broker.kill()
        until(lambda: not get(url + "/api/v1/fleet").json()["connected"])
        assert post(url + "/api/v1/stop", json={}).status_code == 503


def test_the_table_in_the_terminal(broker: Mosquitto, listener: Listener) -> None:
    listener.say(Topics("hall").available, "online", retain=True)
    ours, terminal = os.openpty()
    with subprocess.Popen(
        [*COMMAND, "fleet", "--broker", f"127.0.0.1:{broker.port}", "--port", "0"],
        stdout=terminal, stderr=terminal, env={**own_environment(), "COLUMNS": "100"},
    ) as process:  # fmt: skip
        os.close(terminal)
        said = ""
        while "hall" not in said:
            said += os.read(ours, 4096).decode(errors="replace")
        page = re.search(r"http://[\w.]+:\d+", said)
        assert page
        assert get(page.group() + "/api/v1/fleet").json()["partners"]
        process.terminate()
        with suppress(OSError):  # the terminal has closed
            while text := os.read(ours, 4096).decode(errors="replace"):
                said += text
    os.close(ours)
    assert "stops today" in said
    assert "Traceback" not in said


@pytest.mark.parametrize(
    ("name", "code", "words"),
    [
        ("hall", 1, "hall did not confirm it"),
        ("cellar", 2, "there are: hall, shed"),
        ("shed", 0, "shed was switched off, and this broker has not heard of it since."),
    ],
)
def test_stop_from_the_terminal_says_what_became_of_it(
    broker: Mosquitto, listener: Listener, name: str, code: int, words: str
) -> None:
    listener.say(Topics("hall").available, "online", retain=True)
    be(listener, "shed", "offline", ended=True)
    done = miburi("fleet", "--broker", f"127.0.0.1:{broker.port}", "--stop", name)
    assert done.returncode == code
    assert words in done.stdout + done.stderr
