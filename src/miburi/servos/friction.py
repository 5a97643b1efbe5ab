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
    """Write the bound of dry friction until the next step, in N·m, to ``bound``, shape (nv,).

    Parameters
    ----------
    rows
        The constants of each servo, (8, 6): see :attr:`miburi.servos.servo.Friction.row`.
    braking
        The torque that back EMF takes from each motor, divided by the speed; (8,), in N·m·s/rad.
    dofs
        The index of each joint in MuJoCo's arrays, (8,).
    motor
        The torque of each motor without back EMF, (8,), in N·m.
    speed, bias, constraint
        MuJoCo's qvel, qfrc_bias and qfrc_constraint, (nv,).
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
