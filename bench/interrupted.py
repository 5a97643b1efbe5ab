"""Ctrl-C at moments drawn by a seed: does a command end at once, in words, without a traceback?

    python bench/interrupted.py > bench/interrupted.txt

Each command is started by itself and interrupted between its start and a little after the time
that it would take; half of them with nothing compiled. An interrupted `run` has done its work: its
code is 0. A command that ended before its moment is not counted.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np

#: Each command line, and the longest time before it is interrupted, in s.
LINES = {
    "run --headless --port 0 --folder home": 12.0,
    "ik --right 0.1 -0.1 0.2 --left 0.1 0.1 0.2 --head 0.0279 0 0.1987": 8.0,
    "experiment --seconds 600 --no-film --out out": 15.0,
    "gesture preview happiness --out preview": 10.0,
    "trials --free 500 --blocked 500 --seed 1 --out trials.parquet": 15.0,
    "paper --claim whenever-and-only-when": 20.0,
    "calibrate --out servos.toml": 20.0,
}


def interrupted(line: str, moment: float, cache: str | None) -> tuple[int, float, str] | None:
    """Return exit code, seconds that it still took, what stood on stderr; None if it had ended."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
        environment |= {"NUMBA_CACHE_DIR": cache} if cache else {}
        process = subprocess.Popen(
            [sys.executable, "-m", "miburi", *line.split()],
            cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        try:
            process.communicate(timeout=moment)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGINT)
            since = time.monotonic()
            _, errors = process.communicate(timeout=120)
            return process.returncode, time.monotonic() - since, errors
        return None


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--times", type=int, default=50)
    chosen = parser.parse_args()
    # A program that a shell started in the background would hand down that it is to be ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    generator = np.random.default_rng(chosen.seed)
    counted, tracebacks, slow, codes = 0, 0, [], set()
    while counted < chosen.times:
        line, longest = list(LINES.items())[generator.integers(len(LINES))]
        moment, fresh = generator.uniform(0.0, longest), bool(generator.integers(2))
        with tempfile.TemporaryDirectory() as empty:
            done = interrupted(line, moment, empty if fresh else None)
        if done is None:
            continue
        counted += 1
        code, took, errors = done
        bad = "Traceback" in errors or "Exception ignored" in errors
        tracebacks += bad
        slow.append(took)
        codes.add(code)
        last = (errors.strip().splitlines() or [""])[-1][:60]
        compiled = "nothing compiled" if fresh else "compiled"
        print(
            f"{moment:5.1f} s  {line.split(' --')[0]:26}{compiled:18}code {code:4}  "
            f"{took:5.2f} s  {last}{'  TRACEBACK' if bad else ''}",
            flush=True,
        )
        if bad:
            print(errors, flush=True)
    print(
        f"\nseed {chosen.seed}: {counted} interrupted, {tracebacks} with a traceback; codes "
        f"{sorted(codes)}; ended within {np.median(slow):.2f} s (median), {max(slow):.2f} s (most)"
    )


if __name__ == "__main__":
    main()
