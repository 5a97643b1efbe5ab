"""Longer words move its arms a little, after the first gesture of a feeling."""

import numpy as np
from tests.fixtures.live import run as live_run
from tests.fixtures.live import until
from tests.fixtures.partner import PaperBody, at_ease, happy, of, run

from miburi import gestures
from miburi.bodies.simulated import Simulated
from miburi.feelings import EmotionalModel
from miburi.live.runner import Runner
from miburi.live.wishes import Speak
from miburi.partner import Event, GestureStarted, MoveSent, Partner, Stopped
from miburi.robot import JOINTS, Robot, forward

LONG = "I have thought about that for a while, and I like what you said."


def raised(robot: Robot, partner: Partner) -> float:
    """How high the higher hand is over neutral, m."""
    now, rest = forward(robot, partner.body.state.angles), forward(robot, robot.neutral)
    return max(now[2] - rest[2], now[5] - rest[5])


def every(pause: float, seconds: float) -> list[float]:
    """Strokes at equal distances."""
    return np.arange(1.0, seconds, pause).tolist()


def highest(robot: Robot, partner: Partner, seconds: float) -> float:
    heights = []
    for _ in range(round(seconds / 0.02)):
        assert not of(Stopped, partner.step(0.02)), "its own arms are no contact"
        heights.append(raised(robot, partner))
    return max(heights)


def test_it_beats_while_it_speaks_and_then_rests_on(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("still"), life=0)
    breathing = highest(robot, partner, 8.0)
    partner.gesticulate(every(0.5, 6.0))
    assert highest(robot, partner, 6.0) > breathing + 0.008
    run(partner, 3.0)
    assert highest(robot, partner, 8.0) < breathing + 0.003


def test_a_hand_is_farthest_when_a_syllable_stands_out(robot: Robot) -> None:
    partner = Partner(Simulated(robot), at_ease("still"), life=1)
    run(partner, 3.0)
    strokes = [1.5, 1.7, 2.9, 4.6, 6.0, 7.9]
    partner.gesticulate(strokes)
    times = 0.02 * np.arange(1, 451)
    heights = np.array([highest(robot, partner, 0.02) for _ in times])
    tops = [
        times[k]
        for k in range(12, len(times) - 12)
        if heights[k] == heights[k - 12 : k + 13].max() > 0.005
    ]
    assert len(tops) >= 2
    assert max(np.abs(np.subtract.outer(tops, strokes)).min(axis=1)) < 0.08


def test_in_distress_it_does_not_beat_either_in_the_middle_of_a_breath(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("lively"), life=1)
    partner.company.calm = True
    beat = np.linalg.norm(
        gestures.beat(robot, np.ones(2))[0].target - forward(robot, robot.neutral)
    )
    for _ in range(1500):
        if partner.body.state.time % 2 < 0.02:
            partner.gesticulate([1.0, 1.5, 2.0])
        partner.step(0.02)
        assert raised(robot, partner) < 0.4 * beat


def test_what_it_says_leaves_a_first_gesture_whole_then_it_beats(robot: Robot) -> None:
    def events(seconds: float) -> list[Event]:
        partner = Partner(PaperBody(robot), happy(), life=2)
        partner.gesticulate(every(0.5, seconds))
        return run(partner, 12.0)

    told = events(8.0)
    silent, spoken = of(MoveSent, events(0.0)), of(MoveSent, told)
    first = next(k for k in range(1, len(silent)) if silent[k].key_pose == 0)
    for one, other in zip(silent[:first], spoken[:first], strict=True):
        np.testing.assert_array_equal(one.move.angles, other.move.angles)
    during = [sent for sent in spoken if sent.time < 7.4]
    reach = [float(np.abs(sent.move.angles - robot.neutral).max()) for sent in during]
    assert max(reach[first:]) < 0.5 < max(reach[:first]), "beats, and no second gesture"
    assert len(reach) > first + 4
    assert of(GestureStarted, told)[1].time > 7.5, "the feeling goes on after what it said"


def test_a_sad_partner_does_not_lift_its_head_to_speak(robot: Robot) -> None:
    def head(sadness: float) -> float:
        feelings = at_ease("still")
        feelings.set_state(mood={"sadness": sadness}, hold=True)
        partner = Partner(PaperBody(robot), feelings, life=1)
        partner.gesticulate(every(0.5, 6.0))
        return float(of(MoveSent, run(partner, 4.0))[-1].move.angles[JOINTS.index("head")])

    assert head(0.9) < head(0.0) - 0.2


def test_without_life_paused_or_stopped_it_does_not(robot: Robot) -> None:
    plain = Partner(PaperBody(robot), EmotionalModel())
    paused = Partner(PaperBody(robot), EmotionalModel(), life=1)
    paused.pause()
    stopped = Partner(PaperBody(robot), EmotionalModel(), life=1)
    stopped.stop()
    for partner in (plain, paused, stopped):
        partner.gesticulate(every(0.5, 5.0))
        assert not of(MoveSent, run(partner, 5.0))


def test_it_stops_beating_when_somebody_needs_calm(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("still"), life=1)
    run(partner, 1.0)
    partner.gesticulate(every(0.5, 20.0))
    assert of(MoveSent, run(partner, 3.0))
    partner.company.calm = True
    run(partner, 1.5)  # the beat that has begun
    assert not of(MoveSent, run(partner, 3.0))


def test_nothing_at_rest_stands_still_until_a_late_stroke(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("lively"), life=1, period=0.5)
    while not of(MoveSent, partner.step(0.02)):
        pass
    partner.gesticulate([12.0])
    run(partner, 8.0)
    places = forward(robot, partner.body.state.angles) - forward(robot, robot.neutral)
    assert np.abs(places).max() < 0.004, "it went back to rest"


def test_it_stays_turned_to_whom_it_speaks(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("still"), life=1)
    partner.company.gaze = 0.3
    run(partner, 10.0)
    partner.gesticulate(every(0.5, 20.0))
    ends = [event.move.angles for event in of(MoveSent, run(partner, 6.0))]
    assert len(ends) > 3
    np.testing.assert_allclose([end[JOINTS.index("waist")] for end in ends], 0.3, atol=1e-6)


def test_a_live_partner_beats_to_longer_words_alone(runner: Runner) -> None:
    until(runner, lambda now: now.phase == "idle")
    live_run(runner, 4.0)
    for text, moves in (("Oh!", False), ("今日は", False), (LONG, True)):
        runner.ask(Speak(text))
        extents = [now.extent for now in live_run(runner, 3.0)]
        assert (max(extents) > 0.012) == moves, max(extents)


def test_its_last_beat_is_whole_even_if_a_feeling_is_left(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), happy(), life=2)
    partner.gesticulate([6.0, 8.0])
    events = run(partner, 8.2)
    begun = [event.time for event in of(GestureStarted, events)]
    beats = [event for event in of(MoveSent, events) if event.time > begun[0] + 4.0]
    assert len(begun) == 1
    assert len(beats) >= 2
