"""The body's kinematics, compiled for the search: Eq. 13 whole, linearised, or changed in a joint.

Each limb's coordinates are taken in a frame that turns with the waist (out of the shoulder,
forward, up): lengths of errors, and so Eq. 13, do not depend on the frame. Importing this module
loads Numba.
"""

from math import factorial, pi

from miburi.bma.operators import TINY, Array
from miburi.ground.compiled import compiled
from miburi.ik.problem import Work
from miburi.robot.description import Lengths

__all__ = [
    "better",
    "body_step",
    "changed",
    "changed_in_turn",
    "know",
    "linearise",
    "sine_and_cosine",
]


@compiled
def better(work: Work, pose: Array, value: float) -> None:
    """Keep the pose if its value is the best so far."""
    if value < work.value:
        work.value = value
        for j in range(8):
            work.best[j] = pose[j]


# 1/3!, 1/5! ... 1/15! and 1/4!, 1/6! ... 1/16!, with the signs of Taylor's series
_S = tuple((-1) ** k / factorial(2 * k + 1) for k in range(1, 8))
_C = tuple((-1) ** k / factorial(2 * k) for k in range(2, 9))
_QUARTER = float.fromhex("0x1.921fb544p+0")  # of a turn: its first 33 bits, and the rest
_QUARTER_REST = float.fromhex("0x1.0b4611a626331p-34")
_WHOLE = 1.5 * 2.0**52  # added and taken away, it rounds to a whole number


@compiled
def sine_and_cosine(angle: float) -> tuple[float, float]:
    """Return both, to 3e-16, for angles up to some thousands.

    Taylor's series about the nearest quarter of a turn; the first term left out is below 5e-17
    there. Without a branch, so that a loop over angles runs in parallel.
    """
    quarter = (angle * (2.0 / pi) + _WHOLE) - _WHOLE
    x = (angle - quarter * _QUARTER) - quarter * _QUARTER_REST
    z = x * x
    sine = _S[1] + z * (_S[2] + z * (_S[3] + z * (_S[4] + z * (_S[5] + z * _S[6]))))
    cosine = _C[1] + z * (_C[2] + z * (_C[3] + z * (_C[4] + z * (_C[5] + z * _C[6]))))
    sine = x + x * z * (_S[0] + z * sine)
    cosine = 1.0 - 0.5 * z + z * z * (_C[0] + z * cosine)
    half = (0.5 * quarter + _WHOLE) - _WHOLE
    odd = quarter - 2.0 * half  # -1, 0 or 1, as is the next
    turned = half - 2.0 * ((0.5 * half + _WHOLE) - _WHOLE)
    even, sign = 1.0 - odd * odd, 1.0 - 2.0 * turned * turned
    return sign * (even * sine + odd * cosine), sign * (even * cosine - odd * sine)


@compiled
def _know_angles(q: Array, sines: Array, cosines: Array) -> None:
    for j in range(q.size):  # not range(8), which would be unrolled and not done in parallel
        sines[j], cosines[j] = sine_and_cosine(q[j])


@compiled
def know(size: Lengths, work: Work, q: Array) -> float:
    """Evaluate the pose ``q``; return Eq. 13.

    Of ``work``, sines, cosines and errors are written.
    """
    _know_angles(q, work.sines, work.cosines)
    work.errors[0] = _arm_error(size, work, 0)
    work.errors[1] = _arm_error(size, work, 1)
    work.errors[2] = _head_error(size, work)
    total: float = work.errors[0] + work.errors[1] + work.errors[2]
    return total


@compiled
def changed(size: Lengths, work: Work, poses: Array, joint: int, tried: Array) -> None:
    """Evaluate poses, (k, 8), that differ from the one known in one joint.

    Writes Eq. 13 to the first row of ``tried``, (3, k); the other rows are working memory.
    """
    for i in range(poses.shape[0]):
        tried[0, i] = poses[i, joint]
    _know_angles(tried[0], tried[1], tried[2])
    _changed(size, work, joint, tried)


