"""Calibration: what free motion needs is granted, with a margin, and no more."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from miburi.calibration import Trace, calibrate, measured_lag, need
from miburi.calibration_file import read_calibration, write_calibration
from miburi.contact import PAPER_PERIOD, PAPER_RATIO, Guards, Rule
from miburi.errors import DescriptionError, InputError
from miburi.motion import FINE, Profile
from miburi.robot import Robot

EIGHT = np.ones(8, dtype=np.int64)
STEP = 2 * np.pi / 4096


def trace(lag: int = 25_000, missing: int = 0, distance: int = 800) -> Trace:
    """All motors follow their profile ``lag`` µs late; the head loses steps half way."""
    profile = Profile.plan(distance * EIGHT, 1000 * EIGHT, 13_000 * EIGHT)
    times = np.arange(0, int(profile.total[0]) + 300_000, 10_000)[:, None]
    positions = profile.position(times - lag) // FINE
    positions[len(times) // 2 :, 7] -= missing
    return Trace(profile, 0 * EIGHT, EIGHT, positions)


@pytest.mark.parametrize("lag", [0, 17_000, 60_000])
def test_the_lag_is_found_to_the_millisecond(lag: int) -> None:
    np.testing.assert_allclose(measured_lag([trace(lag)]), lag, atol=1000)


def test_a_motor_that_never_moved_is_taken_for_the_others() -> None:
    still = trace(30_000)
    distance = still.profile.distance.copy()
    distance[0] = 0
    profile = Profile.plan(distance, still.profile.speed, still.profile.acceleration)
    positions = still.positions.copy()
    positions[:, 0] = 0
    lag = measured_lag([Trace(profile, still.start, still.direction, positions)])
    assert abs(int(lag[0]) - 30_000) <= 1000


def test_what_is_missing_is_needed() -> None:
    found = need([trace(missing=9)], 25_000 * EIGHT, 8 * EIGHT, PAPER_PERIOD, PAPER_RATIO)
    clean = need([trace()], 25_000 * EIGHT, 8 * EIGHT, PAPER_PERIOD, PAPER_RATIO)
    assert (clean.slack <= FINE).all()
    # Of 100 steps 6.28 may be missing by the ratio.
    assert 2 * FINE <= found.slack[7] <= 9 * FINE
    assert found.tracking[7] >= 9 * FINE
    assert found.arrival[7] == 9 * FINE
    assert found.slack[0] == clean.slack[0]


def test_calibrated_guards_let_their_own_traces_pass_and_notice_a_block() -> None:
    traces = [trace(), trace(distance=300), trace(missing=3)]
    rule = Rule(calibrate(traces, STEP))
    for one in traces:
        watch = rule.watch(one.profile, one.start, one.direction)
        for row in range(10, len(one.positions), 10):
            assert watch.look(one.positions[row], row * one.interval) is None
    blocked = trace()
    blocked.positions[40:] = blocked.positions[40]
    watch = rule.watch(blocked.profile, blocked.start, blocked.direction)
    assert any(watch.look(blocked.positions[r], r * 10_000) for r in range(10, 60, 10))


def test_a_larger_margin_grants_more() -> None:
    traces = [trace(missing=12)]
    little, much = calibrate(traces, STEP, margin=1.0), calibrate(traces, STEP, margin=2.0)
    assert much.slack[7] > little.slack[7]


def test_nothing_cannot_be_calibrated() -> None:
    with pytest.raises(InputError, match="traces"):
        calibrate([], STEP)


def test_the_file_keeps_the_rule_to_the_step(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "calibration.toml"
    grants = {name: np.arange(8) + 3 for name in ("slack", "least", "tracking", "arrival")}
    rule = Rule(Guards(lag=1000 * (np.arange(8) + 20), **grants), period=80_000, ratio=9100)
    write_calibration(robot, rule, path, "two\nlines")
    body, back = read_calibration(robot, path)
    assert (back.period, back.ratio) == (80_000, 9100)
    for name in ("lag", "slack", "least", "tracking", "arrival"):
        np.testing.assert_array_equal(getattr(back.guards, name), getattr(rule.guards, name))
    assert Rule.of(body).guards.slack.tolist() == list(range(3, 11))
    path.write_text(path.read_text().replace("ratio = 0.91", "ratio = 1.5"))
    with pytest.raises(DescriptionError, match=r"rule\.ratio"):
        read_calibration(robot, path)


def test_guards_of_a_coarse_encoder_are_whole_steps() -> None:
    rough = calibrate([trace()], 2 * np.pi / 1229)
    assert (rough.slack >= 1).all()
    assert (rough.least >= 4).all()
    assert replace(rough).lag.tolist() == rough.lag.tolist()
