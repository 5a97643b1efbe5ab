"""The free moves that the paper's rule (Eqs. 1 and 2) lets pass, by lag and acceleration.

In a move at a speed v, the servo follows a trapezoid of speed with acceleration a, delayed by a
lag. In the first window of p = 0.1 s it covers v (p − lag − v / 2a), so it passes that window only
if lag + v / 2a is at most 0.0628 p = 6.28 ms. A motor that has arrived is not judged.
"""

from collections.abc import Sequence

import numpy as np

from miburi.robot import Array, Robot
from miburi.safety.contact import PAPER_RATIO
from miburi.safety.move import Move

_PERIOD, _RATIO = 0.1, PAPER_RATIO / 10_000
#: The largest lag + v / 2a, in s, with which a motor passes its first window.
FIRST_WINDOW = (1 - _RATIO) * _PERIOD


def is_stopped(distance: float, speed: float, ramp: float, lag: float) -> bool:
    """Return whether the printed rule stops a free move over a distance at a speed.

    ``distance`` is in rad, ``speed`` in rad/s. ``ramp`` is the acceleration at both ends in rad/s²,
    or inf; ``lag`` is the servo's delay in s.
    """
    rise = speed / ramp
    if distance < speed * rise:  # it never reaches its speed
        rise = float(np.sqrt(distance / ramp))
    peak = min(speed, ramp * rise)
    end = distance / peak + rise if peak else 0.0

    def place(time: float) -> float:
        t = min(max(time - lag, 0.0), end)
        up, down = min(t, rise), max(t - (end - rise), 0.0)
        lost = down * down * ramp / 2 if rise else 0.0
        gained = up * up * ramp / 2 if rise else 0.0
        return gained + peak * max(t - rise, 0.0) - lost

    for window in range(int((end + lag) / _PERIOD)):
        begin = window * _PERIOD
        if begin + _PERIOD >= end + lag:
            break  # it has arrived
        if place(begin + _PERIOD) - place(begin) < _RATIO * speed * _PERIOD - 1e-12:
            return True
    return False


def fastest(robot: Robot, moves: Sequence[tuple[Array, Move]]) -> list[tuple[float, float]]:
    """Return the distance (in rad) and speed (in rad/s) of each move's fastest motor.

    Each move comes with its first pose, shape (8,), in rad; moves of at most one encoder step are
    left out.
    """
    found = []
    for start, move in moves:
        motor = int(np.argmax(move.speeds))
        distance = float(np.abs(move.angles - start)[motor])
        if distance > robot.servo.step:
            found.append((distance, float(move.speeds[motor])))
    return found


def pass_map(moves: list[tuple[float, float]], lags: Array, ramps: Array) -> Array:
    """Return, for each ramp (row) and lag (column), the share of moves that pass.

    ``moves`` has the distance and speed of each move, as :func:`fastest` returns them.
    """
    return np.array(
        [
            [np.mean([not is_stopped(d, v, float(ramp), float(lag)) for d, v in moves])
             for lag in lags]
            for ramp in ramps
        ]
    )  # fmt: skip
