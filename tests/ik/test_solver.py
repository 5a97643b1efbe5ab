import dataclasses
import json
import subprocess
import sys
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from tests.ik.robots import drawn_targets, random_robots, scaled

import miburi
from miburi import bma, ik
from miburi.errors import InputError
from miburi.ground import compiled
from miburi.robot import forward, inverse, iphonoid
from miburi.robot.geometry import arm_reach

ROBOT = iphonoid()
REACHED = ik.REACHED * arm_reach(ROBOT)
RESIDUAL = ik.residual_settings(ROBOT)

HARD = json.loads((Path(__file__).parent / "targets.json").read_text())


def random_poses(count, seed=0):
    return np.random.default_rng(seed).uniform(ROBOT.lower, ROBOT.upper, (count, 8))


class TestSolve:
    def test_reaches_random_targets_inside_the_limits(self):
        for target in forward(ROBOT, random_poses(200)):
            solution = ik.solve(ROBOT, target)
            assert solution.status == ik.CONVERGED
            miss = (forward(ROBOT, solution.angles) - target).reshape(3, 3)
            assert np.all(np.linalg.norm(miss, axis=1) <= 1e-4)
            assert np.allclose(np.linalg.norm(miss, axis=1), solution.error, atol=1e-12)
            assert np.all(solution.angles >= ROBOT.lower)
            assert np.all(solution.angles <= ROBOT.upper)

    @pytest.mark.parametrize(
        "bad",
        [
            np.full(9, np.nan), np.zeros(8), "left", [np.inf] * 9, np.full(9, 1e154),
            np.full(9, -1e10), np.zeros(9, complex), np.ma.masked_all(9), 0.0, np.zeros((1, 9)),
            [10**400] * 9, ["0.1"] * 9, np.zeros(9, "datetime64[s]"), [date(2026, 1, 1)] * 9,
        ],
        ids=lambda bad: str(bad)[:20],
    )  # fmt: skip
    def test_refuses_what_is_no_target(self, bad):
        with pytest.raises(InputError, match="target"):
            ik.solve(ROBOT, bad)
        with pytest.raises(InputError, match="targets"):
            ik.solve_batch(ROBOT, bad if np.ndim(bad) == 2 and np.shape(bad)[1] != 9 else [bad])

    @pytest.mark.parametrize("bad", ["iphonoid", None, "robot.toml"])
    def test_refuses_what_is_no_robot(self, bad):
        with pytest.raises(InputError, match="robot must be a Robot"):
            ik.solve(bad, np.zeros(9))

    def test_refuses_settings_that_are_only_named(self):
        with pytest.raises(InputError, match=r"settings must be .* got 'paper'"):
            ik.solve(ROBOT, np.zeros(9), settings="paper")

    @pytest.mark.parametrize(
        "bad", [np.full(8, np.nan), np.zeros(9), np.zeros((1, 8)), np.zeros(8, complex)]
    )
    def test_refuses_what_is_no_pose_to_start_from(self, bad):
        with pytest.raises(InputError, match="start"):
            ik.solve(ROBOT, np.zeros(9), start=bad)

    def test_starts_from_a_pose_a_little_outside_of_the_limits(self):
        target = forward(ROBOT, ROBOT.upper)
        solution = ik.solve(ROBOT, target, start=ROBOT.upper + 0.01)
        assert solution.residual <= 1e-4
        assert np.all(solution.angles <= ROBOT.upper)

    def test_takes_what_numpy_takes(self):
        target = forward(ROBOT, ROBOT.neutral)
        read_only = np.frombuffer(target.tobytes())
        expected = ik.solve(ROBOT, target).angles.tobytes()
        for same in (read_only, target.tolist(), tuple(target), np.repeat(target, 2)[::2],
                     target.astype(">f8")):  # fmt: skip
            assert ik.solve(ROBOT, same).angles.tobytes() == expected

    def test_does_not_write_into_what_is_given(self):
        target, start = forward(ROBOT, ROBOT.neutral), ROBOT.upper + 0.5
        before = target.copy(), start.copy()
        ik.solve(ROBOT, target, start=start)
        assert np.array_equal(target, before[0])
        assert np.array_equal(start, before[1])

    def test_with_a_hand_on_the_shoulder_axis_the_shoulder_stays_where_it_is(self):
        straight = ROBOT.neutral.copy()
        straight[1:4] = [2.0, 0.0, 0.0]
        solution = ik.solve(ROBOT, forward(ROBOT, straight), start=straight)
        assert np.allclose(solution.angles, straight, atol=1e-6)

    def test_another_robot_is_not_taken_for_the_last_one(self):
        longer = ROBOT.model_copy(
            update={"lengths": ROBOT.lengths.model_copy(update={"L34": 0.12})}
        )
        target = forward(longer, longer.neutral)
        assert ik.solve(ROBOT, target).status == ik.OUT_OF_REACH
        assert ik.solve(longer, target).status == ik.CONVERGED
        assert ik.solve(ROBOT, target).status == ik.OUT_OF_REACH


