"""The real binary lets a hand lead a body at rest: it stops, yields, and goes back slowly."""

from pathlib import Path

import numpy as np
import pytest
from tests.firmware.rig import Rig
from tests.firmware.test_faults import turn_clock_on
from tests.firmware.toolchain import changed_card

from miburi.card.card import wake
from miburi.robot import JOINTS
from miburi.safety.controller import YIELDS
from miburi.safety.stop import Phase, StopReason

MOTOR = 2
NAME = JOINTS[MOTOR]


def at_rest(firmware: Path) -> Rig:
    """A body at rest after a move, so that the twin looks on."""
    rig = Rig(firmware, 7)
    rig.turn([MOTOR], by=0.2, speed=1.0)
    assert rig.settle() is Phase.IDLE
    return rig


def push(rig: Rig, steps: float) -> None:
    """Hold the elbow so many steps further than it is, or there, if it comes back."""
    shaft = rig.servos[MOTOR].shaft
    wall = shaft.place + rig.settings.joints[MOTOR].direction * steps
    low, high = sorted((wall, wall + np.copysign(1000, wall - shaft.place)))
    shaft.low, shaft.high = low, high


def free(rig: Rig) -> None:
    rig.servos[MOTOR].shaft.low, rig.servos[MOTOR].shaft.high = -np.inf, np.inf


def slack(rig: Rig) -> int:
    """Steps that a motor at rest may be away from its place."""
    guards = rig.settings.joints[MOTOR].guards
    return max(guards.slack, guards.arrival)


def test_a_hand_leads_a_body_at_rest(firmware: Path) -> None:
    rig = at_rest(firmware)
    push(rig, slack(rig) + 4)
    rig.run(0.12)
    assert rig.body.state.phase is Phase.IDLE
    rig.run(0.12)
    assert rig.cause == (StopReason.TOUCHED, NAME)
    stop = rig.body.state.stop
    rig.run(0.06)
    servo = rig.servos[MOTOR]
    assert rig.body.report.held
    assert servo.get("goal_pwm") == rig.settings.general.hold_pwm
    # It gives in again and again, and pushes back by less than a motor at rest may be away.
    for _ in range(4):
        push(rig, slack(rig) + 4)
        rig.run(0.24)
        assert abs(servo.segment.goal - servo.shaft.place) <= 1
    led_to = servo.shaft.place
    free(rig)
    rig.run(1.0)
    assert abs(servo.shaft.place - led_to) <= 2
    assert rig.body.state.stop == stop
    rig.body.release()
    fastest = 0.0
    for _ in range(400):
        state = rig.body.step(0.02)
        fastest = max(fastest, float(np.abs(state.velocities).max()))
        if state.phase is Phase.IDLE:
            break
    assert state.phase is Phase.IDLE
    assert fastest <= 0.5
    np.testing.assert_allclose(state.angles, rig.robot.neutral, atol=0.02)
    rig.close()


@pytest.mark.parametrize("reason", [StopReason.ASKED, StopReason.LINE_LOST])
def test_another_stop_takes_the_place_of_a_touch(firmware: Path, reason: StopReason) -> None:
    """A person's, or the card's own, half a minute after it last heard from its host."""
    rig = at_rest(firmware)
    push(rig, slack(rig) + 4)
    rig.run(0.4)
    assert rig.cause == (StopReason.TOUCHED, NAME)
    if reason is StopReason.ASKED:
        rig.body.stop()
    else:
        turn_clock_on(rig, firmware, 31.0)
    rig.run(0.1)
    assert rig.cause == (reason, None)
    goal = rig.servos[MOTOR].segment.goal
    push(rig, 60)
    rig.run(1.0)
    assert rig.servos[MOTOR].segment.goal == goal
    assert rig.body.report.held
    free(rig)
    rig.run(0.3)
    wake(rig.body)
    rig.close()


def test_a_short_knock_at_rest_is_no_touch(firmware: Path) -> None:
    rig = at_rest(firmware)
    for _ in range(5):
        push(rig, slack(rig) + 4)
        rig.run(0.1)
        free(rig)
        rig.run(0.2)
    assert rig.body.state.phase is Phase.IDLE
    rig.close()


def test_within_its_slack_a_motor_holds(firmware: Path) -> None:
    rig = at_rest(firmware)
    goal = rig.servos[MOTOR].segment.goal
    push(rig, slack(rig) - 2)
    rig.run(1.0)
    assert rig.body.state.phase is Phase.IDLE
    assert rig.servos[MOTOR].segment.goal == goal
    rig.close()


def test_a_motor_that_turns_backwards_at_rest_is_let_go(firmware: Path) -> None:
    """Its horn is on the wrong way round, say: it runs from its goal, and the card lets it."""
    rig = at_rest(firmware)
    servo = rig.servos[MOTOR]
    began = servo.shaft.place
    for _ in range(20):
        push(rig, 3)
        rig.run(0.04)
    assert rig.cause == (StopReason.TOUCHED, NAME)
    assert servo.get("goal_pwm") == rig.settings.general.hold_pwm
    assert abs(servo.segment.goal - servo.shaft.place) <= slack(rig) + 3
    assert abs(servo.shaft.place - began) > 40
    rig.close()


def test_a_servo_that_says_that_it_is_elsewhere_is_followed_for_3_s(firmware: Path) -> None:
    rig = at_rest(firmware)
    servo, off = rig.servos[MOTOR], -20 * rig.settings.joints[MOTOR].direction
    began = servo.shaft.place
    servo.lie = lambda place: place + off
    rig.run(8.0)
    assert rig.body.state.phase is Phase.STOPPED
    assert 10 < (servo.shaft.place - began) / off <= YIELDS + 2
    rig.close()


#: What each changed line of the firmware would do, and which it is.
MUTANTS = {
    "feels nothing": ("c.kept_since == 0) {\n    c.kept_since = time;", "false) {\n"),
    "feels a knock": ("time - c.kept_since >= YIELD_AFTER", "time - c.kept_since >= 0"),
    "feels what its gears leave": ("? guards.slack : guards.arrival);", "* 0);"),
    "yields once": ("c.yields_at = led(c) ? time + YIELD_AFTER : 0;", "c.yields_at = 0;"),
    "never yields": ("c.yields = YIELDS;\n  }\n}", "c.yields = 0;\n  }\n}"),
    "yields for ever": ("static_cast<uint8_t>(c.yields - 1)", "c.yields"),
    "hurries back": ("usual * 2u / 5u", "usual"),
    "names another motor": ("      motor = i;", "      motor = 0;"),
    "keeps a touch at a Stop": ("} else if (led(c)) {\n    lose(", "} else if (0) {\n    lose("),
}  # fmt: skip


@pytest.mark.proof("test_a_hand_leads_a_body_at_rest")
@pytest.mark.parametrize("name", MUTANTS)
def test_a_changed_card_is_noticed(firmware: Path, tmp_path: Path, name: str) -> None:
    built = changed_card(tmp_path, "controller.h", *MUTANTS[name])
    for one in CHECKS:
        try:
            one(built)
        except AssertionError:
            return
    pytest.fail("the changed card passed")


CHECKS = (
    test_a_hand_leads_a_body_at_rest,
    lambda firmware: test_another_stop_takes_the_place_of_a_touch(firmware, StopReason.ASKED),
    test_a_short_knock_at_rest_is_no_touch,
    test_within_its_slack_a_motor_holds,
    test_a_motor_that_turns_backwards_at_rest_is_let_go,
    test_a_servo_that_says_that_it_is_elsewhere_is_followed_for_3_s,
)
