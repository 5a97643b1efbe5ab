"""Calibration: the guards let free motion pass, with a margin, and nothing more."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from miburi.calibration.file import Mounting, read_calibration, write_calibration
from miburi.calibration.free_motion import (
    Trace,
    calibrate,
    measure_lag,
    measure_need,
)
from miburi.calibration.identify import expecting
from miburi.calibration.shares import Shares
from miburi.errors import DescriptionError, InputError
from miburi.robot import Robot
from miburi.robot.guards import GUARDS, Guards
from miburi.safety.contact import PAPER_PERIOD, PAPER_RATIO, Rule
from miburi.safety.free import FreeRule
from miburi.safety.profile import FINE, Profile, Steps
from miburi.servos import load_servo
from miburi.version import __version__

EIGHT = np.ones(8, dtype=np.int64)
STEP = 2 * np.pi / 4096


def trace(
    lag: int = 25_000, missing: int = 0, distance: int = 800, times: Steps | None = None
) -> Trace:
    """Return a move that all motors follow ``lag`` µs late; the head loses steps half way."""
    profile = Profile.plan(distance * EIGHT, FINE * 1000 * EIGHT, 13_000 * EIGHT)
    if times is None:
        times = np.arange(0, int(profile.total[0]) + 300_000, 10_000)
    positions = profile.position(times[:, None] - lag) // FINE
    positions[len(times) // 2 :, 7] -= missing
    return Trace(profile, 0 * EIGHT, EIGHT, times, positions)


def irregular(rng: np.random.Generator) -> Steps:
    """Return times of readings like a card's: about every 20 ms, with one missing now and then."""
    return np.cumsum(rng.choice([19_000, 20_000, 20_300, 40_100], 80, p=[0.1, 0.5, 0.3, 0.1]))


@pytest.mark.parametrize("lag", [0, 17_000, 60_000])
def test_the_lag_is_found_to_the_millisecond(lag: int) -> None:
    np.testing.assert_allclose(measure_lag([trace(lag)]), lag, atol=1000)


def test_a_motor_that_never_moved_gets_the_lag_of_the_others() -> None:
    still = trace(30_000)
    distance = still.profile.distance.copy()
    distance[0] = 0
    profile = Profile.plan(distance, still.profile.speed, still.profile.acceleration)
    positions = still.positions.copy()
    positions[:, 0] = 0
    quiet = Trace(profile, still.start, still.direction, still.times, positions)
    lag = measure_lag([quiet])
    assert abs(int(lag[0]) - 30_000) <= 1000


def test_missing_travel_is_needed_as_a_guard() -> None:
    found = measure_need([trace(missing=9)], 25_000 * EIGHT, 8 * EIGHT, PAPER_PERIOD, PAPER_RATIO)
    clean = measure_need([trace()], 25_000 * EIGHT, 8 * EIGHT, PAPER_PERIOD, PAPER_RATIO)
    assert (clean.slack <= FINE).all()
    # The ratio itself allows 6.28 of 100 steps to be missing.
    assert 2 * FINE <= found.slack[7] <= 9 * FINE
    # The lag doubt, 2 ms at 1000 steps/s, covers two of the nine.
    assert 7 * FINE <= found.behind[7] <= 8 * FINE
    assert (found.ahead == clean.ahead).all()
    assert found.arrival[7] == 9 * FINE
    assert found.slack[0] == clean.slack[0]


def test_calibrated_guards_let_their_own_traces_pass_and_notice_a_block() -> None:
    traces = [trace(), trace(distance=300), trace(missing=3)]
    rule = Rule(calibrate(traces, STEP))
    for one in traces:
        watch = rule.watch(one.profile, one.start, one.direction)
        for time, positions in zip(one.times, one.positions, strict=True):
            assert watch.look(positions, int(time)) is None
    blocked = trace()
    blocked.positions[40:] = blocked.positions[40]
    watch = rule.watch(blocked.profile, blocked.start, blocked.direction)
    assert any(watch.look(blocked.positions[r], r * 10_000) for r in range(10, 60, 10))


