"""Solvers of a whole tree, step by step: pinocchio, placo, mink and pink."""

# Matrices have capital letters, and not every peer needs all that a maker is given.
# ruff: noqa: N803, N806, ARG002, PLR0912, PLR0915

import math

import numpy as np

from peers.body import HI, JOINTS, LO, MJCF, STOP2, TIPS, URDF, jit, normal, square, sum_squares

# Pinocchio sorts joints by name within each branch.
PIN_ORDER = np.array([0, 7, 4, 5, 6, 1, 2, 3])
PIN_BACK = np.argsort(PIN_ORDER)
LO_PIN, HI_PIN = LO[PIN_ORDER], HI[PIN_ORDER]


@jit
def _box_step(A, g, lam, q, lo, hi, qn):
    """A damped step within the limits: qn = q - (A + lam)^-1 g over the joints free to move."""
    n = q.shape[0]
    free = np.empty(n, np.int64)
    M = np.empty((n, n))
    x = np.empty(n)
    m = 0
    for i in range(n):
        qn[i] = q[i]
        if not ((q[i] <= lo[i] and g[i] > 0.0) or (q[i] >= hi[i] and g[i] < 0.0)):
            free[m] = i
            m += 1
    for rep in range(3):
        for a in range(m):  # Cholesky and forward substitution, row by row
            i = free[a]
            x[a] = -g[i]
            if rep > 0:  # those that met their limit within this step have moved already
                for k in range(n):
                    x[a] -= A[i, k] * (qn[k] - q[k])
            for b in range(a + 1):
                v = A[i, free[b]] + lam if a == b else A[i, free[b]]
                for k in range(b):
                    v -= M[a, k] * M[b, k]
                M[a, b] = math.sqrt(max(v, 1e-30)) if a == b else v / M[b, b]
            for k in range(a):
                x[a] -= M[a, k] * x[k]
            x[a] /= M[a, a]
        for a in range(m - 1, -1, -1):
            for k in range(a + 1, m):
                x[a] -= M[k, a] * x[k]
            x[a] /= M[a, a]
        before, m = m, 0
        for a in range(before):
            i = free[a]
            v = q[i] + x[a]
            if lo[i] <= v <= hi[i]:
                x[m], free[m] = v, i
                m += 1
            else:
                qn[i] = lo[i] if v < lo[i] else hi[i]
        if m in (0, before):
            break
    for a in range(m):
        qn[free[a]] = x[a]


@jit
def _pin_errors(pr, pl, ph, Jd, t):
    """Residual and Jacobian by columns, out of the tips' places and Pinocchio's world Jacobian."""
    r = np.empty(9)
    J = np.zeros((8, 9))
    for e, p in enumerate((pr, pl, ph)):
        for i in range(3):
            r[3 * e + i] = p[i] - t[3 * e + i]
        for j in range(8):
            if j == 0 or (e == 2 and j == 1) or (e == 1 and 2 <= j < 5) or (e == 0 and j >= 5):
                wx, wy, wz = Jd[3, j], Jd[4, j], Jd[5, j]
                J[j, 3 * e] = Jd[0, j] + wy * p[2] - wz * p[1]
                J[j, 3 * e + 1] = Jd[1, j] + wz * p[0] - wx * p[2]
                J[j, 3 * e + 2] = Jd[2, j] + wx * p[1] - wy * p[0]
    return r, J


@jit
def _lm_step(pr, pl, ph, Jd, t, qn, w, A, first, reach):
    """Judge pose qn and put the next to try in qn; w: q 0-7, g 8-15, cost 16, lam 17, slow 18."""
    r, J = _pin_errors(pr, pl, ph, Jd, t)
    f = sum_squares(r)
    if first or f < w[16]:
        if first:
            w[17], w[18] = 0.1, 0.0
        else:
            w[18] = w[18] + 1.0 if w[16] - f < (0.02 if reach else 1e-7) * w[16] else 0.0
            w[17] = max(w[17] * 0.5, 1e-5)
        w[16] = f
        w[:8] = qn
        if (reach and f < STOP2) or w[18] >= 2.0:
            return True
        normal(J, r, A, w[8:16])
    else:
        w[17] *= 10.0
        if w[17] > 1e6:
            return True
    q = w[:8]
    _box_step(A, w[8:16], w[17] * w[16] + 1e-12, q, LO_PIN, HI_PIN, qn)
    d = 0.0
    for i in range(8):
        d = max(d, abs(qn[i] - q[i]))
    return d < 1e-9


