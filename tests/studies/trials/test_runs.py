"""Runs: the same file however they are carried out, and nothing repeated or lost."""

import json
import socket
from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as parquet
import pytest

from miburi.errors import InputError, MiburiError, OutputError
from miburi.robot import Robot
from miburi.safety.free import FreeRule
from miburi.studies.trials import plan as plans
from miburi.studies.trials import runs
from miburi.studies.trials.plan import Plan, Subject
from miburi.studies.trials.runs import carry_out_plan, read_parquet
from miburi.studies.trials.trial import Outcome, TrialKind


@pytest.fixture(scope="module")
def plan(robot: Robot) -> Plan:
    return Plan((Subject(robot, FreeRule.of(robot)),), seed=3, free=4, blocked=3)


@pytest.fixture(scope="module")
def written(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Outcome]]:
    out = tmp_path_factory.mktemp("whole") / "trials.parquet"
    return out, carry_out_plan(plan, out)


@pytest.fixture
def whole(written: tuple[Path, list[Outcome]]) -> bytes:
    return written[0].read_bytes()


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plans, "CHUNK", 2)


@pytest.mark.proof("test_a_broken_off_run_goes_on_where_it_was")
def test_processes_write_the_same_bytes(plan: Plan, whole: bytes, tmp_path: Path) -> None:
    carry_out_plan(plan, tmp_path / "trials.parquet", workers=2)
    assert (tmp_path / "trials.parquet").read_bytes() == whole
    assert [file.name for file in tmp_path.iterdir()] == ["trials.parquet"]


def test_the_file_reads_back(written: tuple[Path, list[Outcome]], tmp_path: Path) -> None:
    out, outcomes = written
    assert [repr(o) for o in read_parquet(out)] == [repr(o) for o in outcomes]
    counted = [(TrialKind(o.kind), o.index) for o in outcomes]
    assert counted == [(TrialKind.FREE, i) for i in range(4)] + [
        (TrialKind.BLOCKED, i) for i in range(3)
    ]
    for row, outcome in zip(parquet.read_table(out).to_pylist(), outcomes, strict=True):
        nothing = {name for name, value in row.items() if value is None}
        if outcome.kind == "free":
            assert {"hand", "link", "speed", "touched", "latency", "right_motor"} <= nothing
        assert ("motor" in nothing) == ("sign" in nothing) == (not outcome.stopped)
    assert all(o.gesture == o.feeling for o in outcomes)  # the names of the shipped ones
    earlier = tmp_path / "earlier.parquet"  # from before a trial named its gesture
    parquet.write_table(parquet.read_table(out).drop_columns("gesture"), earlier)
    assert {o.gesture for o in read_parquet(earlier)} == {""}
    (tmp_path / "no").write_bytes(b"no")
    with pytest.raises(InputError, match="not a file of trials"):
        read_parquet(tmp_path / "no")


def test_a_broken_off_run_goes_on_where_it_was(
    plan: Plan, whole: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A killed run, too: each finished chunk is on the disk before the next one begins."""
    out, journal = tmp_path / "trials.parquet", tmp_path / ".trials.parquet.journal"
    carried: list[runs.Chunk] = []
    carry_out = runs.carry_out_chunk

    def until_tired(plan: Plan, chunk: runs.Chunk) -> list[Outcome]:
        assert journal.read_bytes().count(b"\n") == 1 + len(carried)
        if len(carried) == 3:
            raise KeyboardInterrupt
        carried.append(chunk)
        return carry_out(plan, chunk)

    monkeypatch.setattr(runs, "carry_out_chunk", until_tired)
    with pytest.raises(KeyboardInterrupt):
        carry_out_plan(plan, out)
    assert not out.exists()
    # A line that was being written when the power went is no line.
    with journal.open("ab") as file:
        file.write(b'{"chunk": ["blocked", 2, 3], "ro')
    shown: list[int] = []
    monkeypatch.setattr(
        runs, "carry_out_chunk", lambda plan, chunk: carried.append(chunk) or carry_out(plan, chunk)
    )
    carry_out_plan(plan, out, progress=lambda done, _: shown.append(done))
    assert carried == plan.chunks
    assert shown == [6, 7]
    assert out.read_bytes() == whole
    assert not journal.exists()


def test_an_interruption_does_not_wait_for_the_chunks_underway(
    plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plans, "CHUNK", 10**6)  # one of them would take a day

    def interrupt(done: int, _all: int) -> None:
        if done:
            raise KeyboardInterrupt

    long = replace(plan, free=1, blocked=10**6)
    with pytest.raises(KeyboardInterrupt):
        carry_out_plan(long, tmp_path / "trials.parquet", workers=2, progress=interrupt)
    assert [file.name for file in tmp_path.iterdir()] == [".trials.parquet.journal"]


def test_another_runs_journal_is_not_touched(plan: Plan, tmp_path: Path) -> None:
    journal = tmp_path / ".trials.parquet.journal"
    journal.write_bytes(json.dumps({"run": "another"}).encode() + b"\n")
    with pytest.raises(OutputError, match="another, unfinished run"):
        carry_out_plan(plan, tmp_path / "trials.parquet")
    assert journal.exists()


def test_the_key_knows_all_that_results_depend_on(plan: Plan, robot: Robot) -> None:
    """A journal must not continue a run of another calibration, even one with equal guards."""
    rule = FreeRule.of(robot)
    others = [
        replace(plan, seed=4),
        replace(plan, servos=(Subject(robot, replace(rule, ratio=9000)),)),
        replace(plan, servos=(Subject(robot, replace(rule, sag=2 * rule.sag)),)),
        replace(plan, servos=(Subject(robot, rule, robot),)),
        replace(plan, blocked=6),
    ]
    assert len({plan.key, *(other.key for other in others)}) == 6


@pytest.mark.parametrize("wrong", [{"seed": -1}, {"free": 0, "blocked": 0}, {"servos": ()}])
def test_wrong_plans_are_refused(plan: Plan, wrong: dict[str, object]) -> None:
    with pytest.raises(InputError):
        replace(plan, **wrong)
    with pytest.raises(InputError, match="workers"):
        carry_out_plan(plan, workers=0)


def test_an_unwritable_place_is_said(plan: Plan, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="cannot be written"):
        carry_out_plan(plan, tmp_path / "file" / "trials.parquet")


def test_a_file_of_trials_says_what_was_chosen(plan: Plan, tmp_path: Path) -> None:
    """Files of two rules could not be told apart."""
    out = tmp_path / "trials.parquet"
    runs.write_parquet(replace(plan, chosen={"rule": "printed"}), [], out)
    assert parquet.read_schema(out).metadata[b"rule"] == b"printed"


def test_a_cluster_that_does_not_answer_is_said_at_once(plan: Plan) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # nobody listens there
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(MiburiError, match="no Ray cluster answers"):
            carry_out_plan(plan, ray=address)
