"""Conduct the experiment of Section 5: happiness at a mood of 0.9, and a hand in the way.

:func:`conduct` takes a simulated body and a setup and returns an :class:`Experiment` with every
stop and gesture. The robot makes a gesture every 2 s, and a human hand blocks an arm now and then.
The paper claims that the robot stops when, and only when, it is blocked; that each encounter lowers
the mood by 20 %; and that the gestures after it are smaller and slower. The loss "will be able to
be erased within some time, at the same rhythm as the mood value" (Section 4). To show this
recovery, the feelings can continue after the gestures, beside the feelings of a control that nobody
touched.
"""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from time import perf_counter

import numpy as np

from miburi import ik
from miburi.bodies import Body, BodyState, Touch, Touchable
from miburi.errors import InputError
from miburi.feelings import FEELINGS, Expression, FeelingModel
from miburi.live.recording.recorder import Recorder, step_messages
from miburi.partner import Event, GestureEnded, GestureStarted, Partner, Stopped
from miburi.robot import EXTREMITIES, JOINTS, Array, Robot, forward
from miburi.safety.contact import Window
from miburi.safety.profile import FINE, SECOND
from miburi.safety.stop import Stop
from miburi.studies.experiment.records import (
    FilmFrame,
    GestureRecord,
    Healing,
    StopRecord,
    WindowRecord,
)
from miburi.studies.experiment.setup import Setup
from miburi.studies.experiment.visitor import Visitor
from miburi.version import __version__

#: The loop's period, in s; the encoders are read twice in it.
STEP = 0.02
#: A contact that no stop follows within this time, in s, counts as missed (our choice).
PATIENCE = 0.3
#: For the motor that caused a stop, the figure shows this much time before the stop, in s (our
#: choice).
_APPROACH = 0.4
#: The mood is watched for this many of its time constants while it heals, at this many moments (our
#: choice).
_HEALING, _MOMENTS = 2.0, 9
#: A film shows every third step: about 17 pictures a second.
STEPS_PER_FRAME = 3


@dataclass
class Experiment:
    """The measurements of a run; the seed reproduces ``report``, but not ``timing``."""

    setup: Setup
    servo: str
    stops: list[StopRecord] = field(default_factory=list)
    missed: list[dict[str, float]] = field(default_factory=list)
    gestures: list[GestureRecord] = field(default_factory=list)
    solutions: list[ik.Solution] = field(default_factory=list)
    solve_seconds: list[float] = field(default_factory=list)
    wall_seconds: float = 0.0
    times: list[float] = field(default_factory=list)
    moods: list[float] = field(default_factory=list)
    hands: list[Array] = field(default_factory=list)
    frames: list[FilmFrame] = field(default_factory=list)
    approaches: list[list[WindowRecord]] = field(default_factory=list)  # to each stop
    healing: Healing | None = None
    self_collisions: int = 0

    @property
    def too_long(self) -> list[GestureRecord]:
        """The gestures that did not fit into a period."""
        period = self.setup.period
        return [g for g in self.gestures if g.complete and g.end - g.start > period]

    @property
    def false_stops(self) -> int:
        """The number of stops without a hand on the robot in the ``PATIENCE`` s before."""
        return sum(stop.contact_time is None for stop in self.stops)

    def report(self) -> dict[str, object]:
        """Return the content of ``experiment.json``: the same seed gives the same bytes."""
        errors = np.array([solution.error for solution in self.solutions]).reshape(-1, 3)
        set_to = self.setup
        return {
            "version": __version__,
            "seed": set_to.seed,
            "servo": self.servo,
            "seconds": round(self.times[-1], 3),
            "feeling": set_to.feeling,
            "mood": set_to.mood,
            "period": set_to.period,
            "temperament": set_to.temperament.name,
            "emotional_model": set_to.model.kind,
            "hand": set_to.hand,
            **set_to.chosen,
            "stops": [_round(asdict(stop)) for stop in self.stops],
            "false_stops": self.false_stops,
            "missed_contacts": self.missed,
            "self_collisions": self.self_collisions,
            "gestures": [_round(asdict(gesture)) for gesture in self.gestures],
            "too_long_for_the_period": len(self.too_long),
            "healing": None if self.healing is None else asdict(self.healing),
            "ik": {
                "solves": len(errors),
                "evaluations": sum(s.evaluations for s in self.solutions),
                "generations": sum(s.generations for s in self.solutions),
                "not_converged": sum(s.status != ik.CONVERGED for s in self.solutions),
                "max_error_m": round(float(errors.max(initial=0.0)), 9),
                "error_m": {
                    name: {
                        "median": round(float(np.median(column)), 9) if len(column) else 0.0,
                        "max": round(float(column.max(initial=0.0)), 9),
                    }
                    for name, column in zip(EXTREMITIES, errors.T, strict=True)
                },
            },
        }

    def timing(self) -> dict[str, float]:
        """Return the content of ``timing.json``, by the wall clock."""
        milliseconds = np.array(self.solve_seconds or [0.0]) * 1e3
        return {
            "ik_median_ms": round(float(np.median(milliseconds)), 4),
            "ik_max_ms": round(float(milliseconds.max()), 4),
            "real_time_factor": round(self.times[-1] / self.wall_seconds, 2),
        }


