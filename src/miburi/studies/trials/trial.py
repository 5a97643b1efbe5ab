"""Carry out one trial: the robot moves, a person may be in its way, and the outcome is measured."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from miburi.bodies.simulated import READING, Simulated
from miburi.calibration.free_motion import Trace
from miburi.errors import InputError
from miburi.gestures import Repertoire
from miburi.robot import Array, Robot
from miburi.robot.mjcf import TIMESTEP
from miburi.safety.contact import Rule
from miburi.safety.drive import aim, demand
from miburi.safety.move import Move
from miburi.safety.profile import SECOND, Steps, plan_profile, to_steps
from miburi.safety.stop import Phase, Stop
from miburi.studies.trials.conditions import Conditions, HandKind, Person, draw, draw_person
from miburi.studies.trials.meeting import Actor, Meeting, carriers, plan
from miburi.studies.trials.plant import TrialPlant

#: A contact counts as missed if the robot does not stop within this time, in s (our choice).
PATIENCE = 1.0
#: How long, in s, the robot may still push after a stop, and for how long after that its push is
#: measured.
SETTLED, WATCHED = 0.3, 0.2
#: The sustained force is a mean over this time, in s, which is the rule's period.
SUSTAINED = 0.1
#: A person is in the way if a robot that does not stop presses on them with at least this sustained
#: force, in N (our choice). A robot that presses less only brushes past.
IN_THE_WAY = 1.0
_READING_US = round(READING * SECOND)
#: How many gestures are drawn at most to find a meeting, and how many people for each gesture.
_GESTURES, _PERSONS = 50, 25


class TrialKind(StrEnum):
    """Whether somebody is in the way."""

    FREE = "free"
    BLOCKED = "blocked"


@dataclass(frozen=True)
class Outcome:
    """The measurements of one trial, in s and N."""

    kind: str
    index: int  #: within its kind
    servo: int  #: its number in this run
    feeling: str
    mood: float
    pose: int  #: the number of the key pose that the (first) move leads to
    hand: str  #: the behaviour of the hand; empty without a person, and so is ``link``
    link: str  #: the link that the hand is to meet
    speed: float  #: m/s, the link's commanded speed there; NaN without a person
    seconds: float  #: simulated time
    stopped: bool
    sign: str  #: the rule's test that found the contact
    motor: str
    false_stop: bool  #: whether it stopped before anybody touched it
    touched: str  #: the part of the robot that met the person first
    latency: float  #: from the first touch to the stop; NaN without either
    #: From a force of 1 N to the stop: NaN if 1 N was never reached, 0 if the stop came before.
    latency_from_1N: float  # noqa: N815  (that is how the unit is written)
    peak_force: float  #: until half a second after the stop
    sustained_force: float  #: the largest mean over 0.1 s, until then
    push_after_stop: float  #: the largest force from 0.3 s to 0.5 s after the stop; NaN without one
    right_motor: bool  #: whether the stop names a motor that carries the touched part
    brushes: int  #: people drawn earlier whom the robot only brushed past
    brush_force: float  #: the largest force on them
    self_collision: bool  #: whether two parts of the robot met before anybody touched it
    gesture: str = ""  #: its name; empty in files from before it was kept


@dataclass
class Run:
    """The record of a trial: a trace for each move, and the force in N at each physics step.

    ``brushes`` are the largest forces, in N, on people drawn earlier whom the robot only brushed
    past.
    """

    conditions: Conditions
    person: Person | None
    meeting: Meeting | None
    stop: Stop | None = None
    touched: str | None = None
    touched_at: float | None = None
    seconds: float = 0.0
    self_collision: bool = False
    traces: list[Trace] = field(default_factory=list)
    began: list[float] = field(default_factory=list)
    forces: Array = field(default_factory=lambda: np.empty(0))
    brushes: list[float] = field(default_factory=list)


def trial(
    plant: TrialPlant,
    rule: Rule,
    seed: int,
    kind: TrialKind,
    index: int,
    servo: int = 0,
    repertoire: Repertoire | None = None,
) -> Outcome:
    """Carry out one trial; it depends only on robot, rule, repertoire, seed, kind and index.

    Raises InputError if no drawn gesture brings this robot into contact with a person.
    """
    return measure(enact(plant, rule, seed, kind, index, repertoire), kind, index, servo)


def enact(
    plant: TrialPlant,
    rule: Rule,
    seed: int,
    kind: TrialKind,
    index: int,
    repertoire: Repertoire | None = None,
) -> Run:
    """Draw one trial and run it; see :func:`trial`."""
    stream = [seed, list(TrialKind).index(kind), index]
    if kind is TrialKind.FREE:
        rng = np.random.default_rng(stream)
        # The swing at the end of the first move disturbs the start of the second.
        conditions = draw(plant.robot, rng, 2, repertoire)
        return _perform(plant, rule, conditions, None, None, rng)
    hand = HandKind(np.random.default_rng(stream).choice([hand.value for hand in HandKind]))
    brushes: list[float] = []
    for attempt in range(_GESTURES):
        rng = np.random.default_rng([*stream, attempt])
        conditions = draw(plant.robot, rng, 1, repertoire)
        for person, meeting in _meetings(plant, conditions, hand, rng):
            result = _perform(plant, rule, conditions, person, meeting, rng)
            if result.touched is None and result.stop is None:
                continue
            motors = carriers(person.link)
            # A hand that met another limb, or the stand, did not block the chosen link.
            if result.touched is not None and carriers(result.touched)[1:2] != motors[1:2]:
                continue
            # A run without a stop does not depend on the rule, so neither does this choice of a
            # person.
            if result.stop is None and sustained_force(result.forces) < IN_THE_WAY:
                brushes.append(float(result.forces.max()))
                continue
            result.brushes = brushes
            return result
    raise InputError(
        f"{kind} trial {index} of seed {seed}: no person could be placed in this robot's way."
    )


def _meetings(
    plant: TrialPlant, conditions: Conditions, hand: HandKind, rng: np.random.Generator
) -> Iterator[tuple[Person, Meeting]]:
    """Yield people in the way of the drawn move, each with the meeting."""
    for _ in range(_PERSONS):
        person = draw_person(rng, hand)
        meeting = plan(plant, person, conditions.start, conditions.moves[0][0])
        if meeting is not None:
            yield person, meeting


def _perform(
    plant: TrialPlant,
    rule: Rule,
    conditions: Conditions,
    person: Person | None,
    meeting: Meeting | None,
    rng: np.random.Generator,
) -> Run:
    """Run the robot and the person; the record is empty if they overlap at the start."""
    result = Run(conditions, person, meeting)
    plant.begin(conditions.start, conditions.variation, rng)
    actor = None
    if person is not None and meeting is not None:
        actor = Actor(plant, person, meeting)
        if plant.overlaps():
            return result
    body = Simulated(plant.robot, rule, plant=plant)

    def watch(seconds: float) -> None:
        for _ in range(round(seconds / READING)):
            if actor is not None:
                actor.act(body.phase)
            body.read()
            readings.append(body.encoders)

    origin, touchable = conditions.start, 0.0
    for move, rest in conditions.moves:
        readings: list[Steps] = [body.encoders]
        result.began.append(body.state.time)
        body.move(move)
        while body.phase is Phase.MOVING:
            watch(READING)
        touchable = plant.time
        if body.phase is Phase.STOPPED:
            watch(SETTLED + WATCHED)
        elif actor is None:
            watch(rest)
        elif plant.touched_at is not None:
            watch(plant.touched_at + PATIENCE - plant.time)
        result.traces.append(trace_of(plant.robot, origin, move, readings))
        origin = move.angles
        if body.phase is Phase.STOPPED:
            break
    result.stop, result.seconds = body.state.stop, plant.time
    result.self_collision = plant.itself is not None
    result.forces = plant.forces
    if plant.touched_at is not None and plant.touched_at <= touchable:
        result.touched, result.touched_at = plant.touched, plant.touched_at
    return result


def trace_of(robot: Robot, origin: Array, move: Move, readings: list[Steps]) -> Trace:
    """Return the trace of a move from ``origin``, (8,) in rad, with the encoders' readings."""
    begin, end = to_steps(robot, aim(robot, np.array([origin, move.angles])))
    profile, direction = plan_profile(robot, begin, end, to_steps(robot, move.speeds))
    times = np.arange(len(readings), dtype=np.int64) * _READING_US
    needs = demand(robot, readings[0], begin, profile, direction)
    return Trace(profile, readings[0], direction, times, np.array(readings), needs.loading)


