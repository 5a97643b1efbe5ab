"""Write the page: every claim with its verdict, command and number, and the paper's figures."""

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

from miburi import ik
from miburi.bodies.simulated import Simulated
from miburi.feelings import FEELINGS
from miburi.gestures import key_poses, load
from miburi.ground.files import whole_files
from miburi.ground.templates import render
from miburi.robot import Robot
from miburi.safety.move import plan_move
from miburi.studies.day import plot_day
from miburi.studies.experiment.figures import experiment_figure
from miburi.studies.paper import figures
from miburi.studies.paper.claims import ClaimVerdict, Runs, claims
from miburi.studies.paper.denavit import TABLES

__all__ = ["write_paper"]

_PAGE = Path(__file__).with_suffix(".md")


def write_paper(
    robot: Robot,
    out: Path,
    progress: Callable[[str], None] = lambda _: None,
    targets: int = 1000,
    seeds: int = 5,
) -> Path:
    """Carry out the paper's claims, and write ``paper.md`` with its pictures in ``images``.

    ``targets`` is how many random ones the inverse kinematics solve for, ``seeds`` how many
    experiments there are.

    Raises
    ------
    OutputError
        The folder cannot be written to.
    """
    with whole_files(out) as draft, whole_files(out / "images") as images:
        runs = Runs(robot, progress, targets, seeds)
        found = list(claims(runs))
        progress("figures")
        figures.safety_figure(images / "paper-safety.png")
        figures.dh_figure(robot, images / "paper-frames.png")
        plot_day(images)
        figures.effort_figure(images / "paper-effort.png")
        follows = figures.flow_figure(Simulated(robot), images / "paper-flow.png")
        figures.function_figure(robot, images / "paper-functions.png")
        experiment_figure(runs.experiments[0], images / "paper-experiment.png")
        free = _moves(robot)
        share = figures.rule_figure(free, images / "paper-rule.png")
        page = render(
            _PAGE,
            claims=found,
            verdicts=[(v.value, Counter(c.verdict for c in found)[v]) for v in ClaimVerdict],
            tables=TABLES,
            words=_words,
            follows=sorted(follows.items()),
            moves=len(free),
            share=share,
        )
        (draft / "paper.md").write_text(page, encoding="utf-8")
    return out / "paper.md"


def _moves(robot: Robot) -> list[tuple[float, float]]:
    """Return distance, rad, and speed, rad/s, of the fastest motor of the gestures' moves."""
    found = []
    for feeling in FEELINGS:
        for mood in (0.3, 0.6, 0.9):
            present = robot.neutral
            for pose in key_poses(robot, load(feeling), mood):
                angles = ik.solve(robot, pose.target, start=present).angles
                move = plan_move(robot, present, angles, pose.duration)
                motor = int(np.argmax(move.speeds))
                distance = float(np.abs(angles - present)[motor])
                if distance > robot.servo.step:
                    found.append((distance, float(move.speeds[motor])))
                present = angles
    return found


def _words(parts: tuple[str, ...]) -> str:
    return " + ".join(parts) or "0"
