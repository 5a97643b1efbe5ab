"""Carry out many trials, on the processes of one machine or on several machines with Ray.

A trial depends only on the run's seed and its number, so the same plan gives the same Parquet file,
byte for byte, wherever it runs. A journal beside the file has the finished chunks, from which an
interrupted run continues.
"""

import json
import os
import signal
import socket
import threading
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import closing, contextmanager
from dataclasses import astuple, fields
from multiprocessing import connection, get_context
from pathlib import Path
from typing import Any

import numpy as np

from miburi.errors import InputError, MiburiError, OutputError, needs_extra
from miburi.ground.files import whole_files
from miburi.studies.trials.plan import Chunk, Plan
from miburi.studies.trials.plant import TrialPlant
from miburi.studies.trials.trial import Outcome, TrialKind, trial
from miburi.version import __version__

#: How long, in s, to wait for a cluster's address to answer.
_KNOCK = 5.0
#: Each type of an outcome's values: its type in a file, and what an outcome holds for null.
_KINDS: dict[Any, tuple[str, Any]] = {
    str: ("string", ""),
    int: ("int64", 0),
    float: ("double", np.nan),
    bool: ("bool", False),
}

Done = tuple[Chunk, list[Outcome]]


def carry_out_plan(
    plan: Plan,
    out: Path | None = None,
    *,
    workers: int = 1,
    ray: str | None = None,
    progress: Callable[[int, int], None] = lambda _done, _all: None,
) -> list[Outcome]:
    """Carry out all trials of a plan; return their outcomes, free trials first, by number.

    The trials run on ``workers`` processes of this machine, 1 or more, or on the cluster at the
    address ``ray``; the address ``auto`` finds a local cluster. ``progress`` is called with the
    number of finished trials and the number of all trials. An interrupted run with the same Parquet
    file, ``out``, is continued.

    Raises InputError if ``workers`` is not positive; OutputError if ``out`` cannot be written, or
    its journal belongs to another run; MiburiError if ``ray`` is given and Ray is not installed or
    does not answer, or ``out`` is given and PyArrow is not installed.
    """
    if workers < 1:
        raise InputError(f"--workers must be 1 or more, got {workers}.")
    if out is not None:
        _arrow()  # fail now if it is missing, not after the last trial
    total, chunks = plan.free + plan.blocked, plan.chunks
    with _journal(plan, out) as (done, write):
        finished = sum(map(len, done.values()))
        progress(finished, total)
        todo = [chunk for chunk in chunks if chunk not in done]
        if ray is not None:
            stream = _on_cluster(plan, todo, ray)
        elif workers == 1:
            stream = ((chunk, carry_out_chunk(plan, chunk)) for chunk in todo)
        else:
            stream = _on_processes(plan, todo, workers)
        with closing(stream):
            for chunk, outcomes in stream:
                write(chunk, outcomes)
                done[chunk] = outcomes
                finished += len(outcomes)
                progress(finished, total)
        outcomes = [outcome for chunk in chunks for outcome in done[chunk]]
        if out is not None:
            write_parquet(plan, outcomes, out)
    if out is not None:
        _journal_path(out).unlink(missing_ok=True)
    return outcomes


def carry_out_chunk(plan: Plan, chunk: Chunk) -> list[Outcome]:
    """Carry out one chunk of a run in this process."""
    kind, first, last = chunk
    outcomes, run_key = [], plan.key
    for index in range(first, last):
        number = index % len(plan.servos)
        robot, rule, true, voltage = plan.servos[number]
        if (run_key, number) not in _plants:
            if len(_plants) >= _MOST_PLANTS:
                _plants.clear()
            _plants[run_key, number] = TrialPlant(robot, true, voltage)
        plant = _plants[run_key, number]
        outcomes.append(trial(plant, rule, plan.seed, kind, index, number, plan.repertoire))
    return outcomes


# A model takes longer to build than to use, so each process keeps its models.
_plants: dict[tuple[str, int], TrialPlant] = {}
_MOST_PLANTS = 64


def _on_processes(plan: Plan, todo: list[Chunk], workers: int) -> Generator[Done, None, None]:
    context = get_context("spawn")
    end, kept = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(workers, context, initializer=_begin_worker, initargs=(end,))
    try:
        waiting: dict[Future[list[Outcome]], Chunk] = {
            pool.submit(carry_out_chunk, plan, chunk): chunk for chunk in todo
        }
        while waiting:
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                yield waiting.pop(future), future.result()
    except BaseException:
        kept.close()  # nobody waits for the chunks that are underway
        raise
    finally:
        pool.shutdown(cancel_futures=True)
        kept.close()


def _begin_worker(end: connection.Connection) -> None:
    # Ctrl-C is for the parent, which ends the workers.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, args=(end,), daemon=True).start()


def _end_with_parent(end: connection.Connection) -> None:
    connection.wait([end])  # until the parent closes its side, or is gone
    os._exit(1)


