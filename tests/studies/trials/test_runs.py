"""Runs: the same file however they are carried out, and nothing repeated or lost."""

import json
import signal
import socket
from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as parquet
import pytest
from tests.fixtures.command import miburi
from tests.fixtures.program import Program
from tests.fixtures.waiting import until

from miburi.errors import InputError, MiburiError, OutputError
from miburi.robot import Robot
from miburi.safety.free import FreeRule
from miburi.studies.trials import plan as plans
from miburi.studies.trials import runs
from miburi.studies.trials.plan import Plan, Subject
from miburi.studies.trials.runs import carry_out_plan, read_parquet
from miburi.studies.trials.trial import TrialKind


@pytest.fixture(scope="module")
def plan(robot: Robot) -> Plan:
    return Plan((Subject(robot, FreeRule.of(robot)),), seed=3, free=6, blocked=5)


@pytest.fixture(scope="module")
def whole(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    out = tmp_path_factory.mktemp("whole") / "trials.parquet"
    carry_out_plan(plan, out)
    return out.read_bytes()


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plans, "CHUNK", 2)


def test_chunks_cover_each_trial_once(plan: Plan) -> None:
    counted = [(kind, i) for kind, first, last in plan.chunks for i in range(first, last)]
    free = [(TrialKind.FREE, i) for i in range(6)]
    assert counted == free + [(TrialKind.BLOCKED, i) for i in range(5)]


def test_processes_write_the_same_bytes(plan: Plan, whole: bytes, tmp_path: Path) -> None:
    carry_out_plan(plan, tmp_path / "trials.parquet", workers=2)
    assert (tmp_path / "trials.parquet").read_bytes() == whole
    assert [file.name for file in tmp_path.iterdir()] == ["trials.parquet"]


def test_the_file_reads_back(plan: Plan, whole: bytes, tmp_path: Path) -> None:
    out = tmp_path / "trials.parquet"
    out.write_bytes(whole)
    assert [repr(o) for o in read_parquet(out)] == [repr(o) for o in carry_out_plan(plan)]
    out.write_bytes(b"no")
    with pytest.raises(InputError, match="not a file of trials"):
        read_parquet(out)


def test_a_broken_off_run_goes_on_where_it_was(
    plan: Plan, whole: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, carried = tmp_path / "trials.parquet", []
    carry_out = runs.carry_out_chunk

    def until_tired(plan: Plan, chunk: runs.Chunk) -> list[runs.Outcome]:
        if len(carried) == 3:
            raise KeyboardInterrupt
        carried.append(chunk)
        return carry_out(plan, chunk)

    monkeypatch.setattr(runs, "carry_out_chunk", until_tired)
    with pytest.raises(KeyboardInterrupt):
        carry_out_plan(plan, out)
    assert not out.exists()
    journal = tmp_path / ".trials.parquet.journal"
    assert len(journal.read_bytes().splitlines()) == 4
    # A line that was being written when the power went is no line.
    with journal.open("ab") as file:
        file.write(b'{"chunk": ["free", 4, 6], "ro')
    shown: list[int] = []
    monkeypatch.setattr(
        runs, "carry_out_chunk", lambda plan, chunk: carried.append(chunk) or carry_out(plan, chunk)
    )
    carry_out_plan(plan, out, progress=lambda done, _: shown.append(done))
    assert carried == plan.chunks
    assert shown == [6, 8, 10, 11]
    assert out.read_bytes() == whole
    assert not journal.exists()


def test_another_runs_journal_is_not_touched(plan: Plan, tmp_path: Path) -> None:
    journal = tmp_path / ".trials.parquet.journal"
    journal.write_bytes(json.dumps({"run": "another"}).encode() + b"\n")
    with pytest.raises(OutputError, match="another, unfinished run"):
        carry_out_plan(plan, tmp_path / "trials.parquet")
    assert journal.exists()


def test_the_key_knows_rule_and_seed(plan: Plan, robot: Robot) -> None:
    rule = FreeRule.of(robot)
    others = [
        replace(plan, seed=4),
        replace(plan, servos=(Subject(robot, replace(rule, ratio=9000)),)),
        replace(plan, servos=(Subject(robot, rule, robot),)),
        replace(plan, blocked=6),
    ]
    assert len({plan.key, *(other.key for other in others)}) == 5


def test_the_key_knows_what_the_rule_expects_of_its_servos(plan: Plan, robot: Robot) -> None:
    """Two calibrations may have the same guards: one's journal must not go on as the other's."""
    rule = FreeRule.of(robot)
    heavier = replace(rule, sag=2 * rule.sag)
    keys = {replace(plan, servos=(Subject(robot, one),)).key for one in (rule, heavier)}
    assert len(keys) == 2


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


def test_a_killed_command_resumes_to_the_same_file(tmp_path: Path) -> None:
    command = ["trials", "--free", "51", "--blocked", "0", "--seed", "9", "--json"]
    out, again = tmp_path / "a.parquet", tmp_path / "b.parquet"
    running = Program(*command, "--out", out, "--workers", "1")
    journal = tmp_path / ".a.parquet.journal"
    # It may have to compile, beside other tests.
    until(lambda: journal.exists() and journal.read_bytes().count(b"\n") > 1, seconds=120)
    running.end(signal.SIGKILL)
    known = journal.read_bytes().count(b"\n")
    assert 1 < known <= 3
    for path in (out, again):
        done = miburi(*command, "--out", path, "--workers", "1")
        assert json.loads(done.stdout)["free"] == 51
    assert out.read_bytes() == again.read_bytes()
    assert not journal.exists()


def test_a_file_of_trials_says_what_was_chosen(plan: Plan, tmp_path: Path) -> None:
    """Files of two rules could not be told apart."""
    out = tmp_path / "trials.parquet"
    carry_out_plan(replace(plan, chosen={"rule": "printed"}), out)
    assert parquet.read_schema(out).metadata[b"rule"] == b"printed"


def test_a_cluster_that_does_not_answer_is_said_at_once(plan: Plan) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # nobody listens there
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(MiburiError, match="no Ray cluster answers"):
            carry_out_plan(plan, ray=address)
