"""What the paper promises of its inverse kinematics, and what its algorithm keeps.

``python bench/ik/reproduce.py`` prints the table of ``docs/inverse-kinematics.md``, writes it to
``bench/ik/reproduction.md`` and draws ``docs/images/inverse-kinematics.png``.
"""

import time
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from targets import ROBOT, reachable

from miburi import bma, ik
from miburi.robot import inverse
from miburi.robot.geometry import arm_reach

HERE = Path(__file__).parent
COUNT = 1000
UNITS = {"m": 1.0, "cm": 100.0, "mm": 1000.0}  # of length, each as many in a metre
PROMISE = 0.015  # rad (Section 3)
PAPER = bma.Settings.paper()
RESIDUAL = replace(PAPER, local_search="residual")  # the search of reference [9], else as printed
TUNED = replace(RESIDUAL, damping=1e-2, gradient_tolerance=1e-12)
OWN = ik.residual_settings(ROBOT)
REACHED = ik.REACHED * arm_reach(ROBOT)


def in_unit(per_metre):
    """The robot with its lengths in another unit: what "1" means to Eq. 12."""
    size = ROBOT.lengths
    scaled = {name: getattr(size, name) * per_metre for name in type(size).model_fields}
    return ROBOT.model_copy(update={"lengths": size.model_copy(update=scaled)})


def nearest_angle(poses, drawn, found):
    """Largest angle error to the drawn pose, and to the nearest valid one, each (n,) rad."""
    to_drawn = np.abs(found - drawn).max(axis=1)
    to_valid = to_drawn.copy()
    for i, valid in enumerate(poses):
        if len(valid):
            to_valid[i] = min(to_drawn[i], np.abs(valid - found[i]).max(axis=1).min())
    return to_drawn, to_valid


def row(name, settings, unit, drawn, targets, valid):
    per_metre = UNITS[unit]
    robot, rows = in_unit(per_metre), targets * per_metre
    ik.solve(robot, rows[0], settings=settings)
    times, found, position, evaluations = [], [], [], []
    for target in rows:
        begun = time.process_time()
        solution = ik.solve(robot, target, settings=settings)
        times.append(time.process_time() - begun)
        found.append(solution.angles)
        position.append(solution.error.max() / per_metre)
        evaluations.append(solution.evaluations)
    to_drawn, to_valid = nearest_angle(valid, drawn, np.array(found))
    constants = "– | –"
    if settings is not None:
        constants = f"{settings.damping:.2g} | {settings.gradient_tolerance:.2g}"
    single = np.array([len(v) == 1 for v in valid])
    return (
        f"| {name} | {unit} | {constants} | {np.mean(to_drawn <= PROMISE):.1%} "
        f"| {np.mean(to_valid <= PROMISE):.1%} "
        f"| {np.mean(to_valid[single] <= PROMISE):.1%} | {np.median(position) * 1e3:.2g} "
        f"| {np.mean(np.array(position) <= 1e-4):.1%} | {np.median(times) * 1e3:.3g} "
        f"| {max(times) * 1e3:.3g} | {np.mean(evaluations):,.0f} |"
    )


def curves(axis, targets):
    generations = [0, 1, 2, 3, 5, 8, 12, 18, 25, 35]
    cases = {
        "Table 2 as printed": PAPER,
        "Table 2, residual search": RESIDUAL,
        "Table 2, no local search": replace(PAPER, local_probability=0.0),
        "Table 2, residual search, γ 0.01": TUNED,
        "residual_settings": replace(OWN, patience=0),
    }
    for name, settings in cases.items():
        error = []
        for count in generations:
            limited = replace(settings, generations=count)
            found = [ik.solve(ROBOT, target, settings=limited) for target in targets]
            error.append(np.median([solution.error.max() for solution in found]))
        axis.semilogy(generations, np.maximum(error, 1e-9), marker=".", label=name)
    axis.set(xlabel="generations", ylabel="largest position error, median [m]")
    axis.legend()
    axis.grid(alpha=0.3)


def changes():
    """Return a table of what each of our changes brings, on many targets."""
    targets = reachable(20_000, seed=5)[1]
    cases = {
        "a local search from the middle of the limits": replace(OWN, generations=0, ends=0),
        "and from the limits": replace(OWN, generations=0),
        "and from the population (`residual_settings`)": OWN,
        "population, but not from the limits": replace(OWN, ends=0),
        "Miburi's default: from where the target points, then along the waist": None,
    }
    lines = [f"| {len(targets):,} reachable targets | not solved | evaluations |", "|---|---|---|"]
    for name, settings in cases.items():
        found = [ik.solve(ROBOT, target, settings=settings) for target in targets]
        missed = sum(solution.residual > REACHED for solution in found)
        tried = np.mean([solution.evaluations for solution in found])
        lines.append(f"| {name} | {missed} | {tried:.1f} |")
    return lines


def main():
    drawn, targets = reachable(COUNT)
    valid = [inverse(ROBOT, target) for target in targets]
    several = np.mean([len(v) > 1 for v in valid])
    none = replace(PAPER, local_probability=0.0)
    cases = [
        *(("Table 2 as printed", PAPER, unit) for unit in UNITS),
        ("no local search", none, "m"),
        ("350 generations", replace(PAPER, generations=350), "m"),
        *(("Table 2, residual search of [9]", RESIDUAL, unit) for unit in UNITS),
        *(("the same, other γ and τ", TUNED, unit) for unit in UNITS),
        ("`residual_settings`", OWN, "m"),
        ("Miburi's default", None, "m"),
    ]
    lines = [
        f"{COUNT} random reachable targets; {several:.1%} have several valid poses.",
        "",
        "| | unit | γ | τ | 0.015 rad of the drawn pose | of the nearest valid pose "
        "| of the only valid pose "
        "| position error, median [mm] | within 0.1 mm | processor time, median [ms] | most [ms] "
        "| evaluations |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for case in cases:
        lines.append(row(*case, drawn, targets, valid))
        print(lines[-1], flush=True)
    text = "\n".join([*lines, "", "What each of our changes brings:", "", *changes()]) + "\n"
    (HERE / "reproduction.md").write_text(text)
    print(text)
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    curves(axis, targets[:300])
    figure.savefig(HERE.parents[1] / "docs" / "images" / "inverse-kinematics.png", dpi=150)


if __name__ == "__main__":
    main()
