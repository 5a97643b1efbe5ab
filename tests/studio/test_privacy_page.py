"""The privacy page says what is on, of everything that can be."""

from dataclasses import fields
from html import unescape
from pathlib import Path

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from tests.fixtures.keys import keys

from miburi.doors.broker import Broker
from miburi.doors.doors import Doors
from miburi.doors.ros_network import RosNetwork
from miburi.live.runner import Runner
from miburi.serving.reach import Reach
from miburi.studio.privacy_page import privacy_router, switches
from miburi.studio.words import page_languages, words
from miburi.talk.endpoint import Endpoint

OPEN = Doors(
    agents=True,
    broker=Broker("broker.local", 1883, user="anna", password="secret"),
    talk=Endpoint("https://models.example/v1", "some-model", "models-key"),
    ros=RosNetwork(),
)
SAFE = Reach(("https://192.168.1.4:8081",), keys("a-token"), b"PEM", "AB:CD")


def page(runner: Runner, doors: Doors, reach: Reach, language: str = "en") -> str:
    app = FastAPI()
    app.include_router(privacy_router(runner, reach, doors))
    answer = TestClient(app).get("/privacy", headers={"Accept-Language": language})
    assert answer.status_code == 200
    return answer.text


def test_every_door_has_a_switch() -> None:
    names = {each.name for each in switches(Doors(), Reach(), said=False, recording=False)}
    assert {field.name for field in fields(Doors)} - {"name", "care", "seed"} <= names


@pytest.mark.parametrize("language", page_languages())
def test_with_all_closed_nothing_is_on(runner: Runner, language: str) -> None:
    said = page(runner, Doors(), Reach(), language)
    say = words(language)["privacy"]
    assert 'class="now on"' not in said
    assert said.count(f">{say['is_off']}<") == len(
        switches(Doors(), Reach(), said=False, recording=False)
    )


def test_with_all_open_it_names_with_whom_and_no_secret(runner: Runner) -> None:
    runner.recordings.start()
    runner.tick()
    try:
        said = page(runner, OPEN, SAFE)
    finally:
        runner.recordings.end()
    assert said.count('class="now on"') == 6, "by https, so not by plain http"
    for where in ("broker.local gets", "go to models.example"):
        assert where in said
    for secret in ("a-token", "models-key", "anna", "secret", "AB:CD", str(Path.home())):
        assert secret not in said
    assert "Nothing is encrypted" in page(
        runner, Doors(), Reach(("http://192.168.1.4",), keys("t"))
    )


@pytest.mark.parametrize("language", page_languages())
def test_each_sense_is_there_in_its_own_words(runner: Runner, language: str) -> None:
    said = unescape(page(runner, Doors(), Reach(), language))
    senses = words(language)["senses"]
    assert {"voice_about", "motion_about", "ears_about", "eyes_about"} <= senses.keys()
    for key in senses:
        if key.endswith("_about"):
            assert senses[key] in said