@pytest.mark.proof("test_guards_are_the_missed_times_a_margin_and_never_under_the_floors")
@given(seed=st.integers(0, 1 << 30), period=st.sampled_from([40_000, 100_000, 130_000]))
def test_a_watch_stops_for_less_than_the_measured_need(seed: int, period: int) -> None:
    """With exactly these guards it lets the move pass, with one step less it stops."""
    rng = np.random.default_rng(seed)
    distance = int(rng.integers(60, 900))
    one = trace(int(rng.integers(10_000, 40_000)), distance=distance, times=irregular(rng))
    one.positions[:] += rng.integers(-2, 3, one.positions.shape)
    lag, least = 25_000 * EIGHT, 8 * EIGHT
    found = measure_need([one], lag, least, period, PAPER_RATIO)
    needs = [np.max(getattr(found, name)) for name in ("slack", "behind", "ahead", "arrival")]
    enough = [-(-int(value) // FINE) for value in needs]

    def stops(slack: int, behind: int, ahead: int, arrival: int) -> set[str]:
        grants = {"slack": slack, "behind": behind, "ahead": ahead, "arrival": arrival}
        guards = Guards(lag, least=least, **{name: EIGHT * most for name, most in grants.items()})
        watch = Rule(guards, period).watch(one.profile, one.start, one.direction)
        looks = zip(one.times, one.positions, strict=True)
        found = [watch.look(positions, int(time)) for time, positions in looks]
        return {contact.sign.value for contact in found if contact is not None}

    assert stops(*enough) == set()
    for index, name in enumerate(("speed", "tracking", "tracking", "arrival")):
        if needs[index] > 0:
            assert name in stops(*(n - (i == index) for i, n in enumerate(enough)))


def test_a_larger_margin_grants_more() -> None:
    traces = [trace(missing=12)]
    little, much = calibrate(traces, STEP, margin=1.0), calibrate(traces, STEP, margin=2.0)
    assert much.slack[7] > little.slack[7]


def test_a_calibration_without_traces_is_refused() -> None:
    with pytest.raises(InputError, match="traces"):
        calibrate([], STEP)


def test_the_file_keeps_the_rule_to_the_step(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "calibration.toml"
    rule = Rule(Guards(*(np.arange(8) + 3 for _ in GUARDS)), period=80_000, ratio=9100)
    write_calibration(robot, rule, path, "two\nlines")
    found = read_calibration(robot, path)
    back = found.rule
    assert (found.servos, found.named) == (None, True)
    assert (back.period, back.ratio) == (80_000, 9100)
    for name, values in vars(rule.guards).items():
        np.testing.assert_array_equal(vars(back.guards)[name], values)
    # Nothing was identified: what the rule expects is the description's servo.
    np.testing.assert_array_equal(back.servo, FreeRule.of(robot).servo)
    good = path.read_text()
    assert good.startswith(f"# two\n# lines\n# Written by Miburi {__version__}.\n")
    before, _, rest = good.partition("[fits]")
    path.write_text(before + "[rule]" + rest.partition("[rule]")[2])
    assert not read_calibration(robot, path).named
    # None of these would be a rule that stops this robot.
    for right, wrong, words in [
        ('robot = "iph', 'robot = "s', r"is for the robot sonoid, and this one is iphonoid"),
        ('servo = "XL', 'servo = "X', r"is for the servo X330-M288-T, but the robot has XL330"),
        ("ratio = 0.91", "ratio = 1.5", r"rule\.ratio"),
        ("ratio = 0.91", "ratio = 0.5", r"rule\.ratio"),
        ("period = 0.08", "period = 0.5", r"rule\.period"),
        ("behind = [0.0046", "behind = [0.9", r"calibration\.toml: guards\.behind is 0\.9\d* rad"),
    ]:
        assert right in good
        path.write_text(good.replace(right, wrong))
        with pytest.raises(DescriptionError, match=words):
            read_calibration(robot, path)


@pytest.mark.parametrize(
    ("table", "key", "value", "words"),
    [
        ("lengths", "L34", 0.12, "lengths"),
        ("masses", "phone", 0.3, "masses"),
        ("left_elbow", "max", 0.5, "joint limits"),
        ("servo", "acceleration", 10.0, "servo's constants or speeds"),
        ("motor", "resistance", 4.0, "servo's constants or speeds"),
        ("drive", "gain", 800.0, "servo's constants or speeds"),
    ],
)
def test_a_calibration_of_another_body_of_the_same_name_is_refused(
    robot: Robot, tmp_path: Path, table: str, key: str, value: float, words: str
) -> None:
    path, data = tmp_path / "calibration.toml", robot.model_dump()
    write_calibration(robot, FreeRule.of(robot), path, "")
    tables = {**data, **data["joints"], **data["servo"]["model"]}
    tables[table][key] = value
    with pytest.raises(DescriptionError, match=f"on a robot with other {words}; give its file"):
        read_calibration(Robot.model_validate(data), path)


def test_the_file_keeps_how_a_cards_servos_are_mounted(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "calibration.toml"
    mounting = Mounting(id=[8, 7, 6, 5, 4, 3, 2, 1], direction=[1, -1] * 4, zero=[0, 4095] * 4)
    write_calibration(robot, FreeRule.of(robot), path, "", mounting)
    assert read_calibration(robot, path).servos == mounting
    good = path.read_text()
    for wrong, right, words in [
        ("zero = [4096,", "zero = [0,", r"servos\.zero\.0"),
        ("direction = [0,", "direction = [1,", r"servos\.direction\.0"),
        ("id = [7,", "id = [8,", "each servo needs an id of its own"),
        ("id = [1, ", "id = [", "8"),
    ]:
        path.write_text(good.replace(right, wrong))
        with pytest.raises(DescriptionError, match=words):
            read_calibration(robot, path)


def test_guards_of_a_coarse_encoder_are_whole_steps() -> None:
    rough = calibrate([trace()], 2 * np.pi / 1229)
    assert (rough.slack >= 1).all()
    assert (rough.least >= 4).all()


def test_identified_servos_come_back_from_their_file(robot: Robot, tmp_path: Path) -> None:
    """All of them, to the last unit of the card: else the file would not fit what the card has."""
    path, rng = tmp_path / "own.toml", np.random.default_rng(5)
    guards = FreeRule.of(robot).guards
    for _ in range(20):
        wear = float(rng.uniform(1, 3))
        shares = Shares(*rng.uniform(0.6, 1.4, (4, 8)), wear=wear)
        worn = robot.with_servo(robot.servo.model.varied(friction=wear))
        rule = expecting(worn, shares, guards)
        write_calibration(worn, rule, path, "two\nlines", identified=shares, of=robot)
        back = read_calibration(robot, path).rule
        assert isinstance(back, FreeRule)
        np.testing.assert_array_equal(back.servo, rule.servo)
        np.testing.assert_array_equal(back.sag, rule.sag)
        for name, values in vars(guards).items():
            np.testing.assert_array_equal(vars(back.guards)[name], values)
    with pytest.raises(DescriptionError, match=r"XL330-M288-T, but the robot has imagined"):
        read_calibration(robot.with_servo(load_servo("imagined")), path)
