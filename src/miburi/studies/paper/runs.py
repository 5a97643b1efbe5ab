"""The runs for the page docs/paper.md; each is performed when a claim first needs it."""

from collections import Counter
from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

import numpy as np

from miburi import ik
from miburi.bma.settings import Settings
from miburi.bodies.simulated import READING, Simulated
from miburi.emulation.body import EmulatedBody
from miburi.emulation.firmware import is_built
from miburi.emulation.packets import SYNC_READ, packets
from miburi.errors import MiburiError
from miburi.feelings import FEELINGS
from miburi.gestures import key_poses, load
from miburi.ground.cores import available_cores
from miburi.robot import Array, Robot, forward, inverse
from miburi.robot.geometry import shoulders
from miburi.safety.free import FreeRule
from miburi.safety.move import Move, plan_move
from miburi.safety.stop import Phase, Stop
from miburi.studies import experiment
from miburi.studies.experiment.visitor import in_the_way
from miburi.studies.gestures.check import Measured, perform
from miburi.studies.trials.plan import Plan, Subject
from miburi.studies.trials.runs import carry_out_plan
from miburi.studies.trials.trial import Outcome

#: The moods for measuring gestures, and for examining their moves.
MOODS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
_PLAIN_MOODS = (0.3, 0.6, 0.9)
#: Units of length, and how many of each make a metre.
UNITS = {"m": 1.0, "cm": 100.0, "mm": 1000.0}
#: The precision that Section 3 promises for the inverse kinematics, in rad.
_PROMISE = 0.015
#: How long, in s, a blocked body may take to stop, and how long it is watched afterwards.
_PATIENCE, _WATCHED = 1.5, 1.0
#: A move that raises both arms to the front: its angle in rad, its duration in s, and the share of
#: the move after which a hand blocks the right arm.
_RAISED, _SECONDS, _SHARE = 1.4, 0.8, 0.6
#: The addresses at which a card may start to read the servos' positions.
_PLACES = range(120, 136)


class Blocked(NamedTuple):
    """How a body reacted to a hand in its way, and whether the stopped body refused a move.

    ``speeds``, shape (n, 8), in rad/s, are the motors' speeds at ``times``, shape (n,), in s after
    the stop.
    """

    stop: Stop | None
    refused: bool
    times: Array
    speeds: Array


class OnCard(NamedTuple):
    """What an emulated Arduino card did after its host went silent.

    ``silence`` is the time from the host's last message to the stop, in s, and ``gaps`` are the
    times between two readings of the servos' positions, in s.
    """

    stop: Stop | None
    silence: float
    gaps: Array


