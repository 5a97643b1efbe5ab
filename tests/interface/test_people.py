"""What it knows of people: told in talk, seen, corrected and deleted over the interface."""

import asyncio
import errno
import os
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from miburi.feelings import FEELINGS
from miburi.interface.api import make_api
from miburi.languages import Language
from miburi.live.runner import Runner
from miburi.talk.script import script


class House:
    """A partner at home, and its interface, at a time that a test moves."""

    def __init__(self, live: Runner, folder: Path) -> None:
        self.now = datetime(2026, 11, 25, 9, tzinfo=UTC)
        self.live, self.folder = live, folder
        self.client = TestClient(make_api(live, folder=folder, clock=lambda: self.now))

    def say(self, text: str) -> str:
        answer = self.client.post("/api/v1/say", json={"text": text})
        assert answer.status_code == 200, answer.text
        return str(answer.json()["answer"])

    def post(self, path: str, **wish: object) -> int:
        return int(self.client.post(f"/api/v1/people{path}", json=wish).status_code)

    def people(self) -> dict[str, object]:
        return dict(self.client.get("/api/v1/people").json())

    def facts(self) -> list[str]:
        (person,) = self.people()["people"]  # type: ignore[misc]
        return [fact["text"] for fact in person["facts"]]


@pytest.fixture
def house(live: Runner, tmp_path: Path) -> Iterator[House]:
    one = House(live, tmp_path / "home")
    one.folder.mkdir()
    with one.client:
        yield one


def test_a_name_and_facts_are_known_again_after_a_restart(house: House, live: Runner) -> None:
    assert house.post("/allowed", allowed=True) == 204
    assert "Anna" in house.say("My name is Anna.")
    house.say("My daughter Julia comes on Sunday.")
    house.say("Remember that the plumber is called Mr Brown.")
    again = House(live, house.folder)
    assert "Anna" not in again.say("Who am I?"), "nobody has said who is there"
    assert again.post("/present", name="anna") == 204
    assert "Anna" in again.say("What is my name?")
    assert "Julia comes on Sunday" in again.say("When does my daughter come?")
    assert "Brown" in again.say("Do you remember what the plumber is called?")
    assert again.facts() == [
        "My daughter Julia comes on Sunday.",
        "the plumber is called Mr Brown",
    ]