class TestHardTargets:
    def test_those_that_random_restarts_miss_are_solved(self):
        assert np.all(ik.solve_batch(ROBOT, HARD["hard_reachable"]).residual <= REACHED)
        for target in HARD["hard_reachable"][::5]:
            assert ik.solve(ROBOT, target, settings=RESIDUAL).residual <= REACHED

    def test_out_of_reach_it_is_the_constrained_optimum(self):
        """The optimum is that of the exact waist search, which shares no code with the solver."""
        optimum = np.array(HARD["optimum"])
        solutions = ik.solve_batch(ROBOT, HARD["out_of_reach"])
        excess = solutions.residual - optimum
        assert np.all(excess >= -1e-9)
        assert np.all(excess <= 1e-4)
        assert np.mean(excess <= 1e-6) >= 0.95
        assert {ik.OUT_OF_REACH} == {
            status for status, least in zip(solutions.status, optimum, strict=True) if least > 1e-3
        }
        assert np.all(solutions.angles >= ROBOT.lower)
        assert np.all(solutions.angles <= ROBOT.upper)


FAR = json.loads((Path(__file__).parent / "far_targets.json").read_text())


class TestOutOfReach:
    """The optimum in the file is that of the waist search, which shares no code with the solver."""

    @pytest.mark.parametrize("case", FAR["cases"], ids=lambda case: case["name"])
    def test_the_best_reachable_pose_is_found(self, case):
        found = ik.solve_batch(ROBOT, case["targets"])
        excess = (found.residual - case["optimum"]) / arm_reach(ROBOT)
        assert np.all(excess >= -1e-8)
        assert np.all(excess <= 1e-6)
        assert set(found.status) <= {ik.OUT_OF_REACH, ik.CONVERGED}

    def test_best_is_only_said_where_it_is_so(self):
        case = next(case for case in FAR["cases"] if case["name"] == "gross, all")
        found = {ik.solve(ROBOT, t, settings=RESIDUAL).status for t in case["targets"][:2]}
        assert ik.OUT_OF_REACH not in found
        assert ik.NEAR in found


class TestOtherRobots:
    def test_every_reachable_target_is_reached(self):
        missed = 0
        for number, robot in enumerate(random_robots(20, seed=1)):
            poses = drawn_targets(robot, 3000, seed=number)
            found = ik.solve_batch(robot, forward(robot, poses))
            missed += np.sum(found.residual > ik.REACHED * arm_reach(robot))
            assert np.all((found.angles >= robot.lower) & (found.angles <= robot.upper))
        assert missed == 0

    def test_the_present_pose_is_the_answer_for_its_own_target(self):
        """Also where the head is nodded over, so that the waist turned by π would do too."""
        for number, robot in enumerate(random_robots(20, seed=2)):
            for pose in drawn_targets(robot, 20, seed=number):
                solution = ik.solve(robot, forward(robot, pose), start=pose)
                assert np.allclose(solution.angles, pose, atol=1e-5)

    def test_of_several_poses_the_nearest_is_chosen(self):
        several = 0
        for number, robot in enumerate(random_robots(20, seed=3)):
            for pose in drawn_targets(robot, 10, seed=number):
                target = forward(robot, pose)
                poses = inverse(robot, target)
                several += len(poses) > 4
                present = poses[-1] + 0.01
                found = ik.solve(robot, target, start=present)
                distances = np.linalg.norm(
                    poses - np.clip(present, robot.lower, robot.upper), axis=1
                )
                nearest = np.linalg.norm(found.angles - np.clip(present, robot.lower, robot.upper))
                assert nearest <= distances.min() + 1e-3
        assert several > 20

    @pytest.mark.parametrize("factor", [0.01, 0.1, 100.0])
    def test_the_size_does_not_matter(self, factor):
        robot, poses = scaled(ROBOT, factor), random_poses(2000, seed=4)
        found = ik.solve_batch(robot, forward(robot, poses))
        assert np.all(found.residual <= ik.TOLERANCE * arm_reach(robot))
        same = ik.solve_batch(ROBOT, forward(ROBOT, poses))
        assert np.mean(np.abs(found.angles - same.angles) <= 1e-6) > 0.999


