"""The waist turns to whom the partner sees: slowly, so far and no further, and never in the way."""

import numpy as np
import pytest
from tests.fixtures.partner import PaperBody, at_ease, of, run

from miburi import gestures, ik
from miburi.bodies.simulated import Simulated
from miburi.feelings import EmotionalModel, Stimulus, shipped_temperament
from miburi.partner import GestureEnded, MoveSent, Partner, Released, Stopped, solve_with
from miburi.partner.rest import Attention
from miburi.robot import JOINTS, Array, Robot, forward
from miburi.safety.stop import Phase, StopReason

WAIST = JOINTS.index("waist")


def waist(partner: Partner) -> float:
    return float(partner.body.state.angles[WAIST])


@pytest.mark.parametrize(("name", "side"), [("calm", -1), ("lively", 1)])
def test_it_turns_slowly_and_as_far_as_its_temperament_lets_it(
    robot: Robot, name: str, side: int
) -> None:
    temperament = shipped_temperament(name)
    partner = Partner(Simulated(robot), at_ease("still", temperament), life=3)
    run(partner, 1.0)
    partner.company.gaze = side * 1.2
    turned = [waist(partner)]
    for _ in range(16):
        run(partner, 0.5)
        turned.append(waist(partner))
    assert turned[-1] * side == pytest.approx(temperament.gaze.turn, abs=0.02)
    assert max(turned, key=abs) * side < temperament.gaze.turn + 0.02
    # Each turn takes 1.4 s; a servo starts and ends slowly.
    in_two_seconds = np.abs(np.array(turned[4:]) - np.array(turned[:-4])).max()
    assert in_two_seconds < temperament.gaze.speed * 2.0 + 0.02


def test_it_turns_back_when_nobody_is_there(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("still"), life=3)
    partner.company.gaze = 0.3
    run(partner, 10.0)
    assert waist(partner) == pytest.approx(0.3, abs=1e-3)
    partner.company.gaze = 0.0
    run(partner, 10.0)
    assert waist(partner) == pytest.approx(0.0, abs=1e-3)


def test_a_partner_without_life_and_one_that_may_not_turn_stay(robot: Robot) -> None:
    still = shipped_temperament().model_copy(deep=True)
    still = still.model_copy(update={"gaze": still.gaze.model_copy(update={"turn": 0.0})})
    for partner in (
        Partner(PaperBody(robot), EmotionalModel()),
        Partner(PaperBody(robot), at_ease("still", still), life=3),
    ):
        partner.company.gaze, partner.company.attends = 0.3, "thinking"
        for _ in range(200):
            partner.step(0.02)
            assert waist(partner) == pytest.approx(0.0, abs=1e-3)


def performed(robot: Robot, gaze: float) -> list[Array]:
    """Return the places that a happy gesture asks for, somebody being at ``gaze``."""
    asked: list[Array] = []

    def solve(robot: Robot, target: Array, start: Array) -> ik.Solution:
        asked.append(target)
        return solve_with()(robot, target, start)

    partner = Partner(PaperBody(robot), at_ease("still"), solve=solve, life=3)
    partner.company.gaze = gaze
    run(partner, 10.0)
    assert waist(partner) == pytest.approx(gaze, abs=1e-3)
    asked.clear()
    partner.feelings.stimulate(Stimulus("happiness", 1.0, "speech"))
    run(partner, 6.0)
    return asked


def test_gestures_face_whom_it_sees(robot: Robot) -> None:
    ahead, aside = performed(robot, 0.0), performed(robot, 0.3)
    assert len(ahead) > 3
    for one, other in zip(ahead[:9], aside[:9], strict=True):
        np.testing.assert_allclose(gestures.turned(one, 0.3), other, atol=1e-9)


def test_between_gestures_it_does_not_look_away_from_somebody(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("still"), life=3)
    partner.company.gaze, partner.company.attends = 0.3, "speaking"
    run(partner, 10.0)
    partner.feelings.stimulate(Stimulus("happiness", 1.0, "speech"))
    ends = [waist(partner) for _ in range(1000) if of(GestureEnded, partner.step(0.02))]
    assert len(ends) == 3
    np.testing.assert_allclose(ends, 0.3, atol=1e-3)


@pytest.mark.parametrize(
    ("attends", "first", "held"), [("listening", 4.0, 0.5), ("thinking", 0.5, 2.5)]
)
def test_it_looks_aside_as_people_do(
    robot: Robot, attends: Attention, first: float, held: float
) -> None:
    partner = Partner(PaperBody(robot), at_ease("lively"), life=5)
    partner.company.attends = attends
    turned = []
    for _ in range(6000):
        partner.step(0.02)
        turned.append(abs(waist(partner)))
    away = np.array(turned) > max(turned) / 2
    begins, ends = (0.02 * np.flatnonzero(np.diff(away.astype(int)) == way) for way in (1, -1))
    begins = begins[: len(ends)]
    lasts = ends - begins
    assert len(lasts) > 12
    assert begins[0] == pytest.approx(first + 0.3, abs=1.2)
    # Half of the ways to and fro, 0.3 to 0.6 s each, counts as turned aside, half as looking at it.
    assert np.mean(lasts) == pytest.approx(held + 0.45, abs=0.35)
    assert np.std(lasts) > 0.02
    assert np.mean(np.diff(begins) - lasts[:-1]) == pytest.approx(4.5, abs=0.5)


