"""Other people's solvers behind one face: (target (9,) m, starting pose (8,)) → pose (8,).

Every one gets the same body, limits and start, and is stopped by its own rules or once the
residual is 1e-4 m. What is called once an evaluation is compiled. A peer that is not installed is
left out.
"""

# A peer is loaded where it is wanted, and not all of them need a start.
# ruff: noqa: ARG002

import tempfile
from pathlib import Path

import numba
import numpy as np
from scipy.optimize import differential_evolution, least_squares, leastsq, minimize

from miburi.ik.problem import pack
from miburi.ik.residuals import jacobian, note_errors
from miburi.robot import JOINTS, iphonoid
from miburi.robot.shape import extremities, links

ROBOT = iphonoid()
LOWER, UPPER = ROBOT.lower, ROBOT.upper
TOLERANCE = 1e-4
GOOD = TOLERANCE**2  # of Eq. 13
RECORD, SIZE = pack(ROBOT), tuple(vars(ROBOT.lengths).values())
MIDDLE, HALF = (LOWER + UPPER) / 2, (UPPER - LOWER) / 2
FRAMES = ("right_hand", "left_hand", "head_centre")
_MOVES = {link.name: link.joint for link in links(ROBOT)}
# each joint: name, parent, origin, axis
_JOINTS = tuple(
    (link.joint, _MOVES.get(link.parent, "base_link"), link.position, link.axis)
    for link in sorted(links(ROBOT), key=lambda link: JOINTS.index(link.joint))
)
_TIPS = tuple(
    (frame, _MOVES[link], point)
    for frame, (link, point) in zip(FRAMES, extremities(ROBOT).values(), strict=True)
)
ORDER = [joint[0] for joint in _JOINTS]


