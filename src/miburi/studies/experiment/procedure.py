"""Section 5 of the paper: happiness at a mood of 0.9, a gesture each 2 s, a hand in the way.

A human hand blocks an arm now and then. The paper's claim, measured here on the physical body:
movement stops when, and only when, it is blocked; each encounter lowers the mood by 20 %; the
gestures after it are smaller and slower.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from time import perf_counter

import numpy as np

from miburi import ik
from miburi.bodies import Body, BodyState, Touch, Touchable
from miburi.errors import InputError
from miburi.feelings import FEELINGS, EmotionalModel, Expression
from miburi.gestures import Repertoire
from miburi.live.recording import Recorder, step_messages
from miburi.partner import Event, GestureEnded, GestureStarted, Partner, Stopped
from miburi.robot import Array, Robot, forward
from miburi.studies.experiment.visitor import Visitor
from miburi.version import __version__

__all__ = [
    "FEELING",
    "MOOD",
    "PATIENCE",
    "PERIOD",
    "STEP",
    "STEPS_PER_FRAME",
    "Experiment",
    "Frame",
    "GestureRecord",
    "StopRecord",
    "conduct",
]

#: The loop's period in s; the encoders are read twice in it.
STEP = 0.02
#: The experiment of Section 5.
FEELING, MOOD, PERIOD = "happiness", 0.9, 2.0
#: A contact that no stop follows within this many seconds is missed (ours).
PATIENCE = 0.3
#: A film shows every third step: about 17 pictures a second.
STEPS_PER_FRAME = 3


@dataclass(frozen=True)
class StopRecord:
    """A stop: s, what the motors said, what the simulation knows (N), and the moods."""

    time: float
    motor: str | None
    sign: str | None
    ratio: float | None
    contact_time: float | None
    latency: float | None
    peak_force: float
    mood_before: float
    mood_after: float


@dataclass(frozen=True)
class GestureRecord:
    """A gesture as performed.

    ``extent``: the larger hand's largest distance from where the gesture began, m;
    ``mean_speed``: path length of both hands over 2 × duration, m/s; ``complete``: not broken off.
    """

    start: float
    end: float
    feeling: str
    mood: float
    extent: float
    mean_speed: float
    complete: bool


@dataclass
class Frame:
    """One picture of the film: true angles (8,), the hand's pose (7,), and what is written in."""

    time: float
    angles: Array
    hand: Array
    feeling: str
    mood: float
    phase: str


@dataclass
class Experiment:
    """What was measured; ``report`` is reproducible from the seed, ``timing`` is not."""

    seed: int
    stops: list[StopRecord] = field(default_factory=list)
    missed: list[dict[str, float]] = field(default_factory=list)
    gestures: list[GestureRecord] = field(default_factory=list)
    solutions: list[ik.Solution] = field(default_factory=list)
    solve_seconds: list[float] = field(default_factory=list)
    wall_seconds: float = 0.0
    times: list[float] = field(default_factory=list)
    moods: list[float] = field(default_factory=list)
    hands: list[Array] = field(default_factory=list)
    frames: list[Frame] = field(default_factory=list)
    self_collisions: int = 0

    @property
    def false_stops(self) -> int:
        """Stops without a hand on the robot in the ``PATIENCE`` before them."""
        return sum(stop.contact_time is None for stop in self.stops)

    def report(self) -> dict[str, object]:
        """Return ``experiment.json``: the same seed gives the same bytes."""
        errors = [float(solution.error.max()) for solution in self.solutions]
        return {
            "version": __version__,
            "seed": self.seed,
            "seconds": round(self.times[-1], 3),
            "stops": [_rounded(asdict(stop)) for stop in self.stops],
            "false_stops": self.false_stops,
            "missed_contacts": self.missed,
            "self_collisions": self.self_collisions,
            "gestures": [_rounded(asdict(gesture)) for gesture in self.gestures],
            "ik": {
                "solves": len(self.solutions),
                "evaluations": sum(solution.evaluations for solution in self.solutions),
                "max_error_m": round(max(errors, default=0.0), 9),
            },
        }

    def timing(self) -> dict[str, float]:
        """Return ``timing.json``: figures by the clock on the wall."""
        milliseconds = np.array(self.solve_seconds or [0.0]) * 1e3
        return {
            "ik_median_ms": round(float(np.median(milliseconds)), 4),
            "ik_max_ms": round(float(milliseconds.max()), 4),
            "real_time_factor": round(self.times[-1] / self.wall_seconds, 2),
        }


