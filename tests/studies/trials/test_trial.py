"""A trial: the same whenever and wherever, and honest about what it measures."""

from dataclasses import replace

import numpy as np
import pytest

from miburi.bodies.simulated import Simulated
from miburi.robot import Robot
from miburi.safety.free import FreeRule
from miburi.safety.move import plan_move
from miburi.safety.printed import PrintedRule
from miburi.safety.stop import Phase
from miburi.studies.trials.conditions import HandKind, draw
from miburi.studies.trials.meeting import carriers
from miburi.studies.trials.plant import Skin, TrialPlant, Variation
from miburi.studies.trials.replay import DeafRule, judge
from miburi.studies.trials.trial import (
    IN_THE_WAY,
    TrialKind,
    enact,
    measure,
    sustained_force,
    trial,
)

RAISED = np.array([0.2, 1.4, 0.9, 0.3, 1.4, -0.9, -0.3, 1.0])


@pytest.fixture(scope="module")
def plant(robot: Robot) -> TrialPlant:
    return TrialPlant(robot)


def test_the_trials_robot_is_the_simulated_one(robot: Robot, plant: TrialPlant) -> None:
    """With nobody near and nothing varied, both move alike to the last bit."""
    plant.begin(np.array(robot.neutral), Variation(), np.random.default_rng(0))
    plant.rest(np.array(robot.neutral), settle=0.5)
    varied, plain = Simulated(robot, plant=plant), Simulated(robot)
    for body in (varied, plain):
        body.move(plan_move(robot, robot.neutral, RAISED, 0.8))
        body.step(1.0)
    np.testing.assert_array_equal(varied.configuration[0], plain.configuration[0])
    assert varied.state.phase is plain.state.phase is Phase.IDLE


def test_a_trial_depends_on_seed_and_number_alone(robot: Robot) -> None:
    """Gears that play are where the last trial left them, until somebody looks at a path."""
    servo = robot.servo.model
    loop = servo.loop.model_copy(update={"backlash": 0.01})
    true = robot.with_servo(servo.model_copy(update={"loop": loop}))
    plant, rule = TrialPlant(robot, true), FreeRule.of(robot)
    first = [trial(plant, rule, 5, kind, 3) for kind in TrialKind]
    trial(plant, rule, 6, TrialKind.BLOCKED, 9)  # leaves no trace in the plant
    again = [trial(TrialPlant(robot, true), rule, 5, kind, 3) for kind in reversed(TrialKind)][::-1]
    assert [repr(o) for o in first] == [repr(o) for o in again]
    assert repr(trial(plant, rule, 6, TrialKind.BLOCKED, 3)) != repr(first[1])


def test_people_are_met_and_felt(robot: Robot, plant: TrialPlant) -> None:
    rule, hands = FreeRule.of(robot), set()
    for index in range(16):
        outcome = trial(plant, rule, 1, TrialKind.BLOCKED, index)
        hands.add(outcome.hand)
        assert outcome.touched
        assert outcome.stopped
        assert not outcome.false_stop
        assert 0 < outcome.latency < 1
        assert outcome.peak_force >= outcome.sustained_force > 0
        assert outcome.right_motor == (outcome.motor in carriers(outcome.touched))
    assert hands == {hand.value for hand in HandKind}


def test_nobody_is_felt_where_nobody_is(robot: Robot, plant: TrialPlant) -> None:
    for index in range(6):
        outcome = trial(plant, FreeRule.of(robot), 1, TrialKind.FREE, index)
        assert (outcome.stopped, outcome.peak_force) == (False, 0)
        assert np.isnan([outcome.latency, outcome.push_after_stop, outcome.speed]).all()
        assert outcome.hand == outcome.link == ""


def test_without_a_rule_people_are_missed(robot: Robot, plant: TrialPlant) -> None:
    """The mutation: a limit of 0 and no backstops must show as missed contacts."""
    far = np.full(8, 10**6)
    rule = FreeRule.of(robot)
    grants = dict.fromkeys(("slack", "behind", "ahead", "arrival"), far)
    deaf = replace(rule, ratio=0, guards=replace(rule.guards, **grants))
    outcomes = [trial(plant, deaf, 1, TrialKind.BLOCKED, index) for index in range(6)]
    assert not any(o.stopped for o in outcomes)
    assert all(o.sustained_force >= IN_THE_WAY for o in outcomes)