def urdf():
    """The body as a URDF, for those who read one."""
    inertia = (
        '<inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" '
        'ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    links = ["base_link", *ORDER, *FRAMES]
    text = [f'<link name="{name}">{inertia}</link>' for name in links]
    for i, (name, parent, origin, axis) in enumerate(_JOINTS):
        text.append(
            f'<joint name="{name}_joint" type="revolute"><parent link="{parent}"/>'
            f'<child link="{name}"/><origin xyz="{_words(origin)}"/><axis xyz="{_words(axis)}"/>'
            f'<limit lower="{LOWER[i]!r}" upper="{UPPER[i]!r}" effort="1" velocity="100"/></joint>'
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
                f'axis="{_words(axis)}" range="{LOWER[i]:.17g} {UPPER[i]:.17g}" limited="true"/>'
                '<geom size="0.005" mass="0.1"/>'
            )
            if name in tips:
                text += f'<site name="{tips[name][0]}" pos="{_words(tips[name][1])}"/>'
            text += body(name) + "</body>"
        return text

    return f'<mujoco><compiler angle="radian"/><worldbody>{body("base_link")}</worldbody></mujoco>'


def _words(values):
    return " ".join(f"{value:.17g}" for value in values)


@numba.njit
def errors(q, target):
    """Return the nine errors, (9,) m, of a pose."""
    e = np.empty(9)
    note_errors(RECORD[0], target, q, e)
    return e


@numba.njit
def costs(poses, target):
    """Return Eq. 13, (n,) m², of poses, (n, 8)."""
    found, e = np.empty(len(poses)), np.empty(9)
    for i in range(len(poses)):
        note_errors(RECORD[0], target, poses[i], e)
        found[i] = np.sum(e * e)
    return found


@numba.njit
def cost_and_slope(q, target):
    """Return Eq. 13 and its gradient, in units of a square centimetre."""
    e = errors(q, target)
    return 1e4 * np.sum(e * e), 2e4 * (jacobian(RECORD, q).T @ e)


@numba.njit
def slopes(q, _):
    return jacobian(RECORD, q)


@numba.njit
def bent_errors(u, target):
    return errors(MIDDLE + HALF * np.sin(u), target)


@numba.njit
def bent_slopes(u, _):
    return jacobian(RECORD, MIDDLE + HALF * np.sin(u)) * (HALF * np.cos(u))


def scipy_trf(_):
    def enough(intermediate_result):
        if 2 * intermediate_result.cost <= GOOD:
            raise StopIteration

    def solve(target, start):
        return least_squares(
            errors,
            np.clip(start, LOWER + 1e-9, UPPER - 1e-9),
            jac=slopes,
            bounds=(LOWER, UPPER),
            gtol=1e-12,
            xtol=1e-10,
            ftol=1e-10,
            args=(target,),
            callback=enough,
        ).x

    return solve


def scipy_lm(_):
    """MINPACK knows no limits: its variables are arcs, whose sines are the angles."""

    def solve(target, start):
        arcs = np.arcsin(np.clip((start - MIDDLE) / HALF, -0.999, 0.999))
        arcs, *_ = leastsq(
            bent_errors,
            arcs,
            (target,),
            Dfun=bent_slopes,
            full_output=True,  # else it warns
            ftol=1e-10,
            xtol=1e-10,
            maxfev=100,
        )
        return MIDDLE + HALF * np.sin(arcs)

    return solve


def scipy_minimize(method):
    bounds = list(zip(LOWER, UPPER, strict=True))
    options = {"ftol": 1e-14, "maxiter": 300}

    def enough(intermediate_result):
        if intermediate_result.fun <= 1e4 * GOOD:
            raise StopIteration

    def solve(target, start):
        found = minimize(
            cost_and_slope,
            start,
            args=(target,),
            jac=True,
            method=method,
            bounds=bounds,
            options=options,
            callback=enough,
        )
        return np.clip(found.x, LOWER, UPPER)

    return solve


@numba.njit
def _damped_step(j, e, q, lower, upper, damping):
    """Return the pose after one step of Levenberg-Marquardt inside the limits."""
    g, h = j.T @ e, j.T @ j
    for i in range(8):
        h[i, i] += damping
        if (q[i] <= lower[i] and g[i] >= 0) or (q[i] >= upper[i] and g[i] <= 0):
            h[i, :], h[:, i], h[i, i], g[i] = 0.0, 0.0, 1.0, 0.0
    return np.minimum(np.maximum(q - np.linalg.solve(h, g), lower), upper)


def pinocchio_lm(_):
    import pinocchio as pin

    model = pin.buildModelFromXML(urdf())
    data = model.createData()
    frames = [model.getFrameId(name) for name in FRAMES]
    index = [model.joints[model.getJointId(f"{name}_joint")].idx_q for name in ORDER]
    lower, upper = np.empty(8), np.empty(8)
    lower[index], upper[index] = LOWER, UPPER
    axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    places = [data.oMf[f] for f in frames]  # pinocchio writes into them
    j = np.empty((9, 8))

    def error(q, target):
        pin.framesForwardKinematics(model, data, q)
        e = np.empty(9)
        for k, place in enumerate(places):
            e[3 * k : 3 * k + 3] = place.translation
        e -= target
        return e, e.dot(e)

    def solve(target, start):
        q = np.empty(8)
        q[index] = start
        (e, cost), damping = error(q, target), 1e-4
        for _ in range(60):
            if cost <= GOOD:
                break
            pin.computeJointJacobians(model, data)
            for k, frame in enumerate(frames):
                j[3 * k : 3 * k + 3] = pin.getFrameJacobian(model, data, frame, axes)[:3]
            better = False
            for _ in range(12):
                new = _damped_step(j, e, q, lower, upper, damping)
                e_new, cost_new = error(new, target)
                if cost_new < cost:
                    better = cost - cost_new > 1e-9 * cost
                    q, e, cost, damping = new, e_new, cost_new, max(damping / 4, 1e-12)
                    break
                damping *= 4
            if not better:
                break
        return q[index]

    return solve


def placo_solver(damping):
    import placo

    folder = Path(tempfile.mkdtemp())
    (folder / "robot.urdf").write_text(urdf())
    robot = placo.RobotWrapper(str(folder), placo.Flags.ignore_collisions)
    solver = placo.KinematicsSolver(robot)
    solver.mask_fbase(True)
    solver.enable_joint_limits(True)
    tasks = []
    for name in FRAMES:
        task = solver.add_position_task(name, np.zeros(3))
        task.configure(name, "soft", 1.0)
        tasks.append(task)
    solver.add_regularization_task(damping)

    def solve(target, start):
        for task, place in zip(tasks, target.reshape(3, 3), strict=True):
            task.target_world = place
        for name, angle in zip(ORDER, start, strict=True):
            robot.set_joint(f"{name}_joint", angle)
        robot.update_kinematics()
        last = np.inf
        for _ in range(60):
            solver.solve(True)
            robot.update_kinematics()
            total = sum(task.error_norm() ** 2 for task in tasks)
            if total <= GOOD or abs(last - total) <= 1e-9 * total:
                break
            last = total
        return np.array([robot.get_joint(f"{name}_joint") for name in ORDER])

    return solve


def mink_solver(damping):
    import mink
    import mujoco

    model = mujoco.MjModel.from_xml_string(mjcf())
    configuration = mink.Configuration(model)
    tasks = [
        mink.FrameTask(name, "site", position_cost=1.0, orientation_cost=0.0) for name in FRAMES
    ]
    limits = [mink.ConfigurationLimit(model)]
    index = [model.joint(name).qposadr[0] for name in ORDER]

    def solve(target, start):
        q = np.empty(8)
        q[index] = start
        configuration.update(q)
        last = np.inf
        for _ in range(60):
            for task, name, place in zip(tasks, FRAMES, target.reshape(3, 3), strict=True):
                pose = configuration.get_transform_frame_to_world(name, "site")
                task.set_target(mink.SE3.from_rotation_and_translation(pose.rotation(), place))
            v = mink.solve_ik(configuration, tasks, 1.0, "daqp", damping=damping, limits=limits)
            configuration.integrate_inplace(v, 1.0)
            places = np.concatenate(
                [
                    configuration.get_transform_frame_to_world(n, "site").translation()
                    for n in FRAMES
                ]
            )
            places -= target
            total = places.dot(places)
            if total <= GOOD or abs(last - total) <= 1e-9 * total:
                break
            last = total
        return np.clip(configuration.q[index], LOWER, UPPER)

    return solve


def pink_solver(damping):
    import pink
    import pinocchio as pin

    model = pin.buildModelFromXML(urdf())
    data = model.createData()
    index = [model.joints[model.getJointId(f"{name}_joint")].idx_q for name in ORDER]
    tasks = [pink.FrameTask(name, position_cost=1.0, orientation_cost=0.0) for name in FRAMES]

    def solve(target, start):
        q = np.empty(8)
        q[index] = start
        configuration = pink.Configuration(model, data, q)
        last = np.inf
        for _ in range(60):
            for task, name, place in zip(tasks, FRAMES, target.reshape(3, 3), strict=True):
                pose = configuration.get_transform_frame_to_world(name)
                task.set_target(pin.SE3(pose.rotation, place))
            v = pink.solve_ik(
                configuration, tasks, 1.0, solver="daqp", damping=damping, safety_break=False
            )
            configuration.integrate_inplace(v, 1.0)
            places = np.concatenate(
                [configuration.get_transform_frame_to_world(n).translation for n in FRAMES]
            )
            places -= target
            total = places.dot(places)
            if total <= GOOD or abs(last - total) <= 1e-9 * total:
                break
            last = total
        return np.clip(configuration.q[index], LOWER, UPPER)

    return solve


@numba.njit
def _take_apart(target):
    """Return a pose with waist and nod alone, and where the hands are, seen from the waist."""
    pose, hands = np.zeros(8), np.empty((2, 3))
    pose[0] = np.arctan2(target[7], target[6])
    pose[7] = np.arctan2(target[8] - SIZE[0] - SIZE[4], np.hypot(target[6], target[7]))
    cos, sin = np.cos(pose[0]), np.sin(pose[0])
    for k, side in enumerate((1.0, -1.0)):
        x, y, z = target[3 * k : 3 * k + 3]
        hands[k] = cos * x + sin * y, side * (cos * y - sin * x), z
    return pose, hands


@numba.njit
def _put_arm(pose, first, candidates):
    """Write the first candidate inside the limits, else the last; the left arm is mirrored."""
    for row in candidates:
        inside = True
        for k in range(3):
            i, angle = first + k, -row[k] if first == 4 and k else row[k]
            angle -= 2 * np.pi * np.round((angle - MIDDLE[i]) / (2 * np.pi))
            inside &= LOWER[i] - 1e-7 <= angle <= UPPER[i] + 1e-7
            pose[i] = min(max(angle, LOWER[i]), UPPER[i])
        if inside:
            return


def arms_apart(arm):
    """Wrap a solver of the right arm alone: (place seen from the waist, start) → (n, 3) angles.

    The waist and the nod are taken from the head, and the left arm is the right one mirrored: an
    easier problem than that of the whole body, and one that has to be taken apart by hand.
    """
    mirror = np.array([1.0, -1.0, -1.0])

    def solve(target, start):
        pose, (right, left) = _take_apart(target)
        _put_arm(pose, 1, arm(right, start[1:4]))
        _put_arm(pose, 4, arm(left, start[4:7] * mirror))
        return pose

    return solve


def arm_and_wrist():
    """Return axes, (6, 3), and offsets, (7, 3) m, of the right arm with a wrist in its fingertip.

    The solvers by subproblems want a whole pose: the wrist, which no arm of ours has, takes up
    the orientation.
    """
    joints = _JOINTS[1:4]
    axes = [joint[3] for joint in joints] + [(0, 0, 1), (0, 1, 0), (0, 0, 1)]
    offsets = [*(joint[2] for joint in joints), _TIPS[0][2], *np.zeros((3, 3))]
    return np.array(axes, dtype=float), np.array(offsets, dtype=float)


def eaik_arms(_):
    from eaik.IK_HP import HPRobot

    chain, pose = HPRobot(*arm_and_wrist()), np.eye(4)

    def arm(place, _):
        pose[:3, 3] = place
        return chain.IK(pose).Q

    return arms_apart(arm)


def ik_geo_arms(_):
    from ik_geo import Robot

    upright = np.eye(3).tolist()
    chain = Robot.spherical_two_intersecting(*(part.tolist() for part in arm_and_wrist()))

    def arm(place, _):
        return np.array([angles for angles, _ in chain.get_ik(upright, place)])

    return arms_apart(arm)


def toolbox_arms(_):
    """Robotics toolbox, Levenberg-Marquardt in C++, which makes its own restarts."""
    import roboticstoolbox as rtb

    size = ROBOT.lengths
    low, high = LOWER[1:4], UPPER[1:4]
    chain = rtb.ETS(
        [
            rtb.ET.ty(-size.L12),
            rtb.ET.tz(size.L01),
            rtb.ET.Ry(flip=True, qlim=[low[0], high[0]]),
            rtb.ET.Rx(qlim=[low[1], high[1]]),
            rtb.ET.ty(-size.L23),
            rtb.ET.Rx(qlim=[low[2], high[2]]),
            rtb.ET.ty(-size.L34),
        ]
    )
    mask, pose = np.array([1, 1, 1, 0, 0, 0], dtype=float), np.eye(4)

    def arm(place, start):
        pose[:3, 3] = place
        return chain.ik_LM(
            pose, q0=start, ilimit=30, slimit=100, tol=1e-9, mask=mask, joint_limits=True
        )[0][None]

    return arms_apart(arm)


def ikpy_arms(_):
    """Serial chains are all that ikpy knows; it calls SciPy's least squares."""
    from ikpy.chain import Chain
    from ikpy.link import OriginLink, URDFLink

    upright, links = [0, 0, 0], [OriginLink()]
    for i, (name, _parent, origin, axis) in enumerate(_JOINTS[1:4], start=1):
        bounds = (LOWER[i], UPPER[i])
        links.append(URDFLink(name, list(origin), upright, rotation=list(axis), bounds=bounds))
    tip = list(_TIPS[0][2])
    links.append(URDFLink("right_hand", tip, upright, joint_type="fixed", rotation=None))
    chain = Chain(links, active_links_mask=[False, True, True, True, False])

    def arm(place, start):
        first = np.r_[0.0, np.clip(start, LOWER[1:4] + 2e-3, UPPER[1:4] - 2e-3), 0.0]
        return chain.inverse_kinematics(place, initial_position=first, tol=1e-8)[None, 1:4]

    return arms_apart(arm)


def scipy_evolution(_):
    bounds = list(zip(LOWER, UPPER, strict=True))

    def enough(intermediate_result):
        return intermediate_result.fun <= GOOD

    def solve(target, start):
        return differential_evolution(
            lambda x: costs(np.ascontiguousarray(x.T), target),
            bounds,
            x0=start,
            rng=0,
            tol=0,
            maxiter=1000,
            popsize=8,
            polish=False,
            updating="deferred",
            vectorized=True,
            callback=enough,
        ).x

    return solve


def cma_solver(_):
    """Ask, evaluate all, tell; the starts after the first are the benchmark's."""
    import cma

    options = {
        "bounds": [LOWER.tolist(), UPPER.tolist()],
        "verbose": -9,
        "ftarget": GOOD,
        "maxfevals": 10_000,
        "popsize": 16,
        "seed": 1,
    }

    def solve(target, start):
        search = cma.CMAEvolutionStrategy(start, 0.5, options)
        while not search.stop():
            points = search.ask()
            search.tell(points, costs(np.array(points), target).tolist())
        return search.result.xbest

    return solve


def pymoo_evolution(_):
    from pymoo.algorithms.soo.nonconvex.de import DE
    from pymoo.core.problem import Problem
    from pymoo.core.termination import TerminateIfAny
    from pymoo.optimize import minimize as pymoo_minimize
    from pymoo.termination.fmin import MinimumFunctionValueTermination
    from pymoo.termination.max_eval import MaximumFunctionCallTermination

    class Reach(Problem):
        def __init__(self, target):
            super().__init__(n_var=8, n_obj=1, xl=LOWER, xu=UPPER)
            self.target = target

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"] = costs(x, self.target)

    def solve(target, start):
        ends = TerminateIfAny(
            MinimumFunctionValueTermination(GOOD), MaximumFunctionCallTermination(10_000)
        )
        search = DE(pop_size=100, variant="DE/best/1/bin", CR=0.9, F=0.6)
        seed = int(1e6 * np.abs(start).sum())  # each start draws another population
        return pymoo_minimize(Reach(target), search, ends, seed=seed).X

    return solve


#: What those that solve a quadratic programme are damped with: mink's and pink's default, which
#: ``damping.py`` finds quickest on reachable targets, and what converges out of reach.
DAMPING, DAMPING_BEYOND = 1e-12, 1e-3

#: name in the table → (its maker, distribution, starts allowed, targets a round in reach and
#: out of reach; 0 where it has no answer)
PEERS = {
    "EAIK (arms apart)": (eaik_arms, "eaik", 1, 500, 0),
    "IK-Geo (arms apart)": (ik_geo_arms, "ik-geo", 1, 500, 0),
    "placo": (placo_solver, "placo", 20, 200, 20),
    "pinocchio, own LM": (pinocchio_lm, "pin", 20, 100, 10),
    "mink (daqp)": (mink_solver, "mink", 20, 8, 5),
    "pink (daqp)": (pink_solver, "pin-pink", 20, 8, 5),
    "robotics toolbox ik_LM (arms apart)": (toolbox_arms, "roboticstoolbox-python", 1, 300, 0),
    "ikpy (arms apart)": (ikpy_arms, "ikpy", 20, 5, 0),
    "scipy trf": (scipy_trf, "scipy", 20, 10, 5),
    "scipy leastsq, angles as sines": (scipy_lm, "scipy", 20, 100, 10),
    "scipy L-BFGS-B": (lambda _: scipy_minimize("L-BFGS-B"), "scipy", 20, 10, 5),
    "scipy SLSQP": (lambda _: scipy_minimize("SLSQP"), "scipy", 20, 10, 5),
    "cma": (cma_solver, "cma", 20, 5, 0),
    "scipy differential evolution": (scipy_evolution, "scipy", 1, 5, 0),
    "pymoo DE": (pymoo_evolution, "pymoo", 20, 5, 0),
}

#: Peers one would expect, and why they are not here.
MISSING = {
    "optik": "is not in the package index that this was made with",
    "ssik": "solves arms of six or seven joints by the subproblems that EAIK and IK-Geo solve",
}
