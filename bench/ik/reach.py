"""Count what the solver misses: of many reachable targets, on many robots, and out of reach.

``python bench/ik/reach.py`` prints a line for each part and writes ``reach.md``. What is done is
kept in ``out/reach`` below the working folder, so that a run that was stopped goes on: the exact
optima for good (they take most of the time, 15 minutes of one core), the solver's parts for as
long as its sources stay as they are.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np
from targets import BEYOND, ROBOT, beyond
from waist_search import optimum

import miburi
from miburi import ik
from miburi.ground.compiled import state_of_sources
from miburi.robot import forward
from miburi.robot.geometry import arm_reach

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parents[1]))
from tests.ik.robots import random_robots  # noqa: E402  (below the root that holds it)

CHUNK, FAR_CHUNK = 100_000, 500
KEPT = Path("out/reach")


def missed(robot, count, seed):
    """Of targets in reach: how many were missed by 0.1 mm (at the iphonoid's size), the worst."""
    poses = np.random.default_rng([seed, count]).uniform(robot.lower, robot.upper, (count, 8))
    found = ik.solve_batch(robot, forward(robot, poses))
    share = found.residual / arm_reach(robot)
    return {"count": count, "missed": int(np.sum(share > ik.REACHED)), "worst": share.max()}


def drawn_beyond(name, count, seed):
    """Return targets out of reach, and the least residual of each."""
    targets = beyond(name, count, seed=[seed, list(BEYOND).index(name)])
    kept = KEPT / f"{name}, {count}, {seed}.npy"
    if not kept.exists():
        np.save(kept, [optimum(ROBOT, target) for target in targets])
    return targets, np.load(kept)


def excess(name, count, seed):
    """Of targets out of reach: how far from the exact optimum, as shares of the reach."""
    targets, least = drawn_beyond(name, count, seed)
    found = ik.solve_batch(ROBOT, targets)
    more = found.residual - least
    more /= arm_reach(ROBOT)
    best = np.array([status == ik.OUT_OF_REACH for status in found.status])
    return {
        "count": count,
        "coarse": int(np.sum(more > 1e-4)),
        "fine": int(np.sum(more > 1e-6)),
        "not_best": int(np.sum(more[best] > 1e-6)),
        "worst": more.max(),
    }


def total(parts):
    """Add up the counts of several parts; keep the worst."""
    return {key: (max if key == "worst" else sum)(p[key] for p in parts) for key in parts[0]}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--targets", type=int, default=10_000_000)
    parser.add_argument("--each", type=int, default=100_000, help="targets for each drawn robot")
    parser.add_argument("--beyond", type=int, default=5_000, help="of each kind out of reach, or 0")
    options = parser.parse_args()
    KEPT.mkdir(parents=True, exist_ok=True)
    state = KEPT / f"{state_of_sources(Path(miburi.__file__).parent)}.json"
    done = json.loads(state.read_text()) if state.exists() else {}

    def part(key, measure, *arguments):
        if key not in done:
            begun = time.perf_counter()
            done[key] = measure(*arguments)
            state.write_text(json.dumps(done))
            print(f"{key}: {done[key]} in {time.perf_counter() - begun:.1f} s", flush=True)
        return done[key]

    chunks = range(max(1, options.targets // CHUNK))
    size = min(CHUNK, options.targets)
    own = total([part(f"iphonoid {i} of {size}", missed, ROBOT, size, i) for i in chunks])
    drawn = [
        part(f"{robot.name}, {options.each}", missed, robot, options.each, i)
        for i, robot in enumerate(random_robots(20, seed=1))
    ]
    others = total(drawn)
    lines = ["| in reach | targets | missed | worst residual, of the reach |", "|---|---|---|---|"]
    for name, sums in (("the iphonoid", own), (f"{len(drawn)} drawn robots", others)):
        lines.append(f"| {name} | {sums['count']:,} | {sums['missed']} | {sums['worst']:.1e} |")
    if options.beyond:
        lines += [
            "",
            "| out of reach | targets | off the optimum by 1e-4 of the reach | by 1e-6 "
            "| called the best, but is not | worst |",
            "|---|---|---|---|---|---|",
        ]
    size = min(FAR_CHUNK, options.beyond)
    for name in BEYOND if options.beyond else ():
        chunks = range(options.beyond // size)
        sums = total([part(f"{name}, {i} of {size}", excess, name, size, i) for i in chunks])
        lines.append(
            f"| {name} | {sums['count']:,} | {sums['coarse']} | {sums['fine']} "
            f"| {sums['not_best']} | {sums['worst']:.1e} |"
        )
    (HERE / "reach.md").write_text("\n".join(lines) + "\n")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
