"""A maker's calibration: servos are identified, named in words, refused where they must be."""

import re
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from miburi.calibration.free_motion import Trace
from miburi.calibration.guards import free_rule
from miburi.calibration.identify import (
    Identified,
    check,
    fitted,
    identify,
    in_words,
    play,
    proposed_gain,
)
from miburi.errors import BodyError, InputError
from miburi.robot import JOINTS, Robot, load_robot
from miburi.robot.specimens import specimens
from miburi.safety.free import FreeRule
from miburi.studies.trials.plant import TrialPlant
from miburi.studies.trials.trial import TrialKind, trial
from miburi.studies.trials.workshop import USUAL, calibrate_servos, record_free_moves

LEFT_ELBOW = JOINTS.index("left_elbow")


@pytest.fixture(scope="module")
def traces(robot: Robot) -> list[Trace]:
    return record_free_moves(TrialPlant(robot), 3, together=True)


@pytest.fixture(scope="module")
def found(robot: Robot, traces: list[Trace]) -> Identified:
    return identify(robot, traces)


@pytest.fixture(scope="module")
def rule(robot: Robot, found: Identified, traces: list[Trace]) -> FreeRule:
    return free_rule(robot, found, traces)


@pytest.fixture(scope="module")
def playing(robot: Robot) -> Robot:
    """The first of the workshop's robots, with play in all gears."""
    (one,) = specimens(robot, 1, 1, play=radians(0.5))
    return one.robot


def test_a_servo_like_its_description_is_found_to_be_so(robot: Robot, found: Identified) -> None:
    assert np.abs(np.log(found.stiffness)).max() < np.log(1.3)
    assert found.missed.max() < 1.0
    assert not play(robot, found).any()
    assert 4000 <= found.delay <= 8000


@pytest.mark.proof("test_a_stiff_elbow_is_named_in_words")
def test_twice_the_stiffness_is_found_and_half_the_gain_proposed(robot: Robot) -> None:
    """The open factor of two: the manual's divisor of the P gain, or the identified one."""
    servo = robot.servo.model
    divisor = servo.divisor.model_copy(update={"p_divisor": servo.divisor.p_divisor / 2})
    stiff = robot.with_servo(servo.model_copy(update={"divisor": divisor}))
    found = identify(robot, record_free_moves(TrialPlant(robot, stiff), 3))
    assert np.median(found.stiffness) == pytest.approx(2.0, rel=0.2)
    horns = 2 * servo.stiffness * (1 - servo.friction.motor_load)  # N·m/rad, at the gain as it is
    assert 4.0 <= horns * proposed_gain(robot, found) / servo.drive.gain <= 6.0
    with pytest.raises(BodyError, match=r"2 to 8 are allowed. Set the P gain to \d{4} "):
        check(robot, found)
    after = fitted(robot, found).servo.model
    expected = horns * after.drive.gain / servo.drive.gain / 0.7332
    assert after.stiffness == pytest.approx(expected, rel=0.2)


def test_a_stiff_elbow_is_named_in_words(robot: Robot) -> None:
    friction = tuple(2.0 if motor == LEFT_ELBOW else 1.0 for motor in range(8))
    rubbing = replace(USUAL, friction=friction)
    found = identify(robot, record_free_moves(TrialPlant(robot), 3, rubbing, together=True))
    words = in_words(robot, found)
    (elbow,) = (line for line in words if line.startswith("left elbow: "))
    assert "friction of the right" in elbow
    assert not any("shoulder" in line for line in words)


def test_a_heavy_arm_is_not_taken_for_loose_gears(robot: Robot, found: Identified) -> None:
    missed = np.where(np.arange(8) == LEFT_ELBOW, 2.0, found.missed)
    seen = replace(found, missed=missed, friction=np.ones(8))
    data = robot.model_dump()
    data["lengths"] |= {"L01": 0.2, "L23": 0.09, "L34": 0.12}
    long = Robot.model_validate(data)
    (loose,) = (line for line in in_words(robot, seen) if "play" in line)
    assert loose.endswith("the gears are worn, or something touched the robot.")
    (either,) = (line for line in in_words(long, seen) if "play" in line)
    assert "Gears seem to have play" in either
    assert "Or it is no play: 2.2 times the inertia of a shipped robot's" in either
    (heavy,) = (line for line in in_words(long, seen, firm=True) if "play" in line)
    assert "the simulated gears have none, so what they carry is too heavy" in heavy
    assert "screw" not in heavy


