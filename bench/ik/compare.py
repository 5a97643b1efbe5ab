"""Time Miburi's inverse kinematics beside its peers: same targets, same machine, in turns.

``make bench-ik`` runs it, with one thread for everybody. Five processes, one after the other;
in each, rounds in which every solver has its turn. A ratio is that of two medians of one turn:
Miburi is timed before the peer, after it, and each few milliseconds between its targets, so that
what else the machine does meets both. Leave the machine alone meanwhile: with a load of 20 a peer
with much code loses more than Miburi does, and its ratio doubles.

It writes ``comparison.md`` beside itself, and what each process measured to
``out/bench-ik``; ``spread.py`` compares such runs.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from importlib.metadata import version
from itertools import cycle
from pathlib import Path

import numpy as np
from compiled_peers import closed_form as compiled_closed_form
from compiled_peers import waist_search
from peers import MISSING, PEERS
from targets import FILE, ROBOT, out_of_reach, reachable
from waist_search import optimum

from miburi import __version__, bma, ik
from miburi.robot import forward, inverse

HERE = Path(__file__).parent
RUNS = HERE.parents[1] / "out" / "bench-ik"
MIDDLE = (ROBOT.lower + ROBOT.upper) / 2
OURS = "**Miburi `ik.solve`**"
WARM = "Miburi, from a pose 0.1 rad off"
PROCESSES, ROUNDS = 5, 7
SLOW = 5  # targets a round; with no more, the processes after the first take one round
HARD = 30
GOOD = 1e-4  # m, the residual at which a solver may stop
SOLVED = GOOD * np.sqrt(3)  # m, each extremity as near as that
BEYOND_STARTS, IN_VAIN = 8, 3  # out of reach: starts allowed, and starts in vain before it ends
PAUSE = 5e-3  # s of a peer's own time, after which Miburi is timed


def timed(solve, target, start):
    """Call a solver; return its pose and the time: the lesser of wall clock and processor time.

    The wall clock counts what other programs take, and processor time what reading it takes.
    """
    processor = time.process_time()
    wall = time.perf_counter()
    pose = solve(target, start)
    wall = time.perf_counter() - wall
    return pose, min(wall, time.process_time() - processor)


def measure(solve, targets, starts, good, in_vain, first_starts, look=lambda _: None):
    """Call a solver for all targets, then from random poses for those that are left.

    A target is left until its residual is ``good``, or ``in_vain`` starts in a row have found
    nothing better. After each call, ``look`` is told the time. Returns times and residuals, each
    (n,).
    """
    generator = np.random.default_rng(1)
    spent, best = np.zeros(len(targets)), np.full(len(targets), np.inf)
    idle, left = np.zeros(len(targets), int), np.arange(len(targets))
    for attempt in range(starts):
        poses = np.empty((len(left), 8))
        for k, i in enumerate(left):
            start = generator.uniform(ROBOT.lower, ROBOT.upper) if attempt else first_starts[i]
            poses[k], took = timed(solve, targets[i], start)
            spent[i] += took
            look(took)
        inside = np.clip(poses, ROBOT.lower, ROBOT.upper)
        residual = np.linalg.norm(forward(ROBOT, inside) - targets[left], axis=1)
        idle[left] = np.where(residual < best[left] - 1e-6, 0, idle[left] + 1)
        best[left] = np.minimum(best[left], residual)
        left = left[(best[left] > good) & (idle[left] < in_vain)]
    return spent, best


def own(settings):
    def solve(target, _):
        return ik.solve(ROBOT, target, settings=settings).angles

    return solve, solve


own_default = own(None)[0]


class Beside:
    """Miburi's times for some targets, taken between those of a peer, in the same loop."""

    def __init__(self, targets, at_once):
        self.parts = cycle(np.split(targets, len(targets) // at_once))
        self.times, self.since = [], 0.0

    def take(self):
        """Solve for a few targets."""
        part = next(self.parts)
        spent, _ = measure(own_default, part, 1, 0.0, 1, [MIDDLE] * len(part))
        self.times += spent.tolist()
        self.since = 0.0

    def look(self, took):
        """Do so where the peer has had its pause."""
        self.since += took
        if self.since > PAUSE:
            self.take()


def own_warm(target, start):
    return ik.solve(ROBOT, target, start=start).angles


def closed_form(target, _):
    poses = inverse(ROBOT, target)
    return poses[0] if len(poses) else MIDDLE


def solvers():
    """Return name → (two solvers, for in reach and beyond; version; starts; targets a round)."""
    paper = bma.Settings.paper()
    found = {
        OURS: (own(None), __version__, 1, 500, 100),
        WARM: ((own_warm, None), __version__, 1, 500, 0),
        "closed form, compiled": ((compiled_closed_form, None), "–", 1, 500, 0),
        "waist search, compiled": ((waist_search, waist_search), "–", 1, 100, 50),
        "closed form, NumPy": ((closed_form, None), __version__, 1, 100, 0),
        "`residual_settings`": (own(ik.residual_settings(ROBOT)), __version__, 1, 100, 5),
        "`Settings.paper()`": (own(paper), __version__, 1, 5, 0),
    }
    missing = [f"{name} {why}." for name, why in MISSING.items()]
    for name, (make, distribution, starts, near, far) in PEERS.items():
        try:
            pair = make(True), make(False)
        except ImportError as error:
            missing.append(f"{name} is not installed ({error.name}).")
        else:
            found[name] = pair, version(distribution), starts, near, far
    return found, missing


def one_process(path, first_of_all):
    """Measure rounds in turns; write medians, high percentiles and ratios of each solver.

    How many targets are solved, and how well, is the same in each process: the first counts it.
    """
    poses, near = reachable(ROUNDS * 500)
    warm = poses + np.random.default_rng(5).uniform(-0.1, 0.1, poses.shape)
    far = out_of_reach(ROUNDS * 100, seed=2)
    hard = np.array(json.loads(FILE.read_text())["hard_reachable"])[:HARD]
    found, missing = solvers()
    least = np.array([optimum(ROBOT, target) for target in far]) if first_of_all else None
    load = [os.getloadavg()[0]]
    results = {
        name: {"version": number, "solved": [], "excess": []}
        | {field: [] for field in ("near", "far", "p99", "times_near", "times_far")}
        for name, (_, number, *_) in found.items()
    }
    for name, ((first, second), _, starts, _, beyond) in found.items():
        if first_of_all:
            _, best = measure(first, hard, starts, GOOD, starts, [MIDDLE] * HARD)
            results[name]["hard"] = np.mean(best <= SOLVED)
        measure(first, near[-2:], 1, 0, 1, warm[-2:])  # warm caches for all
        if beyond:
            measure(second, far[-2:], 1, 0, 1, warm[-2:])
    for turn in range(ROUNDS):
        for name, ((first, second), _, starts, count, beyond) in found.items():
            if count <= SLOW and turn and not first_of_all:
                continue
            result = results[name]
            rows = slice(turn * count, (turn + 1) * count)
            begin = warm[rows] if name == WARM else [MIDDLE] * count
            own_rows = slice(turn * 500, (turn + 1) * 500)
            spent, best, ratio = beside(
                near[own_rows], 100, first, near[rows], starts, GOOD, starts, begin
            )
            result["near"].append(np.median(spent))
            result["times_near"].append(ratio)
            result["p99"].append(np.percentile(spent, 99))
            result["solved"] += (best <= SOLVED).tolist()
            if beyond:
                rows = slice(turn * beyond, (turn + 1) * beyond)
                own_rows = slice(turn * 100, (turn + 1) * 100)
                allowed, begin = 1 if starts == 1 else BEYOND_STARTS, [MIDDLE] * beyond
                spent, best, ratio = beside(
                    far[own_rows], 20, second, far[rows], allowed, -1.0, IN_VAIN, begin
                )
                result["far"].append(np.median(spent))
                result["times_far"].append(ratio)
                if first_of_all:
                    result["excess"] += (best - least[rows]).tolist()
        print(f"round {turn + 1} of {ROUNDS}", flush=True)
    load.append(os.getloadavg()[0])
    data = {"load": load, "missing": missing, "batch": batch(), "results": results}
    path.write_text(json.dumps(data))


def beside(own_targets, at_once, solve, *arguments):
    """Measure a solver and Miburi in turns; return times, residuals and the ratio of medians."""
    own_times = Beside(own_targets, at_once)
    own_times.take()
    own_times.take()
    spent, best = measure(solve, *arguments, own_times.look)
    own_times.take()
    own_times.take()
    return spent, best, np.median(spent) / np.median(own_times.times)


def batch():
    """Return how many targets a second a batch takes, on all cores: the median of nine."""
    targets, took = reachable(10_000, seed=3)[1], []
    for _ in range(9):
        begun = time.perf_counter()
        ik.solve_batch(ROBOT, targets)
        took.append(time.perf_counter() - begun)
    return 10_000 / np.median(took), 10_000 / min(took)


def ratio(processes, name, field):
    """Return the ratio to Miburi's median, its spread over rounds, and that of each process."""
    each = [process["results"][name][field] for process in processes]
    if not each[0]:
        return "– | –"
    low, high = np.percentile(np.concatenate(each), [10, 90])
    runs = ", ".join(f"{np.median(times):.3g}" for times in each)
    return f"**{np.median(np.concatenate(each)):.3g}** ({low:.3g}–{high:.3g}) | {runs}"


def table(processes):
    lines = [
        f"| solver | version | solved | n | of {HARD} hard ones | median [µs] | p99 [µs] "
        "| times Miburi (10–90 % of rounds) | each process | out of reach: 1e-4 | 1e-6 | n "
        "| median [µs] | times Miburi | each process |",
        "|" + "---|" * 15,
    ]
    for name in processes[0]["results"]:
        every = [process["results"][name] for process in processes]
        near, p99, far = (
            np.concatenate([result[field] for result in every]) for field in ("near", "p99", "far")
        )
        solved, excess = every[0]["solved"], np.array(every[0]["excess"])  # the same in each
        line = (
            f"| {name} | {every[0]['version']} | {np.mean(solved):.1%} | {len(solved)} "
            f"| {every[0]['hard']:.0%} "
            f"| {np.median(near) * 1e6:,.1f} | {np.median(p99) * 1e6:,.0f} "
            f"| {ratio(processes, name, 'times_near')} |"
        )
        if len(far):
            line += (
                f" {np.mean(excess <= 1e-4):.1%} | {np.mean(excess <= 1e-6):.1%} | {len(excess)} "
                f"| {np.median(far) * 1e6:,.0f} | {ratio(processes, name, 'times_far')} |"
            )
        else:
            line += " – | – | – | – | – | – |"
        lines.append(line)
    return lines


def explanation(processes):
    loads = "; ".join(f"{a:.1f} to {b:.1f}" for a, b in (p["load"] for p in processes))
    return [
        f"{platform.machine()}, {os.cpu_count()} cores, one thread. There are {PROCESSES} "
        f"processes of {ROUNDS} rounds each. Every solver runs in every round; only the slowest "
        "run in just one round of each process after the first. "
        f"The machine's load before and after each process: {loads}. "
        "Times are the lesser of wall clock and processor time; *times Miburi* is a solver's "
        "median time divided by Miburi's, which is measured before the solver's turn, after it, "
        f"and every {PAUSE * 1e3:.0f} ms during it.",
        "",
        "A solver begins at the middle of the limits. While the residual is above 0.1 mm, it "
        "starts again from a random pose, up to 20 starts in all. The robotics toolbox makes "
        "its own restarts; EAIK, IK-Geo and Miburi get one call. If a target is out of reach, no "
        "residual can show that a search has succeeded. For such a target a solver makes up "
        f"to {BEYOND_STARTS} starts, and stops early if {IN_VAIN} in a row have found nothing "
        "better (by 1e-6 m). If a solver's pose is slightly outside the limits, it is moved onto "
        "them before it is judged. The columns 1e-4 and 1e-6 give the share of targets solved to "
        "within that distance, in metres, of the exact optimum.",
        "",
    ]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--one", type=Path, help="measure in this process, write the file")
    parser.add_argument("--first", action="store_true", help="and count what is solved")
    options = parser.parse_args()
    if options.one:
        one_process(options.one, options.first)
        return
    RUNS.mkdir(parents=True, exist_ok=True)
    run = RUNS / str(1 + len(list(RUNS.iterdir())))
    run.mkdir()
    processes = []
    for number in range(PROCESSES):
        path = run / f"process-{number}.json"
        first = [] if number else ["--first"]
        subprocess.run([sys.executable, __file__, "--one", path, *first], check=True)
        processes.append(json.loads(path.read_text()))
    rates = [process["batch"] for process in processes]
    text = [
        *explanation(processes),
        *table(processes),
        "",
        "Some solvers are missing. " + " ".join(processes[0]["missing"]),
        "",
        "`ik.solve_batch` solves a batch of 10,000 reachable targets on all cores. By the wall "
        "clock, the median batches of five processes ran at "
        + ", ".join(f"{median:,.0f}" for median, _ in rates)
        + f" targets a second (the fastest batch: {max(best for _, best in rates):,.0f}).",
    ]
    (HERE / "comparison.md").write_text("\n".join(text) + "\n")
    print("\n".join(text))


if __name__ == "__main__":
    main()