def _pin_body(pin):
    """Model, data, and views into Pinocchio's own memory: the tips' places, the Jacobian."""
    model = pin.buildModelFromUrdf(URDF)
    assert list(model.names)[1:] == [f"{JOINTS[i]}_joint" for i in PIN_ORDER]
    data = model.createData()
    pin.computeJointJacobians(model, data, np.zeros(8))
    pin.updateFramePlacements(model, data)
    places = [data.oMf[model.getFrameId(tip)].translation for tip in TIPS]
    return model, data, (*places, data.J)


def make_pin(reach):
    """Pinocchio's computeJointJacobians and updateFramePlacements, in a compiled LM with limits."""
    import pinocchio as pin

    model, data, views = _pin_body(pin)
    pr, pl, ph, Jd = views
    jacobians, frames = pin.computeJointJacobians, pin.updateFramePlacements
    qn, w, A = np.empty(8), np.zeros(19), np.zeros((8, 8))
    best = w[:8]
    rounds = range(26 if reach else 81)

    def solve(target, start):
        start.take(PIN_ORDER, out=qn)
        for k in rounds:
            jacobians(model, data, qn)
            frames(model, data)
            if _lm_step(pr, pl, ph, Jd, target, qn, w, A, k == 0, reach):
                break
        return best.take(PIN_BACK)

    return solve


@jit
def _permuted_square(qfull, perm, t):
    q = np.empty(8)
    for i in range(8):
        q[i] = qfull[perm[i]]
    return square(q, t, np.empty(9))


def make_placo(reach):
    """placo's KinematicsSolver.solve, three position tasks; far: its regularization damps an LM."""
    import placo

    robot = placo.RobotWrapper(URDF, placo.Flags.ignore_collisions)
    solver = placo.KinematicsSolver(robot)
    solver.mask_fbase(True)
    solver.enable_joint_limits(True)
    solver.enable_velocity_limits(False)
    tasks = [solver.add_position_task(tip, np.zeros(3)) for tip in TIPS]
    for tip, task in zip(TIPS, tasks, strict=True):
        task.configure(tip, "soft", 1.0)
    tr, tl, th = tasks
    perm = np.array([robot.get_joint_offset(f"{name}_joint") for name in JOINTS])
    robot.update_kinematics()
    state = robot.state
    q0 = state.q.copy()
    update, qp = robot.update_kinematics, solver.solve

    def near(target, start):
        q = q0.copy()
        q[perm] = start
        state.q = q
        tr.target_world, tl.target_world, th.target_world = target[:3], target[3:6], target[6:]
        best, slow = 1e9, 0
        for _ in range(20):
            update()
            try:
                qp(True)
            except RuntimeError:
                break
            f = _permuted_square(state.q, perm, target)
            if f < STOP2:
                break
            if f < best:
                slow = slow + 1 if best - f < 0.05 * best else 0
                best = f
            else:
                slow += 1
            if slow >= 3:
                break
        return state.q[perm]

    if reach:
        return near
    damper = solver.add_regularization_task(1.0)

    def far(target, start):
        q = q0.copy()
        q[perm] = start
        state.q = q
        tr.target_world, tl.target_world, th.target_world = target[:3], target[3:6], target[6:]
        update()
        best, lam, slow = _permuted_square(q, perm, target), 1e-3, 0
        for _ in range(60):
            damper.configure("damper", "soft", lam)
            try:
                qp(True)
            except RuntimeError:
                break
            qn = state.q.copy()
            f = _permuted_square(qn, perm, target)
            if f < best:
                slow = slow + 1 if best - f < 1e-5 * best else 0
                best, q, lam = f, qn, max(lam * 0.3, 1e-7)
                if slow >= 2:
                    break
            else:
                lam *= 6.0
                if lam > 1.0 or abs(qn - q).max() < 1e-6:
                    break
                state.q = q
            update()
        return q[perm]

    return far


