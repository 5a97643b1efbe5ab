"""The body that every solver gets, its two descriptions, and its compiled errors.

A target is (9,) m: where the right hand, the left hand and the head's centre shall be. A pose is
(8,) rad in the order of ``JOINTS``. Slopes are kept by columns, (8, 9).
"""

# Matrices have capital letters, and not every peer needs all that a maker is given.
# ruff: noqa: N803, N806

import math
import tempfile
from pathlib import Path

import numba as nb
import numpy as np

from miburi.robot import JOINTS, iphonoid
from miburi.robot.shape import extremities, links

ROBOT = iphonoid()
LO, HI = ROBOT.lower, ROBOT.upper
MID, HALF = (LO + HI) / 2, (HI - LO) / 2
TIPS = ("right_hand", "left_hand", "head_centre")
L1, L2 = 0.06, 0.08  # m, elbow to fingertip joint, fingertip joint to hand
SY, SZ = 0.05, 0.12  # m, shoulder: sideways, up
HX, HZ = 0.04, 0.17  # m, head: forward from its joint, height of the joint
#: The squared residual at which a solver may stop, m²: a little under the 1e-4 m asked.
STOP2 = 0.98e-4**2

_MOVES = {link.name: link.joint for link in links(ROBOT)}
# each joint: name, parent, origin, axis
_JOINTS = tuple(
    (link.joint, _MOVES.get(link.parent, "base_link"), link.position, link.axis)
    for link in sorted(links(ROBOT), key=lambda link: JOINTS.index(link.joint))
)
_TIPS = tuple(
    (frame, _MOVES[link], point)
    for frame, (link, point) in zip(TIPS, extremities(ROBOT).values(), strict=True)
)

jit = nb.njit(error_model="numpy")


def urdf():
    """The body as a URDF, for those who read one."""
    inertia = (
        '<inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" '
        'ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    links = ["base_link", *JOINTS, *TIPS]
    text = [f'<link name="{name}">{inertia}</link>' for name in links]
    for i, (name, parent, origin, axis) in enumerate(_JOINTS):
        text.append(
            f'<joint name="{name}_joint" type="revolute"><parent link="{parent}"/>'
            f'<child link="{name}"/><origin xyz="{_words(origin)}"/><axis xyz="{_words(axis)}"/>'
            f'<limit lower="{LO[i]!r}" upper="{HI[i]!r}" effort="1" velocity="100"/></joint>'
        )
    for name, parent, origin in _TIPS:
        text.append(
            f'<joint name="{name}_joint" type="fixed"><parent link="{parent}"/>'
            f'<child link="{name}"/><origin xyz="{_words(origin)}"/></joint>'
        )
    return f'<robot name="iphonoid">{"".join(text)}</robot>'.replace("np.float64(", "").replace(
        ")", ""
    )


def mjcf():
    """The same as an MJCF, nested."""
    children = {}
    for i, joint in enumerate(_JOINTS):
        children.setdefault(joint[1], []).append((i, joint))
    tips = {parent: (name, origin) for name, parent, origin in _TIPS}

    def body(parent):
        text = ""
        for i, (name, _, origin, axis) in children.get(parent, []):
            text += (
                f'<body name="{name}" pos="{_words(origin)}"><joint name="{name}" '
                f'axis="{_words(axis)}" range="{LO[i]:.17g} {HI[i]:.17g}" limited="true"/>'
                '<geom size="0.005" mass="0.1"/>'
            )
            if name in tips:
                text += f'<site name="{tips[name][0]}" pos="{_words(tips[name][1])}"/>'
            text += body(name) + "</body>"
        return text

    return f'<mujoco><compiler angle="radian"/><worldbody>{body("base_link")}</worldbody></mujoco>'


def _words(values):
    return " ".join(f"{value:.17g}" for value in values)


def _written(text, name):
    """Put a description where a library can read it; return its path."""
    path = Path(tempfile.mkdtemp()) / name
    path.write_text(text, encoding="utf-8")
    return str(path)


URDF, MJCF = _written(urdf(), "body.urdf"), _written(mjcf(), "body.xml")


@jit
def hand_seen(q, j, s):
    """The hand seen from its shoulder (s: +1 right, -1 left), and its slopes by three joints."""
    cs, ss = math.cos(q[j]), math.sin(q[j])
    a, b = q[j + 1], q[j + 1] + q[j + 2]
    cb, sb = L2 * math.cos(b), L2 * math.sin(b)
    C, S = L1 * math.cos(a) + cb, L1 * math.sin(a) + sb
    slopes = (
        (s * cs * S, 0.0, s * ss * S),
        (s * ss * C, s * S, -s * cs * C),
        (s * ss * cb, s * sb, -s * cs * cb),
    )
    return (s * ss * S, -s * C, -s * cs * S), slopes


@jit
def fk(q, p):
    """Write the three tips' places into p (9,)."""
    cw, sw = math.cos(q[0]), math.sin(q[0])
    for arm in range(2):
        s, k = 1.0 - 2.0 * arm, 3 * arm
        (x, y, z), _ = hand_seen(q, 1 + k, s)
        y -= s * SY
        p[k], p[k + 1], p[k + 2] = cw * x - sw * y, sw * x + cw * y, SZ + z
    x = HX * math.cos(q[7])
    p[6], p[7], p[8] = cw * x, sw * x, HZ + HX * math.sin(q[7])


@jit
def square(q, t, p):
    """Squared residual of a pose; p (9,) is scratch."""
    fk(q, p)
    f = 0.0
    for i in range(9):
        d = p[i] - t[i]
        f += d * d
    return f


@jit
def errors(q, t):
    """Residual r (9,) and Jacobian by columns, J[i] = dr/dq_i, (8, 9)."""
    r = np.empty(9)
    J = np.zeros((8, 9))
    cw, sw = math.cos(q[0]), math.sin(q[0])
    for arm in range(2):
        s, k = 1.0 - 2.0 * arm, 3 * arm
        (x, y, z), slopes = hand_seen(q, 1 + k, s)
        y -= s * SY
        J[0, k], J[0, k + 1] = -sw * x - cw * y, cw * x - sw * y
        r[k], r[k + 1], r[k + 2] = J[0, k + 1] - t[k], sw * x + cw * y - t[k + 1], SZ + z - t[k + 2]
        for i in range(3):
            dx, dy, dz = slopes[i]
            j = 1 + k + i
            J[j, k], J[j, k + 1], J[j, k + 2] = cw * dx - sw * dy, sw * dx + cw * dy, dz
    ch, sh = HX * math.cos(q[7]), HX * math.sin(q[7])
    r[6], r[7], r[8] = cw * ch - t[6], sw * ch - t[7], HZ + sh - t[8]
    J[0, 6], J[0, 7] = -sw * ch, cw * ch
    J[7, 6], J[7, 7], J[7, 8] = -cw * sh, -sw * sh, ch
    return r, J


@jit
def sum_squares(r):
    f = 0.0
    for i in range(9):
        f += r[i] * r[i]
    return f


@jit
def normal(J, r, H, c):
    """H = J J', c = J r (J by columns); returns the sum of squares."""
    for a in range(8):
        v = 0.0
        for k in range(9):
            v += J[a, k] * r[k]
        c[a] = v
        for b in range(a + 1):
            v = 0.0
            for k in range(9):
                v += J[a, k] * J[b, k]
            H[a, b] = H[b, a] = v
    return sum_squares(r)