def measure(result: Run, kind: TrialKind, index: int, servo: int) -> Outcome:
    """Return the measurements of a run."""
    conditions, person, stop = result.conditions, result.person, result.stop
    touched_at = result.touched_at
    false_stop = stop is not None and (touched_at is None or stop.time < touched_at)
    answered = stop is not None and touched_at is not None and not false_stop
    forces, latency, firm, push = result.forces, np.nan, np.nan, np.nan
    if answered and stop is not None and touched_at is not None:
        latency = stop.time - touched_at
        reached = np.flatnonzero(forces >= IN_THE_WAY)
        if len(reached):
            firm = max(0.0, stop.time - float(reached[0] + 1) * TIMESTEP)
        push = float(forces[round((stop.time + SETTLED) / TIMESTEP) :].max())
    return Outcome(
        kind=kind.value,
        index=index,
        servo=servo,
        feeling=conditions.feeling,
        mood=conditions.mood,
        pose=conditions.pose,
        hand=person.kind.value if person else "",
        link=person.link if person else "",
        speed=result.meeting.speed if result.meeting else np.nan,
        seconds=result.seconds,
        stopped=stop is not None,
        sign=(stop.sign or "") if stop else "",
        motor=(stop.motor or "") if stop else "",
        false_stop=false_stop,
        touched=result.touched or "",
        latency=latency,
        latency_from_1N=firm,
        peak_force=float(forces.max()),
        sustained_force=sustained_force(forces),
        push_after_stop=push,
        right_motor=answered and stop is not None and stop.motor in carriers(result.touched or ""),
        brushes=len(result.brushes),
        brush_force=max(result.brushes, default=0.0),
        self_collision=result.self_collision,
        gesture=conditions.gesture,
    )


def sustained_force(forces: Array) -> float:
    """Return the largest mean over 0.1 s of forces, (n,) in N, one for each physics step."""
    width = round(SUSTAINED / TIMESTEP)
    sums = np.cumsum(np.concatenate([[0.0], forces]))
    return float((sums[width:] - sums[:-width]).max() / width)
