"""Solvers that know serial chains alone: the head gives waist and nod, then each arm is solved."""

# Matrices have capital letters, and not every peer needs all that a maker is given.
# ruff: noqa: N803, N806, ARG001

import math
import warnings

import numpy as np

from peers.body import HI, HZ, L1, L2, LO, MID, SY, SZ, hand_seen, jit


@jit
def head_split(t, out):
    """out: waist, nod, then each hand's place seen from its shoulder, the waist turned back."""
    w = min(max(math.atan2(t[7], t[6]), LO[0]), HI[0])
    cw, sw = math.cos(w), math.sin(w)
    out[0] = w
    out[1] = min(max(math.atan2(t[8] - HZ, cw * t[6] + sw * t[7]), LO[7]), HI[7])
    out[2] = cw * t[0] + sw * t[1]
    out[3] = -sw * t[0] + cw * t[1] + SY
    out[4] = t[2] - SZ
    out[5] = cw * t[3] + sw * t[4]
    out[6] = -sw * t[3] + cw * t[4] - SY
    out[7] = t[5] - SZ


@jit
def head_poses(t, out, TR, TL):
    """As head_split, with the hands' places also written into two 4x4 poses."""
    head_split(t, out)
    for i in range(3):
        TR[i, 3] = out[2 + i]
        TL[i, 3] = out[5 + i]


@jit
def _pick(QR, QL, h):
    """For each arm the closed-form solution that breaks its limits least."""
    q = MID.copy()
    q[0], q[7] = h[0], h[1]
    for o, Q in ((1, QR), (4, QL)):
        best = 1e300
        for k in range(Q.shape[0]):
            v = 0.0
            for j in range(3):
                v += max(LO[o + j] - Q[k, j], 0.0) + max(Q[k, j] - HI[o + j], 0.0)
            if v < best:
                best = v
                q[o : o + 3] = Q[k, :3]
    return q


# Both closed-form libraries want six joints: the arm's three, then a wrist that does not matter
_AXES = np.array([[0, -1, 0], [1, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0]], float)


def _offsets(side):
    P = np.zeros((7, 3))
    P[2, 1], P[3, 1] = -side * L1, -side * L2
    return P


def make_eaik(reach):
    """EAIK's HPRobot.IK, one robot per arm; of its solutions we take the one within the limits."""
    from eaik.IK_HP import HPRobot

    right, left = HPRobot(_AXES, _offsets(1.0)).IK, HPRobot(_AXES, _offsets(-1.0)).IK
    TR, TL = np.asfortranarray(np.eye(4)), np.asfortranarray(np.eye(4))
    h = np.empty(8)

    def solve(target, start):
        head_poses(target, h, TR, TL)
        return _pick(right(TR).Q, left(TL).Q, h)

    return solve


def make_ikgeo(reach):
    """IK-Geo's Robot.spherical_two_intersecting and get_ik; takes the first pose in the limits."""
    import ik_geo

    build = ik_geo.Robot.spherical_two_intersecting
    right, left = build(_AXES, _offsets(1.0)).get_ik, build(_AXES, _offsets(-1.0)).get_ik
    eye = np.eye(3).tolist()
    h = np.empty(8)
    # Plain floats: comparing them is faster than comparing array elements
    (a0, a1, a2), (b0, b1, b2) = (LO[1:4] - 1e-7).tolist(), (HI[1:4] + 1e-7).tolist()
    (c0, c1, c2), (d0, d1, d2) = (LO[4:7] - 1e-7).tolist(), (HI[4:7] + 1e-7).tolist()
    array = np.array

    def solve(target, start):
        head_split(target, h)
        w, n, x, y, z, u, v, s = h.tolist()
        q1 = q2 = q3 = q4 = q5 = q6 = 0.5
        # [::2] because every second solution differs in the wrist only
        for (r1, r2, r3, _, _, _), _ in right(eye, [x, y, z])[::2]:
            if a2 <= r3 <= b2 and a1 <= r2 <= b1 and a0 <= r1 <= b0:
                q1, q2, q3 = r1, r2, r3
                break
        for (r1, r2, r3, _, _, _), _ in left(eye, [u, v, s])[::2]:
            if c2 <= r3 <= d2 and c1 <= r2 <= d1 and c0 <= r1 <= d0:
                q4, q5, q6 = r1, r2, r3
                break
        return array((w, q1, q2, q3, q4, q5, q6, n))

    return solve


