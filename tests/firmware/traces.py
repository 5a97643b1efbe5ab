"""Random traces for the rule, dense around its boundaries, and what free.py decides of them."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from miburi.robot import guards as table
from miburi.safety.contact import Loading, Sign, Watch, lag_doubt
from miburi.safety.free import SETTLES, FreeRule, granted_share
from miburi.safety.profile import FINE, SECOND, Profile, plan_towards
from miburi.servos.free import STEP, FreeServo

MOTORS = 8
SIGNS = {None: 0, Sign.SPEED: 1, Sign.TRACKING: 2, Sign.ARRIVAL: 3}
RULE = np.dtype([("period", "<i4"), ("ratio", "<i4")])
OF_SERVO = ("pull", "brake", "friction", "lost")
OF_MOTOR = np.dtype(
    [
        *((name, f"<{guard.unit.code}") for name, guard in table.GUARDS.items()),
        *((name, "u1" if name == "lost" else "<u2") for name in OF_SERVO),
    ]
)
OF_LOADING = ("offset", "begin", "end", "most", "velocity", "gone")
MOTION = np.dtype(
    [
        *((name, "<i4") for name in ("distance", "speed", "acceleration")),
        *((name, "<i2") for name in ("start", "direction")),
        *((name, "<i4") for name in OF_LOADING),
    ]
)
LOOK = np.dtype([("time", "<i8"), ("positions", "<i2", MOTORS)])
LOOKS = 4
TRACE = np.dtype(
    [
        ("rule", RULE),
        ("motors", OF_MOTOR, MOTORS),
        ("motion", MOTION, MOTORS),
        # A move that replaces it before the look `again`, `elapsed` µs after its start. There,
        # `distance` has a sign, and direction is not looked at.
        ("next", MOTION, MOTORS),
        ("again", "<i2"),
        ("elapsed", "<i8"),
        ("count", "<i2"),
        ("looks", LOOK, LOOKS),
    ]
)
DECISION = np.dtype(
    [
        ("sign", "u1"),
        ("motor", "u1"),
        ("arrived", "u1"),
        ("came", "<u4"),
        ("measured", "<i4"),
        ("expected", "<i4"),
        ("length", "<i8"),
    ]
)

Records = NDArray[np.void]


def random_traces(rng: np.random.Generator, n: int) -> Records:
    """Return n traces; all motors follow, but for one, which is put on a boundary of the rule."""
    traces = np.zeros(n, dtype=TRACE)
    traces["count"] = LOOKS
    _draw_rules(rng, traces["rule"], traces["motors"])
    _draw_motions(rng, traces["motors"], traces["motion"])
    _draw_next(rng, traces)
    # Some have nothing but the window's limit in mind, which is seldom a whole number of steps.
    exact = rng.random(n) < 0.25
    traces["rule"]["ratio"][exact] = 10_000
    for trace, only_window in zip(traces, exact.tolist(), strict=True):
        _draw_looks(rng, trace, only_window)
    return traces


def _draw_rules(rng: np.random.Generator, rule: Records, motors: Records) -> None:
    n, shape = len(rule), motors.shape
    rule["period"] = rng.choice([20_000, 50_000, 100_000, 100_000, 100_000, 200_000], n)
    rule["ratio"] = rng.choice([9372, 9372, 9372, 8000, 10_000, 5000], n)
    motors["lag"] = rng.choice([0, 1, 5500, 5500, 30_000, 100_000], shape)
    motors["slack"] = rng.integers(0, 12, shape)
    motors["least"] = rng.choice([1, 8, 16, 16, 25, 100], shape)
    motors["behind"] = rng.integers(1, 120, shape)
    motors["ahead"] = rng.integers(1, 120, shape)
    motors["arrival"] = rng.integers(1, 60, shape)
    # Real servos, and the ends of what a card takes.
    real = rng.random(shape) < 0.6
    motors["pull"] = np.where(real, rng.integers(2000, 8000, shape), rng.integers(1, 16_384, shape))
    motors["brake"] = np.where(
        real, rng.integers(3000, 40_000, shape), rng.choice([0, 1, 65_535], shape)
    )
    motors["friction"] = np.where(
        real, rng.integers(0, 9000, shape), rng.choice([0, 1, 32_767], shape)
    )
    motors["lost"] = np.where(real, rng.integers(0, 100, shape), rng.choice([0, 1, 255], shape))


def _draw_motions(rng: np.random.Generator, motors: Records, motion: Records) -> None:
    shape = motion.shape
    near_least = motors["least"] + rng.integers(-1, 2, shape)
    motion["distance"] = np.where(rng.random(shape) < 0.3, near_least, rng.integers(0, 2400, shape))
    slowest = np.maximum(motion["distance"] * FINE // 2, FINE)  # none takes longer than some 2 s
    fast = np.exp(rng.uniform(np.log(FINE), np.log(4000 * FINE), shape))
    motion["speed"] = np.maximum(fast, slowest)
    # At one step/s less the lag's doubt is a whole number of steps, or just below: so a µs more or
    # less is seen. (A ramp, cut to whole µs, seldom comes to the whole speed.)
    whole = rng.random(shape) < 0.5
    motion["speed"][whole] = FINE * rng.choice([512, 1001, 1500, 2001, 2500, 2500], shape)[whole]
    motion["acceleration"] = np.exp(rng.uniform(np.log(2440), np.log(40_000), shape))
    # A ramp that is full and short at once, but for a rounded microsecond of the total time.
    seam = rng.random(len(motion)) < 0.05
    for name, value in (("distance", 1), ("speed", 82 * FINE), ("acceleration", 6723)):
        motion[name][seam] = value
    motors["lag"][seam] = 30_000
    # A model's step that falls on the end of a ramp.
    profile = Profile.plan(
        *(motion[name].astype(np.int64).ravel() for name in ("distance", "speed", "acceleration"))
    )
    ends = np.stack([profile.ramp, profile.total - profile.ramp, profile.total])
    end = rng.choice(ends).reshape(shape)
    hits = rng.random(shape) < 0.6
    motors["lag"][hits] = (-end % STEP)[hits]
    motion["start"] = rng.integers(-2400, 2400, shape)
    motion["direction"] = rng.choice([-1, 1], shape)
    bare = rng.random(shape) < 0.3
    motion["most"] = np.where(
        rng.random(shape) < 0.5, rng.integers(0, 6000, shape), rng.integers(6000, 110_000, shape)
    )
    for name, most in (("offset", 20), ("begin", 32), ("end", 32)):
        fine = rng.integers(-most * FINE, most * FINE + 1, shape)
        # Whole steps, so that a motor can be exactly on the limit about its goal.
        steps = rng.integers(-most, most + 1, shape) * FINE
        motion[name] = np.where(bare, 0, np.where(rng.random(shape) < 0.5, steps, fine))
    # Some still swing from the move before.
    swings = rng.random(shape) < 0.3
    fastest = np.where(rng.random(shape) < 0.03, 4000 * FINE, 700 * FINE)
    motion["velocity"] = np.where(swings, rng.integers(-fastest, fastest + 1, shape), 0)
    age = rng.choice([0, 4000, 20_000, 60_000], shape)
    motion["gone"] = motion["velocity"].astype(np.int64) * age // SECOND
    # Stiff motors come to rest on whole steps; a feather's speed grows by the least that there is.
    stiff, feather = rng.random(shape) < 0.25, rng.random(shape) < 0.03
    for some, offset, servo in ((stiff, 0, (16_383, 49_152, 0, 0)), (feather, 384, (1, 0, 0, 0))):
        for name, value in zip(OF_SERVO, servo, strict=True):
            motors[name][some] = value
        for name, value in zip(OF_LOADING, (offset, 0, 0, 110_000, 0, 0), strict=True):
            motion[name][some] = value
    motion["distance"][feather] = 0
    for name in ("begin", "end"):  # no weight is more than the motor can hold
        motion[name] = np.clip(motion[name], -motion["most"], motion["most"])


def _draw_next(rng: np.random.Generator, traces: Records) -> None:
    next_, shape = traces["next"], traces["next"].shape
    traces["again"] = rng.choice([1, 2, 3, LOOKS, LOOKS], len(traces))
    traces["elapsed"] = rng.choice([0, 1, 5000, 20_000, 7001], len(traces))  # after that look
    # Some just where a motor can stop, and some where it is.
    ways = (rng.integers(-2000, 2001, shape), rng.integers(-60, 61, shape), np.zeros(shape))
    next_["distance"] = np.choose(rng.choice(3, shape, p=[0.5, 0.4, 0.1]), ways)
    slowest = np.maximum(np.abs(next_["distance"]) * FINE // 2, FINE)
    fast = np.exp(rng.uniform(np.log(FINE), np.log(3000 * FINE), shape))
    next_["speed"] = np.where(rng.random(shape) < 0.5, slowest, np.maximum(fast, slowest))
    next_["acceleration"] = np.exp(rng.uniform(np.log(2440), np.log(40_000), shape))
    for name in OF_LOADING[:4]:
        next_[name] = rng.permuted(traces["motion"][name], axis=1)
    for name in ("begin", "end"):
        next_[name] = np.clip(next_[name], -next_["most"], next_["most"])


def _draw_looks(rng: np.random.Generator, trace: np.void, only_window: bool) -> None:
    """Choose moments and places, one motor's on a boundary of the rule as it stands then."""
    odd = int(rng.integers(MOTORS))
    # Sometimes two motors fall behind alike: the first has to be named.
    other = (odd + int(rng.integers(1, MOTORS))) % MOTORS
    alike = rng.random() < 0.2
    if alike:
        trace["motors"][other], trace["motion"][other] = trace["motors"][odd], trace["motion"][odd]
    if only_window:
        # At rest on a whole step, with the whole guards: then it can be just on the limit.
        _stiffen(trace["motors"], trace["motion"], odd)
    watch = _watch(trace)
    rule, guards = watch.rule, watch.rule.guards
    # One that judges nothing tells what is expected since the move began.
    never = np.full(MOTORS, 1 << 40)
    blind = replace(guards, slack=never, least=never, behind=never, ahead=never, arrival=never)
    blind_watch = replace(watch, rule=replace(rule, guards=blind))
    # As the rule has them: what it had seen when the latest period ended.
    based, period_ends, time = np.zeros((2, MOTORS), dtype=np.int64), rule.period, 0
    granted = carried = np.zeros((2, MOTORS), dtype=np.int64)  # share and doubt, and before
    begun, seen = np.zeros(MOTORS, dtype=np.int64), np.zeros((2, MOTORS), dtype=np.int64)
    for k, look in enumerate(trace["looks"]):
        if k == trace["again"]:
            # In the seam of a profile, or some time after the latest look.
            ends = (watch.profile.ramp, watch.profile.total - watch.profile.fall)
            elapsed = time + int(trace["elapsed"])
            near = [int(end[odd]) for end in ends if time <= end[odd] <= time + 100_000]
            trace["elapsed"] = rng.choice([elapsed, *near])
            trace["next"]["start"] = trace["looks"]["positions"][k - 1]
            before, blind_watch = blind_watch, _replaced(blind_watch, trace, time)
            watch = _replaced(watch, trace, time)
            on = before.direction == watch.direction
            moved = (before.start - watch.start) * watch.direction * FINE
            now = np.where(on, seen[0], -seen[0]) + moved
            begun = np.where(on, begun + moved, now)
            based = np.where(on, based + moved, np.stack([now, np.zeros_like(now)]))
            carried = granted
            period_ends, time = period_ends - int(trace["elapsed"]), 0
        if k in (0, trace["again"]):
            profile = watch.profile
            early, later = granted_share(profile, watch.loading.velocity), granted_share(profile)
            doubt, goal = lag_doubt(profile), profile.distance * FINE
            early, early_doubt = np.maximum(early, carried[0]), np.maximum(doubt, carried[1])
            goal = goal + watch.loading.offset - watch.loading.end
        time = max(time, _moment(rng, watch, odd, time, period_ends))
        due = time >= period_ends
        granted = np.stack((early, early_doubt) if time < SETTLES else (later, doubt))
        share, most = granted
        period_ends += rule.period if due else 0
        blind_watch.look(watch.start, time)
        assert blind_watch.window is not None
        expected = blind_watch.window.expected + begun
        should = expected - based[0]
        back = watch.turned & (should < 0)  # on the way to where it turns
        based[0], should = np.where(back, expected, based[0]), np.where(back, 0, should)
        measured = np.rint(expected / FINE).astype(np.int64) * FINE
        window = based[1][odd] + should[odd] * rule.ratio // 10_000 - guards.slack[odd] * share[odd]
        if only_window:
            measured[odd] = window // FINE * FINE
        elif rng.random() < 0.8:
            limit = rng.choice(
                [
                    window,
                    expected[odd] - guards.behind[odd] * share[odd] - most[odd],
                    expected[odd] + guards.ahead[odd] * share[odd] + most[odd],
                    goal[odd] - guards.arrival[odd] * FINE,
                    goal[odd] + guards.arrival[odd] * FINE,
                    measured[odd],
                ]
            )
            measured[odd] = (limit // FINE + rng.integers(-1, 2)) * FINE
        if alike:
            measured[other] = measured[odd]
        places = np.clip(watch.start + watch.direction * (measured // FINE), -6000, 6000)
        look["time"], look["positions"] = time, places
        seen = np.stack([expected, measured])
        based[1] = np.where(back, measured, based[1])
        judged = due & (should >= guards.least * FINE)
        based = np.where(judged, np.stack([expected, measured]), based)


def _stiffen(motors: Records, motion: Records, odd: int) -> None:
    for name, value in zip(OF_SERVO, (16_383, 49_152, 0, 0), strict=True):
        motors[name][odd] = value
    for name, value in zip(OF_LOADING, (0, 0, 0, 110_000, 0, 0), strict=True):
        motion[name][odd] = value
    for name, least in (("distance", 100), ("speed", 1000 * FINE), ("acceleration", 10_000)):
        motion[name][odd] = max(motion[name][odd], least)


def _moment(rng: np.random.Generator, watch: Watch, odd: int, time: int, period_ends: int) -> int:
    """Return a moment at a boundary of the odd motor's move or of the model, or some time later."""
    rule, profile = watch.rule, watch.profile
    lag, total, ramp = (int(n[odd]) for n in (rule.guards.lag, profile.total, profile.ramp))
    ended = total + lag
    last = int((profile.total + rule.guards.lag).max())
    return int(
        rng.choice(
            [
                time + rng.integers(15_000, 40_000),
                (time // STEP + rng.integers(1, 9)) * STEP + rng.integers(-1, 2),
                period_ends + rng.integers(-1, 2),
                *(SETTLES + rng.integers(-1, 2, 3)),
                ended + rng.integers(-1, 2),
                last + rng.integers(-1, 2),
                ended + rule.period + rng.integers(-1, 2),
                lag + ramp + rng.integers(0, STEP),
                ended - ramp + rng.integers(0, STEP),
                rng.integers(0, ended + rule.period),
            ]
        )
    )


def _watch(trace: np.void) -> Watch:
    motors, motion = (
        {name: values[name].astype(np.int64) for name in values.dtype.names}
        for values in (trace["motors"], trace["motion"])
    )
    rule = FreeRule(
        table.Guards(*(motors[name] for name in table.GUARDS)),
        int(trace["rule"]["period"]),
        int(trace["rule"]["ratio"]),
        servo=FreeServo(*(motors[name] for name in OF_SERVO)),
    )
    profile = Profile.plan(motion["distance"], motion["speed"], motion["acceleration"])
    loading = Loading(*(motion[name] for name in OF_LOADING))
    return rule.watch(profile, motion["start"], motion["direction"], loading)


def _replaced(watch: Watch, trace: np.void, seen: int) -> Watch:
    """Watch the move that replaces another, of which the latest look was at ``seen`` µs."""
    motion, elapsed = trace["next"], int(trace["elapsed"])
    way, speed, acceleration, start = (
        motion[name].astype(np.int64) for name in ("distance", "speed", "acceleration", "start")
    )
    velocity = watch.direction * watch.profile.velocity(elapsed)
    here = np.zeros_like(way)
    profile, direction = plan_towards(here, way, speed, acceleration, velocity, watch.direction)
    loading = Loading(*(motion[name].astype(np.int64) for name in OF_LOADING))
    after = watch.rule.watch(profile, start, direction, loading)
    after.go_on(watch, seen, elapsed)
    return after


def decide(traces: Records) -> Records:
    """Let free.py decide every look: (n, LOOKS) of ``DECISION``."""
    decisions = np.zeros((len(traces), LOOKS), dtype=DECISION)
    for trace, of_trace in zip(traces, decisions, strict=True):
        watch, seen = _watch(trace), 0
        for k, look in enumerate(trace["looks"]):
            if k == trace["again"]:
                watch = _replaced(watch, trace, seen)
            seen = int(look["time"])
            time, positions = int(look["time"]), look["positions"].astype(np.int64)
            contact = watch.look(positions, time)
            arrived, came = watch.arrived(positions, time), 0
            seams = watch.profile.position(watch.profile.ramp).tolist()
            for steps, seam in zip(watch.came.tolist(), seams, strict=True):
                came = (came * 31 + steps) % (1 << 32)
                if k in (0, trace["again"]):
                    came = (came * 31 + seam) % (1 << 32)
            of_trace[k] = (
                (0, 0, arrived, came, 0, 0, 0)
                if contact is None
                else (
                    SIGNS[contact.sign],
                    contact.motor,
                    arrived,
                    came,
                    contact.measured,
                    contact.expected,
                    contact.length,
                )
            )
    return decisions
