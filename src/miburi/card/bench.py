"""Measure the servos of a real robot. These measurements have never been made on hardware.

From a :class:`Bench`, a card with a person beside it, this module makes a report in TOML, which can
be sent to the project. :data:`STEPS` are the seven measurements. Each measurement can be left out,
and is written down when it is done, so that an interrupted session can be resumed. A report's
``constants`` have the form of a servo's TOML file.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from miburi.calibration.identify import Identified, identify, stiffness
from miburi.card.bench_moves import (
    CLEAR,
    DEEPER,
    ELBOW,
    GENTLY,
    GRID,
    LOOK,
    REST,
    go,
    listening,
    peek,
    positions,
    rest,
    with_gain,
)
from miburi.card.bench_report import BenchFindings, Value
from miburi.card.card import Card, wake
from miburi.card.free_moves import free_moves, gesture, record
from miburi.card.settings import FULL_PWM
from miburi.card.units import next_speed, real_speed
from miburi.errors import BodyError
from miburi.gestures import shipped_functions
from miburi.robot import JOINTS, Array, Robot
from miburi.robot.loads import GRAVITY, loads
from miburi.safety.drive import uneased
from miburi.safety.move import Move
from miburi.safety.profile import FINE, SECOND
from miburi.safety.stop import Phase

#: The weight that the person hangs on the arm, in kg, and its distance from the elbow's axle, in m.
WEIGHT, LEVER = 0.1, 0.1
#: P gains at which the stiffness and the hunting are measured.
_STIFF, _HUNTING = (800, 3200), (1600, 3200, 6400)
#: The waist's turn in rad, the duty limits (out of 885), and the speeds in rad/s.
_PUSH, _DUTIES, _FAST = 0.8, (FULL_PWM, 110), 4.0
#: A long turn of the waist, in rad, and its slow speed, in rad/s; it shows how fast the servo's
#: clock runs.
_LONG, _SLOW = 1.2, 0.1
#: Registers: present PWM, present current and input voltage, 2 bytes each.
_PWM, _CURRENT, _VOLTAGE = 124, 126, 144
#: How far, in rad, the loaded joint turns to either side before it approaches its pose, and its
#: speed then, in rad/s.
_ASIDE, _SIDEWAYS = 0.15, 0.3


@dataclass(frozen=True)
class Bench:
    """The equipment for the measurements.

    Attributes
    ----------
    card
        The card of a calibrated robot.
    ask
        Asks the person at the robot for something, and returns when it is done.
    gestures
        The number of gestures performed while stops are counted; half as many warm the servos up
        first.
    """

    card: Card
    ask: Callable[[str], object]
    gestures: int = 200


@dataclass(frozen=True)
class BenchStep:
    """One measurement.

    Attributes
    ----------
    name, what
        Its name, and what it does and asks of the person.
    run
        The function that measures, given a bench.
    """

    name: str
    what: str
    run: Callable[[Bench], BenchFindings]

    def conduct(self, bench: Bench) -> BenchFindings:
        """Make the measurement, then stop the card and restore its settings.

        Raises
        ------
        BodyError
            Something was in the way, or a servo failed.
        """
        card = bench.card
        before = card.settings
        try:
            return self.run(bench)
        finally:
            with suppress(BodyError):
                card.stop()
                card.configure(before)


def _level_arm(robot: Robot) -> Array:
    """Return neutral with the right forearm level, where its weight loads the elbow most."""
    angles = np.repeat(np.array(robot.neutral)[None], GRID**2, axis=0)
    lower, upper = robot.lower + CLEAR, robot.upper - CLEAR
    shoulder, elbow = (np.linspace(lower[i], upper[i], GRID) for i in (ELBOW - 1, ELBOW))
    angles[:, ELBOW - 1], angles[:, ELBOW] = np.repeat(shoulder, GRID), np.tile(elbow, GRID)
    angles[:, ELBOW + 1] = 0.0
    pulls = np.abs(loads(robot, angles).gravity[:, ELBOW])
    level: Array = angles[int(pulls.argmax())]
    return level


def _measure_stiffness(bench: Bench) -> BenchFindings:
    """Let a weight pull at the elbow, and measure how far the elbow sinks.

    The joint is read twice, once after a move from above and once after a move from below. In the
    mean of both readings, the dry friction that holds the joint up or down cancels out. The share
    of the motor's torque that the gears absorb cancels out only in part; the calculation allows for
    the rest.
    """
    card, found = bench.card, list[float]()
    for gain in _STIFF:
        robot = with_gain(card, gain, DEEPER)
        pose, places = _level_arm(robot), list[float]()
        pull = np.sign(loads(robot, pose).gravity[ELBOW])
        deeper = WEIGHT * GRAVITY * LEVER / robot.servo.model.stiffness / robot.servo.step
        for weight in (0.0, pull * deeper * 4):
            if weight:
                grams, far = 1000 * WEIGHT, 100 * LEVER
                bench.ask(f"Hang {grams:.0f} g on the right forearm, {far:.0f} cm from the elbow")
            sides = []
            for side in (-_ASIDE, _ASIDE):
                aside = pose + side * (np.arange(len(JOINTS)) == ELBOW)
                go(card, aside, GENTLY, FULL_PWM, round(weight))
                go(card, pose, _SIDEWAYS, FULL_PWM, round(weight))
                sides.append(rest(card)[ELBOW])
            places.append(float(np.mean(sides)))
        bench.ask("Take off the weight")
        go(card, robot.neutral, GENTLY, FULL_PWM, 0)
        sank = max(abs(places[1] - places[0]), robot.servo.step / 4)
        lost = robot.servo.model.friction.motor_load
        torque = WEIGHT * GRAVITY * LEVER * (1 / (1 + lost) + 1 / (1 - lost)) / 2
        found.append(torque / sank)
    servo = card.robot.servo.model
    described = np.array([servo.stiffness * gain / servo.drive.gain for gain in _STIFF])
    return BenchFindings(
        {"gain": [float(gain) for gain in _STIFF], "stiffness": found},
        {"divisor": {"p_divisor": servo.divisor.p_divisor * float(np.median(described / found))}},
    )


def _measure_hunting(bench: Bench) -> BenchFindings:
    card = bench.card
    worst = []
    for gain in _HUNTING:
        robot = with_gain(card, gain)
        most = np.zeros(len(JOINTS))
        for side in (0.15, -0.15):
            go(card, np.clip(robot.neutral + side, robot.lower, robot.upper))
            card.step(REST)
            with listening(card) as reports:
                card.step(2 * REST)
            most = np.maximum(most, np.ptp(positions(reports), axis=0))
        worst.append(float(most.max()))
    return BenchFindings({"gain": [float(gain) for gain in _HUNTING], "steps": worst}, {})


def _measure_ceiling(bench: Bench) -> BenchFindings:
    """Measure the waist's top speed at full duty and at an eighth; a servo may ignore the limit."""
    card = bench.card
    robot, speeds = with_gain(card, card.settings.general.p_gain), []
    for duty in _DUTIES:
        reports = go(card, robot.neutral + _PUSH * (np.arange(8) == 0), _FAST, duty)
        times = np.array([report.time for report in reports]) / SECOND
        ways = np.diff(positions(reports)[::3, 0]) / np.diff(times[::3])
        speeds.append(float(ways.max() * robot.servo.step))
        if card.state.phase is Phase.STOPPED:  # the contact rule may have found the waist too slow
            card.step(REST)
            wake(card)
        go(card, robot.neutral)
    obeys = "yes" if speeds[1] < 0.6 * speeds[0] else "no"
    duties = [float(duty) for duty in _DUTIES]
    return BenchFindings({"pwm": duties, "speed": speeds, "obeys": obeys}, {})


