"""A face that the eyes see: where the live partner turns, and what it does not take."""

import numpy as np
import pytest
from tests.fixtures.live import Server, run, until
from tests.fixtures.waiting import post

from miburi import connect
from miburi.bodies import BodyState
from miburi.gestures import look
from miburi.live.attention import FADES, TURN, Attending
from miburi.live.gaze import FORGOTTEN, Gaze
from miburi.live.runner import STEP, Runner
from miburi.live.wishes import Attend, Perform, See, Sense, Speak
from miburi.robot import JOINTS
from miburi.safety.stop import Phase
from miburi.senses import Impression

WAIST = JOINTS.index("waist")


def body(time: float, waist: float = 0.0) -> BodyState:
    angles = np.zeros(8)
    angles[WAIST] = waist
    return BodyState(time, angles, np.zeros(8), Phase.IDLE, None)


def test_the_left_of_a_picture_is_the_partners_left() -> None:
    gaze = Gaze(rides=False)
    for x, degrees in ((0.5, 0.0), (0.0, 32.0), (1.0, -32.0)):
        gaze.see(x, body(1.0))
        assert np.degrees(gaze.turn(1.0)) == pytest.approx(degrees)


def test_a_camera_on_the_head_turns_with_it() -> None:
    riding, standing = Gaze(rides=True), Gaze(rides=False)
    for gaze in (riding, standing):
        gaze.see(0.5, body(1.0, waist=0.3))
    assert riding.turn(1.0) == pytest.approx(0.3), "who is in the middle is where it looks"
    assert standing.turn(1.0) == 0.0


def test_who_is_no_longer_told_of_has_gone() -> None:
    gaze = Gaze(rides=False)
    gaze.see(0.2, body(1.0))
    assert gaze.turn(1.0 + FORGOTTEN) > 0
    assert gaze.turn(1.1 + FORGOTTEN) == 0.0
    gaze.see(0.2, body(8.0))
    gaze.see(None, body(8.1))
    assert gaze.turn(8.1) == 0.0


def test_a_live_partner_turns_to_a_face_and_back(runner: Runner) -> None:
    for _ in range(4):
        runner.ask(See(0.0))
        states = run(runner, 2.0)
    assert states[-1].angles[WAIST] == pytest.approx(0.5, abs=0.02)  # as far as "playful" goes
    assert all(now.stop is None for now in states)
    until(runner, lambda state: abs(state.angles[WAIST]) < 0.02, FORGOTTEN + 14.0)


def test_a_face_moves_no_stopped_body(runner: Runner) -> None:
    runner.ask(See(0.0))
    run(runner, 1.0)
    runner.stop()
    held = run(runner, 0.5)[-1]
    for x in (1.0, None, 1.0):
        runner.ask(See(x))
        assert run(runner, 1.0)[-1].phase == "stopped"
    assert run(runner, 0.1)[-1].angles[WAIST] == pytest.approx(held.angles[WAIST], abs=0.01)


def test_eyes_go_first_and_come_back_as_the_head_follows(runner: Runner) -> None:
    runner.ask(Perform(None, look(runner.robot, "left", 2.0), "look"))
    begun = until(runner, lambda state: state.phase == "moving")
    assert begun.eyes[0] == 1.0  # the partner's left is the right of its face
    assert abs(begun.angles[WAIST]) < 0.05
    there = until(runner, lambda state: state.phase == "idle")
    assert there.eyes == pytest.approx((0.0, 0.0), abs=0.05)
    assert there.angles[WAIST] > 0.6
    runner.ask(Perform(None, look(runner.robot, "down", 2.0), "look"))
    assert until(runner, lambda state: state.eyes[1] > 0.5)
    runner.stop()
    assert run(runner, 0.1)[-1].eyes == (0.0, 0.0)


def attention(attending: Attending, seconds: float, sentence: int | None = None) -> str | None:
    """Return the partner's attention after ``seconds``, while it says a sentence, if any."""
    return [attending.step(STEP, sentence) for _ in range(round(seconds / STEP))][-1]


def test_it_attends_to_a_talker_and_to_nobody_later() -> None:
    attending = Attending()
    assert attention(attending, 0.1) is None
    attending.begin("listening")
    assert attention(attending, FADES["listening"] - 0.1) == "listening"
    assert attention(attending, 0.2) is None
    assert attention(attending, 0.5, sentence=1) == "speaking"
    assert attention(attending, TURN - 0.1) == "listening"
    assert attention(attending, 0.2) is None


def test_an_interruption_makes_it_think() -> None:
    attending = Attending()
    assert attention(attending, 0.5, sentence=1) == "speaking"
    attending.begin("thinking")
    attending.begin("listening")  # sent before it, and late
    assert attention(attending, 0.5, sentence=1) == "thinking"
    assert attention(attending, 12.0) == "thinking"
    assert attention(attending, 0.1, sentence=2) == "speaking"


def test_a_live_partner_attends(runner: Runner) -> None:
    told = []
    for wish in (
        Attend("listening"), Sense(Impression(None, 0.0, "speech")), Speak("A good question."),
    ):  # fmt: skip
        runner.ask(wish)
        told.append(run(runner, 0.1)[-1].attention)
    assert told == ["listening", "thinking", "speaking"]
    assert until(runner, lambda state: state.attention != "speaking").attention == "listening"


def test_a_turn_and_a_face_go_over_the_interface_as_a_place_alone(server: Server) -> None:
    def tell(path: str, **content: object) -> int:
        return post(f"{server.url}/api/v1/{path}", json=content).status_code

    with connect(server.url) as partner:
        partner.attend()
        assert partner.state.attention == "listening"
    right = (tell("attend", turn="thinking"), tell("face", x=0.2), tell("face", x=None))
    assert right == (204, 204, 204)
    for wrong in ({}, {"turn": "speaking"}, {"turn": None}, {"turn": "listening", "who": "me"}):
        assert tell("attend", **wrong) == 422
    for wrong in ({}, {"x": 1.5}, {"x": "left"}, {"x": 0.2, "picture": "/9j/"}):
        assert tell("face", **wrong) == 422
