"""What is said of the contact rule is what the rule that runs has."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from fastapi.testclient import TestClient
from tests.fixtures.live import block, interface, run

from miburi.feelings import FEELINGS, EmotionalModel, shipped_temperament
from miburi.live.recording.archive import Archive
from miburi.live.runner import STEP, Runner
from miburi.live.wishes import Release
from miburi.robot import Robot
from miburi.safety.free import FreeRule
from miburi.studio.contact_panel import facts, why
from miburi.studio.words import page_languages, words


def partner(robot: Robot, folder: Path, body: str = "simulated") -> Runner:
    """A partner whose rule judges over 50 ms, at 90 %, and by windows alone."""
    feelings = EmotionalModel(shipped_temperament("playful"))
    feelings.set_state(mood=dict.fromkeys(FEELINGS, 0.6))
    rule, far = FreeRule.of(robot), np.full(8, 300)
    guards = replace(rule.guards, behind=far, ahead=far)
    rule = replace(rule, guards=guards, period=50_000, ratio=9000)
    return Runner(robot, feelings, Archive(folder), body=body, rule=rule)


def test_pages_and_programs_see_the_running_rule(robot: Robot, tmp_path: Path) -> None:
    runner = partner(robot, tmp_path)
    ours = Runner(robot, EmotionalModel(), Archive(tmp_path))
    for language in page_languages():
        _, more = why(runner.snapshot.state, words(language))
        assert "90\N{NO-BREAK SPACE}%" in more
        assert "0.05\N{NO-BREAK SPACE}s" in more
        assert "93.72" not in more
        _, more = why(ours.snapshot.state, words(language))
        assert "93.72" in more
        assert "0.1\N{NO-BREAK SPACE}s" in more
    runner.tick()
    with TestClient(interface(runner)) as client:
        state = client.get("/api/v1/state").json()
        assert state["rule"] == {"period": 0.05, "ratio": 0.9}
        assert client.get("/api/v1/motors").json()["rule"] == state["rule"]
        assert client.get("/api/v1/robot").json()["threshold"] == 0.9


def test_a_contact_is_held_against_the_rule_that_stopped_it(robot: Robot, tmp_path: Path) -> None:
    runner = partner(robot, tmp_path)
    stop = block(runner).stop
    assert stop is not None
    assert stop.sign == "speed"
    assert "limit 0.9)" in facts(runner.snapshot.state, runner.history.after(0), words("en"))
    runner.ask(Release())
    run(runner, STEP)
    assert "limit 0.9)" in facts(runner.snapshot.state, runner.history.after(0), words("en"))


def test_a_card_has_a_rule_of_its_own(robot: Robot, tmp_path: Path, firmware: Path) -> None:
    runner = partner(robot, tmp_path, "emulated-card")
    assert runner.snapshot.state.rule.ratio == 0.9
    body = runner.body
    body.stop()
    body.configure(body.settings.with_rule(replace(FreeRule.of(robot), period=120_000, ratio=9100)))
    run(runner, 1.0)
    assert (runner.motors.rule.period, runner.motors.rule.ratio) == (0.12, 0.91)
    assert runner.snapshot.state.rule == runner.motors.rule