def _measure_clock(bench: Bench) -> BenchFindings:
    card = bench.card
    found = _identify(card)
    robot = card.robot
    wake(card)
    go(card, robot.neutral - _LONG / 2 * (np.arange(8) == 0))
    reports = go(card, robot.neutral + _LONG / 2 * (np.arange(8) == 0), _SLOW)
    way = positions(reports)[:, 0]
    middle = slice(len(way) // 10, -len(way) // 10)
    times = np.array([report.time for report in reports])[middle] / SECOND
    told = real_speed(next_speed(round(_SLOW / robot.servo.step))) / FINE
    fast = float(np.polyfit(times, way[middle], 1)[0]) / told
    late = max(found.delay / SECOND - robot.guards.lag[0], 0.0)
    return BenchFindings(
        {"delay": found.delay / SECOND, "clock": fast},
        {"loop": {"start_delay": late, "clock_error": abs(fast - 1)}},
    )


def _measure_stall(bench: Bench) -> BenchFindings:
    card = bench.card
    robot = with_gain(card, card.settings.general.p_gain)
    go(card, _level_arm(robot), duty=FULL_PWM // 2)
    before = rest(card)[ELBOW]
    bench.ask("Press the right hand down by a few degrees, and hold it until the next question")
    card.step(LOOK)
    off = float(card.state.angles[ELBOW] - before)
    pwm, current = peek(card, ELBOW, _PWM, 2), peek(card, ELBOW, _CURRENT, 2)
    volts = peek(card, ELBOW, _VOLTAGE, 2) / 10
    bench.ask("Let the hand go")
    duty, amperes = abs(pwm) / FULL_PWM, abs(current) / 1000
    # The servo reports the supply's current: the motor's current times the duty.
    constants = {"motor": {"resistance": duty**2 * volts / amperes}} if amperes else {}
    measured: dict[str, Value] = {"angle": off, "pwm": float(pwm)}
    return BenchFindings(measured | {"current": amperes, "voltage": volts}, constants)


def _measure_friction(bench: Bench) -> BenchFindings:
    card = bench.card
    measured: dict[str, Value] = {}
    bench.ask("The servos should be cold: let them rest for half an hour")
    for state in ("cold", "warm"):
        if state == "warm":
            wake(card)
            _perform(card, bench.gestures // 2)
        found = _identify(card)
        measured[f"friction_{state}"] = found.friction.tolist()
        measured[f"stiffness_{state}"] = stiffness(card.robot, found).tolist()
        measured[f"temperature_{state}"] = [float(hot) for hot in card.report.temperatures]
        if state == "cold":
            own = card.robot.servo.model.friction
            share = float(np.median(found.friction))
            constants = {"friction": {"dry": own.dry * share, "stiction": own.stiction * share}}
    return BenchFindings(measured, constants)


def _measure_false_stops(bench: Bench) -> BenchFindings:
    card = bench.card
    card.stop()
    wake(card)
    stops, moves = list[str](), 0
    for _name, move in free_moves(card.robot):
        moves += 1
        stops += _stops_of(card, move)
    made, stopped = _perform(card, bench.gestures)
    return BenchFindings({"moves": float(moves + made), "stops": stops + stopped}, {})


def _identify(card: Card) -> Identified:
    """Identify the servos, with the description's gain, from free moves of all joints at once."""
    with_gain(card, card.robot.servo.model.drive.gain)
    moves = [move for name, move in free_moves(card.robot) if name not in JOINTS]
    traces = record(card, moves, uneased(card.robot))
    card.stop()
    return identify(card.robot, traces)


def _perform(card: Card, count: int) -> tuple[int, list[str]]:
    """Perform gestures in turn, each in a different variation; count the moves and the stops."""
    moves, stops, functions = 0, list[str](), shipped_functions()
    for number in range(count):
        feeling = functions[number % len(functions)].feeling
        mood = 0.2 + 0.8 * (number * 7 % 10) / 9
        for move in gesture(card.robot, feeling, mood, number):
            moves += 1
            stopped = _stops_of(card, move)
            stops += stopped
            if stopped:
                break
    return moves, stops


def _stops_of(card: Card, move: Move) -> list[str]:
    """Make a move. If it is stopped, release the body and return the joint that stopped it."""
    card.move(move)
    while card.step(0.02).phase is Phase.MOVING:
        pass
    stop = card.state.stop
    if stop is None:
        return []
    if stop.sign is None:
        raise BodyError(
            f"Stopped: {stop.reason.spoken} ({stop.motor}). Put that right, then go on."
        )
    card.step(REST)
    wake(card)
    return [f"{stop.motor}, {stop.sign}"]


#: The measurements, the most informative first.
STEPS = (
    BenchStep(
        "stiffness",
        f"How stiff are the servos? Needs a weight of {1000 * WEIGHT:.0f} g on a string.",
        _measure_stiffness,
    ),
    BenchStep("hunting", "Do servos at rest oscillate at higher gains?", _measure_hunting),
    BenchStep("ceiling", "Does Goal PWM limit a motion? The waist turns fast.", _measure_ceiling),
    BenchStep(
        "clock", "How long do servos take to begin, and is their clock accurate?", _measure_clock
    ),
    BenchStep(
        "stall",
        "What PWM and current does a servo report while held? You press the right hand down.",
        _measure_stall,
    ),
    BenchStep(
        "friction", "How much friction do the servos have, cold and warm?", _measure_friction
    ),
    BenchStep(
        "false_stops",
        "How often is free motion stopped? The robot makes sixty moves, then gestures.",
        _measure_false_stops,
    ),
)
