"""Compiled code for the servos' dry friction at every physics step; MuJoCo's own is constant.

Importing this module loads Numba.
"""

import numpy as np
from numpy.typing import NDArray

from miburi.ground.compiled import compiled
from miburi.servos.voltage import Array, dry_friction

_dry_friction = compiled(dry_friction)


@compiled
def set_friction(
    bound: Array,
    rows: Array,
    braking: Array,
    dofs: NDArray[np.int64],
    motor: Array,
    speed: Array,
    bias: Array,
    constraint: Array,
    row_forces: Array,
    places: NDArray[np.int64],
) -> None:
    """Write the bound of dry friction until the next step, N·m, to ``bound`` (nv,).

    Parameters
    ----------
    rows
        (8, 6), the constants of each servo: :attr:`miburi.servos.servo.Friction.row`.
    braking
        (8,) N·m·s/rad: the torque that back EMF takes from the motor, divided by the speed.
    dofs
        (8,), where each joint is in MuJoCo's arrays.
    motor
        The motors' torque, (8,) N·m, without back EMF.
    speed, bias, constraint
        (nv,), MuJoCo's qvel, qfrc_bias and qfrc_constraint.
    row_forces, places
        MuJoCo's efc_force, and the index of each joint's friction in it, (8,). Friction is among
        the constraint forces, but is not a load, so it is subtracted.
    """
    for joint, dof in enumerate(dofs):
        load = constraint[dof] - bias[dof] - row_forces[places[joint]]
        torque = motor[joint] - braking[joint] * speed[dof]
        dry, stiction, motor_load, load_stiction, stribeck_speed, stribeck_shape = rows[joint]
        bound[dof] = _dry_friction(
            dry, stiction, motor_load, load_stiction, stribeck_speed, stribeck_shape,
            torque, load, speed[dof],
        )  # fmt: skip
