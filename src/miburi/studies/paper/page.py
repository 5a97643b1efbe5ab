"""Write the page: every claim with its verdict, command and number, and the paper's figures."""

from collections import Counter
from collections.abc import Callable
from pathlib import Path

from miburi.bodies.simulated import Simulated
from miburi.ground.files import whole_files
from miburi.ground.templates import render
from miburi.robot import Robot
from miburi.studies.day import plot_day
from miburi.studies.experiment.chart import experiment_figure
from miburi.studies.paper import redrawn
from miburi.studies.paper.claim import ClaimVerdict
from miburi.studies.paper.claims import ABSENT, CLAIMS
from miburi.studies.paper.denavit import TABLES
from miburi.studies.paper.rule import fastest
from miburi.studies.paper.runs import Runs

_PAGE = Path(__file__).with_suffix(".md")


def write_paper(
    robot: Robot,
    out: Path,
    progress: Callable[[str], None] = lambda _: None,
    targets: int = 1000,
    seeds: int = 5,
    trials: int = 1000,
) -> Path:
    """Check the paper's claims, and write ``paper.md`` with its pictures in ``images``.

    ``targets``, ``seeds`` and ``trials`` are as in :class:`~miburi.studies.paper.runs.Runs`.

    Raises OutputError if the folder cannot be written to.
    """
    with whole_files(out) as draft, whole_files(out / "images") as images:
        runs = Runs(robot, progress, targets, seeds, trials)
        found = {name: carry_out(runs) for name, carry_out in CLAIMS.items()}
        progress("figures")
        redrawn.safety_figure(images / "paper-safety.png")
        redrawn.dh_figure(robot, images / "paper-frames.png")
        plot_day(images)
        full = {feeling: row[-1].measures for feeling, row in runs.gestures.items()}
        redrawn.effort_figure(full, images / "paper-effort.png")
        redrawn.flow_figure(Simulated(robot), images / "paper-flow.png")
        redrawn.function_figure(robot, images / "paper-functions.png")
        experiment_figure(runs.experiments[0], images / "paper-experiment.png")
        free = fastest(robot, runs.moves)
        redrawn.rule_figure(free, images / "paper-rule.png")
        counts = Counter(claim.verdict for claim in (*found.values(), *ABSENT))
        page = render(
            _PAGE,
            claims=found,
            absent=ABSENT,
            verdicts=[(verdict.value, counts[verdict]) for verdict in ClaimVerdict],
            tables=TABLES,
            words=lambda parts: " + ".join(parts) or "0",
            moves=len(free),
        )
        (draft / "paper.md").write_text(page, encoding="utf-8")
    return out / "paper.md"
