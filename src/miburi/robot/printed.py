"""Eqs. 3–11 exactly as the paper prints them, misprints included, for reproduction.

They differ from :func:`miburi.robot.forward`, the body of Figs. 2 and 3, in these places:

- Eqs. 3, 4, 6, 7: in the last link, the sign between cos E · (waist) and (waist) · sin S · sin E
  is inverted, so that the length of the link depends on the pose.
- Eqs. 4, 7: the last link has cos W instead of sin S.
- Eq. 8: the base height L01 is subtracted instead of added.
- Eq. 11: the head's height uses cos H instead of sin H, so that the head's centre does not move on
  a circle.
"""

import numpy as np
from numpy.typing import ArrayLike

from miburi.robot.description import Array, Robot
from miburi.robot.kinematics import finite_array


def forward_as_printed(robot: Robot, angles: ArrayLike) -> Array:
    """Evaluate Eqs. 3–11 as printed; use :func:`miburi.robot.forward` for the real body.

    Parameters, result and errors are those of :func:`~miburi.robot.forward`.
    """
    q = finite_array(angles, 8, "angles")
    size = robot.lengths
    (sw, srs, sre, srf, sls, sle, slf, _) = np.moveaxis(np.sin(q), -1, 0)
    (cw, crs, cre, crf, cls, cle, clf, ch) = np.moveaxis(np.cos(q), -1, 0)
    eq3 = (
        size.L12 * sw
        + size.L23 * (cre * sw + cw * srs * sre)
        + size.L34 * (-crf * (-cre * sw + cw * srs * sre) + (cw * cre * srs - sw * sre) * srf)
    )
    eq4 = (
        -size.L12 * cw
        + size.L23 * (-cre * cw + sw * srs * sre)
        + size.L34 * (-crf * (cre * cw + sw * srs * sre) + (sw * cre * cw + cw * sre) * srf)
    )
    eq5 = size.L01 - size.L23 * crs * sre + size.L34 * (-crs * crf * sre - crs * cre * srf)
    eq6 = (
        -size.L12 * sw
        + size.L23 * (-cle * sw - cw * sls * sle)
        + size.L34 * (clf * (-cle * sw + cw * sls * sle) - (cw * cle * sls - sw * sle) * slf)
    )
    eq7 = (
        size.L12 * cw
        + size.L23 * (cle * cw - sw * sls * sle)
        + size.L34 * (clf * (cle * cw + sw * sls * sle) - (sw * cle * cw + cw * sle) * slf)
    )
    eq8 = -size.L01 + size.L23 * cls * sle + size.L34 * (cls * clf * sle + cls * cle * slf)
    eq9 = size.LH2 * cw * ch
    eq10 = size.LH2 * sw * ch
    eq11 = size.L01 + size.LH1 + size.LH2 * ch
    return np.stack([eq3, eq4, eq5, eq6, eq7, eq8, eq9, eq10, eq11], axis=-1)