def test_one_soft_servo_among_good_ones_is_refused_by_name(robot: Robot, found: Identified) -> None:
    check(robot, found)
    soft = np.where(np.arange(8) == LEFT_ELBOW, 0.3, found.stiffness)
    with pytest.raises(
        BodyError, match=r"left elbow springs back with 1\.3 N.* others .* horn's screw"
    ):
        check(robot, replace(found, stiffness=soft))


def test_guards_are_the_missed_times_a_margin_and_never_under_the_floors(
    robot: Robot, found: Identified, traces: list[Trace], rule: FreeRule
) -> None:
    floors = FreeRule.of(robot).guards
    for name, values in vars(rule.guards).items():
        if name != "lag":
            assert np.all(values >= vars(floors)[name])
    # A hand that holds the head back in one move is free motion that needs a wider guard.
    held = traces[-2]
    positions = held.positions.copy()
    positions[20:60, 7] -= 40 * held.direction[7]
    wider = free_rule(robot, found, [replace(held, positions=positions)]).guards
    assert wider.behind[7] > floors.behind[7]
    assert np.all(wider.behind[:7] == floors.behind[:7])


def test_the_rule_of_a_calibrated_robot_lets_its_own_moves_pass(
    traces: list[Trace], rule: FreeRule
) -> None:
    for one in traces:
        watch = rule.watch(one.profile, one.start, one.direction, one.loading)
        for time, positions in zip(one.times.tolist(), one.positions, strict=True):
            assert watch.look(positions, time) is None


@pytest.mark.proof("test_the_rule_of_a_calibrated_robot_lets_its_own_moves_pass")
def test_worn_servos_pass_freely_when_they_are_cold_and_the_supply_is_low(robot: Robot) -> None:
    """Gears take half of the motors' torque; each of these trials brings a fifth more friction."""
    rubbing = robot.with_servo(robot.servo.model.varied(friction=1.9))
    done = calibrate_servos(robot, 1, rubbing)
    assert done.found.wear == pytest.approx(1.9, rel=0.1)
    assert np.median(done.found.friction) == pytest.approx(0.92, abs=0.1)
    plant = TrialPlant(done.robot, done.true)
    cold = (7, 110)  # both were stopped
    free = [trial(plant, done.rule, 101, TrialKind.FREE, index) for index in cold]
    assert [one.index for one in free if one.stopped] == []
    held = [trial(plant, done.rule, 101, TrialKind.BLOCKED, index) for index in range(3)]
    assert all(one.stopped and not one.false_stop for one in held)


@pytest.mark.proof("test_the_chosen_gain_rests_in_spite_of_play")
def test_gears_that_play_are_calibrated_named_and_still_notice_somebody(
    robot: Robot, playing: Robot
) -> None:
    done = calibrate_servos(robot, 1, playing)
    (words,) = (each for each in done.words if "play" in each)
    assert words.startswith("Gears seem to have play, of about ")
    assert "the waist" in words
    told = [float(angle) for angle in re.findall(r"(\d\.\d)°", words)]
    assert len(told) >= 4
    assert all(0.3 <= angle <= 1.0 for angle in told)
    plant = TrialPlant(done.robot, done.true)
    free = [trial(plant, done.rule, 1, TrialKind.FREE, index) for index in range(8)]
    assert [one.index for one in free if one.stopped] == []
    held = [trial(plant, done.rule, 1, TrialKind.BLOCKED, index) for index in range(8)]
    assert not any(one.false_stop for one in held)
    missed = [one.sustained_force for one in held if not one.stopped]
    assert len(missed) <= 1
    assert max(missed, default=0.0) < 2.0  # N: lighter ones may pass


