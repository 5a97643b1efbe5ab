"""The rule in C++ equals free.py, decision for decision, natively and on the AVR."""

import json
import os
from math import isqrt
from pathlib import Path

import numpy as np
import pytest
from tests.firmware.toolchain import HERE, NATIVE, run
from tests.firmware.traces import DECISION, LOOKS, Records, decide, random_traces

from miburi.emulation.firmware import Mega

#: Traces for each of four seeds; `make firmware-proof` asks for 100,000 in all.
TRACES = int(os.environ.get("MIBURI_TRACES", "3000")) // 4
AVR_TRACES = max(TRACES // 20, 80)


def decided(program: Path, traces: Records) -> Records:
    count = np.int32(len(traces)).tobytes()
    return np.frombuffer(run(program, data=count + traces.tobytes()), DECISION).reshape(-1, LOOKS)


MORE = [
    pytest.param(seed, marks=pytest.mark.proof("test_native_rule_equals_the_reference"))
    for seed in (1, 2, 3)
]


@pytest.mark.parametrize("seed", [0, *MORE])
def test_native_rule_equals_the_reference(native: Path, seed: int) -> None:
    traces = random_traces(np.random.default_rng(seed), TRACES)
    expected = decide(traces)
    assert np.array_equal(decided(native, traces), expected)
    # Every part of the rule had its say, often.
    for sign in range(4):
        assert np.mean(expected["sign"] == sign) > 0.02
    assert np.mean(expected["arrived"]) > 0.01


def test_a_model_that_nothing_holds_stays_where_the_card_can_count(native: Path) -> None:
    """The load takes all that the motors may push, no friction brakes, and seconds pass.

    Found among 100,000 traces: the model's place overflowed.
    """
    (trace,) = random_traces(np.random.default_rng(3), 1)
    trace["rule"] = (20_000, 9372)
    trace["motors"] = (2033, 5, 1, 32, 45, 29, 13_920, 1, 0, 0)
    trace["motion"] = (1893, 131_072, 3514, 687, -1, -1658, 4820, -5031, 5031, 0, 0)
    trace["again"] = LOOKS
    trace["looks"]["time"] = [151_841, 160_000, 3_865_001, 3_875_000]
    trace["looks"]["positions"] = 687
    traces = np.array([trace])
    assert np.array_equal(decided(native, traces), decide(traces))


def test_rule_on_the_avr_equals_the_reference(firmware: Path, rule_on_avr: Path) -> None:
    """And the card keeps up: it takes no longer than the motion that it judges.

    The looks of some traces are closer together than the card's, which are 20 ms apart. A trace's
    bytes on the line come on top, 10 µs each.
    """
    traces = random_traces(np.random.default_rng(9), AVR_TRACES)
    lasts = traces["looks"]["time"].max(axis=1) + traces["elapsed"]
    brief = lasts < 20e6  # µs; one of a hundred lasts minutes, and would take as long as the rest
    traces, lasts = traces[brief], lasts[brief]
    assert np.mean(brief) > 0.95
    expected = decide(traces)
    size = LOOKS * DECISION.itemsize
    limits = np.maximum(lasts, LOOKS * 20_000) + 10.0 * (traces.itemsize + size + 1)
    mega = Mega(rule_on_avr, firmware / "libmega.so")
    try:
        said, began = b"", 0.0
        for index, limit in enumerate([1e6, *limits.tolist()]):
            # Decisions, then '>' when it is ready for the next trace.
            while len(said) < index * (size + 1) + 1:
                assert mega.time < began + limit, f"trace {index - 1}"
                mega.run(mega.time + 1000)
                said += mega.take(0)
            began = mega.time
            mega.give(0, traces[index : index + 1].tobytes())
    finally:
        mega.close()
    answers = b"".join(said[1 + i * (size + 1) :][:size] for i in range(len(traces)))
    assert np.array_equal(np.frombuffer(answers, DECISION).reshape(-1, LOOKS), expected)


def test_a_look_takes_at_most_6_ms_on_the_avr(firmware: Path, rule_on_avr: Path) -> None:
    """With all motors at full speed, and four steps of the model since the last look."""
    (trace,) = random_traces(np.random.default_rng(3), 1)
    for name, value in (("distance", 2000), ("speed", 2000 * 256), ("acceleration", 13_000)):
        trace["motion"][name] = value
    trace["looks"]["time"] = np.arange(1, LOOKS + 1) * 20_000
    trace["again"] = LOOKS
    ended = []
    for count in (1, LOOKS):
        trace["count"] = count
        mega = Mega(rule_on_avr, firmware / "libmega.so")
        while not mega.take(0):  # '>' when it is ready
            mega.run(mega.time + 1000)
        mega.give(0, trace.tobytes())
        said = b""
        while len(said) < count * DECISION.itemsize + 1:
            mega.run(mega.time + 20)
            said += mega.take(0)
        ended.append(mega.time)
        mega.close()
    assert (ended[1] - ended[0]) / (LOOKS - 1) < 6000


def test_square_root_equals_the_reference(native: Path) -> None:
    rng = np.random.default_rng(3)
    edges = [k * k + d for k in (1, 2, 3, 1 << 16, 1 << 31, (1 << 32) - 1) for d in (-1, 0, 1)]
    powers = [1 << k for k in range(64)]
    some = [int(rng.integers(0, 1 << 63)) >> int(rng.integers(0, 63)) for _ in range(2000)]
    values = np.array([0, (1 << 64) - 1, *edges, *powers, *some], dtype=np.uint64)
    said = run(native, "roots", data=np.int32(len(values)).tobytes() + values.tobytes())
    assert np.frombuffer(said, "<u8").tolist() == [isqrt(int(value)) for value in values]


@pytest.mark.proof("test_native_rule_equals_the_reference")
def test_every_line_of_the_rule_is_run(
    native: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run(*NATIVE, "-O0", "--coverage", HERE / "traces_native.cpp", "-o", tmp_path / "covered")
    traces = random_traces(np.random.default_rng(5), 2000)
    run(tmp_path / "covered", data=np.int32(len(traces)).tobytes() + traces.tobytes())
    said = run("gcov", "--json-format", "--stdout", next(tmp_path.glob("*.gcda")))
    files = {Path(f["file"]).name: f["lines"] for f in json.loads(said)["files"]}
    for name in ("contact.h", "free.h", "profile.h"):
        missed = [line["line_number"] for line in files[name] if not line["count"]]
        assert files[name]
        assert not missed, f"{name}: lines {missed} never ran"
