"""Forward kinematics and Jacobian of the body in Figs. 2 and 3.

The eight joint angles give the positions of hands and head in the base frame, which has x forward,
y to the robot's left and z up. Let lat be the direction out of a shoulder, fwd the direction that
the chest faces, and d(S) = sin S · fwd − cos S · up. Then:

    right hand = L01 up + L12 lat + L23 (cos RE lat + sin RE d(RS))
                 + L34 (cos(RE+RF) lat + sin(RE+RF) d(RS))
    left hand  = the same with its own lat, and with −LE, −LF for RE, RF
    head       = (L01 + LH1) up + LH2 (cos H fwd + sin H up)

These are Eqs. 3–11 with their misprints corrected; :mod:`miburi.robot.printed` has them as printed.
"""

import numpy as np
from numpy.typing import ArrayLike

from miburi.errors import InputError
from miburi.ground.arguments import real_numbers
from miburi.robot.description import Array, Robot

_UP = np.array([0.0, 0.0, 1.0])


def forward(robot: Robot, angles: ArrayLike) -> Array:
    """Return the positions of the two hands and the head centre (Eqs. 3–11, corrected).

    Parameters
    ----------
    robot
        Gives the six lengths.
    angles
        (8,) or (n, 8) rad, in the order of ``JOINTS``; the limits are not applied.

    Returns
    -------
    (9,) or (n, 9) m in the base frame: right x y z, left x y z, head x y z.

    Raises
    ------
    InputError
        The shape is wrong, or a value is not finite.
    """
    q = finite_array(angles, 8, "angles")
    size = robot.lengths
    waist, rs, re, rf, ls, le, lf, head = np.moveaxis(q, -1, 0)
    left, fwd = _directions(waist)
    shoulder_height = size.L01 * _UP
    right_hand = shoulder_height + _arm(robot, -left, fwd, rs, re, rf)
    left_hand = shoulder_height + _arm(robot, left, fwd, ls, -le, -lf)
    head_centre = (size.L01 + size.LH1) * _UP + size.LH2 * (
        np.cos(head)[..., None] * fwd + np.sin(head)[..., None] * _UP
    )
    return np.concatenate([right_hand, left_hand, head_centre], axis=-1)


def jacobian(robot: Robot, angles: ArrayLike) -> Array:
    """Return the derivatives of :func:`forward` at one pose, in m/rad; the shape is (9, 8).

    ``angles`` is the pose, in rad; its shape is (8,).

    Raises
    ------
    InputError
        The shape is not (8,), or a value is not finite.
    """
    q = finite_array(angles, 8, "angles")
    if q.ndim != 1:
        raise InputError(f"angles must have the shape (8,), got {q.shape}.")
    size = robot.lengths
    waist, rs, re, rf, ls, le, lf, head = q
    left, fwd = _directions(waist)
    rows = np.zeros((9, 8))
    rows[:, 0] = np.cross(_UP, forward(robot, q).reshape(3, 3)).ravel()
    rows[0:3, 1:4] = _arm_derivatives(robot, -left, fwd, rs, re, rf)
    rows[3:6, 4:7] = _arm_derivatives(robot, left, fwd, ls, -le, -lf) * [1, -1, -1]
    rows[6:9, 7] = size.LH2 * (-np.sin(head) * fwd + np.cos(head) * _UP)
    return rows


def _directions(waist: Array) -> tuple[Array, Array]:
    """Return the left and forward directions of the turned chest, each (..., 3)."""
    cos, sin, zero = np.cos(waist), np.sin(waist), np.zeros_like(waist)
    return np.stack([-sin, cos, zero], axis=-1), np.stack([cos, sin, zero], axis=-1)


def _arm(robot: Robot, lat: Array, fwd: Array, s: Array, e: Array, f: Array) -> Array:
    size = robot.lengths
    along = size.L12 + size.L23 * np.cos(e) + size.L34 * np.cos(e + f)
    out = size.L23 * np.sin(e) + size.L34 * np.sin(e + f)
    swing = np.sin(s)[..., None] * fwd - np.cos(s)[..., None] * _UP
    hand: Array = along[..., None] * lat + out[..., None] * swing
    return hand


def _arm_derivatives(robot: Robot, lat: Array, fwd: Array, s: Array, e: Array, f: Array) -> Array:
    size = robot.lengths
    swing = np.sin(s) * fwd - np.cos(s) * _UP
    out = size.L23 * np.sin(e) + size.L34 * np.sin(e + f)
    by_shoulder = out * (np.cos(s) * fwd + np.sin(s) * _UP)
    by_fingertip = size.L34 * (np.cos(e + f) * swing - np.sin(e + f) * lat)
    by_elbow = by_fingertip + size.L23 * (np.cos(e) * swing - np.sin(e) * lat)
    return np.column_stack([by_shoulder, by_elbow, by_fingertip])


def finite_array(values: ArrayLike, width: int, name: str) -> Array:
    """Return ``values`` as finite float64 of shape (width,) or (n, width).

    Raises
    ------
    InputError
        The shape is wrong, or a value is not a finite number.
    """
    array = real_numbers(values, name, f"{width} real numbers")
    if array.ndim not in (1, 2) or array.shape[-1] != width:
        raise InputError(
            f"{name} must have the shape ({width},) or (n, {width}), got {array.shape}."
        )
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} must be finite numbers, got {values!r}.")
    return array