def _qp_solver(reach, build_ik, task_class, objective, conf, evaluate, lo, hi):
    """mink's or Pink's QPs, solved by daqp; evaluate(target) -> cost, filling the objective."""
    from ctypes import c_int

    import daqp

    # No rows of inequalities: daqp takes the limits as simple bounds
    rows, sense = np.zeros((0, 8)), np.zeros(8, dtype=c_int)

    class Places(task_class):
        def compute_qp_objective(self, configuration):
            return objective

        def compute_qp_residual(self, configuration):
            """Give None, so that mink asks for the objective; the two below are never called."""

        compute_error = compute_jacobian = compute_qp_residual
        __repr__ = object.__repr__

    tasks, limits = [Places(cost=np.ones(9))], []

    def visit(target, q):
        conf.update(q)
        return evaluate(target)

    def step(q, damping):
        problem = build_ik(conf, tasks, 1.0, damping, limits)
        return q + daqp.solve(problem.P, problem.q, rows, hi - q, lo - q, sense)[0]

    def near(target, q):
        best = last = visit(target, q)
        qb, slow = q, 0
        if best < STOP2:
            return q
        for _ in range(20):
            q = step(q, 1e-7 + 0.05 * last)
            last = visit(target, q)
            slow = slow + 1 if best - last < 0.05 * best else 0
            if last < best:
                best, qb = last, q
            if best < STOP2 or slow >= 3:
                break
        return qb

    def far(target, q):  # Levenberg-Marquardt, taking no step that makes it worse
        best, lam, slow = visit(target, q), 1e-2, 0
        for _ in range(60):
            qn = step(q, lam)
            f = visit(target, qn)
            if f < best:
                slow = slow + 1 if best - f < 1e-5 * best else 0
                best, q, lam = f, qn, max(lam * 0.4, 1e-7)
                if slow >= 2:
                    break
            else:
                lam *= 6.0
                if lam > 1.0 or abs(qn - q).max() < 1e-6:
                    break
                visit(target, q)
        return q

    return near if reach else far


@jit
def _mj_normal(x, axis, anchor, t, H, c):
    """From MuJoCo's sites, joint axes and anchors to the task's H and c; returns the cost."""
    r = np.empty(9)
    J = np.zeros((8, 9))
    for e in range(3):
        for k in range(3):
            r[3 * e + k] = x[e, k] - t[3 * e + k]
        for j in range(8):
            if j == 0 or (e == 0 and 1 <= j < 4) or (e == 1 and 4 <= j < 7) or (e == 2 and j == 7):
                dx, dy, dz = x[e, 0] - anchor[j, 0], x[e, 1] - anchor[j, 1], x[e, 2] - anchor[j, 2]
                J[j, 3 * e] = axis[j, 1] * dz - axis[j, 2] * dy
                J[j, 3 * e + 1] = axis[j, 2] * dx - axis[j, 0] * dz
                J[j, 3 * e + 2] = axis[j, 0] * dy - axis[j, 1] * dx
    return normal(J, r, H, c)


def make_mink(reach):
    """mink's build_ik with one compiled task for all three places; its QP is solved by daqp."""
    import mink
    import mujoco

    model = mujoco.MjModel.from_xml_path(MJCF)
    assert tuple(model.site(i).name for i in range(3)) == TIPS
    conf = mink.Configuration(model)
    site, axis, anchor = conf.data.site_xpos, conf.data.xaxis, conf.data.xanchor
    H, c = np.zeros((8, 8)), np.zeros(8)

    def evaluate(target):
        return _mj_normal(site, axis, anchor, target, H, c)

    objective = mink.Objective(H, c)
    return _qp_solver(reach, mink.build_ik, mink.Task, objective, conf, evaluate, LO, HI)


@jit
def _pin_normal(pr, pl, ph, Jd, t, H, c):
    r, J = _pin_errors(pr, pl, ph, Jd, t)
    return normal(J, r, H, c)


def make_pink(reach):
    """Pink's build_ik with one compiled task for all three places; its QP is solved by daqp."""
    import pink
    import pinocchio as pin

    model, data, (pr, pl, ph, Jd) = _pin_body(pin)
    conf = pink.Configuration(model, data, np.zeros(8), copy_data=False)
    H, c = np.zeros((8, 8)), np.zeros(8)

    def evaluate(target):
        return _pin_normal(pr, pl, ph, Jd, target, H, c)

    run = _qp_solver(reach, pink.build_ik, pink.tasks.Task, (H, c), conf, evaluate, LO_PIN, HI_PIN)
    return lambda target, start: run(target, start.take(PIN_ORDER)).take(PIN_BACK)
