"""Time Miburi's inverse kinematics beside its peers: same targets, same machine, one run.

``make bench-ik`` runs it, with one thread for everybody. It writes ``comparison.md`` and
``comparison.png`` beside itself.
"""

import argparse
import platform
import time
from importlib.metadata import version
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from peers import DAMPING, DAMPING_BEYOND, PEERS
from targets import ROBOT, out_of_reach, reachable
from waist_search import optimum

from miburi import __version__, bma, ik
from miburi.robot import forward, inverse

HERE = Path(__file__).parent
MIDDLE = (ROBOT.lower + ROBOT.upper) / 2
OURS = "**Miburi `ik.solve`**"
ROUNDS = 3


def residual(pose, target):
    return float(np.linalg.norm(forward(ROBOT, pose) - target))


def with_restarts(solve, target, starts, good, generator):
    """Call a solver from the middle, then from random poses, until one is good; keep the best."""
    spent, best, start = 0.0, np.inf, MIDDLE
    for _ in range(max(starts, 1)):
        begun = time.process_time()
        pose = solve(target, start)
        spent += time.process_time() - begun
        best = min(best, residual(np.clip(pose, ROBOT.lower, ROBOT.upper), target))
        if best <= good:
            break
        start = generator.uniform(ROBOT.lower, ROBOT.upper)
    return spent, best


def measure(solve, targets, starts, good):
    generator = np.random.default_rng(1)
    solve(targets[0], MIDDLE)
    return np.array([with_restarts(solve, t, starts, good, generator) for t in targets])


def cells(times, ok):
    median, high = np.percentile(times * 1e6, [50, 99])
    return f"{median:,.1f} | {high:,.0f} | {ok:.1%}"


def least(rounds):
    """Return the least time of each target, and what was found in the first round."""
    return np.min([found[:, 0] for found in rounds], axis=0), rounds[0][:, 1]


def table_row(name, note, solvers, starts, share, near, far, best):
    """Measure one solver; return its row, its medians (near, far) and its share of successes."""
    near, far = near[: max(10, int(share * len(near)))], far[: max(10, int(share * len(far)))]
    rounds = range(ROUNDS if share == 1 else 1)
    times, found = least([measure(solvers[0], near, starts, 1e-4) for _ in rounds])
    solved = np.mean(found <= 1e-4 * np.sqrt(3))
    line, beyond = f"| {name} | {note} | {cells(times, solved)} |", np.nan
    if starts:
        # out of reach nobody can know that it is done, so every start allowed is made
        spent, found = least([measure(solvers[1], far, min(starts, 8), -1.0) for _ in rounds])
        excess = found - best[: len(far)]
        line += f" {cells(spent, np.mean(excess <= 1e-4))} | {np.mean(excess <= 1e-6):.1%} |"
        beyond = np.median(spent)
    else:
        line += " – | – | – | – |"
    print(line, flush=True)
    return line, np.median(times), beyond, solved


def own(settings):
    def solve(target, _):
        return ik.solve(ROBOT, target, settings=settings).angles

    return solve, solve


def closed_form(target, _):
    poses = inverse(ROBOT, target)
    return poses[0] if len(poses) else MIDDLE


def batch():
    """Say how many targets a second a batch takes, on all cores, by the clock on the wall."""
    targets, took = reachable(10_000, seed=3)[1], []
    for _ in range(9):
        begun = time.perf_counter()
        found = ik.solve_batch(ROBOT, targets)
        took.append(time.perf_counter() - begun)
    return (
        f"Batch of 10,000 reachable, `ik.solve_batch`, by the wall clock: "
        f"{10_000 / np.median(took):,.0f} a second (median of 9; best {10_000 / min(took):,.0f}), "
        f"{np.mean(found.residual <= 1e-4):.2%} solved."
    )


def draw(points):
    figure, axis = plt.subplots(figsize=(7, 4.5), layout="constrained")
    for name, (_, median, _, solved) in points.items():
        plain = name.replace("*", "").replace("`", "")
        axis.semilogx(median * 1e6, 100 * solved, "o", color="C3" if "Miburi" in name else "C0")
        axis.annotate(
            plain,
            (median * 1e6, 100 * solved),
            xytext=(3, -4),
            textcoords="offset points",
            rotation=-35,
            fontsize=7,
            va="top",
        )
    axis.set(xlabel="median time [µs]", ylabel="reachable targets solved [%]", ylim=(-30, 105))
    axis.grid(alpha=0.3)
    figure.savefig(HERE / "comparison.png", dpi=150)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--targets", type=int, default=1000)
    parser.add_argument("--beyond", type=int, default=200)
    options = parser.parse_args()
    near, far = reachable(options.targets)[1], out_of_reach(options.beyond, seed=2)
    best = np.array([optimum(ROBOT, target) for target in far])
    sets = (near, far, best)
    points = {
        OURS: table_row(OURS, __version__, own(ik.SETTINGS), 1, 1.0, *sets),
        "closed form, NumPy": table_row(
            "closed form, NumPy", __version__, (closed_form, None), 0, 0.3, *sets
        ),
        "`Settings.paper()`": table_row(
            "`Settings.paper()`", __version__, own(bma.Settings.paper()), 0, 0.1, *sets
        ),
    }
    missing = []
    for name, (make, distribution, starts, share) in PEERS.items():
        try:
            solvers = make(DAMPING), make(DAMPING_BEYOND)
            points[name] = table_row(name, version(distribution), solvers, starts, share, *sets)
        except ImportError as error:
            missing.append(f"{name} is not installed ({error.name}).")
    _, near_median, far_median, _ = points[OURS]
    ratios = [
        f"| {name} | {median / near_median:.1f} | "
        + ("– |" if np.isnan(beyond) else f"{beyond / far_median:.1f} |")
        for name, (_, median, beyond, _) in points.items()
    ]
    text = [
        f"{platform.machine()}, {len(near)} reachable targets and {len(far)} out of reach (fewer "
        "for the slow), one thread, processor time in µs; for those that were given all, the "
        f"least of {ROUNDS} rounds for each target. A solver with restarts begins at the middle "
        "of the limits, then at random poses: until the residual is 0.1 mm, 20 times at most; "
        "out of reach 8 times. A pose a little outside of the limits is put on them first. The "
        "last columns: within 1e-4 m and 1e-6 m of the exact optimum.",
        "",
        "| solver | version | median | p99 | solved | out of reach: median | p99 | 1e-4 | 1e-6 |",
        "|---|---|---|---|---|---|---|---|---|",
        *(line for line, *_ in points.values()),
        "",
        *missing,
        batch(),
        "",
        "Times Miburi's median:",
        "",
        "| solver | reachable | out of reach |",
        "|---|---|---|",
        *ratios,
    ]
    (HERE / "comparison.md").write_text("\n".join(text) + "\n")
    print("\n".join(text))
    draw(points)


if __name__ == "__main__":
    main()