# ---------------------------------------------------------------- arms apart, by iteration
def _arms_apart(right, left):
    """Waist and nod from the head, then right and left (pose 4x4, start (3,)) -> angles (3,)."""
    TR, TL = np.asfortranarray(np.eye(4)), np.asfortranarray(np.eye(4))
    h = np.empty(8)

    def solve(target, start):
        head_poses(target, h, TR, TL)
        q = np.empty(8)
        q[0], q[7] = h[0], h[1]
        q[1:4] = right(TR, start[1:4])
        q[4:7] = left(TL, start[4:7])
        return q

    return solve


def make_rtb(reach):
    """Robotics Toolbox's ETS.ik_LM on each arm, with Chan's damping at k=0.1 and position only."""
    from roboticstoolbox import ET

    mask = np.array([1.0, 1, 1, 0, 0, 0])
    tol = 0.5 * 0.69e-4**2  # its cost is half a squared error; two arms' 0.69e-4 make under 1e-4

    def arm(side, o):
        q1, q2, q3 = np.array([LO[o : o + 3], HI[o : o + 3]]).T
        ets = ET.Ry(flip=True, qlim=q1) * ET.Rx(qlim=q2) * ET.ty(-side * L1)
        solve = (ets * ET.Rx(qlim=q3) * ET.ty(-side * L2)).ik_LM
        return lambda pose, start: solve(pose, start.copy(), 20, 60, tol, mask, True, 0.1).q

    return _arms_apart(arm(1.0, 1), arm(-1.0, 4))


@jit
def _arm_jac(x, s):
    J = np.empty((3, 3))
    slopes = hand_seen(x, 0, s)[1]
    for i in range(3):
        J[0, i], J[1, i], J[2, i] = slopes[i]
    return J


@jit
def _link(a, i, j, ty, tip):
    """Shift by ty along y, turn by a from axis i to axis j, shift by tip along the new y."""
    M = np.eye(4)
    c, s = math.cos(a), math.sin(a)
    M[i, i], M[i, j], M[j, i], M[j, j] = c, -s, s, c
    M[1, 3], M[2, 3] = ty + c * tip, s * tip
    return M


def make_ikpy(reach):
    """IKPy's Chain.inverse_kinematics_frame, with compiled links, an exact Jacobian and dogbox."""
    from ikpy.chain import Chain
    from ikpy.link import Link

    warnings.filterwarnings("ignore", module="ikpy")
    common = {"method": "dogbox", "xtol": 1e-4, "ftol": 1e-2, "gtol": 2e-7, "max_nfev": 40}

    def arm(side, o):
        links = [Link(f"link {j}", 0.1, (LO[j], HI[j])) for j in range(o, o + 3)]
        # A plain Link has no matrix of its own; these are compiled
        links[0].get_link_frame_matrix = lambda a: _link(a, 0, 2, 0.0, 0.0)
        links[1].get_link_frame_matrix = lambda a: _link(a, 1, 2, 0.0, 0.0)
        links[2].get_link_frame_matrix = lambda a: _link(a, 1, 2, -side * L1, -side * L2)
        solve = Chain(links).inverse_kinematics_frame
        options = {"jac": lambda x: _arm_jac(x, side), **common}
        return lambda pose, start: solve(pose, start, optimizer_kwargs=options)

    return _arms_apart(arm(1.0, 1), arm(-1.0, 4))
