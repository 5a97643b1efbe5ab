"""Urgent gestures break off a move at once; free gestures pass their key poses."""

import numpy as np
import pytest
from tests.fixtures.partner import PaperBody, at_ease, happy, of, run

from miburi.bodies.simulated import Simulated
from miburi.feelings import EmotionalModel, Expression, Stimulus
from miburi.partner import GestureEnded, GestureStarted, MoveSent, Partner, Stopped
from miburi.robot import Robot
from miburi.safety.stop import Phase


def under_way(partner: Partner) -> float:
    """Let it show happiness until it is fast, and return when."""
    partner.feelings.stimulate(Stimulus("happiness", 0.9, "speech"))
    while np.abs(partner.body.course().velocities).max() < 1.0:
        partner.step(0.02)
    return partner.body.state.time


def test_another_feeling_breaks_a_gesture_off_in_mid_move(robot: Robot) -> None:
    partner = Partner(Simulated(robot), at_ease("still"), life=1, period=0.5)
    began = under_way(partner)
    partner.feelings.stimulate(Stimulus("fright", 1.0, "speech"))
    events = run(partner, 0.1)
    (ended,), (started,) = of(GestureEnded, events), of(GestureStarted, events)
    assert not ended.complete
    assert started.expression is not None
    assert started.expression.feeling == "fright"
    assert started.time - began <= 0.05
    assert of(MoveSent, events)
    assert not of(Stopped, run(partner, 8.0))


def test_a_fright_amid_fear_shows_before_the_fear_that_it_raises(robot: Robot) -> None:
    partner = Partner(Simulated(robot), at_ease("still"), life=1, period=0.5)
    partner.feelings.stimulate(Stimulus("fear", 0.9, "speech"))
    run(partner, 0.5)
    partner.feelings.stimulate(Stimulus("fright", 0.9, "speech"))
    strongest = partner.feelings.express()
    assert strongest is not None
    assert strongest.feeling == "fear"
    events = run(partner, 0.1)
    (ended,), (started,) = of(GestureEnded, events), of(GestureStarted, events)
    assert ended.expression is not None
    assert started.expression is not None
    assert (ended.expression.feeling, started.expression.feeling) == ("fear", "fright")
    then = next(event for event in run(partner, 10.0) if isinstance(event, GestureStarted))
    assert then.expression is not None
    assert then.expression.feeling == "fear"


def test_what_somebody_asked_for_is_not_broken_off_by_a_feeling(robot: Robot) -> None:
    partner = Partner(PaperBody(robot, move_time=0.5), at_ease("still"), life=1, period=0.5)
    partner.perform(Expression("happiness", 0.9), wish="mine")
    run(partner, 0.5)
    partner.feelings.stimulate(Stimulus("fright", 1.0, "speech"))
    (ended, *_) = of(GestureEnded, run(partner, 6.0))
    assert (ended.wish, ended.complete) == ("mine", True)


def test_a_feeling_that_another_one_fades_below_breaks_nothing_off(robot: Robot) -> None:
    partner = Partner(PaperBody(robot, move_time=0.5), at_ease("still"), life=1, period=0.5)
    partner.feelings.set_state(emotion={"happiness": 0.6, "surprise": 0.59}, hold=True)
    while partner.expression is None:
        partner.step(0.02)
    run(partner, 0.3)
    partner.feelings.set_state(emotion={"happiness": 0.5, "surprise": 0.58}, hold=True)
    (ended, *_) = of(GestureEnded, run(partner, 6.0))
    assert ended.complete


def test_the_papers_experiment_breaks_nothing_off(robot: Robot) -> None:
    partner = Partner(Simulated(robot), EmotionalModel(), period=2.0)
    under_way(partner)
    partner.feelings.stimulate(Stimulus("fright", 1.0, "speech"))
    (ended, *_) = of(GestureEnded, run(partner, 6.0))
    assert ended.complete


@pytest.mark.parametrize("life", [None, 1])
def test_a_free_gesture_of_a_lively_partner_stops_nowhere(robot: Robot, life: int | None) -> None:
    partner = Partner(Simulated(robot), happy(), life=life, period=2.0)
    while partner.body.state.phase is Phase.IDLE:
        partner.step(0.01)
    from_rest = 0
    while partner.expression is not None:
        still = np.abs(partner.body.course().velocities).max() < 0.02
        events = partner.step(0.01)
        assert not of(Stopped, events)
        from_rest += still and len(of(MoveSent, events))
    assert bool(from_rest == 0) is (life is not None), from_rest
