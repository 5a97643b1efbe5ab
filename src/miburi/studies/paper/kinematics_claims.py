"""Section 3 of the paper: the kinematic model and its inverse."""

from dataclasses import replace
from functools import partial

import numpy as np

from miburi.bma.operators import printed_step
from miburi.bma.settings import Settings
from miburi.robot import JOINTS, forward, forward_as_printed, inverse, jacobian
from miburi.robot.description import Joint
from miburi.studies.paper.claim import Claims, Finding, claim, holds
from miburi.studies.paper.denavit import TABLES, frames
from miburi.studies.paper.runs import UNITS, Runs

#: Table 1, rad.
_TABLE_1 = {
    "waist": (-1.744, 1.744),
    "right_shoulder": (-0.523, 3.1415),
    "right_elbow": (-0.174, 1.744),
    "right_fingertip": (-0.174, 1.744),
    "left_shoulder": (-0.523, 3.1415),
    "left_elbow": (-1.744, 0.174),
    "left_fingertip": (-1.744, 0.174),
    "head": (0.174, 1.22),
}
#: Poses that differ by no more than this angle, in rad, count as one.
_ALIKE = 1e-3

KINEMATICS: Claims = {}
_claim = partial(claim, KINEMATICS, "3")


@_claim("Table 1: the range of the eight motors.")
def _table_1(runs: Runs) -> Finding:
    robot = runs.robot
    same = sum(
        (low, high) == _TABLE_1[name]
        for name, low, high in zip(JOINTS, robot.lower, robot.upper, strict=True)
    )
    ends = np.array([move.angles for _, move in runs.moves])
    beyond = float(max((robot.lower - ends).max(), (ends - robot.upper).max(), 0.0))
    return holds(same == len(JOINTS) and beyond == 0), (
        f"{same} of {len(JOINTS)} ranges are the paper's; {len(ends)} moves of the gestures go "
        f"{beyond:g} rad beyond them"
    )


@_claim(
    "The kinematic model follows the Denavit-Hartenberg convention (Figs. 2 and 3).",
    ours="the paper prints no table and no lengths",
)
def _denavit_hartenberg(runs: Runs) -> Finding:
    ours = forward(runs.robot, runs.poses)
    chain = np.array(
        [
            np.concatenate([frames(runs.robot, e, pose)[-1][:3, 3] for e in TABLES])
            for pose in runs.poses
        ]
    )
    off = np.abs(chain - ours).max()
    return holds(off < 1e-12), f"the table below and the model differ by at most {off:.0e} m"


@_claim("“The kinematic model is presented in Equations (3)–(11).”")
def _equations(runs: Runs) -> Finding:
    off = np.abs(forward_as_printed(runs.robot, runs.poses) - forward(runs.robot, runs.poses))
    wrong = int((off.max(axis=0) > 1e-12).sum())
    return holds(wrong == 0), (
        f"{wrong} of 9 equations are misprinted; a hand is off by up to {1e3 * off.max():.0f} mm"
    )


@_claim(
    "“The direct inversion of the forward kinematic model gives us 8 solutions.”",
    ours="the condition: solutions are counted arm by arm",
)
def _eight_solutions(runs: Runs) -> Finding:
    """Count each arm's poses with the hand in the same position, ignoring joint limits."""
    joints = runs.robot.joints
    free = {
        name: Joint(symbol=joint.symbol, min=-np.pi, max=np.pi, neutral=joint.neutral)
        for name in JOINTS
        if (joint := getattr(joints, name))
    }
    unlimited = runs.robot.model_copy(update={"joints": joints.model_copy(update=free)})
    arms, bodies = [], []
    for pose in runs.poses[:200]:
        found = inverse(unlimited, forward(unlimited, pose))
        turned = np.abs(np.angle(np.exp(1j * (found[:, 0] - pose[0])))) > _ALIKE
        here = found[~turned]  # the waist as it was
        arms.append(_distinct(here[:, 1:4]) + _distinct(here[:, 4:7]))
        bodies.append(_distinct(found))
    return holds(False, set(arms) == {8}), (
        f"without limits each arm has {min(arms) // 2}, {min(arms)} in all; combined, they give "
        f"{int(np.median(bodies))} poses of the whole body, and up to {max(bodies)} with the waist "
        "turned by half a circle"
    )


