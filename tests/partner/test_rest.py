"""At rest it moves now and then, like something living, and its mood shows."""

from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from tests.fixtures.partner import PaperBody, at_ease, happy, of, run

from miburi.bodies.simulated import Simulated
from miburi.feelings import EmotionalModel, Stimulus, shipped_temperament
from miburi.feelings.temperament import RestLevel
from miburi.partner import GestureStarted, MoveSent, Partner, Stopped
from miburi.robot import JOINTS, Array, Robot, load_robot
from miburi.safety.stop import Phase

WAIST, HEAD = JOINTS.index("waist"), JOINTS.index("head")


def rested(partner: Partner, seconds: float) -> tuple[float, Array]:
    """Let it rest; return the share of time in which it was moved, and its angles (n, 8)."""
    moved, angles = 0, []
    steps = round(seconds / 0.02)
    for _ in range(steps):
        assert not of(Stopped, partner.step(0.02)), "its own arms are no contact"
        moved += partner.body.state.phase is Phase.MOVING
        angles.append(partner.body.state.angles)
    return moved / steps, np.array(angles)


def test_in_distress_it_only_breathes(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("lively"), life=4, period=0.5)
    partner.company.calm = True
    share, angles = rested(partner, 30.0)
    assert share > 0.05
    assert np.abs(angles - robot.neutral)[:, [WAIST, HEAD]].max() < 0.15
    partner.company.calm = False
    assert np.abs(rested(partner, 60.0)[1][:, WAIST]).max() > 0.1


def test_in_distress_it_shows_no_feeling(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), happy(), life=4)
    partner.company.calm = True
    assert not of(GestureStarted, run(partner, 3.0))
    partner.company.calm = False
    assert of(GestureStarted, run(partner, 3.0))


def head(robot: Robot, mood: dict[str, float]) -> float:
    """How high the head is on average, rad over neutral, in a mood and no emotion."""
    feelings = EmotionalModel(shipped_temperament())
    feelings.set_state(mood=mood, hold=True)
    partner = Partner(PaperBody(robot), feelings, life=4, period=0.5)
    _, angles = rested(partner, 60)
    return float(np.median(angles[1000:, HEAD]) - robot.neutral[HEAD])


def test_a_sad_mood_lowers_the_head_and_a_happy_one_lifts_it(robot: Robot) -> None:
    sad, plain, happy = (head(robot, m) for m in ({"sadness": 0.9}, {}, {"happiness": 0.9}))
    assert sad < plain - 0.15
    assert happy > plain + 0.05


def test_an_act_at_rest_gives_way_to_a_feeling(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("lively"), life=1, period=0.5)
    while not of(MoveSent, partner.step(0.02)):
        pass
    partner.feelings.stimulate(Stimulus("fright", 1.0, "speech"))
    assert of(GestureStarted, run(partner, 2.0))


def test_levels_move_it_little_and_differently_and_a_seed_repeats_it(robot: Robot) -> None:
    def lived(level: RestLevel) -> tuple[float, Array]:
        return rested(Partner(PaperBody(robot), at_ease(level), life=2, period=0.5), 90.0)

    still, quiet, lively = (lived(level) for level in get_args(RestLevel))
    assert 0 < still[0] < quiet[0] < lively[0] < 0.45
    np.testing.assert_array_equal(lively[1], lived("lively")[1])


def gestures_of(partner: Partner, seconds: float) -> list[float]:
    """When gestures began, s."""
    return [one.time for one in of(GestureStarted, run(partner, seconds))]


def test_one_emotion_shows_in_a_few_gestures_and_a_new_one_in_others(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("still"), life=1, period=0.5)
    run(partner, 1.1)
    partner.feelings.stimulate(Stimulus("happiness", 0.9, "speech"))
    assert len(gestures_of(partner, 40.0)) == 3
    partner.feelings.stimulate(Stimulus("happiness", 0.9, "speech"))
    assert len(gestures_of(partner, 40.0)) == 3


def test_a_new_emotion_waits_for_no_period(robot: Robot) -> None:
    partner = Partner(PaperBody(robot), at_ease("still"), life=1, period=2.0)
    run(partner, 0.5)
    partner.feelings.stimulate(Stimulus("surprise", 0.9, "speech"))
    began = gestures_of(partner, 0.1)
    assert began == [pytest.approx(partner.body.state.time - 0.08, abs=0.021)]


@pytest.mark.proof("test_a_sad_mood_lowers_the_head_and_a_happy_one_lifts_it")
def test_the_liveliest_acts_meet_nothing_on_longer_arms(tall_file: Path) -> None:
    """A weight shift pressed the arm of a taller robot against its trunk."""
    feelings = at_ease("lively")
    feelings.set_state(mood={"happiness": 1.0, "thrill": 1.0}, hold=True)
    body = Simulated(load_robot(tall_file))
    rested(Partner(body, feelings, life=0, period=0.5), 120)
