"""Random traces for the rule, dense around its boundaries, and what contact.py decides of them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from miburi.robot import guards as table
from miburi.safety.contact import Rule, Sign, Watch, lag_doubt
from miburi.safety.profile import FINE, Profile

MOTORS = 8
SIGNS = {None: 0, Sign.SPEED: 1, Sign.TRACKING: 2, Sign.ARRIVAL: 3}
RULE = np.dtype([("period", "<i4"), ("ratio", "<i4")])
GUARDS = np.dtype([(name, f"<{guard.unit.code}") for name, guard in table.GUARDS.items()])
MOTION = np.dtype(
    [
        *((name, "<i4") for name in ("distance", "speed", "acceleration")),
        *((name, "<i2") for name in ("start", "direction")),
    ]
)
LOOK = np.dtype([("time", "<i8"), ("positions", "<i2", MOTORS)])
LOOKS = 4
TRACE = np.dtype(
    [
        ("rule", RULE),
        ("guards", GUARDS, MOTORS),
        ("motion", MOTION, MOTORS),
        ("count", "<i2"),
        ("looks", LOOK, LOOKS),
    ]
)
DECISION = np.dtype(
    [
        ("sign", "u1"),
        ("motor", "u1"),
        ("arrived", "u1"),
        ("measured", "<i4"),
        ("expected", "<i4"),
        ("length", "<i8"),
    ]
)

Records = NDArray[np.void]


@dataclass(frozen=True)
class Traces:
    """Traces (n,) of ``TRACE`` with their decisions (n, LOOKS) of ``DECISION``."""

    traces: Records
    decisions: Records


def random_traces(rng: np.random.Generator, n: int) -> Records:
    """Return n traces; all motors follow, but for one, which is put on a boundary of the rule."""
    traces = np.zeros(n, dtype=TRACE)
    traces["count"] = LOOKS
    rule, guards, motion = traces["rule"], traces["guards"], traces["motion"]
    rule["period"] = rng.choice([20_000, 50_000, 100_000, 100_000, 100_000, 200_000], n)
    rule["ratio"] = rng.choice([9372, 9372, 9372, 8000, 10_000, 5000], n)
    shape = (n, MOTORS)
    guards["lag"] = rng.choice([0, 1, 30_000, 30_000, 100_000], shape)
    guards["slack"] = rng.integers(0, 12, shape)
    guards["least"] = rng.choice([1, 8, 16, 16, 25, 100], shape)
    guards["behind"] = rng.integers(1, 120, shape)
    guards["ahead"] = rng.integers(1, 120, shape)
    guards["arrival"] = rng.integers(1, 60, shape)
    near_least = guards["least"] + rng.integers(-1, 2, shape)
    motion["distance"] = np.where(rng.random(shape) < 0.3, near_least, rng.integers(0, 2400, shape))
    motion["speed"] = np.exp(rng.uniform(np.log(FINE), np.log(4000 * FINE), shape))
    # At one step/s less the lag's doubt is a whole number of steps, or just below: so a µs more or
    # less is seen. (A ramp, cut to whole µs, seldom comes to the whole speed.)
    whole = rng.random(shape) < 0.3
    motion["speed"][whole] = FINE * rng.choice([501, 1001, 2001, 2500, 2500], shape)[whole]
    motion["acceleration"] = np.exp(rng.uniform(np.log(244), np.log(40_000), shape))
    # A ramp that is full and short at once, but for a rounded microsecond of the total time.
    seam = rng.random(n) < 0.05
    motion["distance"][seam], motion["speed"][seam], motion["acceleration"][seam] = (
        1,
        82 * FINE,
        6723,
    )
    guards["lag"][seam] = 30_000
    motion["start"] = rng.integers(-2400, 2400, shape)
    motion["direction"] = rng.choice([-1, 1], shape)
    profile = Profile.plan(
        *(motion[name].astype(np.int64).ravel() for name in ("distance", "speed", "acceleration"))
    )
    doubt = lag_doubt(profile).reshape(shape)
    total, ramp = profile.total.reshape(shape), profile.ramp.reshape(shape)
    every = np.arange(n)
    odd = rng.integers(0, MOTORS, n)
    before = np.zeros((2, *shape), dtype=np.int64)
    time = np.zeros(n, dtype=np.int64)
    period_ends = rule["period"].astype(np.int64)
    for index in range(LOOKS):
        # A moment on a boundary of the odd motor's profile, or some periods later.
        lag, whole, first = guards["lag"][every, odd], total[every, odd], ramp[every, odd]
        edges = np.stack(
            [lag, lag + first, lag + whole - first, lag + whole, lag + whole + rule["period"]]
        )
        edge = edges[rng.integers(0, len(edges), n), every] + rng.integers(-1, 2, n)
        onward = time + rule["period"] * rng.integers(1, 4, n) + rng.integers(0, 9000, n)
        at_its_end = period_ends + rng.integers(-1, 2, n)
        some = (rng.random(n) * (whole + lag + rule["period"])).astype(np.int64)
        time = np.choose(rng.integers(0, 4, n), [edge, onward, np.maximum(some, time), at_its_end])
        due = time >= period_ends
        period_ends += np.where(due, rule["period"], 0)
        expected = profile.position((time[:, None] - guards["lag"]).ravel()).reshape(shape)
        should = expected - before[0]
        measured = np.rint(expected / FINE).astype(np.int64) * FINE
        # Where the odd motor is: on the limit of one part of the rule, give or take a step.
        limits = np.stack(
            [
                before[1]
                + (should * rule["ratio"][:, None]) // 10_000
                - guards["slack"].astype(np.int64) * FINE,
                expected - guards["behind"].astype(np.int64) * FINE - doubt,
                expected + guards["ahead"].astype(np.int64) * FINE + doubt,
                (motion["distance"] - guards["arrival"]).astype(np.int64) * FINE,
                (motion["distance"] + guards["arrival"]).astype(np.int64) * FINE,
                measured,
            ]
        )
        at = limits[rng.integers(0, len(limits), n), every, odd]
        at = (at // FINE + rng.integers(-1, 2, n)) * FINE
        follows = rng.random(n) < 0.2
        measured[every, odd] = np.where(follows, measured[every, odd], at)
        # Sometimes two motors fall behind alike: the first has to be named.
        other = (odd + rng.integers(1, MOTORS, n)) % MOTORS
        alike = rng.random(n) < 0.1
        measured[every[alike], other[alike]] -= (
            (expected - measured)[every, odd][alike] // FINE * FINE
        )
        travel = measured // FINE
        traces["looks"]["time"][:, index] = time
        traces["looks"]["positions"][:, index] = np.clip(
            motion["start"] + motion["direction"] * travel, -32_000, 32_000
        )
        based = due[:, None] & (should >= guards["least"].astype(np.int64) * FINE)
        before = np.where(based, np.stack([expected, measured]), before)
    return traces


def decide(traces: Records) -> Records:
    """Let contact.py decide every look: (n, LOOKS) of ``DECISION``."""
    decisions = np.zeros((len(traces), LOOKS), dtype=DECISION)
    wide = {name: traces["motion"][name].astype(np.int64) for name in traces["motion"].dtype.names}
    guards = {
        name: traces["guards"][name].astype(np.int64) for name in traces["guards"].dtype.names
    }
    periods, ratios = traces["rule"]["period"].tolist(), traces["rule"]["ratio"].tolist()
    times = traces["looks"]["time"].tolist()
    positions = traces["looks"]["positions"].astype(np.int64)
    for i, of_trace in enumerate(decisions):
        rule = Rule(table.Guards(**{k: v[i] for k, v in guards.items()}), periods[i], ratios[i])
        profile = Profile.plan(wide["distance"][i], wide["speed"][i], wide["acceleration"][i])
        watch = Watch(rule, profile, wide["start"][i], wide["direction"][i])
        for k in range(LOOKS):
            contact = watch.look(positions[i, k], times[i][k])
            came = watch.arrived(positions[i, k], times[i][k])
            if contact is None:
                of_trace[k] = (0, 0, came, 0, 0, 0)
            else:
                of_trace[k] = (
                    SIGNS[contact.sign],
                    contact.motor,
                    came,
                    contact.measured,
                    contact.expected,
                    contact.length,
                )
    return decisions