class Runs:
    """The runs behind the page, each performed once; ``progress`` gets their names.

    There are ``targets`` random targets for the inverse kinematics, ``seeds`` experiments, and
    ``trials`` contact trials with somebody in the way and as many without.
    """

    def __init__(
        self,
        robot: Robot,
        progress: Callable[[str], None] = lambda _: None,
        targets: int = 1000,
        seeds: int = 5,
        trials: int = 1000,
    ) -> None:
        self.robot, self.targets, self.seeds, self.trials = robot, targets, seeds, trials
        self._progress = progress

    @cached_property
    def experiments(self) -> list[experiment.Experiment]:
        """The experiment of Section 5 for each seed; in the first run, the mood also recovers."""
        return [
            self._conduct(f"experiment, seed {seed}", experiment.Setup(seed=seed, heal=seed == 1))
            for seed in range(1, self.seeds + 1)
        ]

    @cached_property
    def undisturbed(self) -> dict[str, experiment.Experiment]:
        """The experiment of Section 5 for each feeling, without contacts."""
        return {
            feeling: self._conduct(
                f"experiment with {feeling}",
                experiment.Setup(feeling=feeling, seconds=8.0, hand=False),
            )
            for feeling in FEELINGS
        }

    @cached_property
    def printed_solver(self) -> experiment.Experiment:
        """Section 5 with the inverse kinematics as printed."""
        setup = experiment.Setup(settings=Settings.paper())
        return self._conduct("experiment, Table 2 as printed", setup)

    def _conduct(self, what: str, setup: experiment.Setup) -> experiment.Experiment:
        self._progress(what)
        return experiment.conduct(Simulated(self.robot), setup)

    @cached_property
    def outcomes(self) -> list[Outcome]:
        """Contact trials, as in docs/safety.md: half of them with nobody in the way."""
        self._progress(f"{2 * self.trials} contact trials")
        subject = Subject(self.robot, FreeRule.of(self.robot))
        plan = Plan((subject,), seed=1, free=self.trials, blocked=self.trials)
        return carry_out_plan(plan, workers=available_cores() if self.trials > 100 else 1)

    @cached_property
    def gestures(self) -> dict[str, list[Measured]]:
        """Each gesture at each of ``MOODS``."""
        found = {}
        for feeling in FEELINGS:
            self._progress(f"gesture of {feeling}")
            found[feeling] = [perform(self.robot, load(feeling), mood) for mood in MOODS]
        return found

    @cached_property
    def moves(self) -> list[tuple[Array, Move]]:
        """The gestures' moves at moods of 0.3, 0.6 and 0.9, each with its first pose."""
        found = []
        for feeling in FEELINGS:
            for mood in _PLAIN_MOODS:
                present = self.robot.neutral
                for pose in key_poses(self.robot, load(feeling), mood):
                    angles = ik.solve(self.robot, pose.target, start=present).angles
                    if np.abs(angles - present).max() > self.robot.servo.step:
                        move = plan_move(self.robot, present, angles, pose.duration)
                        found.append((present, move))
                    present = angles
        return found

    @cached_property
    def poses(self) -> Array:
        """Random poses inside the limits, shape (n, 8), in rad."""
        rng = np.random.default_rng(0)  # as in bench/ik
        return rng.uniform(self.robot.lower, self.robot.upper, (self.targets, 8))

    @cached_property
    def valid(self) -> list[Array]:
        """For each random pose, all poses with hands and head in the same positions."""
        self._progress("all solutions of random targets")
        return [inverse(self.robot, forward(self.robot, pose)) for pose in self.poses]

    @property
    def _raise(self) -> Move:
        """A move from neutral that raises both arms to the front."""
        raised = self.robot.neutral.copy()
        raised[[1, 4]] += _RAISED
        return plan_move(self.robot, self.robot.neutral, raised, _SECONDS)

    @cached_property
    def moving(self) -> Blocked:
        """A body that raises both arms, with a hand in the way of its right arm."""
        body = Simulated(self.robot)
        _block(body, self.robot.neutral, self._raise.angles)
        body.move(self._raise)
        return _watch(body, Phase.MOVING)

    @cached_property
    def returning(self) -> Blocked:
        """A body on its way back to neutral after a stop, with a hand in its way."""
        body = Simulated(self.robot)
        body.move(self._raise)
        while body.state.phase is Phase.MOVING:
            body.step(READING)
        body.stop()
        body.step(1.0)
        _block(body, body.state.angles, self.robot.neutral)
        body.release()
        return _watch(body, Phase.RETURNING)

    @cached_property
    def resting(self) -> Blocked:
        """A body at rest, with a hand that pushes its right arm forward."""
        body, hand = Simulated(self.robot), forward(self.robot, self.robot.neutral)[:3]
        for step in range(round(_PATIENCE / READING)):
            push = min(0.05 * step * READING, 0.06)  # m, at 0.05 m/s
            body.place_hand(hand + np.array([push - 0.03, 0.0, 0.01]), np.array([0.0, 1.0, 0.0]))
            body.step(READING)
            if body.state.phase is Phase.STOPPED:
                break
        return _stopped(body)

    @cached_property
    def on_card(self) -> OnCard | None:
        """A blocked move on the emulated card; the host sends the move, and nothing after it."""
        if not is_built():
            return None
        self._progress("the emulated card")
        body = EmulatedBody(self.robot)
        readings = _readings(body)
        try:
            _block(body, self.robot.neutral, self._raise.angles)
            body.move(self._raise)
            told = body.emulation.now()
            body.emulation.wait(told + _PATIENCE)  # the host neither speaks nor listens
            stop = body.step(READING).stop
            silence = 1e-6 * body.report.stop_time - told
        finally:
            body.close()
        return OnCard(stop, silence, np.diff(readings))

    def met(self) -> Counter[str]:
        """Count the kinds of link that first hit 20 random obstacles in each move's way."""
        self._progress("obstacles")
        rng = np.random.default_rng(0)
        counts = Counter[str]()
        for start, move in self.moves:
            ways = start + np.linspace(0.0, 1.0, 40)[:, None] * (move.angles - start)
            corners = forward(self.robot, ways).reshape(-1, 3)
            low, high = corners.min(axis=0) - 0.05, corners.max(axis=0) + 0.05
            gaps = _gaps(self.robot, ways, rng.uniform(low, high, (20 * _OBSTACLES, 3)))
            touched = gaps < _SKIN  # (time, link, obstacle)
            new = np.flatnonzero(touched.any(axis=(0, 1)) & ~touched[0].any(axis=0))[:_OBSTACLES]
            for obstacle in new:
                first = touched[:, :, obstacle].any(axis=1).argmax()
                counts[_LINKS[int(gaps[first, :, obstacle].argmin())]] += 1
        return counts

    def promise(self, settings: Settings, unit: str) -> float:
        """Return the share of random targets solved by a pose within 0.015 rad of a valid pose."""
        self._progress(f"inverse kinematics, {settings.local_search}, {unit}")
        factor, size = UNITS[unit], self.robot.lengths
        scaled = {name: factor * getattr(size, name) for name in type(size).model_fields}
        robot = self.robot.model_copy(update={"lengths": size.model_copy(update=scaled)})
        met = 0
        for pose, valid in zip(self.poses, self.valid, strict=True):
            found = ik.solve(robot, forward(robot, pose), settings=settings).angles
            known = np.vstack([valid, pose])
            met += np.abs(known - found).max(axis=1).min() <= _PROMISE
        return met / len(self.poses)