class TestPaper:
    SETTINGS = dataclasses.replace(bma.Settings.paper(), generations=2)

    def test_its_result_is_that_of_the_table(self):
        """The first targets of bench/ik/reproduction.md, as another, compiled code had them."""
        poses = np.random.default_rng(0).uniform(ROBOT.lower, ROBOT.upper, (1000, 8))[:3]
        found = [ik.solve(ROBOT, t, settings=bma.Settings.paper()) for t in forward(ROBOT, poses)]
        assert [one.evaluations for one in found] == [39610, 39444, 40573]
        assert [round(1e3 * one.error.max(), 4) for one in found] == [1.9796, 1.3128, 2.6835]
        assert {(one.generations, one.status) for one in found} == {(35, ik.BUDGET_SPENT)}

    @pytest.mark.parametrize(
        "settings",
        [
            dataclasses.replace(SETTINGS, segment=3, transferred=2, target=1e-12),
            dataclasses.replace(RESIDUAL, first_iterations=0, local_probability=0.3),
        ],
        ids=["segments", "from the population"],
    )
    def test_compiled_residuals_and_derivatives_are_those_of_the_kinematics(self, settings):
        """The searches part only by the rounding of differences."""
        for seed in range(3):
            target = forward(ROBOT, random_poses(1, seed=seed)[0])
            compiled = ik.solve(ROBOT, target, settings=settings, seed=seed)
            general = bma.minimize(
                lambda q, target=target: forward(ROBOT, q) - target,
                np.column_stack([ROBOT.lower, ROBOT.upper]),
                settings=settings,
                seed=seed,
            )
            assert compiled.generations == general.generations
            assert compiled.residual**2 == pytest.approx(general.value, rel=1e-3, abs=1e-11)


class TestDeadline:
    def test_the_best_so_far_is_returned(self):
        target = forward(ROBOT, random_poses(1)[0])
        solution = ik.solve(ROBOT, target, settings=bma.Settings.paper(), deadline=1e-9)
        assert solution.status == ik.DEADLINE
        assert solution.generations < 35
        assert np.all(solution.angles >= ROBOT.lower)
        assert np.all(solution.angles <= ROBOT.upper)

    def test_a_distant_one_changes_nothing(self):
        settings = dataclasses.replace(RESIDUAL, first_iterations=0)
        for target in HARD["hard_reachable"][:3]:
            with_deadline = ik.solve(ROBOT, target, settings=settings, seed=2, deadline=1e9)
            without = ik.solve(ROBOT, target, settings=settings, seed=2)
            assert with_deadline.angles.tobytes() == without.angles.tobytes()
            assert with_deadline.status == without.status
            assert with_deadline.evaluations == without.evaluations

    @pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, "x", 1j])
    def test_must_be_above_zero(self, bad):
        with pytest.raises(InputError, match="deadline"):
            ik.solve(ROBOT, np.zeros(9), deadline=bad)


class TestStartUp:
    def test_everything_is_compiled_once(self):
        """Importing does not load Numba; no call compiles another variant, whatever it is given."""
        code = """
import sys
import numpy as np
import miburi.bma, miburi.ik
assert "numba" not in sys.modules
from numba.core import event
from miburi import bma, ik
from miburi.robot import iphonoid
robot = iphonoid()
ik.solve(robot, np.ones(9))
paper = bma.Settings(generations=0, local_search="residual")
ik.solve(robot, np.ones(9), settings=paper)
with event.install_recorder("numba:compile") as compiled:
    for target in (np.frombuffer(np.ones(9).tobytes()), [1] * 9, np.ones((9, 2), order="F")[:, 0]):
        for options in ({}, {"start": target[:8]}, {"settings": paper}, {"seed": np.uint8(3)}):
            for deadline in (None, 0.1, 1):
                ik.solve(robot, target, deadline=deadline, **options)
        ik.solve_batch(robot, [target])
print(len(compiled.buffer))
"""
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        )
        assert done.stdout.strip() == "0"

    def test_without_a_writable_cache_it_says_what_to_do(self, monkeypatch):
        monkeypatch.setenv("NUMBA_CACHE_DIR", "/dev/null/no")
        monkeypatch.setattr(compiled, "CACHE", compiled.cache_folder(Path(miburi.__file__).parent))
        assert compiled.CACHE is None
        assert "NUMBA_CACHE_DIR" in compiled.announcement()


class TestBatch:
    def test_answers_as_one_by_one(self):
        targets = forward(ROBOT, random_poses(300, seed=2))
        targets[::10, 0] += 0.3
        together = ik.solve_batch(ROBOT, targets)
        assert len(together) == 300
        for i, target in enumerate(targets):
            alone = ik.solve(ROBOT, target)
            assert alone.angles.tobytes() == together[i].angles.tobytes()
            assert (alone.status, alone.evaluations) == (
                together[i].status,
                together[i].evaluations,
            )

    @pytest.mark.parametrize("nothing", [np.empty((0, 9)), [], ()], ids=str)
    def test_of_nothing_is_nothing(self, nothing):
        assert len(ik.solve_batch(ROBOT, nothing)) == 0
