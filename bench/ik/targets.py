"""Targets to solve for: reachable, out of reach, and the hard ones that tests and benchmark share.

Run it to write ``tests/ik/targets.json`` anew (two minutes).
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from waist_search import optimum

from miburi import ik
from miburi.robot import forward, iphonoid
from miburi.robot.geometry import shoulders

ROBOT = iphonoid()
FILE = Path(__file__).parents[2] / "tests" / "ik" / "targets.json"


def reachable(count, seed=0):
    """Poses drawn uniformly inside Table 1, and where they put hands and head."""
    poses = np.random.default_rng(seed).uniform(ROBOT.lower, ROBOT.upper, (count, 8))
    return poses, forward(ROBOT, poses)


def out_of_reach(count, seed=0, stretch=1.2):
    """Reachable targets with both hands pushed outward from the shoulders."""
    poses, targets = reachable(count, seed)
    for first, (_, out, up) in zip((0, 3), shoulders(ROBOT), strict=True):
        shoulder = np.column_stack(
            [-out * np.sin(poses[:, 0]), out * np.cos(poses[:, 0]), np.full(count, up)]
        )
        hands = targets[:, first : first + 3]
        targets[:, first : first + 3] = shoulder + stretch * (hands - shoulder)
    return targets


#: A local search alone, without population or ends.
LOCAL = replace(ik.SETTINGS, generations=0, ends=0)


def hard_reachable(count, drawn=100_000, restarts=60):
    """Of many reachable targets, those that random restarts of a local search solve least often."""
    _, targets = reachable(drawn, seed=11)
    left = targets[ik.solve_batch(ROBOT, targets, settings=LOCAL).residual > ik.REACHED]
    starts, _ = reachable(restarts, seed=12)
    solved = sum(
        ik.solve_batch(ROBOT, left, settings=LOCAL, start=start).residual <= ik.REACHED
        for start in starts
    )
    chosen = np.argsort(solved, kind="stable")[:count]
    return left[chosen], solved[chosen] / restarts


def hard_out_of_reach(count, drawn=5_000):
    """Of many targets out of reach, those where one local search misses the optimum by most."""
    targets = out_of_reach(drawn, seed=13)
    once = ik.solve_batch(ROBOT, targets, settings=LOCAL).residual
    chosen = np.argsort(ik.solve_batch(ROBOT, targets).residual - once, kind="stable")[:count]
    return targets[chosen]


def main():
    hard, share = hard_reachable(100)
    beyond = np.concatenate([hard_out_of_reach(30), out_of_reach(10, seed=14, stretch=30.0)])
    data = {
        "hard_reachable": hard.tolist(),
        "solved_by_restarts": share.tolist(),
        "out_of_reach": beyond.tolist(),
        "optimum": [optimum(ROBOT, target) for target in beyond],
    }
    FILE.write_text(json.dumps(data, indent=0) + "\n")
    print(f"{FILE}: hardest solved by {share[0]:.3f}, 100th by {share[-1]:.3f} of restarts")


if __name__ == "__main__":
    main()
