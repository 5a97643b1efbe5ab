"""Calibrate a simulated robot as its maker would, by fifty free moves and a test with gestures.

The robot may differ from its description within workshop tolerances
(:mod:`miburi.robot.specimens`); the calibration sees only the description and the encoders.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from miburi.bodies.simulated import Simulated
from miburi.calibration.free_motion import Trace
from miburi.calibration.guards import free_rule, granted, shaken
from miburi.calibration.identify import (
    Identified,
    and_play,
    check,
    fitted,
    identify,
    in_words,
    proposed_gain,
    worn,
)
from miburi.card.free_moves import free_moves, gestures, swings
from miburi.errors import BodyError
from miburi.robot import JOINTS, Array, Robot
from miburi.safety.drive import uneased
from miburi.safety.free import FreeRule
from miburi.safety.move import Move
from miburi.safety.stop import Phase
from miburi.studies.trials.plant import TrialPlant, Variation
from miburi.studies.trials.replay import DeafRule
from miburi.studies.trials.trial import trace_of

#: Readings recorded after each move, longer than the rule waits for a motor's arrival.
_AFTER = 30
#: The most gains tried.
_ROUNDS = 3
#: A robot on a desk: encoders are noisy, and setpoints come one physics step late.
USUAL = Variation(noise=0.3, delay=1)


@dataclass(frozen=True)
class Calibrated:
    """A calibrated robot."""

    robot: Robot  #: the description with the identified servos and the chosen gain
    true: Robot  #: the actual robot, with that gain
    rule: FreeRule
    found: Identified  #: the servos that the rule expects
    words: tuple[str, ...]  #: remarks for its maker
    seconds: float  #: the duration in the robot's time


def calibrate_servos(robot: Robot, seed: int, true: Robot | None = None) -> Calibrated:
    """Identify a robot's servos, derive its rule, and test it with gestures, as a card does.

    Guards, the rule's tolerances, are raised where gestures leave too little margin. ``true`` is
    the actual robot, by default as described. If the P gain makes servos too soft or stiff, it is
    changed first, and the moves are repeated.

    Raises BodyError if a servo is too soft or too stiff with the gains that were tried, or the rule
    stopped a gesture.
    """
    # Only of a body that is simulated as described is the play of its gears known.
    firm = true is None and not robot.servo.model.loop.backlash
    true = true or robot
    seconds = 0.0
    first = robot.servo.model.drive.gain
    for after in reversed(range(_ROUNDS)):
        # moves of all joints at once are enough for the gain, and quick
        plant = TrialPlant(robot, true)
        traces = record_free_moves(plant, seed, together=True)
        found = identify(robot, traces)
        seconds += plant.time
        if not after or proposed_gain(robot, found) == round(robot.servo.model.drive.gain):
            break
        robot = fitted(robot, found)
        true = driven(true, gain=robot.servo.model.drive.gain)
    # A ceiling on the motors' push that suits new gears would hold worn ones back, and make them
    # seem softer than they are.
    robot, found, _ = worn(robot, found, traces)
    plant = TrialPlant(robot, true)
    traces = record_free_moves(plant, seed)
    seconds += plant.time
    found = identify(robot, traces, found.wear)
    check(robot, found)
    gain, words = robot.servo.model.drive.gain, in_words(robot, found, firm=firm)
    if gain != first:
        words.insert(
            0, f"the P gain is {gain:g} now; {first:g} made the servos too soft or too stiff"
        )
    robot, found, traces = worn(robot, found, traces)
    plant = TrialPlant(robot, true)
    rng = np.random.default_rng([seed, _STREAM, 2])
    swung = _record_all(plant, swings(robot), USUAL, rng, after=0)
    seconds += plant.time
    rule = shaken(free_rule(robot, found, traces), swung)
    try:
        rule = granted(rule, _test(plant, rule, seed, firm=firm))
    except BodyError as error:
        raise BodyError(f"{error}{and_play(robot, found, firm=firm)}") from error
    return Calibrated(robot, true, rule, found, tuple(words), seconds + plant.time)


def record_free_moves(
    plant: TrialPlant, seed: int, variation: Variation = USUAL, *, together: bool = False
) -> list[Trace]:
    """Have a robot make the moves of a calibration without a rule; return their traces.

    ``together`` leaves out the moves of single joints.
    """
    moves = (m for name, m in free_moves(plant.robot) if not (together and name in JOINTS))
    return _record_all(plant, moves, variation, np.random.default_rng([seed, _STREAM]), _AFTER)


def _record_all(
    plant: TrialPlant,
    moves: Iterable[Move],
    variation: Variation,
    rng: np.random.Generator,
    after: int,
) -> list[Trace]:
    """Have a robot make moves from neutral without a rule; return their traces."""
    here = np.array(plant.robot.neutral)
    plant.begin(here, variation, rng)
    body = Simulated(uneased(plant.robot), DeafRule.of(plant.robot), plant=plant)
    traces = []
    for move in moves:
        traces.append(_record(body, here, move, after))
        here = move.angles
    return traces


def _record(body: Simulated, here: Array, move: Move, after: int) -> Trace:
    """Move a body from ``here``, (8,) in rad, until it arrives or stops; return the trace."""
    readings = [body.encoders]
    body.move(move)
    while body.phase is Phase.MOVING:
        body.read()
        readings.append(body.encoders)
    for _ in range(after):
        body.read()
        readings.append(body.encoders)
    return trace_of(body.robot, here, move, readings)


def _test(plant: TrialPlant, rule: FreeRule, seed: int, *, firm: bool) -> list[Trace]:
    here = np.array(plant.robot.neutral)
    plant.begin(here, USUAL, np.random.default_rng([seed, _STREAM, 1]))
    body = Simulated(plant.robot, rule, plant=plant)
    traces = []
    for _, moves in gestures(plant.robot):
        for move in moves:
            traces.append(_record(body, here, move, after=0))
            here = move.angles
            if body.state.stop is not None:
                look = (
                    "Nothing is loose or in the way in this simulation: what the servos carry is "
                    "too long or heavy for them."
                    if firm
                    else "Look for a loose horn or screw, a cable that pulls, or a hand in the "
                    "way; then calibrate again."
                )
                raise BodyError(
                    f"The calibrated rule stopped a free gesture at {body.state.stop.motor}. {look}"
                )
    return traces


def driven(robot: Robot, **values: float) -> Robot:
    """Return a robot whose servos are driven with other values, such as another gain."""
    servo = robot.servo.model
    drive = servo.drive.model_copy(update=values)
    return robot.with_servo(servo.model_copy(update={"drive": drive}))


_STREAM = 13  # its own stream of random numbers