@pytest.mark.proof("test_the_rule_of_a_calibrated_robot_lets_its_own_moves_pass")
def test_play_hides_no_wear(robot: Robot) -> None:
    """Its joints that play seem to rub as new ones; taken for new, it stops in 3 of 10 moves."""
    true = specimens(robot, seed=1, count=12)[3].robot
    rubs = true.servo.model.friction.dry / robot.servo.model.friction.dry
    assert calibrate_servos(robot, 1, true).found.wear == pytest.approx(rubs, rel=0.25)


@pytest.mark.proof("test_a_servo_like_its_description_is_found_to_be_so")
def test_coarse_encoders_are_not_taken_for_play(robot: Robot) -> None:
    servo = robot.servo.model
    encoder = servo.encoder.model_copy(update={"steps_per_turn": 1024})
    coarse = robot.with_servo(servo.model_copy(update={"encoder": encoder}))
    found = identify(coarse, record_free_moves(TrialPlant(coarse), 3))
    assert not play(coarse, found).any()


@pytest.mark.proof("test_a_servo_like_its_description_is_found_to_be_so")
def test_play_is_told_where_it_stops_the_calibration(
    robot: Robot, playing: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A joint that jams in a gesture is refused, however far the gears of others play."""
    begin, begun = TrialPlant.begin, list[TrialPlant]()

    def jammed(plant: TrialPlant, *rest: Any) -> None:
        begin(plant, *rest)
        if plant in begun:  # the moves that shake the waist were made: now come the gestures
            plant.friction[LEFT_ELBOW, 0] += 0.3
            plant.rest(robot.neutral)
        begun.append(plant)

    monkeypatch.setattr(TrialPlant, "begin", jammed)
    with pytest.raises(
        BodyError, match=r"at left_elbow\..*Gears seem to have play, of about .*° at the waist"
    ):
        calibrate_servos(robot, 1, playing)


@pytest.mark.proof("test_a_servo_like_its_description_is_found_to_be_so")
def test_shoulders_are_granted_the_guards_of_joints_without_a_load(
    robot: Robot, playing: Robot
) -> None:
    """A load presses their teeth together while they are calibrated, and not in each gesture."""
    moves = record_free_moves(TrialPlant(robot, playing), 1)
    guards = free_rule(robot, identify(robot, moves), moves).guards
    floors = FreeRule.of(robot).guards
    shoulders = [JOINTS.index("right_shoulder"), JOINTS.index("left_shoulder")]
    assert np.all(guards.slack[shoulders] >= 2 * floors.slack[shoulders])


@pytest.mark.proof("test_guards_are_the_missed_times_a_margin_and_never_under_the_floors")
def test_longer_arms_shake_a_waist_and_its_guards_know_it(tall_file: Path) -> None:
    """Without moves in which arms swing against each other, a gesture that tests it is stopped."""
    waist = calibrate_servos(load_robot(tall_file), 0).rule.guards
    assert waist.ahead[0] > 12


@pytest.mark.proof("test_guards_are_the_missed_times_a_margin_and_never_under_the_floors")
def test_guards_hold_in_another_state_than_the_calibrations(robot: Robot, rule: FreeRule) -> None:
    """New gears fit under the description's guards; worn ones, softer by a quarter, do not."""
    floors = vars(FreeRule.of(robot).guards)
    new = vars(rule.guards)
    rubbing = robot.with_servo(robot.servo.model.varied(friction=1.9))
    moves = record_free_moves(TrialPlant(rubbing), 3)
    worn = vars(free_rule(rubbing, identify(rubbing, moves, 1.9), moves).guards)
    for name in ("slack", "behind"):
        np.testing.assert_array_equal(new[name], floors[name])
        assert worn[name][7] >= 1.4 * floors[name][7]
    for name, values in worn.items():
        if name != "lag":
            assert np.all(values >= floors[name])


def test_without_moves_nothing_is_identified(robot: Robot) -> None:
    with pytest.raises(InputError, match="free moves"):
        identify(robot, [])
