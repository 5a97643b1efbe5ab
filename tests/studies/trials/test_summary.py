"""Summaries: intervals by the book, and each trial counted as what it was."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from miburi.errors import InputError
from miburi.robot import Robot
from miburi.safety.contact import PAPER_PERIOD, PAPER_RATIO
from miburi.safety.free import FreeRule
from miburi.studies.trials.charts import Point, rule_map
from miburi.studies.trials.replay import record
from miburi.studies.trials.safety_page import write_page
from miburi.studies.trials.summary import needed_to_show, quantile_interval, summarise, wilson
from miburi.studies.trials.tables import in_words, rows
from miburi.studies.trials.trial import Outcome, Run
from miburi.studies.trials.tuning import BOX, Verdict, assess, tune

FREE = Outcome(
    kind="free", index=0, servo=0, feeling="fear", mood=0.5, pose=0, hand="", link="",
    speed=np.nan, seconds=1.0, stopped=False, sign="", motor="", false_stop=False, touched="",
    latency=np.nan, latency_from_1N=np.nan, peak_force=0.0, sustained_force=0.0,
    push_after_stop=np.nan, right_motor=False, brushes=0, brush_force=0.0, self_collision=False,
)  # fmt: skip
MET = replace(
    FREE, kind="blocked", hand="rigid", link="left_hand", speed=0.3, stopped=True, sign="speed",
    motor="waist", touched="left_hand", latency=0.1, latency_from_1N=0.09, peak_force=5.0,
    sustained_force=2.5, push_after_stop=0.1, right_motor=True,
)  # fmt: skip
MISSED = replace(MET, stopped=False, latency=np.nan, push_after_stop=np.nan, right_motor=False)


@pytest.mark.parametrize(
    ("hits", "trials", "low", "high"),
    [(0, 10, 0.0, 0.2775), (5, 10, 0.2366, 0.7634), (1, 1000, 0.00018, 0.00565), (0, 0, 0, 1)],
)
def test_wilsons_interval(hits: int, trials: int, low: float, high: float) -> None:
    assert wilson(hits, trials) == pytest.approx((low, high), abs=1e-4)


def test_the_interval_of_a_quantile_holds_it_in_95_of_100_samples() -> None:
    rng = np.random.default_rng(1)
    true = -np.log(0.01)
    intervals = [quantile_interval(rng.exponential(size=600), 0.99) for _ in range(400)]
    ends = [(low, high or np.inf) for low, high in filter(None, intervals)]
    assert np.mean([low <= true <= high for low, high in ends]) > 0.93
    assert quantile_interval(np.array([]), 0.99) is None
    for count in (1, 200, 367):  # few values do not bound a high quantile
        interval = quantile_interval(np.arange(float(count)), 0.99)
        assert interval is not None
        assert interval[1] is None


def test_each_trial_is_counted_as_what_it_was() -> None:
    early = replace(MET, false_stop=True, touched="", latency=np.nan)
    light = replace(MISSED, peak_force=2.5, sustained_force=1.2)
    late = replace(MET, latency=0.26, sustained_force=1.9)
    found = summarise(
        [FREE, replace(FREE, false_stop=True, stopped=True), MET, MISSED, light, early, late]
    )
    assert (found.free, found.blocked) == (2, 5)
    assert found.false_stops == 2
    assert (found.missed, found.missed_above_2N, found.missed_peak_above_2N) == (2, 1, 2)
    assert found.latency_max == 0.26
    assert (found.late, found.latency_above_2N_max) == (1, 0.1)
    assert found.push_after_stop_max == 0.1
    assert found.missed_interval == wilson(2, 4)


@pytest.mark.parametrize("bound", [0.001, 0.05, 1.0])
def test_so_many_trials_show_a_bound(bound: float) -> None:
    enough = needed_to_show(bound)
    assert enough is not None
    assert 0.98 * bound <= wilson(0, enough)[1] <= bound
    assert needed_to_show(0.0) is None


def test_nothing_is_none_not_zero() -> None:
    found = summarise([FREE])
    assert found.latency_max is None
    assert found.peak_force_median is None
    assert found.as_json()["latency_p95"] is None
    assert "–" in in_words(found)


@pytest.fixture(scope="module")
def recorded(robot: Robot) -> list[Run]:
    return record(robot, seed=4, free=8, blocked=4)


def test_shipped_guards_stop_nobody_for_nothing(robot: Robot, recorded: list[Run]) -> None:
    does = assess(FreeRule.of(robot), recorded)
    assert does.false_stops == 0
    assert does.missed == 0
    assert 0 < does.delay < 0.2


def test_tuning_keeps_the_bound_and_beats_the_middle_of_the_box(
    robot: Robot, recorded: list[Run], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("miburi.studies.trials.tuning._BUDGET", 6)
    tried: list[int] = []
    found = tune(robot, recorded, 0.0, 1, tried.append)
    assert found.verdict.false_stops == 0
    assert found.tried == len(tried) >= 6
    assert BOX[0][0] * 10_000 <= found.rule.period <= BOX[0][1] * 10_000
    for runs, bound in ((recorded, 2.0), (recorded[:8], 0.1)):
        with pytest.raises(InputError):
            tune(robot, runs, bound, 1)


def test_the_page_shows_all_columns_and_names_the_norms_standing(tmp_path: Path) -> None:
    points = [
        Point(PAPER_PERIOD, PAPER_RATIO, printed, Verdict(float(printed), 0.1, 0.2, 3.0))
        for printed in (False, True)
    ]
    tables = {
        "main": {"ours": [FREE, MET, MISSED], "printed": [FREE, MET]},
        "states": {"hot": [MET]},
    }
    write_page(tables, points, tmp_path)
    page = (tmp_path / "safety.md").read_text()
    assert "| | ours | printed |" in page
    assert "| | hot |" in page
    assert "What each part brings" not in page  # no such trials were given
    assert "secondary sources" in page
    assert "as printed | 0.1 | 0.9372 | 100.0%" in page
    for picture in ("safety-distributions.png", "safety-rules.png"):
        assert (tmp_path / picture).stat().st_size > 10_000


def test_the_map_has_the_papers_point(
    robot: Robot, recorded: list[Run], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("miburi.studies.trials.charts.PERIODS", (PAPER_PERIOD,))
    monkeypatch.setattr("miburi.studies.trials.charts.RATIOS", (PAPER_RATIO,))
    ours, printed = rule_map(recorded, FreeRule.of(robot))
    assert printed.verdict.false_stops > 0.9
    assert ours.verdict.false_stops == 0
    assert "missed contacts" in dict(rows({"a": summarise([MET])}))
    assert (ours.period, ours.ratio) == (PAPER_PERIOD, PAPER_RATIO)
