"""Targets to solve for: reachable, out of reach, and the hard ones that tests and benchmark share.

Run it to write ``targets.json`` and ``far_targets.json`` in ``tests/ik`` again (several minutes).
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from waist_search import optimum

from miburi import ik
from miburi.robot import forward, iphonoid
from miburi.robot.geometry import arm_reach, shoulders

ROBOT = iphonoid()
FILE = Path(__file__).parents[2] / "tests" / "ik" / "targets.json"
FAR_FILE = FILE.with_name("far_targets.json")


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


#: name → (least and greatest distance from a reachable target in m, how many extremities)
BEYOND = {
    f"{name}, {'all' if limbs == 3 else 'one'}": (least, most, limbs)
    for name, least, most in (("near", 0.002, 0.05), ("far", 0.05, 1.0), ("gross", 1.0, 100.0))
    for limbs in (1, 3)
}


def beyond(name, count, seed=0, robot=ROBOT):
    """Reachable targets with one extremity or all moved away, in any direction."""
    least, most, limbs = BEYOND[name]
    generator = np.random.default_rng(seed)
    poses = generator.uniform(robot.lower, robot.upper, (count, 8))
    targets = forward(robot, poses).reshape(count, 3, 3)
    away = generator.normal(size=(count, 3, 3))
    away /= np.linalg.norm(away, axis=2, keepdims=True)
    away *= np.exp(generator.uniform(np.log(least), np.log(most), (count, 3, 1)))
    moved = generator.permuted(np.tile(np.arange(3), (count, 1)), axis=1) < limbs
    return (targets + away * moved[:, :, None]).reshape(count, 9)


#: A local search alone, without population or ends.
LOCAL = replace(ik.residual_settings(ROBOT), generations=0, ends=0)
REACHED = ik.REACHED * arm_reach(ROBOT)


def residuals_of(targets, settings, start=None):
    """Return the residual, (n,) m, of each target with these settings."""
    return np.array(
        [ik.solve(ROBOT, row, settings=settings, start=start).residual for row in targets]
    )


def hard_reachable(count, drawn=100_000, restarts=60):
    """Of many reachable targets, those that random restarts of a local search solve least often."""
    _, targets = reachable(drawn, seed=11)
    left = targets[residuals_of(targets, LOCAL) > REACHED]
    starts, _ = reachable(restarts, seed=12)
    solved = sum(residuals_of(left, LOCAL, start) <= REACHED for start in starts)
    chosen = np.argsort(solved, kind="stable")[:count]
    return left[chosen], solved[chosen] / restarts


def hard_out_of_reach(count, drawn=5_000):
    """Of many targets out of reach, those where one local search misses the optimum by most."""
    targets = out_of_reach(drawn, seed=13)
    once = residuals_of(targets, LOCAL)
    chosen = np.argsort(ik.solve_batch(ROBOT, targets).residual - once, kind="stable")[:count]
    return targets[chosen]


def far_cases(count):
    """A few targets of each kind out of reach, with the exact optimum of each."""
    cases = []
    for seed, name in enumerate(BEYOND):
        targets = beyond(name, count, seed=100 + seed)
        best = [optimum(ROBOT, target) for target in targets]
        cases.append({"name": name, "targets": targets.tolist(), "optimum": best})
    targets = out_of_reach(700, seed=2)[400:460]  # one of them has a valley 5 mrad wide
    best = [optimum(ROBOT, target) for target in targets]
    cases.insert(0, {"name": "pushed", "targets": targets.tolist(), "optimum": best})
    target = beyond("gross, all", 500, seed=[0, 5])[195]
    case = {"targets": [target.tolist()], "optimum": [optimum(ROBOT, target)]}
    cases.append({"name": "two valleys, 6 mrad apart"} | case)
    return {"cases": cases}


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
    FAR_FILE.write_text(json.dumps(far_cases(60)) + "\n")
    print(f"{FILE}: hardest solved by {share[0]:.3f}, 100th by {share[-1]:.3f} of restarts")


if __name__ == "__main__":
    main()
