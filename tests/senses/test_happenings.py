"""Touches, motions and sounds: what each brings, over the interface, and what it never does."""

from pathlib import Path

import httpx
import pytest
from tests.fixtures.live import Server, block, interface, run, serving
from tests.fixtures.waiting import post

import miburi
from miburi.errors import DescriptionError, InputError
from miburi.feelings import FEELINGS, shipped_temperament
from miburi.interface.api import NOTICED_BURST, NOTICED_RATE
from miburi.live.runner import Runner
from miburi.live.wishes import Sense
from miburi.senses import stimuli
from miburi.senses.happenings import MAKES_UP, happenings, notice


@pytest.mark.parametrize(
    ("kind", "feeling"),
    [
        ("stroke", "happiness"), ("pat", "happiness"), ("poke", "anger"), ("shake", "fright"),
        ("knock", "surprise"), ("drop", "fright"), ("startle", "fright"),
        ("smile", "happiness"), ("sad_face", "sadness"), ("greet", "happiness"),
    ],
)  # fmt: skip
def test_each_brings_its_feeling_and_says_why(kind: str, feeling: str) -> None:
    one = notice(kind)
    assert one.feeling == feeling
    assert one.reason.startswith(f"'{kind.replace('_', ' ')}': {feeling} ")
    assert notice(kind, 0.5).strength == pytest.approx(one.strength / 2)


def test_a_stroke_makes_up_for_a_contact_and_a_poke_does_not() -> None:
    plain, late = notice("stroke"), notice("stroke", since_contact=MAKES_UP + 0.1)
    soon = notice("stroke", since_contact=MAKES_UP)
    assert soon.strength > plain.strength == late.strength
    assert notice("poke", since_contact=1.0) == notice("poke")


@pytest.mark.parametrize("clearness", [-0.1, 1.1, float("nan")])
def test_a_clearness_that_is_none_is_refused(clearness: float) -> None:
    with pytest.raises(InputError):
        notice("startle", clearness)


def test_the_temperament_says_what_startles() -> None:
    """A calm partner is startled half as much as one that takes over what it hears."""
    clap = notice("startle")
    (calm,) = stimuli(clap, shipped_temperament("calm"))
    (default,) = stimuli(clap, shipped_temperament())
    assert calm.strength == default.strength / 2


def test_an_unhappy_face_weighs_less_than_a_smile() -> None:
    """A model of single pictures is often wrong about it."""
    for kind in ("sad_face", "angry_face", "scared_face", "disgusted_face"):
        assert notice(kind).strength <= notice("smile").strength / 2


def test_a_touch_is_felt_over_the_interface_and_the_log_says_why(server: Server) -> None:
    answer = post(server.url + "/api/v1/sense", json={"kind": "stroke"})
    assert answer.status_code == 204
    with miburi.connect(server.url) as partner:
        now = next(now for now in partner.watch() if max(now.emotion) > 0)
        assert now.felt is not None
        assert now.felt.feeling == "happiness"
        entry = next(entry for entry in partner.log() if entry.kind == "stimulus")
        assert (entry.source, entry.detail) == ("touch", "'stroke': happiness 0.60")
        assert now.spoken is None


def test_a_stroke_soon_after_a_contact_is_felt_more(runner: Runner) -> None:
    block(runner)
    runner.start()
    try:
        with serving(interface(runner)) as url:
            post(url + "/api/v1/sense", json={"kind": "stroke"}).raise_for_status()
    finally:
        runner.close(patience=0.0)
    felt = [entry for entry in runner.history.after(0) if entry.kind == "stimulus"]
    assert [(entry.feeling, entry.strength) for entry in felt] == [("happiness", 1.0)]


def test_what_is_no_happening_is_refused(server: Server) -> None:
    wrong = [
        {"kind": "kick"}, {}, {"kind": "stroke", "clearness": 1.5}, {"kind": "pat", "stop": False},
        {"kind": "pat", "sound": "UklGRg=="}, {"kind": ["pat"]},
    ]  # fmt: skip
    answers = [post(server.url + "/api/v1/sense", json=content).status_code for content in wrong]
    assert answers == [422] * len(wrong)


def test_a_flood_is_held_up_and_no_stop_with_it(server: Server) -> None:
    with httpx.Client(base_url=server.url + "/api/v1", verify=False) as client:
        answers, elapsed = [], 0.0
        for _ in range(60):
            answers.append(client.post("/sense", json={"kind": "drop"}))
            elapsed += answers[-1].elapsed.total_seconds()
        taken = [answer for answer in answers if answer.status_code == 204]
        refused = [answer for answer in answers if answer.status_code == 429]
        assert taken
        # A computer so slow that it sends fewer than the allowed number has no flood.
        assert refused or elapsed > (60 - NOTICED_BURST) / NOTICED_RATE
        assert len(taken) + len(refused) == 60
        assert len(taken) <= NOTICED_BURST + NOTICED_RATE * (elapsed + 1)
        assert all("a second" in answer.json()["detail"] for answer in refused)
        assert client.post("/stop").status_code == 204


def test_no_happening_frees_a_stopped_body_or_changes_the_rule(runner: Runner) -> None:
    """A stop stays, whatever is noticed; and a contact is felt as no touch."""
    block(runner)
    before = len([entry for entry in runner.history.after(0) if entry.kind == "stimulus"])
    assert before == 0
    held = runner.snapshot.state.angles
    runner.stop()
    rule = runner.body.motors().rule
    for kind in happenings():
        runner.ask(Sense(notice(kind)))
        states = run(runner, 0.2)
        assert {state.phase for state in states} == {"stopped"}
    assert runner.body.motors().rule == rule
    assert runner.snapshot.state.angles == pytest.approx(held, abs=0.1)
    assert runner.snapshot.state.emotion[FEELINGS.index("fright")] > 0


def test_a_mistyped_key_in_a_file_of_ones_own_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    own = tmp_path / "own.toml"
    own.write_text('[happening.rain]\nsource = "application"\nfeeling = "fear"\nstrenght = 1.0\n')
    monkeypatch.setenv("MIBURI_SENSES", str(own))
    happenings.cache_clear()
    try:
        with pytest.raises(DescriptionError, match="strenght.*the known ones are .*strength"):
            happenings()
    finally:
        happenings.cache_clear()