def conduct(
    body: Body,
    setup: Setup,
    *,
    recorder: Recorder | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Experiment:
    """Conduct an experiment in simulation; ``body`` must be at neutral.

    ``recorder`` gets states, feelings, commands and contacts as they happen; ``progress`` is called
    with the robot's time after each step.

    Raises InputError if the body is not a simulation.
    """
    robot = body.robot
    result = Experiment(setup, robot.servo.model.name)

    def timed_solve(robot: Robot, target: Array, start: Array) -> ik.Solution:
        began = perf_counter()
        solution = ik.solve(robot, target, start=start, settings=setup.settings)
        result.solve_seconds.append(perf_counter() - began)
        result.solutions.append(solution)
        return solution

    touchable = body.touchable
    if touchable is None:
        raise InputError(
            "the experiment puts a hand in the robot's way, and this body is not a simulation: use "
            "the simulated body or an emulated card."
        )
    feelings = setup.feelings()
    partner = Partner(
        body,
        feelings,
        repertoire=setup.repertoire,
        period=setup.period,
        solve=timed_solve,
        choices=setup.seed,
    )
    visitor = Visitor(robot, touchable, np.random.default_rng(setup.seed)) if setup.hand else None
    # The first call, which compiles or loads the kernel, is not timed.
    ik.solve(robot, forward(robot, robot.neutral), start=robot.neutral, settings=setup.settings)
    observer = _Observer(result, robot)
    began = perf_counter()
    for index in range(round(setup.seconds / STEP)):
        events = partner.step(STEP)
        if visitor is not None:
            visitor.step(body.state.angles, events, STEP)
        observer.observe(body, touchable, events, feelings)
        if recorder is not None:
            felt = feelings if index % 5 == 0 else None
            touch, met = touchable.touch, observer.met(events, touchable.touch)
            recorder.write(step_messages(body.state, felt, events, touch=touch, met=met))
        progress(body.state.time)
    result.wall_seconds = perf_counter() - began
    observer.finish()
    if setup.heal:
        result.healing = _heal(setup, feelings)
    return result


def _heal(setup: Setup, feelings: FeelingModel) -> Healing:
    """Continue the feelings without stimuli, and beside them an untouched control of equal age."""
    which = FEELINGS.index(setup.feeling)
    twin = setup.feelings()
    twin.step(feelings.time)
    constant = float(setup.temperament.fading[2, which])
    times = np.linspace(0.0, _HEALING * constant, _MOMENTS)
    moods = []
    for dt in np.diff(times, prepend=0.0):
        feelings.step(float(dt))
        twin.step(float(dt))
        moods.append([round(float(model.mood[which]), 6) for model in (feelings, twin)])
    touched, untouched = (list(column) for column in zip(*moods, strict=True))
    return Healing(constant, times.tolist(), touched, untouched)


class _Observer:
    """Fill an :class:`Experiment` from states, touches and events."""

    def __init__(self, result: Experiment, robot: Robot) -> None:
        self._result, self._robot = result, robot
        self._touched: float | None = None  # when the present contact began
        self._last_touch = -np.inf
        self._peak = 0.0
        self._stopped = False  # whether a stop answered the present contact
        self._gesture: tuple[float, Expression, str | None] | None = None
        self._began_at = 0
        self._windows = deque[tuple[float, Window]](maxlen=round(_APPROACH / STEP))

    def observe(
        self, whole: Body, body: Touchable, events: list[Event], feelings: FeelingModel
    ) -> None:
        result, touch, state = self._result, body.touch, whole.state
        shown = feelings.express()
        feeling = shown.feeling if shown else ""
        mood = float(feelings.mood[FEELINGS.index(feeling)]) if shown else 0.0
        angles, hand = body.configuration
        if len(result.times) % STEPS_PER_FRAME == 0:
            result.frames.append(
                FilmFrame(state.time, angles, hand, feeling, mood, state.phase.value)
            )
        result.times.append(state.time)
        result.moods.append(mood)
        result.hands.append(forward(self._robot, state.angles)[:6])
        result.self_collisions += touch.itself is not None
        if whole.window is not None:
            self._windows.append((state.time, whole.window))
        self._contacts(touch, state)
        for event in events:
            match event:
                case GestureStarted(time, Expression() as expression, gesture):
                    self._gesture = time, expression, gesture
                    self._began_at = len(result.hands) - 1
                case GestureEnded(time, _, complete):
                    self._end_gesture(time, complete)
                case Stopped():
                    self._stop(event)

    def met(self, events: list[Event], touch: Touch) -> Touch | None:
        """Return the largest force and the touched part if the body stopped in this step."""
        stopped = any(isinstance(event, Stopped) for event in events)
        return Touch(self._result.stops[-1].peak_force, part=touch.part) if stopped else None

    def _approach(self, stop: Stop) -> Iterator[WindowRecord]:
        """Yield the contact rule's latest windows for the motor that caused a stop."""
        if stop.motor is None:
            return
        i, step = JOINTS.index(stop.motor), self._robot.servo.step / FINE
        for time, window in self._windows:
            if window.judged[i] and window.expected[i] > 0 and time > stop.time - _APPROACH:
                speed = step * SECOND / float(window.length[i])
                yield WindowRecord(
                    time,
                    float(window.measured[i]) * speed,
                    float(window.expected[i]) * speed,
                    float(window.granted[i]) / float(window.expected[i]),
                )

    def finish(self) -> None:
        """Count the last contact, unless the run ended within ``PATIENCE`` s of its beginning."""
        if self._touched is not None and self._result.times[-1] - self._touched > PATIENCE:
            self._end_contact()

    def _contacts(self, touch: Touch, state: BodyState) -> None:
        if touch.began is not None:
            if self._touched is None:
                self._touched, self._peak = touch.began, 0.0
                # A hand that brushes a stopped arm as it withdraws needs no further stop.
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
        self._result.approaches.append(list(self._approach(stop)))
        self._windows.clear()
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
        start, expression, gesture = self._gesture
        path = np.array(self._result.hands[self._began_at :]).reshape(-1, 2, 3)
        extent = np.linalg.norm(path - path[0], axis=2).max()
        length = np.linalg.norm(np.diff(path, axis=0), axis=2).sum()
        self._result.gestures.append(
            GestureRecord(
                start=start,
                end=time,
                feeling=expression.feeling,
                gesture=gesture,
                mood=expression.mood,
                extent=float(extent),
                mean_speed=float(length / (2 * max(time - start, STEP))),
                complete=complete,
            )
        )
        self._gesture = None


def _round(values: dict[str, object]) -> dict[str, object]:
    return {
        key: round(value, 6) if isinstance(value, float) else value for key, value in values.items()
    }