def test_whoever_speaks_ends_its_thinking_at_once(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("still"), life=5)
    partner.company.attends = "thinking"
    run(partner, 2.0)
    assert abs(waist(partner)) > 0.3
    partner.company.attends = "speaking"
    run(partner, 2.0)
    assert waist(partner) == pytest.approx(0.0, abs=0.02)


def test_what_it_attended_to_before_does_not_hold_its_breath_in_distress(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("lively"), life=5)
    partner.company.attends = "listening"
    run(partner, 1.0)
    partner.company.calm = True
    run(partner, 10.0)
    assert of(MoveSent, run(partner, 20.0))


def test_it_turns_slowly_to_a_person_who_moved_while_it_looked_aside(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("still"), life=5)
    partner.company.attends = "listening"
    while abs(waist(partner)) < 0.05:
        partner.step(0.02)
    partner.company.gaze = 0.35
    turned = [waist(partner)]
    while turned[-1] < 0.33:
        partner.step(0.02)
        turned.append(waist(partner))
    assert max(np.diff(turned)) < 0.3  # this body jumps: 0.2 rad/s for 1.4 s, then the rest


def test_who_begins_to_talk_waits_for_no_arm(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("lively"), life=5)
    more_than_a_breath, interrupted = 0.25, 0
    for _ in range(8):
        for _ in range(500):
            partner.step(0.02)
            raised = np.abs(partner.body.state.angles - robot.neutral)[[1, 4]].min()
            if raised > more_than_a_breath:
                interrupted += 1
                break
        partner.company.attends = "speaking"
        run(partner, 5.0)
        raised = np.abs(partner.body.state.angles - robot.neutral)[[1, 4]].min()
        assert raised < more_than_a_breath
        partner.company.attends = None
    assert interrupted


def test_who_is_in_distress_is_not_looked_away_from(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("lively"), life=5)
    partner.company.attends, partner.company.calm = "thinking", True
    turned = []
    for _ in range(500):
        partner.step(0.02)
        turned.append(abs(waist(partner)))
    assert max(turned) < 0.02


@pytest.mark.parametrize("reason", [StopReason.ASKED, StopReason.CONTACT])
def test_while_stopped_it_turns_to_nobody(robot: Robot, reason: StopReason) -> None:
    body = PaperBody(robot)
    partner = Partner(body, at_ease("still"), life=3)
    partner.company.gaze = 0.3
    run(partner, 0.1)
    assert body.phase is Phase.MOVING
    sent = len(body.moves)
    if reason is StopReason.ASKED:
        partner.stop()
    else:
        body.touch()
    (stopped,) = of(Stopped, partner.step(0.02))
    assert stopped.time == body.time
    for side in range(20):  # somebody walks about
        partner.company.gaze = 0.3 if side % 2 else -0.3
        partner.step(0.02)
    assert body.phase is Phase.STOPPED
    assert len(body.moves) == sent


def contact(robot: Robot, *, news: bool) -> float:
    """Return when a hand in the way of a gesture stops it, s, news of a face coming or not."""
    partner = Partner(Simulated(robot), at_ease("still"), life=3)
    partner.feelings.set_state(emotion={"happiness": 1.0}, mood={"happiness": 1.0}, hold=True)
    places = []
    for _ in range(75):
        partner.step(0.02)
        places.append(forward(robot, partner.body.state.angles)[:3])
    body = Simulated(robot)
    partner = Partner(body, partner.feelings, life=3)
    body.place_hand(max(places, key=lambda place: place[2]), np.array([1.0, 0.0, 0.0]))
    for number in range(500):
        if news:
            partner.company.gaze = 0.3 * (-1) ** number
        if stopped := of(Stopped, partner.step(0.02)):
            return float(stopped[0].time)
    pytest.fail("nothing stopped it")


def test_a_face_delays_no_contact_stop(robot: Robot) -> None:
    assert contact(robot, news=True) == contact(robot, news=False)


def test_a_hand_in_its_way_stops_the_turn(robot: Robot) -> None:
    body = Simulated(robot)
    partner = Partner(body, at_ease("still", shipped_temperament("lively")), life=3)
    neutral = forward(robot, robot.neutral)[3:6]
    turned = 0.25  # rad, on the left hand's way
    turn = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
    body.place_hand(np.array([*turn @ neutral[:2], neutral[2]]), np.array([0.0, 0.0, 1.0]))
    partner.company.gaze = 0.5
    touched = None
    for _ in range(1000):
        events = partner.step(0.02)
        if touched is None and body.touch.force > 0:
            touched = body.state.time
        if stopped := of(Stopped, events):
            assert stopped[0].stop.reason is StopReason.CONTACT
            assert touched is not None
            assert stopped[0].time - touched < 0.5
            break
    else:
        pytest.fail("it pressed on")
    body.remove_hand()
    later = run(partner, 10.0)
    assert of(Released, later)
    assert of(MoveSent, later), "it breathes and turns again"