@compiled
def changed_in_turn(size: Lengths, work: Work, poses: Array, tried: Array) -> None:
    """Do the same for (16, 8): the first two poses differ in the first joint, and so on."""
    for i in range(16):
        tried[0, i] = poses[i, i // 2]
    _know_angles(tried[0], tried[1], tried[2])
    for joint in range(8):
        _changed(size, work, joint, tried[:, 2 * joint : 2 * joint + 2])


@compiled
def _changed(size: Lengths, work: Work, joint: int, tried: Array) -> None:
    """Write Eq. 13 for each sine and cosine of the joint, in the second and third row."""
    sine, cosine = work.sines[joint], work.cosines[joint]
    right, left, head = work.errors[0], work.errors[1], work.errors[2]
    for i in range(tried.shape[1]):
        work.sines[joint], work.cosines[joint] = tried[1, i], tried[2, i]
        if joint < 4:
            right = _arm_error(size, work, 0)
        if joint == 0 or 4 <= joint < 7:
            left = _arm_error(size, work, 1)
        if joint in (0, 7):
            head = _head_error(size, work)
        tried[0, i] = right + left + head
    work.sines[joint], work.cosines[joint] = sine, cosine


@compiled
def _arm_error(size: Lengths, work: Work, limb: int) -> float:
    """Return the squared error of a hand: 0 the right one, 1 the left."""
    target, sines, cosines = work.target, work.sines, work.cosines
    side, first = (-1.0, 4) if limb else (1.0, 1)
    x, y, z = target[3 * limb], target[3 * limb + 1], target[3 * limb + 2]
    se, ce = side * sines[first + 1], cosines[first + 1]
    sf, cf = side * sines[first + 2], cosines[first + 2]
    along = size.L12 + size.L23 * ce + size.L34 * (ce * cf - se * sf)
    out = size.L23 * se + size.L34 * (se * cf + ce * sf)
    aside = along - side * (x * sines[0] - y * cosines[0])
    ahead = out * sines[first] - (x * cosines[0] + y * sines[0])
    above = size.L01 - out * cosines[first] - z
    error: float = aside * aside + ahead * ahead + above * above
    return error


@compiled
def _head_error(size: Lengths, work: Work) -> float:
    target, sines, cosines = work.target, work.sines, work.cosines
    aside = target[6] * sines[0] - target[7] * cosines[0]
    ahead = size.LH2 * cosines[7] - (target[6] * cosines[0] + target[7] * sines[0])
    above = size.L01 + size.LH1 + size.LH2 * sines[7] - target[8]
    error: float = aside * aside + ahead * ahead + above * above
    return error


@compiled
def linearise(size: Lengths, work: Work, q: Array) -> float:
    """Evaluate the pose ``q`` with its neighbourhood; return Eq. 13.

    Of ``work``, sines, cosines, JᵀJ and the gradient are written.
    """
    target, sines, cosines = work.target, work.sines, work.cosines
    normal, gradient = work.normal, work.gradient
    _know_angles(q, sines, cosines)
    sw, cw = sines[0], cosines[0]
    reach, rise = size.LH2 * cosines[7], size.LH2 * sines[7]
    ahead = reach - (target[6] * cw + target[7] * sw)
    aside = target[6] * sw - target[7] * cw
    above = size.L01 + size.LH1 + rise - target[8]
    normal[0, 0] = reach * reach
    normal[7, 7] = reach * reach + rise * rise
    gradient[0] = 2.0 * reach * aside
    gradient[7] = 2.0 * (reach * above - rise * ahead)
    total: float = ahead * ahead + aside * aside + above * above
    total += _add_arm(size, work, 0)
    total += _add_arm(size, work, 1)
    return total


@compiled
def _add_arm(size: Lengths, work: Work, limb: int) -> float:
    """Write an arm's part of JᵀJ and 2 Jᵀe, add its part for the waist; return its part of Eq. 13.

    A column of J holds the hand's velocity sideways, forward and up, for the waist (w), the
    shoulder (s), the elbow (e) or the fingertip (f).
    """
    target, sines, cosines = work.target, work.sines, work.cosines
    normal, gradient = work.normal, work.gradient
    side, first = (-1.0, 4) if limb else (1.0, 1)
    x, y, z = target[3 * limb], target[3 * limb + 1], target[3 * limb + 2]
    ss, cs = sines[first], cosines[first]
    se, ce = side * sines[first + 1], cosines[first + 1]
    sf, cf = side * sines[first + 2], cosines[first + 2]
    sef, cef = size.L34 * (se * cf + ce * sf), size.L34 * (ce * cf - se * sf)
    along, out = size.L12 + size.L23 * ce + cef, size.L23 * se + sef
    aside = along - side * (x * sines[0] - y * cosines[0])
    ahead = out * ss - (x * cosines[0] + y * sines[0])
    above = size.L01 - out * cs - z
    w_aside, w_ahead = -side * out * ss, side * along
    s_ahead, s_above = out * cs, out * ss
    f_aside, f_swing = -side * sef, side * cef
    e_aside, e_swing = f_aside - side * size.L23 * se, f_swing + side * size.L23 * ce
    e_ahead, e_above, f_ahead, f_above = e_swing * ss, -e_swing * cs, f_swing * ss, -f_swing * cs
    normal[0, 0] += w_aside * w_aside + w_ahead * w_ahead
    normal[first, 0] = s_ahead * w_ahead
    normal[first + 1, 0] = e_aside * w_aside + e_ahead * w_ahead
    normal[first + 2, 0] = f_aside * w_aside + f_ahead * w_ahead
    normal[first, first] = s_ahead * s_ahead + s_above * s_above
    normal[first + 1, first] = e_ahead * s_ahead + e_above * s_above
    normal[first + 2, first] = f_ahead * s_ahead + f_above * s_above
    normal[first + 1, first + 1] = e_aside * e_aside + e_swing * e_swing
    normal[first + 2, first + 1] = f_aside * e_aside + f_swing * e_swing
    normal[first + 2, first + 2] = f_aside * f_aside + f_swing * f_swing
    gradient[0] += 2.0 * (w_aside * aside + w_ahead * ahead)
    gradient[first] = 2.0 * (s_ahead * ahead + s_above * above)
    gradient[first + 1] = 2.0 * (e_aside * aside + e_ahead * ahead + e_above * above)
    gradient[first + 2] = 2.0 * (f_aside * aside + f_ahead * ahead + f_above * above)
    error: float = aside * aside + ahead * ahead + above * above
    return error


@compiled
def body_step(work: Work, damping: float) -> None:
    """Write the step that ``bma.operators.residual_step`` would, using the zeros of the body's JᵀJ.

    Only the waist couples the arms, and nothing couples the head. So each arm gives its step as a
    fixed part less a multiple of the waist's step, and the waist's step follows from both arms.
    """
    normal, gradient, free, step = work.normal, work.gradient, work.free, work.step
    right, right_stiffness, right_push = _arm_step(work, damping, 1)
    left, left_stiffness, left_push = _arm_step(work, damping, 4)
    stiffness = normal[0, 0] + damping - right_stiffness - left_stiffness
    push = -0.5 * gradient[0] - right_push - left_push
    waist = free[0] * push / max(stiffness, TINY)
    step[0] = waist
    for k in range(3):
        step[1 + k] -= right[k] * waist
        step[4 + k] -= left[k] * waist
    step[7] = -0.5 * free[7] * gradient[7] / (normal[7, 7] + damping)


@compiled
def _arm_step(
    work: Work, damping: float, first: int
) -> tuple[tuple[float, float, float], float, float]:
    """Write an arm's step with the waist at rest.

    Returns by how much less it is for each radian of the waist's step, and what the arm takes
    away from the waist's stiffness and push. L D Lᵀ from the fingertip (f) to the elbow (e) and
    the shoulder (s); w is the waist.
    """
    normal, gradient, free, step = work.normal, work.gradient, work.free, work.step
    s, e, f = first, first + 1, first + 2
    fe = free[f] * free[e] * normal[f, e]
    fs = free[f] * free[s] * normal[f, s]
    es = free[e] * free[s] * normal[e, s]
    per_f = 1.0 / max(normal[f, f] + damping, TINY)
    e_by_f, s_by_f = fe * per_f, fs * per_f
    es -= e_by_f * fs
    per_e = 1.0 / max(normal[e, e] + damping - e_by_f * fe, TINY)
    s_by_e = es * per_e
    per_s = 1.0 / max(normal[s, s] + damping - s_by_f * fs - s_by_e * es, TINY)
    factors = (e_by_f, s_by_f, s_by_e, per_f, per_e, per_s)
    ws = free[0] * free[s] * normal[s, 0]
    we = free[0] * free[e] * normal[e, 0]
    wf = free[0] * free[f] * normal[f, 0]
    less = _solved(factors, ws, we, wf)
    alone = _solved(
        factors,
        -0.5 * free[s] * gradient[s],
        -0.5 * free[e] * gradient[e],
        -0.5 * free[f] * gradient[f],
    )
    step[s], step[e], step[f] = alone
    stiffness = ws * less[0] + we * less[1] + wf * less[2]
    return less, stiffness, ws * alone[0] + we * alone[1] + wf * alone[2]


@compiled
def _solved(
    factors: tuple[float, float, float, float, float, float], s: float, e: float, f: float
) -> tuple[float, float, float]:
    """Solve L D Lᵀ x = (s, e, f)."""
    e_by_f, s_by_f, s_by_e, per_f, per_e, per_s = factors
    e -= e_by_f * f
    s -= s_by_f * f + s_by_e * e
    x_s = s * per_s
    x_e = e * per_e - s_by_e * x_s
    return x_s, x_e, f * per_f - s_by_f * x_s - e_by_f * x_e
