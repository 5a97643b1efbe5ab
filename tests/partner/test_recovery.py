"""From a stop back to life: contacts, pauses, who may release."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from tests.fixtures.partner import PaperBody, happy, of, run
from tests.partner.conftest import Moving

from miburi.bodies import BodyState
from miburi.bodies.simulated import Simulated
from miburi.errors import BodyError
from miburi.feelings import FEELINGS, EmotionalModel, Expression
from miburi.feelings.catalogue import FeelingName
from miburi.partner import (
    GestureEnded,
    GestureStarted,
    Partner,
    Released,
    Stopped,
    UnsettledError,
)
from miburi.partner.recovery import FIRST_PAUSE, LET_GO, LONGEST_PAUSE
from miburi.robot import Robot, forward
from miburi.safety.move import Move
from miburi.safety.stop import Phase, StopReason


def test_contact_lowers_the_mood_by_a_fifth_and_the_gesture_is_broken_off(robot: Robot) -> None:
    body, feelings = PaperBody(robot), happy(0.9)
    partner = Partner(body, feelings)
    run(partner, 0.3)
    body.touch()
    events = partner.step(0.02)
    stopped, ended = events
    assert isinstance(stopped, Stopped)
    assert (stopped.mood_before, stopped.mood_after) == pytest.approx((0.9, 0.72))
    assert ended == GestureEnded(ended.time, ended.expression, complete=False)
    assert partner.expression is None
    moves = len(body.moves)
    later = run(partner, FIRST_PAUSE - 0.1)
    assert later == []
    assert len(body.moves) == moves
    assert of(Released, run(partner, 0.2))
    assert body.phase is Phase.RETURNING
    again = of(GestureStarted, run(partner, 4.0))
    assert again[0].expression.mood == pytest.approx(0.72, abs=0.001)


def test_who_is_led_by_a_hand_keeps_its_mood_and_waits_until_it_is_still(robot: Robot) -> None:
    body, feelings = PaperBody(robot), happy(0.9)
    partner = Partner(body, feelings)
    body.touch(StopReason.TOUCHED)
    (stopped,) = partner.step(0.02)
    assert isinstance(stopped, Stopped)
    assert stopped.mood_before == stopped.mood_after
    body.speeds = np.full(8, 0.5)
    assert run(partner, 10.0) == []
    body.speeds = np.zeros(8)
    assert run(partner, LET_GO - 0.1) == []
    assert of(Released, run(partner, 0.2))


def test_who_is_led_slowly_is_not_released(robot: Robot) -> None:
    """At 0.02 rad/s, which is slower than what counts as motion elsewhere."""
    body = PaperBody(robot)
    partner = Partner(body, happy())
    body.touch(StopReason.TOUCHED)
    partner.step(0.02)
    for _ in range(500):
        body.angles = body.angles + 0.0004
        assert partner.step(0.02) == []
    with pytest.raises(UnsettledError):
        partner.release()
    assert of(Released, run(partner, LET_GO + 0.3))


def test_a_new_partner_of_a_led_body_waits_for_the_hand_too(robot: Robot) -> None:
    body = PaperBody(robot)
    body.touch(StopReason.TOUCHED)
    body.time += 60.0
    partner = Partner(body, happy())
    assert of(Released, run(partner, LET_GO - 0.2)) == []


def test_who_is_led_and_stopped_by_a_person_waits_for_the_person(robot: Robot) -> None:
    body = PaperBody(robot)
    partner = Partner(body, happy())
    body.touch(StopReason.TOUCHED)
    partner.step(0.02)
    partner.stop()
    assert run(partner, 2 * LET_GO) == []
    partner.release()
    assert body.phase is Phase.RETURNING


def test_blocked_again_on_the_way_back_the_pauses_grow(moving: Moving) -> None:
    partner, body = moving
    pauses = []
    for _ in range(6):
        body.touch()
        told = body.time
        stopped = of(Stopped, partner.step(0.02))[0]
        assert stopped.mood_after == pytest.approx(0.8 * stopped.mood_before)
        while body.phase is Phase.STOPPED:
            partner.step(0.02)
        pauses.append(body.time - told)
    expected = np.minimum(FIRST_PAUSE * 2.0 ** np.arange(6), LONGEST_PAUSE)
    np.testing.assert_allclose(pauses, expected, atol=0.05)
    # A whole gesture without a contact: the next pause is the first again.
    run(partner, 6.0)
    body.touch()
    told = body.time
    while body.phase is Phase.STOPPED:
        partner.step(0.02)
    assert body.time - told == pytest.approx(FIRST_PAUSE, abs=0.05)


@pytest.mark.parametrize("begun", [False, True], ids=["waits", "has begun"])
def test_a_persons_stop_drops_what_was_asked_for_before_it(robot: Robot, begun: bool) -> None:
    partner = Partner(PaperBody(robot), EmotionalModel())
    run(partner, 0.1)
    partner.perform(Expression("surprise", 0.8))
    run(partner, 0.1 if begun else 0.0)
    assert partner.asked is begun
    partner.stop()
    run(partner, 2.0)
    partner.release()
    assert of(GestureStarted, run(partner, 10.0)) == []


def test_rest_ends_a_contact_stop_after_its_pause(moving: Moving) -> None:
    partner, body = moving
    body.touch()
    run(partner, 0.1)
    partner.rest()
    run(partner, FIRST_PAUSE + 2.0)
    assert partner.at_rest


@pytest.mark.parametrize("ending", [False, True])
@pytest.mark.parametrize("contact", [False, True])
def test_a_persons_stop_stays_until_a_release_and_leaves_the_mood(
    moving: Moving, contact: bool, ending: bool
) -> None:
    """Also after a contact, whose own pause would end by itself, and at the end of all."""
    partner, body = moving
    if contact:
        body.touch()
        run(partner, 0.1)
    mood = partner.feelings.mood.max()
    assert not partner.held
    partner.stop()
    if ending:
        partner.rest()
    assert of(Released, run(partner, LONGEST_PAUSE + 1.0)) == []
    assert body.phase is Phase.STOPPED
    assert partner.held
    assert not partner.at_rest
    assert partner.feelings.mood.max() == pytest.approx(mood, abs=0.001)
    partner.release()
    assert not partner.held
    assert bool(of(GestureStarted, run(partner, 4.0))) is not ending


@pytest.mark.parametrize("ending", [False, True])
def test_a_failed_body_waits_for_a_person(moving: Moving, ending: bool) -> None:
    """Even if a contact came first, and at the end of all: the card may come back by itself."""
    partner, body = moving
    body.touch()
    run(partner, 0.5)
    body.touch(StopReason.LINE_LOST)
    if ending:
        partner.rest()
    assert of(Released, run(partner, LONGEST_PAUSE + 1.0)) == []
    assert body.phase is Phase.STOPPED
    partner.release()
    assert body.phase is Phase.RETURNING


def test_the_pause_holds_for_everyone_but_a_person(moving: Moving) -> None:
    partner, body = moving
    for pause in (1.0, 2.0, 4.0):
        body.touch()
        run(partner, 0.5)
        with pytest.raises(BodyError, match=rf"in {pause - 0.5:.1f} s"):
            partner.release()
        run(partner, pause)
    body.touch()
    run(partner, 0.5)
    partner.release(by_person=True)
    assert body.phase is Phase.RETURNING


@pytest.mark.parametrize(("feeling", "step"), [("surprise", 15), ("thrill", 40)])
def test_a_release_at_once_after_a_contact_invents_no_contacts(
    robot: Robot, feeling: FeelingName, step: int
) -> None:
    def begin() -> tuple[Partner, Simulated]:
        feelings, body = EmotionalModel(), Simulated(robot)
        feelings.set_state(mood=dict.fromkeys(FEELINGS, 0.5))
        partner = Partner(body, feelings, period=0.5)
        partner.perform(Expression(feeling, 1.0))
        return partner, body

    partner, body = begin()
    run(partner, (step + 1) * 0.02)
    place = forward(robot, body.state.angles)[:3]
    partner, body = begin()
    body.place_hand(place, np.array([1.0, 0.0, 0.0]))
    while body.phase is not Phase.STOPPED:
        partner.step(0.02)
    body.remove_hand()
    events = []
    for _ in range(300):
        events += partner.step(0.02)
        if body.phase is Phase.STOPPED:
            with suppress(UnsettledError):
                partner.release(by_person=True)
    assert of(Stopped, events) == []
    assert partner.feelings.mood.max() > 0.35


@pytest.mark.parametrize("by_person", [False, True])
def test_a_body_that_still_moves_is_not_released(
    moving: Moving, monkeypatch: pytest.MonkeyPatch, by_person: bool
) -> None:
    """Neither at a wish nor, once the pause is over, by itself."""
    partner, body = moving
    body.touch()
    pushed = BodyState(0.0, body.state.angles, np.full(8, 0.2), Phase.STOPPED, body.stopped)
    with monkeypatch.context() as patch:
        pushing = property(lambda body: replace(pushed, time=body.time))
        patch.setattr(PaperBody, "state", pushing)
        assert of(Released, run(partner, 8.0)) == []
        with pytest.raises(UnsettledError, match="rest"):
            partner.release(by_person=by_person)
    run(partner, 0.1)
    with pytest.raises(UnsettledError):
        partner.release(by_person=by_person)
    assert len(of(Released, run(partner, 0.2))) == 1


def test_a_body_that_is_not_ready_is_asked_again(
    moving: Moving, monkeypatch: pytest.MonkeyPatch
) -> None:
    partner, body = moving
    body.touch()
    with monkeypatch.context() as refusing:
        refusing.setattr(body, "release", _refuse)
        assert of(Released, run(partner, 5.0)) == []
    assert len(of(Released, run(partner, 2.0))) == 1


def test_a_move_that_comes_too_late_for_a_stopped_body_is_no_failure(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    body = PaperBody(robot)
    partner = Partner(body, happy())

    def stopped_just_now(move: Move) -> None:
        body.touch(StopReason.LINE_LOST)
        _refuse()

    monkeypatch.setattr(body, "move", stopped_just_now)
    assert len(of(Stopped, run(partner, 1.0))) == 1
    body.phase = Phase.IDLE
    monkeypatch.setattr(body, "move", _refuse)
    with pytest.raises(BodyError):  # but what an idle body refuses is a mistake of ours
        run(partner, 4.0)


def _refuse(_move: Move | None = None) -> None:
    raise BodyError("refused")