#: The links in the order of :func:`_gaps`, and the distance, in m, below which a link counts as
#: touching an obstacle: half an arm's width plus half a finger's (our choice).
_LINKS = ("upper_arm", "forearm", "upper_arm", "forearm", "phone")
_SKIN = 0.02
_OBSTACLES = 20


def _gaps(robot: Robot, ways: Array, obstacles: Array) -> Array:
    """Return the distances, in m, of k obstacles from the five links in n poses, (n, 5, k)."""
    size = robot.lengths
    short = robot.model_copy(update={"lengths": size.model_copy(update={"L34": 1e-9})})
    ends, bends = forward(robot, ways), forward(short, ways)
    gaps = []
    for arm in (0, 1):
        hand, bend = ends[:, 3 * arm : 3 * arm + 3], bends[:, 3 * arm : 3 * arm + 3]
        turn = np.array([_turned(shoulders(robot)[arm], angle) for angle in ways[:, 0]])
        gaps += [_from_line(turn, bend, obstacles), _from_line(bend, hand, obstacles)]
    middle = ends[:, 6:9]
    gaps.append(np.linalg.norm(middle[:, None] - obstacles, axis=2) - 0.03)
    return np.stack(gaps, axis=1)


def _turned(place: Array, angle: float) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([cos * place[0] - sin * place[1], sin * place[0] + cos * place[1], place[2]])


def _from_line(start: Array, end: Array, points: Array) -> Array:
    """Return the distances, (n, m), of m points from n lines, each from ``start`` to ``end``."""
    way = end - start
    from_start = points - start[:, None]
    length = np.maximum((way**2).sum(axis=1), 1e-12)[:, None]
    share = np.einsum("nmk,nk->nm", from_start, way) / length
    nearest = start[:, None] + np.clip(share, 0.0, 1.0)[..., None] * way[:, None]
    gaps: Array = np.linalg.norm(points - nearest, axis=2)
    return gaps


def _readings(body: EmulatedBody) -> list[float]:
    """Return a list that collects when, in s, the card reads the servos' positions."""
    heard: list[float] = []

    def hear(data: bytes) -> bytes:
        for _, instruction, parameters in packets(data)[0]:
            register = int.from_bytes(parameters[:2], "little")
            if instruction == SYNC_READ and register in _PLACES:
                heard.append(body.emulation.now())
        return data

    body.emulation.bus.spoil = hear
    return heard


def _block(body: Simulated | EmulatedBody, start: Array, end: Array) -> None:
    body.place_hand(*in_the_way(body.robot, start, end, 0, _SHARE, 0.9))


def _watch(body: Simulated, phase: Phase) -> Blocked:
    """Run a blocked body until it stops, and watch it after that."""
    for _ in range(round(_PATIENCE / READING)):
        body.step(READING)
        if body.state.phase is not phase:
            break
    return _stopped(body)


def _stopped(body: Simulated) -> Blocked:
    """Watch a body after its stop, and see whether it refuses a move."""
    stop, refused = body.state.stop, False
    if stop is None:
        return Blocked(None, False, np.zeros(0), np.zeros((0, 8)))
    times, speeds = [], []
    before = body.configuration[0]
    for _ in range(round(_WATCHED / READING)):
        body.step(READING)
        now = body.configuration[0]
        times.append(body.state.time - stop.time)
        speeds.append((now - before) / READING)
        before = now
    try:
        body.move(plan_move(body.robot, body.state.angles, body.robot.neutral, 1.0))
    except MiburiError:
        refused = True
    return Blocked(stop, refused, np.array(times), np.array(speeds))