def test_the_printed_rule_stops_free_moves(robot: Robot, plant: TrialPlant) -> None:
    rule = PrintedRule.of(robot)
    outcomes = [trial(plant, rule, 1, TrialKind.FREE, index) for index in range(5)]
    assert all(o.false_stop for o in outcomes)


@pytest.mark.parametrize("kind", list(TrialKind))
def test_judging_a_recording_is_as_good_as_being_there(
    robot: Robot, plant: TrialPlant, kind: TrialKind
) -> None:
    rule, compared = FreeRule.of(robot), 0
    for index in range(4):
        there, recorded = (enact(plant, r, 2, kind, index) for r in (rule, DeafRule.of(robot)))
        if there.brushes != recorded.brushes:
            continue  # the rule stops for somebody who is else only brushed past
        compared += 1
        later = judge(rule, recorded)
        assert (later.stopped_at is not None) == (there.stop is not None)
        if later.latency is not None:
            latency = measure(there, kind, index, 0).latency
            assert later.latency == pytest.approx(latency, abs=1e-9)
    assert compared >= 3


def test_after_a_persons_stop_the_way_back_is_no_contact(robot: Robot, plant: TrialPlant) -> None:
    """Stopped at any moment of any gesture, and released: loads must not look like a touch."""
    for index in range(16, 30):  # 20, 23 and 25 notice a rule that forgets the loads
        rng = np.random.default_rng([5, index])
        conditions = draw(robot, rng, moves=1)
        plant.begin(conditions.start, conditions.variation, rng)
        body = Simulated(robot, plant=plant)
        body.move(conditions.moves[0][0])
        body.step(float(rng.uniform(0.02, 0.8)))
        body.stop()
        body.step(1.0)
        body.release()
        while body.phase is Phase.RETURNING:
            body.read()
        assert body.phase is Phase.IDLE, body.state.stop


def test_a_grasp_holds_back_and_is_let_go_of(robot: Robot, plant: TrialPlant) -> None:
    plant.begin(RAISED, Variation(), np.random.default_rng(0))
    body = Simulated(robot, plant=plant)
    body.move(plan_move(robot, RAISED, robot.neutral, 0.8))
    body.step(0.4)
    plant.grasp("right_forearm", np.array([0.0, -0.05, 0.0]), Skin(2000.0, 40.0, 0.01, 0.5))
    body.step(0.3)
    assert body.state.phase is Phase.STOPPED
    assert max(plant.forces) > 1.0


def test_load_and_weak_batteries_make_the_arms_sag(robot: Robot) -> None:
    """Goals that are aimed above the sag would hide it."""
    servo = robot.servo.model
    drive = servo.drive.model_copy(update={"lift": 0.0})
    plant = TrialPlant(robot.with_servo(servo.model_copy(update={"drive": drive})))
    forward = np.array([0.0, 1.57, 1.5, 0.0, 1.57, -1.5, 0.0, 0.8])

    def sag(variation: Variation) -> float:
        plant.begin(forward, variation, np.random.default_rng(0))
        return float((forward - plant.angles)[1])

    plain = sag(Variation())
    assert plain > robot.servo.step
    assert min(sag(Variation(load=0.05)), sag(Variation(voltage=2.5))) > 1.5 * plain
    assert sag(Variation()) == plain


def test_sustained_force_is_a_mean_over_the_rules_period() -> None:
    assert sustained_force(np.full(100, 3.0)) == pytest.approx(3.0)
    blow = np.zeros(100)
    blow[50] = 50.0
    assert sustained_force(blow) == pytest.approx(1.0)


def test_carriers_know_the_chains() -> None:
    assert carriers("left_lower") == (
        "waist", "left_shoulder", "left_elbow", "left_fingertip"
    )  # fmt: skip
    assert carriers("right_upper") == ("waist", "right_shoulder", "right_elbow")
    assert carriers("phone_sides") == ("waist", "head")
    assert carriers("trunk") == ("waist",)
    assert carriers("foot") == ()
