"""What each part of the contact stop brings on the identified servo: rule, model, ceiling.

    python bench/servos/ablation.py [--free 250] [--blocked 200] [--seed 61]

Runs are recorded with no rule on, with and without the ceiling of the motors' push, then judged by
each rule (:mod:`miburi.studies.trials.replay`). The delayed profile has the narrowest guards with
which hardly a free run is stopped; "+ gravity" adds the sag that the description's weight brings.
Worn servos have twice the friction, hot ones a fifth more resistance; all have 4.75 to 5.25 V. The
rules know nothing of either. None has gears that play.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat

import numpy as np

from miburi.robot import iphonoid
from miburi.robot.mjcf import TIMESTEP
from miburi.safety.contact import Rule, Watch
from miburi.safety.free import FreeRule
from miburi.studies.trials.ablation import PROFILE_GUARDS
from miburi.studies.trials.plant import TrialPlant
from miburi.studies.trials.replay import DeafRule, judge
from miburi.studies.trials.trial import TrialKind, enact, sustained_force

CHUNK = 25
HEADROOM = iphonoid().servo.model.drive.headroom


class SaggingRule(Rule):
    """The delayed profile, lower by what the load takes."""

    def watch(self, profile, start, direction, loading):
        return _SaggingWatch(self, profile, start, direction, loading)


class _SaggingWatch(Watch):
    def __post_init__(self):
        super().__post_init__()
        self._goal = self._goal + self.loading.offset - self.loading.end

    def expected_travel(self, time):
        loading, went = self.loading, super().expected_travel(time)
        share = went // np.maximum(self.profile.distance, 1)
        sag = loading.begin + (((loading.end - loading.begin) * share) >> 8)
        return went + np.clip(loading.offset - sag, -512, 512)


def servo(headroom: float, friction: float, resistance: float):
    own = iphonoid().servo.model.varied(friction=friction)
    motor = own.motor.model_copy(update={"resistance": own.motor.resistance * resistance})
    drive = own.drive.model_copy(update={"headroom": headroom})
    return own.model_copy(update={"motor": motor, "drive": drive})


def described(headroom: float):
    return iphonoid().with_servo(servo(headroom, 1.0, 1.0))


def record(chunk, headroom: float, friction: float, resistance: float, seed: int):
    kind, first, last = chunk
    robot = described(headroom)
    plant = TrialPlant(robot, iphonoid().with_servo(servo(headroom, friction, resistance)))
    rule = DeafRule.of(robot)
    return [enact(plant, rule, seed, kind, index) for index in range(first, last)]


def row(name: str, rule: Rule | None, runs) -> str:
    free = [run for run in runs if run.person is None]
    met = [run for run in runs if run.person is not None]
    stopped = sum(judge(rule, run).stopped_at is not None for run in free) if rule else 0
    latencies, missed, forces = [], [], []
    for run in met:
        latency = judge(rule, run).latency if rule else None
        if latency is None:
            missed.append(sustained_force(run.forces))
            forces.append(missed[-1])
            continue
        latencies.append(latency)
        # The hand is pressed until the stop, and for the rest of the 0.1 s no more than then.
        end = round((run.touched_at + latency) / TIMESTEP)
        forces.append(sustained_force(np.concatenate([np.zeros(50), run.forces[:end]])))
    late = centiles(1e3 * np.array(latencies), 0) if latencies else "–"
    hard = f", the hardest {max(missed):.1f} N" if missed and rule else ""
    return (
        f"| {name} | {stopped} of {len(free)} | {len(missed)} of {len(met)}{hard} | {late} | "
        f"{centiles(forces, 1)} |"
    )


def centiles(values, digits: int) -> str:
    return " / ".join(f"{each:.{digits}f}" for each in np.percentile(values, (50, 95, 100)))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    for name, default in (("free", 250), ("blocked", 200), ("seed", 61), ("workers", 2)):
        options.add_argument(f"--{name}", type=int, default=default)
    chosen = options.parse_args()
    chunks = [
        (kind, first, min(first + CHUNK, count))
        for kind, count in ((TrialKind.FREE, chosen.free), (TrialKind.BLOCKED, chosen.blocked))
        for first in range(0, count, CHUNK)
    ]
    print("| | free runs stopped | missed | latency, ms | force over 0.1 s, N |")
    print("|---|---|---|---|---|")
    with ProcessPoolExecutor(chosen.workers) as pool:

        def runs(headroom: float, friction: float = 1.0, resistance: float = 1.0):
            each = map(repeat, (headroom, friction, resistance, chosen.seed))
            return [run for some in pool.map(record, chunks, *each) for run in some]

        loose, limited = runs(1000.0), runs(HEADROOM)
        free = FreeRule.of(described(HEADROOM))
        rows = [
            ("no rule, no ceiling", None, loose),
            ("delayed profile", Rule(PROFILE_GUARDS), loose),
            ("+ gravity", SaggingRule(PROFILE_GUARDS), loose),
            ("free servo", free, loose),
            ("free servo + ceiling: what ships", free, limited),
            ("no rule, the ceiling alone", None, limited),
            ("what ships, worn", free, runs(HEADROOM, 2.0)),
            ("what ships, hot", free, runs(HEADROOM, 1.0, 1.2)),
            ("what ships, worn and hot", free, runs(HEADROOM, 2.0, 1.2)),
        ]
        for one in rows:
            print(row(*one), flush=True)


if __name__ == "__main__":
    main()
