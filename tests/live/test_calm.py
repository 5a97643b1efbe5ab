"""After a distress the partner is calm for ten minutes of its own time, at every door."""

import pytest
from fastapi.testclient import TestClient
from tests.fixtures.live import run, until

from miburi.feelings import Expression, Stimulus
from miburi.interface.api import make_api
from miburi.live.runner import Runner
from miburi.live.speaker import CALM
from miburi.live.wishes import AllowWords, ChangeBody, Feel, Perform, Sense, Speak
from miburi.senses import Impression
from miburi.senses.words import hear
from miburi.studio.contact_panel import line
from miburi.studio.words import words
from miburi.talk.care import Care

FALL = Impression(None, 0.0, "speech", distress="fall")


def test_distress_is_an_event_with_no_words_unless_the_user_allows_them(runner: Runner) -> None:
    runner.ask(Sense(FALL, "I fell in the hall"))
    run(runner, 0.1)
    runner.ask(AllowWords(True))
    runner.ask(Sense(FALL, "I fell in the bath"))
    run(runner, 0.1)
    told = [(e.name, e.text) for e in runner.history.after(0) if e.kind == "distress"]
    assert told == [("fall", None), ("fall", "I fell in the bath")]
    for language, said in (
        ("en", "Distress heard: a fall"),
        ("ja", "助けを求める言葉：転倒や転落"),
    ):
        wordless, with_words = (
            line(entry, words(language))
            for entry in runner.history.after(0)
            if entry.kind == "distress"
        )
        assert wordless == said
        assert "I fell in the bath" in with_words
    heard = runner.snapshot.state.distress
    assert heard is not None
    assert (heard.kind, heard.words) == ("fall", "I fell in the bath")


def test_a_feeling_that_it_has_is_not_shown_and_none_comes_by_words(runner: Runner) -> None:
    runner.ask(Feel(Stimulus("anger", 1.0, "face")))
    until(runner, lambda state: state.expressed is not None)
    runner.ask(Sense(FALL))
    until(runner, lambda state: state.expressed is None)
    felt = runner.ask(Sense(hear("I am furious with you")))
    states = run(runner, 2.0)
    assert felt.result() == ()
    assert all(state.expressed is None and not any(state.face) for state in states)
    spoken = runner.ask(Speak("I am here."))
    run(runner, 0.1)
    assert spoken.result()
    assert runner.snapshot.state.spoken is not None
    assert runner.snapshot.state.spoken.feeling is None, "no feeling colours its voice"
    runner.ask(Perform(Expression("happiness", 0.5)))
    until(runner, lambda state: state.asked)  # somebody may still ask for a gesture, and stop it
    runner.stop()
    assert run(runner, 0.2)[-1].phase == "stopped"


def test_ten_minutes_later_it_is_itself_again(
    runner: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert CALM == 600
    monkeypatch.setattr("miburi.live.speaker.CALM", 2.0)
    runner.ask(Sense(FALL))
    assert run(runner, 1.9)[-1].distress is not None
    assert run(runner, 0.2)[-1].distress is None
    runner.ask(Feel(Stimulus("happiness", 1.0, "face")))
    until(runner, lambda state: state.expressed is not None)


def test_another_body_is_as_calm(runner: Runner) -> None:
    runner.ask(Sense(FALL))
    run(runner, 0.1)
    used = runner.ask(ChangeBody("simulated"))
    runner.ask(Feel(Stimulus("anger", 1.0, "face")))
    assert all(state.expressed is None for state in run(runner, 1.5))
    used.result()


def test_over_http_help_names_the_number_and_words_are_told_if_allowed(live: Runner) -> None:
    live.ask(AllowWords(True)).result(10)
    app = make_api(live, care=Care("GB"))
    with TestClient(app) as client:
        answer = client.post("/api/v1/say", json={"text": "I fell and can't get up"}).json()
        state = client.get("/api/v1/state").json()
        log = client.get("/api/v1/log").json()
        after = client.post("/api/v1/say", json={"text": "I am so sad"}).json()
    assert (answer["distress"], answer["feeling"], answer["felt"]) == ("fall", None, [])
    assert answer["answer"] == Care("GB").help("fall", "en", 0)
    assert state["distress"]["kind"] == "fall"
    assert [e["text"] for e in log if e["kind"] == "distress"] == ["I fell and can't get up"]
    assert (after["answer"], after["felt"]) == (Care("GB").stay("en", 0), [])


def test_no_feeling_is_heard_in_what_is_said_after_distress(live: Runner) -> None:
    # Else the page says "I heard anger" to somebody who lies on the floor.
    with TestClient(make_api(live)) as client:
        before = client.post("/api/v1/say", json={"text": "I am so sad"}).json()
        client.post("/api/v1/say", json={"text": "I fell and can't get up"})
        after = client.post("/api/v1/say", json={"text": "I am so sad"}).json()
        log = client.get("/api/v1/log").json()
    assert (before["feeling"], after["feeling"]) == ("sadness", None)
    assert (after["strength"], after["why"]) == (0.0, [])
    assert [e.get("feeling") for e in log if e["kind"] == "heard"] == ["sadness", None, None]
