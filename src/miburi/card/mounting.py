"""Find servos that were mounted wrongly, by having a person turn the joints while all are limp.

It takes the mounting that a built robot should have, and the servos' positions while each joint is
turned by hand. It returns faults in words: servos swapped, turned the other way, or with a horn a
quarter turn off. Nothing here switches torque on.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from miburi.calibration.file import Mounting
from miburi.card.units import STEPS_PER_TURN
from miburi.robot import JOINTS

#: The least turn that counts, and how far from its place a joint may be when it is set by hand, in
#: encoder steps: 6° and 20° (our choice).
_TURN, _BY_HAND = 68, 228
_QUARTER = STEPS_PER_TURN // 4


@dataclass(frozen=True)
class Turned:
    """Servo positions before and after a person turns one joint, in encoder steps.

    Attributes
    ----------
    motor
        The joint's index, in the order of ``JOINTS``.
    before
        (8,) all servos' positions with this joint at its zero.
    after
        (8,) the same after a turn of about 10° in the joint's positive direction.
    """

    motor: int
    before: NDArray[np.int64]
    after: NDArray[np.int64]


def mounting_faults(built: Mounting, turns: list[Turned]) -> list[str]:
    """Return one line for each servo that is not mounted as the parts require."""
    lines = []
    for turned in turns:
        name = JOINTS[turned.motor].replace("_", " ")
        ways = _wrapped(turned.after - turned.before)
        # Other limp joints sag meanwhile, so check the requested joint before the joint that moved
        # most.
        asked, most = turned.motor, int(np.argmax(np.abs(ways)))
        if abs(ways[most]) < _TURN:
            lines.append(f"{name}: no servo turned by 6° or more; look at its horn's screws.")
            continue
        if abs(ways[asked]) < _TURN:
            other = JOINTS[most].replace("_", " ")
            lines.append(
                f"{name}: servo {built.id[most]} turned, which belongs to the {other}. If "
                f"turning the {other} moves this joint's servo, the two are swapped: exchange "
                "them (--ids)."
            )
            continue
        if np.sign(ways[asked]) != built.direction[asked]:
            lines.append(
                f"{name}: servo {built.id[asked]} turned the other way: its horn faces the "
                "wrong way, or the joint was turned the wrong way."
            )
            continue
        off = int(_wrapped(turned.before[asked] - built.zero[asked]))
        quarters = round(off / _QUARTER)
        if abs(off - quarters * _QUARTER) > _BY_HAND:
            lines.append(
                f"{name}: servo {built.id[asked]} is {off * 360 / STEPS_PER_TURN:.0f}° from where "
                "its zero should be: set the joint to zero, and check the horn's screws."
            )
        elif quarters % 4:
            lines.append(
                f"{name}: the horn of servo {built.id[asked]} sits {90 * abs(quarters)}° off: take "
                "its four screws out, and turn it until its notch shows in the slot."
            )
    return lines


def _wrapped(steps: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return differences of positions, from minus half a turn to half a turn."""
    half = STEPS_PER_TURN // 2
    return (steps + half) % STEPS_PER_TURN - half