@pytest.mark.parametrize(
    ("language", "said", "word"),
    [
        ("en", "Remember that the bus comes at nine.", "bus"),
        ("ja", "バスは九時に来ると覚えておいて。", "バス"),
        ("fr", "Retiens que le bus arrive à neuf heures.", "bus"),
    ],
)
def test_while_the_disk_is_full_it_promises_to_keep_nothing(
    house: House, language: Language, said: str, word: str
) -> None:
    def full(_file: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    house.post("/allowed", allowed=True)
    house.post("/present", name="Anna")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", full)
        assert house.say(said) in script(language).unkept
        house.say(said)
        (told,) = [each for each in house.live.history.after(0) if each.kind == "trouble"]
        assert "No space left on device" in (told.name or "")
        assert house.people()["trouble"] == told.name
    assert word in house.say(said)
    assert house.people()["trouble"] is None


def test_without_leave_nothing_is_written_and_it_forgets(house: House, live: Runner) -> None:
    house.say("My name is Anna.")
    house.say("My daughter Julia comes on Sunday.")
    assert "Sunday" in house.say("When does my daughter come?")
    assert list(house.folder.iterdir()) == []
    assert House(live, house.folder).people()["people"] == []


def test_nobody_is_told_what_somebody_else_told(house: House) -> None:
    house.say("My name is Anna.")
    house.say("My daughter Julia comes on Sunday.")
    house.say("My name is Bert.")
    assert "Sunday" not in house.say("When does my daughter come?")
    assert "Anna" not in house.say("Good night!")
    house.now += timedelta(hours=3)
    assert "Bert" not in house.say("What is my name?")


def test_what_somebody_told_before_their_name_is_theirs_and_nobody_elses(house: House) -> None:
    house.post("/allowed", allowed=True)
    house.say("Remember that the keys are in the drawer.")
    assert "drawer" in house.say("Do you remember where the keys are?")
    assert house.people()["people"] == []
    assert "drawer" not in (house.folder / "people.json").read_text(encoding="utf-8")
    house.say("I'm Anna, by the way.")
    assert house.facts() == ["the keys are in the drawer"]
    house.say("My name is Bert.")
    assert "drawer" not in house.say("Do you remember where the keys are?")


def test_a_person_corrects_and_deletes(house: House) -> None:
    house.post("/allowed", allowed=True)
    house.say("My name is Anna.")
    house.say("My sister Wilhelmina lives in Leeds.")
    assert house.post("/Anna/facts/1", text="My sister lives in York.") == 204
    assert house.facts() == ["My sister lives in York."]
    kept = (house.folder / "people.json").read_text(encoding="utf-8")
    assert "Wilhelmina" not in kept
    for method, path in (("DELETE", "/Bert"), ("DELETE", "/Anna/facts/9")):
        assert house.client.request(method, f"/api/v1/people{path}").status_code == 400
    assert house.client.delete("/api/v1/people/Anna/facts/1").status_code == 204
    assert house.facts() == []
    assert house.client.delete("/api/v1/people/Anna").status_code == 204
    assert house.people()["people"] == []
    house.post("/allowed", allowed=False)
    assert list(house.folder.iterdir()) == []


@pytest.mark.parametrize(
    ("method", "path"), [("DELETE", "/Anna"), ("DELETE", "/Anna/facts/1"), ("POST", "/allowed")]
)
@pytest.mark.parametrize("asks", ["Remember that.", "Say that again."])
def test_what_is_deleted_is_not_taken_up_again(
    house: House, method: str, path: str, asks: str
) -> None:
    """Of the last remarks it still knew who "she" was, and what "that" was."""
    house.post("/allowed", allowed=True)
    house.say("My name is Anna.")
    house.say("My sister Wilhelmina lives in Leeds.")
    body = {"allowed": False} if method == "POST" else None
    assert house.client.request(method, f"/api/v1/people{path}", json=body).status_code == 204
    answer = house.say(asks)
    assert "Wilhelmina" not in answer
    assert not answer.endswith(": ")
    house.say("Remember that her birthday is on Friday.")
    house.say("My name is Anna.")
    assert house.facts() == ["her birthday is on Friday"]


def test_no_question_order_mood_or_distress_is_kept(house: House) -> None:
    """No remark is taken for a name, either: all facts belong to one person."""
    house.post("/allowed", allowed=True)
    house.say("My name is Anna.")
    for said in (
        "Is my daughter here?",
        "Dance!",
        "I am so happy today!",
        "I'm tired.",
        "I am Tired Of This",
        "I have three sons, and not one of them would miss me.",
        "I fell and cannot get up.",
        "Remember that.",
        "My husband beats me and I have a knife.",
        "Stop",
    ):
        house.say(said)
        assert house.facts() == [], said


def test_on_a_full_disk_a_cry_for_help_is_answered_and_deletions_say_why_not(
    house: House, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_file: int) -> None:
        spoken.append(house.live.snapshot.state.spoken)
        raise OSError(errno.ENOSPC, "No space left on device")

    house.post("/allowed", allowed=True)
    house.post("/present", name="Anna")
    spoken: list[object] = []
    monkeypatch.setattr(os, "fsync", full)
    answer = house.say("Help me, I fell and I cannot get up!")
    assert [said and said.text for said in spoken] == [answer], "said before it writes"
    assert "Bert" in house.say("My name is Bert.")
    assert house.post("/allowed", allowed=True) == 507
    deleted = house.client.delete("/api/v1/people/Anna")
    assert deleted.status_code == 507
    assert "Make room" in deleted.json()["detail"]
    assert house.post("/allowed", allowed=False) == 204
    assert list(house.folder.iterdir()) == []


def test_no_writing_holds_up_the_server(house: House, monkeypatch: pytest.MonkeyPatch) -> None:
    """A Stop may come while the disk is slow."""

    def slow(_file: int) -> None:
        nonlocal written
        written += 1
        with pytest.raises(RuntimeError, match="no running event loop"):
            asyncio.get_running_loop()

    written = 0
    monkeypatch.setattr(os, "fsync", slow)
    house.post("/allowed", allowed=True)
    house.say("My name is Anna.")
    house.say("Remember that the key is under the pot.")
    house.post("/present", name="Bert")
    house.post("/Anna/facts/1", text="The key is gone.")
    house.post("/manners", on=True, most=4, quiet_from=20, quiet_to=9)
    for path in ("/Anna/facts/1", "/Anna"):
        assert house.client.delete(f"/api/v1/people{path}").status_code == 204
    assert written >= 8


def test_kindness_shows_in_the_resting_mood_of_that_person_alone(house: House) -> None:
    house.say("My name is Anna.")
    for _ in range(4):
        house.say("You are so sweet, I love being with you!")
        house.now += timedelta(hours=1)
    house.say("My name is Bert.")
    anna, bert = (person["leaning"] for person in house.people()["people"])  # type: ignore[attr-defined]
    assert set(anna) == set(FEELINGS)
    assert anna["happiness"] > bert["happiness"] == 0


def test_it_begins_only_as_allowed_and_keeps_that(house: House, live: Runner) -> None:
    assert house.client.get("/api/v1/people/manners").json()["on"] is False
    assert house.post("/manners", on=True, most=4, quiet_from=20, quiet_to=9) == 204
    again = House(live, house.folder)
    assert again.client.get("/api/v1/people/manners").json() == {
        "on": True, "most": 4, "quiet_from": 20, "quiet_to": 9,
    }  # fmt: skip
    assert house.post("/manners", most=2) == 204
    assert house.client.get("/api/v1/people/manners").json() == {
        "on": True, "most": 2, "quiet_from": 20, "quiet_to": 9,
    }  # fmt: skip
    for wrong in ({"most": 11}, {"most": True}, {"on": 1}, {"quiet_to": "9"}):
        assert house.post("/manners", **wrong) == 422
    (house.folder / "manners.json").write_text("{[", encoding="utf-8")
    broken = House(live, house.folder)
    assert broken.client.get("/api/v1/people/manners").json()["on"] is False