@_claim(
    "“There should be only one solution for getting each extremity to a desired and accessible "
    "position.”"
)
def _one_solution(runs: Runs) -> Finding:
    several = float(np.mean([len(valid) > 1 for valid in runs.valid]))
    return holds(several == 0), (
        f"{several:.0%} of {len(runs.poses)} random targets have 2 to "
        f"{max(len(valid) for valid in runs.valid)} valid poses (a nearly straight arm can be "
        "mirrored at the elbow)"
    )


@_claim("Eq. 12 is “the Levenberg-Marquardt method”.")
def _levenberg_marquardt(runs: Runs) -> Finding:
    robot, rng = runs.robot, np.random.default_rng(1)
    bend = 0.0
    for pose in runs.poses:
        start = rng.uniform(robot.lower, robot.upper)
        error = forward(robot, start) - forward(robot, pose)
        gradient = 2 * jacobian(robot, start).T @ error
        step, _ = printed_step(gradient, 1.0)
        beside = step / np.linalg.norm(step) + gradient / np.linalg.norm(gradient)
        bend = max(bend, float(np.linalg.norm(beside)))
    return holds(bend > 1e-3), (
        f"apart from γI its matrix has rank one, so each of {len(runs.poses)} steps is a shortened "
        f"gradient step (its direction differs by {bend:.0g} rad at most)"
    )


@_claim(
    "“Always a solution with 0.015 radian precision within 1 second” with Table 2.",
    ours="γ and τ are absolute, so the unit of length counts; the paper names none",
)
def _promise(runs: Runs) -> Finding:
    settings = Settings.paper()
    shares = {unit: runs.promise(settings, unit) for unit in UNITS}
    return holds(min(shares.values()) == 1.0), (
        "share of targets solved to within 0.015 rad of the nearest valid pose: "
        + ", ".join(f"{share:.1%} in {unit}" for unit, share in shares.items())
    )


@_claim(
    "The same, with the Levenberg-Marquardt search of the paper's reference [9].",
    ours="centimetres or millimetres are the condition",
)
def _promise_of_reference_9(runs: Runs) -> Finding:
    settings = replace(Settings.paper(), local_search="residual")
    shares = {unit: runs.promise(settings, unit) for unit in UNITS}
    kept = shares["cm"] > 0.99 and shares["mm"] > 0.99
    return holds(False, kept), (
        ", ".join(f"{share:.1%} in {unit}" for unit, share in shares.items())
    )


@claim(
    KINEMATICS,
    "5",
    "“The inverse kinematic calculation by the Bacterial Memetic Algorithm was working within "
    "1 second of calculation.”",
    ours="on this computer, not on a phone",
)
def _within_a_second(runs: Runs) -> Finding:
    slowest = 1e3 * max(runs.printed_solver.solve_seconds)
    default = 1e3 * max(max(run.solve_seconds) for run in runs.experiments)
    return holds(max(slowest, default) < 1000), (
        f"with Table 2 as printed {slowest:.0f} ms at most, of "
        f"{len(runs.printed_solver.solutions)} solutions; the default, not an evolutionary "
        f"search, {default:.2g} ms"
    )


def _distinct(poses: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> int:
    """Return the number of different poses; angles that differ by a turn of 2π are the same."""
    kept: list[np.ndarray[tuple[int, ...], np.dtype[np.float64]]] = []
    for pose in poses:
        around = [np.abs(np.angle(np.exp(1j * (pose - other)))).max() for other in kept]
        if not around or min(around) > _ALIKE:
            kept.append(pose)
    return len(kept)
