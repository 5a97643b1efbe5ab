"""Time Miburi's inverse kinematics beside its peers: same targets, same machine, one run.

``make bench-ik`` runs it, with one thread for everybody. It writes ``comparison.md`` and
``comparison.png`` beside itself.
"""

import argparse
import json
import platform
import time
from importlib.metadata import version
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from peers import DAMPING, DAMPING_BEYOND, MISSING, PEERS
from targets import FILE, ROBOT, out_of_reach, reachable
from waist_search import optimum

from miburi import __version__, bma, ik
from miburi.robot import forward, inverse

HERE = Path(__file__).parent
MIDDLE = (ROBOT.lower + ROBOT.upper) / 2
OURS = "**Miburi `ik.solve`**"
ROUNDS = 3
BEYOND_STARTS, IN_VAIN = 8, 3  # out of reach: starts allowed, and starts in vain before it ends


def timed(solve, target, start):
    """Call a solver; return its pose and the time: the lesser of wall clock and processor time.

    The wall clock counts what other programs take, and processor time what reading it takes.
    """
    processor = time.process_time()
    wall = time.perf_counter()
    pose = solve(target, start)
    wall = time.perf_counter() - wall
    return pose, min(wall, time.process_time() - processor)


def measure(solve, targets, starts, good, in_vain):
    """Call a solver for all targets, then from random poses for those that are left.

    A target is left until its residual is ``good``, or ``in_vain`` starts in a row have found
    nothing better. Returns time and residual after the first start, and at the end, each (n,).
    """
    generator = np.random.default_rng(1)
    solve(targets[0], MIDDLE)
    spent, best = np.zeros(len(targets)), np.full(len(targets), np.inf)
    idle, left = np.zeros(len(targets), int), np.arange(len(targets))
    first = spent, best
    for attempt in range(starts):
        poses = np.empty((len(left), 8))
        for k, i in enumerate(left):
            start = generator.uniform(ROBOT.lower, ROBOT.upper) if attempt else MIDDLE
            poses[k], took = timed(solve, targets[i], start)
            spent[i] += took
        inside = np.clip(poses, ROBOT.lower, ROBOT.upper)
        residual = np.linalg.norm(forward(ROBOT, inside) - targets[left], axis=1)
        idle[left] = np.where(residual < best[left] - 1e-6, 0, idle[left] + 1)
        best[left] = np.minimum(best[left], residual)
        left = left[(best[left] > good) & (idle[left] < in_vain)]
        if attempt == 0:
            first = spent.copy(), best.copy()
    return (*first, spent, best)


def least(rounds):
    """Return the least times of several rounds, and the residuals of the first."""
    once, found_once, spent, found = zip(*rounds, strict=True)
    return np.min(once, axis=0), found_once[0], np.min(spent, axis=0), found[0]


def part(targets, share):
    return targets[: max(10, round(share * len(targets)))]


def row(name, note, solvers, starts, share, sets, beyond):
    """Measure one solver; return its line of the table, and what the plot and the ratios need."""
    near, hard, far, best = (part(targets, share) for targets in sets)
    rounds = range(ROUNDS if share == 1 else 1)
    good, reached = 1e-4, 1e-4 * np.sqrt(3)
    once, found_once, spent, found = least(
        [measure(solvers[0], near, starts, good, starts) for _ in rounds]
    )
    *_, hard_found = measure(solvers[0], hard, starts, good, starts)
    median, high = np.percentile(spent * 1e6, [50, 99])
    solved = np.mean(found <= reached)
    first = "–" if starts == 1 else f"{np.mean(found_once <= reached):.1%}"
    line = (
        f"| {name} | {note} | {len(near)} | {first} | {solved:.1%} | {median:,.1f} | {high:,.0f} "
        f"| {1 / np.mean(spent):,.0f} | {np.mean(hard_found <= reached):.0%} |"
    )
    last = np.nan
    if beyond:
        allowed = 1 if starts == 1 else BEYOND_STARTS
        once, found_once, spent, found = least(
            [measure(solvers[1], far, allowed, -1.0, IN_VAIN) for _ in rounds]
        )
        last = np.median(spent)
        single, high = np.median(once) * 1e6, np.percentile(spent, 99) * 1e6
        excess, excess_once = found - best, found_once - best
        line += (
            f" {single:,.0f} | {np.mean(excess_once <= 1e-4):.1%} | {last * 1e6:,.0f} "
            f"| {high:,.0f} | {np.mean(excess <= 1e-4):.1%} | {np.mean(excess <= 1e-6):.1%} |"
        )
    else:
        line += 6 * " – |"
    print(line, flush=True)
    return line, median / 1e6, last, solved


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


#: The columns after name, version and number of targets.
HEAD = (
    "one start: solved | solved | median | p99 | a second | hard ones solved "
    "| out of reach: one start | 1e-4 | median | p99 | 1e-4 | 1e-6"
)


def explanation(near, hard, far):
    return [
        f"{platform.machine()}, one thread. {near:,} reachable targets, {hard} hard ones "
        f"(reachable, but by hardly any random start) and {far} out of reach; a slow solver gets "
        f"the first of them, 10 at least. Times in µs for a target, the lesser of wall clock and "
        f"processor time; of those that got all targets, the least of {ROUNDS} rounds.",
        "",
        "A solver begins at the middle of the limits. Until the residual is 0.1 mm it begins anew "
        "at random poses, 20 starts in all; *one start* is what it does without. The robotics "
        "toolbox makes its own restarts, and the evolutionary ones and Miburi get one call. "
        f"Out of reach, where no residual tells that a start was the last that is needed, it makes "
        f"{BEYOND_STARTS} starts, and stops before that once {IN_VAIN} in a row have found nothing "
        "better (by 1e-6 m). A pose a little outside of the limits is put on them first. *A "
        "second*: targets one after another, on one core, by the mean time. The columns 1e-4 and "
        "1e-6: within so many metres of the exact optimum.",
        "",
    ]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--targets", type=int, default=1000)
    parser.add_argument("--beyond", type=int, default=200)
    options = parser.parse_args()
    near, far = reachable(options.targets)[1], out_of_reach(options.beyond, seed=2)
    hard = np.array(json.loads(FILE.read_text())["hard_reachable"])
    sets = near, hard, far, np.array([optimum(ROBOT, target) for target in far])
    ours = {
        OURS: (own(ik.SETTINGS), 1.0, True),
        "closed form, NumPy": ((closed_form, None), 0.3, False),
        "`Settings.paper()`": (own(bma.Settings.paper()), 0.1, False),
    }
    points = {
        name: row(name, __version__, solvers, 1, share, sets, beyond)
        for name, (solvers, share, beyond) in ours.items()
    }
    missing = [f"{name} {why}." for name, why in MISSING.items()]
    for name, (make, distribution, starts, share, beyond) in PEERS.items():
        try:
            solvers = make(DAMPING), make(DAMPING_BEYOND)
        except ImportError as error:
            missing.append(f"{name} is not installed ({error.name}).")
        else:
            points[name] = row(name, version(distribution), solvers, starts, share, sets, beyond)
    _, near_median, far_median, _ = points[OURS]
    ratios = [
        f"| {name} | {median / near_median:.1f} | "
        + ("– |" if np.isnan(last) else f"{last / far_median:.1f} |")
        for name, (_, median, last, _) in points.items()
    ]
    text = [
        *explanation(len(near), len(hard), len(far)),
        f"| solver | version | targets | {HEAD} |",
        "|---|---|---|" + "---|" * 12,
        *(line for line, *_ in points.values()),
        "",
        "Not here: " + " ".join(missing),
        "",
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
