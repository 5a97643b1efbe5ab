"""The guided hand: it stays out of what cannot give way, and gives way itself."""

import numpy as np
import pytest

from miburi.bodies import Touch
from miburi.bodies.simulated import Simulated
from miburi.live.hand import FASTEST, FEELING, GIVES_WAY, GuidedHand
from miburi.robot import iphonoid

INWARDS = np.array([-1.0, 0.0, 0.0])


@pytest.mark.parametrize(
    "goal", [[0.0, 0.0, 0.05], [0.0, 0.02, 0.1], [0.0, 0.04, 0.1], [-0.02, 0.0, -0.02]]
)
def test_a_hand_stays_out_of_the_trunk(goal: list[float]) -> None:
    """Neither could give way: the force was 1e17 N, and an arm between them was caught."""
    body, hand = Simulated(iphonoid()), GuidedHand()
    body.place_hand(np.array([0.25, 0.0, goal[2]]), INWARDS)
    hand.guide(body, np.array(goal), INWARDS)
    for _ in range(100):
        hand.step(body, 0.02)
        body.step(0.02)
        assert body.touch.force < 500
    x, y, z = body.configuration[1][:3]
    assert np.hypot(x, y) > 0.03 or z > 0.15


def test_a_hand_that_feels_the_robot_is_slow_and_goes_back_where_it_is_pressed() -> None:
    body, hand = Simulated(iphonoid()), GuidedHand()
    body.place_hand(np.array([0.3, 0.0, 0.1]), INWARDS)
    hand.guide(body, np.array([0.2, 0.0, 0.1]), INWARDS)
    places = []
    for force in (0.0, GIVES_WAY - 1, GIVES_WAY + 1):
        body.touch = Touch(force=force)
        hand.step(body, 0.02)
        places.append(body.configuration[1][0])
    step, slow = FASTEST * 0.02, FEELING * 0.02
    assert np.allclose(places, [0.3 - step, 0.3 - step - slow, 0.3 - slow])


def test_a_pressed_hand_that_is_led_away_comes_away() -> None:
    """It used to back away from where it was led: deeper, where it pressed and stayed."""
    body, hand, rng = Simulated(iphonoid()), GuidedHand(), np.random.default_rng(5)
    out = np.array([0.25, -0.1, 0.1])
    body.place_hand(out, INWARDS)
    pressed = 0
    for _ in range(40):
        hand.guide(body, rng.uniform([-0.05, -0.2, 0.0], [0.25, 0.2, 0.2]), INWARDS)
        for _ in range(10):
            hand.step(body, 0.02)
            body.step(0.02)
            pressed = pressed + 1 if body.touch.force > 100 else 0
            assert pressed <= 3  # steps
    hand.guide(body, out, INWARDS)
    for _ in range(100):
        hand.step(body, 0.02)
        body.step(0.02)
    assert np.allclose(body.configuration[1][:3], out, atol=1e-3)
    assert body.touch.force == 0


def test_a_hand_that_has_waited_for_long_still_goes_back_when_it_is_pressed() -> None:
    body, hand = Simulated(iphonoid()), GuidedHand()
    body.place_hand(np.array([0.3, 0.0, 0.1]), INWARDS)
    hand.guide(body, np.array([0.2, 0.0, 0.1]), INWARDS)
    for force in (*[0.0] * 1000, GIVES_WAY + 1):
        body.touch = Touch(force=force)
        hand.step(body, 0.02)
    assert body.configuration[1][0] == pytest.approx(0.2 + FASTEST * 0.02)