def conduct(
    body: Body,
    seed: int,
    seconds: float,
    *,
    repertoire: Repertoire | None = None,
    hand: bool = True,
    recorder: Recorder | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Experiment:
    """Conduct the paper's experiment in simulation.

    Parameters
    ----------
    body
        What is moved, at neutral.
    seed
        0 or more; chooses which arm is blocked, when, and where.
    seconds
        Length in the robot's time; at least one period of 2 s.
    repertoire
        The gestures; by default those that ship with Miburi.
    hand
        Whether a hand gets in the way at all.
    recorder
        Takes states, feelings, commands and contacts as they happen.
    progress
        Called with the robot's time after each step.

    Raises
    ------
    InputError
        The seed is negative, the length is not finite or too short, or the body is no simulation.
    """
    if seed < 0:
        raise InputError(f"the seed must be 0 or more, got {seed}.")
    if not (np.isfinite(seconds) and PERIOD <= seconds <= 86_400):
        raise InputError(f"the length must be from {PERIOD:g} to 86400 s, got {seconds:g}.")
    robot = body.robot
    result = Experiment(seed)

    def timed_solve(robot: Robot, target: Array, start: Array) -> ik.Solution:
        began = perf_counter()
        solution = ik.solve(robot, target, start=start)
        result.solve_seconds.append(perf_counter() - began)
        result.solutions.append(solution)
        return solution

    touchable = body.touchable
    if touchable is None:
        raise InputError(
            "the experiment needs a body in whose way a hand can be put, and this one is no "
            "simulation: take the simulated body or an emulated card."
        )
    feelings = EmotionalModel()
    feelings.set_state(emotion={FEELING: 1.0}, mood={FEELING: MOOD}, hold=True)
    partner = Partner(body, feelings, repertoire=repertoire, period=PERIOD, solve=timed_solve)
    visitor = Visitor(robot, touchable, np.random.default_rng(seed)) if hand else None
    # The first call compiles or loads the kernel: not part of what is timed.
    ik.solve(robot, forward(robot, robot.neutral), start=robot.neutral)
    observer = _Observer(result, robot)
    began = perf_counter()
    for index in range(round(seconds / STEP)):
        events = partner.step(STEP)
        if visitor is not None:
            visitor.step(body.state.angles, events, STEP)
        observer.observe(body.state, touchable, events, feelings)
        if recorder is not None:
            felt = feelings if index % 5 == 0 else None
            recorder.write(step_messages(body.state, felt, events))
        progress(body.state.time)
    result.wall_seconds = perf_counter() - began
    observer.finish()
    return result


class _Observer:
    """Fills an :class:`Experiment` from what happens."""

    def __init__(self, result: Experiment, robot: Robot) -> None:
        self._result = result
        self._robot = robot
        self._touched: float | None = None  # when the present contact began
        self._last_touch = -np.inf
        self._peak = 0.0
        self._stopped = False  # whether a stop answered the present contact
        self._gesture: tuple[float, Expression] | None = None
        self._began_at = 0

    def observe(
        self, state: BodyState, body: Touchable, events: list[Event], feelings: EmotionalModel
    ) -> None:
        result, touch = self._result, body.touch
        shown = feelings.express()
        feeling = shown.feeling if shown else ""
        mood = float(feelings.mood[FEELINGS.index(feeling)]) if shown else 0.0
        angles, hand = body.configuration
        if len(result.times) % STEPS_PER_FRAME == 0:
            result.frames.append(Frame(state.time, angles, hand, feeling, mood, state.phase.value))
        result.times.append(state.time)
        result.moods.append(mood)
        result.hands.append(forward(self._robot, state.angles)[:6])
        result.self_collisions += touch.itself is not None
        self._contacts(touch, state)
        for event in events:
            match event:
                case GestureStarted(time, expression):
                    self._gesture, self._began_at = (time, expression), len(result.hands) - 1
                case GestureEnded(time, _, complete):
                    self._end_gesture(time, complete)
                case Stopped():
                    self._stop(event)
                case _:
                    pass

    def finish(self) -> None:
        """Judge the last contact, unless the run ended before a stop was due."""
        if self._touched is not None and self._result.times[-1] - self._touched > PATIENCE:
            self._end_contact()

    def _contacts(self, touch: Touch, state: BodyState) -> None:
        if touch.began is not None:
            if self._touched is None:
                self._touched, self._peak = touch.began, 0.0
                # A hand that brushes a stopped arm on its way out asks for no other stop.
                self._stopped = state.stop is not None and state.stop.time < touch.began
            self._peak, self._last_touch = max(self._peak, touch.force), state.time
        elif self._touched is not None and state.time - self._last_touch > PATIENCE:
            self._end_contact()

    def _end_contact(self) -> None:
        if self._touched is not None and not self._stopped:
            self._result.missed.append(
                {"time": round(self._touched, 4), "peak_force": round(self._peak, 3)}
            )
        self._touched = None

    def _stop(self, event: Stopped) -> None:
        stop, touched = event.stop, self._touched
        self._stopped = touched is not None
        self._result.stops.append(
            StopRecord(
                time=stop.time,
                motor=stop.motor,
                sign=stop.sign,
                ratio=stop.ratio,
                contact_time=touched,
                latency=None if touched is None else stop.time - touched,
                peak_force=self._peak if touched is not None else 0.0,
                mood_before=event.mood_before,
                mood_after=event.mood_after,
            )
        )

    def _end_gesture(self, time: float, complete: bool) -> None:
        if self._gesture is None:
            return
        start, expression = self._gesture
        path = np.array(self._result.hands[self._began_at :]).reshape(-1, 2, 3)
        extent = np.linalg.norm(path - path[0], axis=2).max()
        length = np.linalg.norm(np.diff(path, axis=0), axis=2).sum()
        self._result.gestures.append(
            GestureRecord(
                start=start,
                end=time,
                feeling=expression.feeling,
                mood=expression.mood,
                extent=float(extent),
                mean_speed=float(length / (2 * max(time - start, STEP))),
                complete=complete,
            )
        )
        self._gesture = None


def _rounded(values: dict[str, object]) -> dict[str, object]:
    return {
        key: round(value, 6) if isinstance(value, float) else value for key, value in values.items()
    }
