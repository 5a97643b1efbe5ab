"""Calibrate a simulated robot as its maker would: fifty free moves, gestures as the test, words.

The robot may differ from its description as one from a workshop does
(:mod:`miburi.robot.specimens`); who calibrates it sees the description and the encoders alone.
"""

from dataclasses import dataclass

import numpy as np

from miburi.bodies.simulated import READING, Simulated
from miburi.calibration.free_motion import Trace
from miburi.calibration.identify import (
    Identified,
    check,
    fitted,
    free_rule,
    identify,
    in_words,
    proposed_gain,
    worn,
)
from miburi.card.free_moves import free_moves
from miburi.errors import BodyError
from miburi.robot import JOINTS, Robot
from miburi.safety.free import FreeRule
from miburi.safety.stop import Phase, Stop
from miburi.studies.trials.conditions import draw
from miburi.studies.trials.plant import TrialPlant, Variation
from miburi.studies.trials.replay import DeafRule
from miburi.studies.trials.trial import trace_of

__all__ = ["USUAL", "Calibrated", "calibrate_servos", "record_free_moves"]

#: Readings that are recorded after each move: longer than the rule waits for a motor to arrive.
_AFTER = 30
#: How often the gain may be changed, and the moves of gestures that test the rule at last.
_ROUNDS, _TEST = 3, 20
#: A robot on a desk: encoders flicker, and setpoints come one physics step late.
USUAL = Variation(noise=0.3, delay=1)


@dataclass(frozen=True)
class Calibrated:
    """A calibrated robot.

    Attributes
    ----------
    robot
        The description with the stiffness and friction that were found, and the gain that fits.
    true
        The robot as it is, with that gain.
    rule, found
        The contact rule, and the servos that it expects.
    words
        What its maker may want to look at.
    seconds
        The robot's time that it took.
    """

    robot: Robot
    true: Robot
    rule: FreeRule
    found: Identified
    words: tuple[str, ...]
    seconds: float


def calibrate_servos(robot: Robot, seed: int, true: Robot | None = None) -> Calibrated:
    """Identify a robot's servos, derive its rule, and test it with gestures.

    ``true`` is the robot as it is, by default as described. A gain that does not fit is changed
    first, and the moves made again.

    Raises
    ------
    BodyError
        A servo is too soft or too stiff with any gain, or the rule stopped a gesture.
    """
    true = true or robot
    seconds = 0.0
    first = robot.servo.model.drive.gain
    for _ in range(_ROUNDS):
        # Moves of all joints at once are enough for the gain, and soon made.
        plant = TrialPlant(robot, true)
        found = identify(robot, record_free_moves(plant, seed, together=True))
        seconds += plant.time
        if proposed_gain(robot, found) == round(robot.servo.model.drive.gain):
            break
        robot = fitted(robot, found)
        true = _with_gain(true, robot.servo.model.drive.gain)
    plant = TrialPlant(robot, true)
    traces = record_free_moves(plant, seed)
    seconds += plant.time
    found = identify(robot, traces)
    check(robot, found)
    gain, words = robot.servo.model.drive.gain, in_words(found)
    if gain != first:
        words.insert(
            0, f"the P gain is {gain:g} now, for {first:g} made the servos too soft or stiff"
        )
    robot, found, traces = worn(robot, found, traces)
    plant = TrialPlant(robot, true)
    rule = free_rule(robot, found, traces)
    tested, stop = _test(plant, rule, seed)
    if stop is not None:
        raise BodyError(
            f"The calibrated rule stopped a free gesture at {stop.motor}. Look for a loose horn or "
            "screw, a cable that pulls, or a hand in the way; then calibrate again."
        )
    return Calibrated(robot, true, rule, found, tuple(words), seconds + tested)


def record_free_moves(
    plant: TrialPlant, seed: int, variation: Variation = USUAL, *, together: bool = False
) -> list[Trace]:
    """Let a robot make the moves of a calibration with no rule on, and return their traces.

    ``together`` leaves out the moves of single joints.
    """
    robot, here = plant.robot, np.array(plant.robot.neutral)
    plant.begin(here, variation, np.random.default_rng([seed, _STREAM]))
    body = Simulated(robot, DeafRule.of(robot), plant=plant)
    traces = []
    for name, move in free_moves(robot):
        if together and name in JOINTS:
            continue
        readings = [body.encoders]
        body.move(move)
        while body.phase is Phase.MOVING:
            body.read()
            readings.append(body.encoders)
        for _ in range(_AFTER):
            body.read()
            readings.append(body.encoders)
        traces.append(trace_of(robot, here, move, readings))
        here = move.angles
    return traces


def _test(plant: TrialPlant, rule: FreeRule, seed: int) -> tuple[float, Stop | None]:
    """Make moves of gestures with the rule on; return the robot's time, and the first stop."""
    seconds = 0.0
    for index in range(_TEST):
        rng = np.random.default_rng([seed, _STREAM, index])
        conditions = draw(plant.robot, rng, 1)
        plant.begin(conditions.start, USUAL, rng)
        body = Simulated(plant.robot, rule, plant=plant)
        body.move(conditions.moves[0][0])
        while body.phase is Phase.MOVING:
            body.step(READING)
        seconds += plant.time
        if body.state.stop is not None:
            return seconds, body.state.stop
    return seconds, None


def _with_gain(robot: Robot, gain: float) -> Robot:
    servo = robot.servo.model
    drive = servo.drive.model_copy(update={"gain": gain})
    return robot.with_servo(servo.model_copy(update={"drive": drive}))


_STREAM = 13  # its own stream of random numbers