def _knock(address: str) -> None:
    """Check that a server listens at ``address``; Ray itself would wait for minutes."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if port.isdecimal():
        try:
            socket.create_connection((host, int(port)), timeout=_KNOCK).close()
        except OSError as error:
            raise _no_answer(address, error) from error


def _no_answer(address: str, error: Exception) -> MiburiError:
    return MiburiError(
        f"no Ray cluster answers at {address!r}: {error}; start one with ray start --head."
    )


def _on_cluster(plan: Plan, todo: list[Chunk], address: str) -> Generator[Done, None, None]:
    _knock(address)
    try:
        import ray
    except ModuleNotFoundError as error:
        raise needs_extra("cluster", error) from error
    try:
        ray.init(address=address, log_to_driver=False, logging_level="ERROR")
    except (ConnectionError, RuntimeError, ValueError) as error:
        raise _no_answer(address, error) from error
    try:
        shared = ray.put(plan)
        # If a node dies, its chunks are carried out again elsewhere.
        work: Any = ray.remote(num_cpus=1, max_retries=-1)(carry_out_chunk)
        left = iter(todo)
        slots = 2 * max(1, int(ray.cluster_resources().get("CPU", 1)))
        waiting: dict[Any, Chunk] = {}
        while True:
            for chunk in left:
                waiting[work.remote(shared, chunk)] = chunk
                if len(waiting) >= slots:
                    break
            if not waiting:
                return
            ready, _ = ray.wait(list(waiting))
            for reference in ready:
                chunk = waiting.pop(reference)
                try:
                    outcomes = ray.get(reference)
                except ray.exceptions.RaySystemError:
                    waiting[work.remote(shared, chunk)] = chunk
                    continue
                yield chunk, outcomes
    finally:
        ray.shutdown()


def _journal_path(out: Path) -> Path:
    return out.with_name(f".{out.name}.journal")


Write = Callable[[Chunk, list[Outcome]], None]


@contextmanager
def _journal(plan: Plan, out: Path | None) -> Iterator[tuple[dict[Chunk, list[Outcome]], Write]]:
    """Yield the finished chunks, and a function that writes another one."""
    if out is None:
        yield {}, lambda _chunk, _outcomes: None
        return
    path = _journal_path(out)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        done, length = _read_journal(path, plan)
        with path.open("ab") as file:
            # Drop a last line that a kill has cut off.
            file.truncate(length)
            if not length:
                _append(file, {"run": plan.key})

            def write(chunk: Chunk, outcomes: list[Outcome]) -> None:
                _append(file, {"chunk": chunk, "rows": [astuple(o) for o in outcomes]})

            yield done, write
    except OSError as error:
        raise OutputError(f"{out} cannot be written: {error.strerror}; choose another.") from error


def _append(file: Any, entry: dict[str, Any]) -> None:
    file.write(json.dumps(entry).encode() + b"\n")
    file.flush()
    os.fsync(file.fileno())


def _read_journal(path: Path, plan: Plan) -> tuple[dict[Chunk, list[Outcome]], int]:
    """Return the finished chunks, and the length in bytes of the journal's whole lines."""
    done: dict[Chunk, list[Outcome]] = {}
    if not path.exists():
        return done, 0
    length = 0
    for line in path.read_bytes().splitlines(keepends=True):
        if not line.endswith(b"\n"):
            break
        entry = json.loads(line)
        if length == 0 and entry.get("run") != plan.key:
            raise OutputError(
                f"{path} is the journal of another, unfinished run; finish that run with the "
                "same options, or delete the journal."
            )
        if "chunk" in entry:
            kind, first, last = entry["chunk"]
            done[TrialKind(kind), first, last] = [Outcome(*row) for row in entry["rows"]]
        length += len(line)
    return done, length


def write_parquet(plan: Plan, outcomes: list[Outcome], out: Path) -> None:
    """Write a Parquet file with a row for each trial, and null where a value does not apply.

    The whole file is written, or none.

    Raises OutputError if the folder cannot be written to, or the disk is full; MiburiError if
    PyArrow is not installed.
    """
    pa, pq = _arrow()
    columns = {
        f.name: pa.array([_cell(o, f.name) for o in outcomes], _KINDS[f.type][0])
        for f in fields(Outcome)
    }
    metadata = {**plan.chosen, "miburi": __version__, "seed": str(plan.seed), "run": plan.key}
    table = pa.table(columns).replace_schema_metadata(metadata)
    with whole_files(out.parent) as draft:
        pq.write_table(table, draft / out.name, compression="zstd")


def read_parquet(path: Path) -> list[Outcome]:
    """Return the trials of a file that :func:`carry_out_plan` wrote.

    Raises InputError if the file cannot be read, or holds something else; MiburiError if PyArrow is
    not installed.
    """
    pa, pq = _arrow()
    try:
        nothing = {f.name: _KINDS[f.type][1] for f in fields(Outcome)}
        return [
            Outcome(**{n: nothing[n] if value is None else value for n, value in row.items()})
            for row in pq.read_table(path).to_pylist()
        ]
    except (OSError, pa.ArrowException, TypeError, KeyError) as error:
        raise InputError(f"{path} is not a file of trials: {error}.") from error


def _cell(outcome: Outcome, name: str) -> object:
    """Return a value, or None where it does not apply."""
    value = getattr(outcome, name)
    if value == "" or value != value:  # noqa: PLR0124  (NaN)
        return None
    return None if name == "right_motor" and np.isnan(outcome.latency) else value


def _arrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ModuleNotFoundError as error:
        raise needs_extra("studies", error) from error
    return pyarrow, pyarrow.parquet


def as_array(outcomes: list[Outcome], name: str) -> np.ndarray[Any, np.dtype[Any]]:
    """Return one field of all outcomes."""
    return np.array([getattr(outcome, name) for outcome in outcomes])
