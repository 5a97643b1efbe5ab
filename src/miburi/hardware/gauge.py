"""The gauge, a test print: the servo's pocket in three fits, and screw holes in seven sizes.

Print it first, with the printer, filament and settings that the parts will use. The pocket that a
servo slides into without force, but does not fall out of, gives the ``--fit`` for all parts.
"""

import numpy as np

from miburi.hardware import servo
from miburi.hardware.build import PrintedPart
from miburi.hardware.dimensions import dimensions
from miburi.hardware.solids import Manifold, box, cut, disc, join, letters, moved
from miburi.robot.shape import BASE

#: The gap on each side of a pocket, in mm, for each of the three fits.
FITS = (0.15, 0.25, 0.35)
#: Diameters of the holes, in mm: a 2 mm screw cuts its thread in the first four, and passes through
#: the other three.
HOLES = (1.5, 1.6, 1.7, 1.8, 2.2, 2.4, 2.6)
#: The distance from one pocket to the next, in mm, and the frame that turns a servo so that its
#: horn is up, as in the neck when the neck is printed.
PITCH = 28.8
TURNED = np.array([[1.0, 0, 0, 0], [0, 0, -1.0, 0], [0, 1.0, 0, 0]])


def gauge() -> list[PrintedPart]:
    """Return the gauge's two parts, as they are printed."""
    solids = {"gauge_pockets": _pockets(), "gauge_holes": _holes()}
    return [PrintedPart(name, BASE, solid, np.eye(3)) for name, solid in solids.items()]


def _pockets() -> Manifold:
    s, w = dimensions().servo, dimensions().wall
    holders = []
    for number, fit in enumerate(FITS):
        # The fit is engraved in the end wall.
        wall = -s.long_end - fit - w.shell
        turn = np.array([[1.0, 0, 0, 0], [0, 0, -1.0, wall + 0.5], [0, 1.0, 0, -8.0]])
        sign = moved(letters(f"{fit:.2f}", 4.0, 2.0), turn)
        one = cut(moved(servo.holder(fit), TURNED), [sign])
        holders.append(one.translate((number * PITCH, 0, 0)))
    base = box((-5.0, 2 * PITCH + 5.0), (-20.0, -14.0), (s.back - 2.8, s.back - 0.8))
    return join([*holders, base])


def _holes() -> Manifold:
    """Return an angle bracket with the same holes through its flat and its upright plate."""
    pitch, thick = 8.0, 6.0
    wide = pitch * (len(HOLES) + 1)
    plates = join([box((0, wide), (0, 16.0), (0, thick)), box((0, wide), (0, thick), (0, 18.0))])
    tools = []
    for number, diameter in enumerate(HOLES):
        x = pitch * (number + 1)
        tools.append(disc("z", (x, 12.0), (-1, thick + 1), diameter / 2))
        tools.append(disc("y", (x, 13.0), (-1, thick + 1), diameter / 2))
        sign = letters(f"{diameter:.1f}", 2.6, 1.0)
        turn = np.array([[1.0, 0, 0, x], [0, 0, -1.0, 0.5], [0, 1.0, 0, 4.0]])
        tools.append(moved(sign, turn))
    return cut(plates, tools)
