"""Other people's solvers behind one face: (target (9,) m, starting pose (8,)) → pose (8,).

Every one gets the same body, limits and start, and is stopped by its own rules or once all
extremities are within 1e-4 m. A peer that is not installed is left out.
"""

# A peer is loaded where it is wanted, and not all of them need a start.
# ruff: noqa: ARG001, ARG002

import tempfile
from pathlib import Path

import numpy as np
from scipy.optimize import differential_evolution, least_squares, minimize

from miburi.robot import JOINTS, forward, iphonoid, jacobian
from miburi.robot.shape import extremities, links

ROBOT = iphonoid()
LOWER, UPPER = ROBOT.lower, ROBOT.upper
TOLERANCE = 1e-4
FRAMES = ("right_hand", "left_hand", "head_centre")
_MOVES = {link.name: link.joint for link in links(ROBOT)}
# each joint: name, parent, origin, axis
_JOINTS = tuple(
    (link.joint, _MOVES.get(link.parent, "base"), link.position, link.axis)
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
    links = ["base", *ORDER, *FRAMES]
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

    return f'<mujoco><compiler angle="radian"/><worldbody>{body("base")}</worldbody></mujoco>'


def _words(values):
    return " ".join(f"{value:.17g}" for value in values)


def _near(q, target):
    miss = (forward(ROBOT, q) - target).reshape(3, 3)
    return np.max(np.linalg.norm(miss, axis=1)) <= TOLERANCE


def scipy_trf(_):
    def solve(target, start):
        start = np.clip(start, LOWER + 1e-9, UPPER - 1e-9)
        return least_squares(
            lambda q: forward(ROBOT, q) - target,
            start,
            jac=lambda q: jacobian(ROBOT, q),
            bounds=(LOWER, UPPER),
            gtol=1e-12,
            xtol=1e-12,
            ftol=1e-12,
        ).x

    return solve


def scipy_minimize(method):
    def solve(target, start):
        def both(q):
            e = forward(ROBOT, q) - target
            return 1e4 * (e @ e), 2e4 * (jacobian(ROBOT, q).T @ e)

        bounds = list(zip(LOWER, UPPER, strict=True))
        options = {"ftol": 1e-14, "maxiter": 300}
        found = minimize(both, start, jac=True, method=method, bounds=bounds, options=options)
        return np.clip(found.x, LOWER, UPPER)

    return solve


def pinocchio_lm(_):
    import pinocchio as pin

    model = pin.buildModelFromXML(urdf())
    data = model.createData()
    frames = [model.getFrameId(name) for name in FRAMES]
    index = [model.joints[model.getJointId(f"{name}_joint")].idx_q for name in ORDER]
    lower, upper = np.empty(8), np.empty(8)
    lower[index], upper[index] = LOWER, UPPER
    axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    def error(q, target):
        pin.framesForwardKinematics(model, data, q)
        return np.concatenate([data.oMf[f].translation for f in frames]) - target

    def solve(target, start):
        q = np.empty(8)
        q[index] = start
        e, damping = error(q, target), 1e-4
        cost = e @ e
        for _ in range(60):
            if cost <= 1e-9:
                break
            pin.computeJointJacobians(model, data, q)
            j = np.vstack([pin.getFrameJacobian(model, data, f, axes)[:3] for f in frames])
            g = j.T @ e
            free = ~(((q <= lower) & (g >= 0)) | ((q >= upper) & (g <= 0)))
            better = False
            for _ in range(12):
                s = np.zeros(8)
                h = j[:, free].T @ j[:, free] + damping * np.eye(free.sum())
                s[free] = -np.linalg.solve(h, g[free])
                new = np.clip(q + s, lower, upper)
                e_new = error(new, target)
                if e_new @ e_new < cost:
                    better = cost - e_new @ e_new > 1e-9 * cost
                    q, e, cost, damping = new, e_new, e_new @ e_new, max(damping / 4, 1e-12)
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
            miss = max(task.error_norm() for task in tasks)
            total = sum(task.error_norm() ** 2 for task in tasks)
            if miss <= TOLERANCE or abs(last - total) <= 1e-9 * total:
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
            e = (places - target).reshape(3, 3)
            total = np.sum(e**2)
            if np.max(np.linalg.norm(e, axis=1)) <= TOLERANCE or abs(last - total) <= 1e-9 * total:
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
            e = (places - target).reshape(3, 3)
            total = np.sum(e**2)
            if np.max(np.linalg.norm(e, axis=1)) <= TOLERANCE or abs(last - total) <= 1e-9 * total:
                break
            last = total
        return np.clip(configuration.q[index], LOWER, UPPER)

    return solve


def arms_apart(arm):
    """Wrap a solver of the right arm alone, (place in the waist's frame, start) → three angles.

    The waist and the nod are taken from the head, and the left arm is the right one mirrored: an
    easier problem than that of the whole body, and one that has to be taken apart by hand.
    """
    size = ROBOT.lengths

    def solve(target, start):
        waist = np.arctan2(target[7], target[6])
        cos, sin = np.cos(waist), np.sin(waist)
        turn = np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
        right, left, head = turn @ target[0:3], turn @ target[3:6], turn @ target[6:9]
        nod = np.arctan2(head[2] - size.L01 - size.LH1, head[0])
        mirrored = np.array([left[0], -left[1], left[2]])
        r, m = arm(right, start[1:4]), arm(mirrored, start[4:7] * [1, -1, -1])
        return np.clip(np.r_[waist, r, m[0], -m[1], -m[2], nod], LOWER, UPPER)

    return solve


def toolbox_arms(_):
    """Robotics toolbox, Levenberg-Marquardt in C++, which makes its own restarts."""
    import roboticstoolbox as rtb
    from spatialmath import SE3

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
    mask = np.array([1, 1, 1, 0, 0, 0], dtype=float)

    def arm(place, start):
        return chain.ik_LM(
            SE3(*place), q0=start, ilimit=30, slimit=100, tol=1e-9, mask=mask, joint_limits=True
        )[0]

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
        return chain.inverse_kinematics(place, initial_position=first, tol=1e-12)[1:4]

    return arms_apart(arm)


def scipy_evolution(_):
    def solve(target, start):
        bounds = list(zip(LOWER, UPPER, strict=True))
        return differential_evolution(
            lambda q: np.sum((forward(ROBOT, q) - target) ** 2),
            bounds,
            x0=start,
            rng=0,
            tol=1e-10,
            callback=lambda intermediate_result: _near(intermediate_result.x, target),
        ).x

    return solve


def cma_solver(_):
    import cma

    def solve(target, start):
        options = {
            "bounds": [LOWER.tolist(), UPPER.tolist()],
            "verbose": -9,
            "ftarget": 3e-9,
            "maxfevals": 42_000,
            "seed": 1,
        }
        return cma.fmin2(
            lambda q: np.sum((forward(ROBOT, q) - target) ** 2), start, 0.5, options, restarts=3
        )[0]

    return solve


def pymoo_genetic(_):
    from pymoo.algorithms.soo.nonconvex.ga import GA
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize as pymoo_minimize

    class Reach(Problem):
        def __init__(self, target):
            super().__init__(n_var=8, n_obj=1, xl=LOWER, xu=UPPER)
            self.target = target

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"] = np.sum((forward(ROBOT, x) - self.target) ** 2, axis=1)

    def solve(target, start):
        return pymoo_minimize(Reach(target), GA(pop_size=100), ("n_eval", 42_000), seed=1).X

    return solve


#: What those that solve a quadratic programme are damped with: mink's and pink's default, which
#: ``damping.py`` finds quickest on reachable targets, and what converges out of reach.
DAMPING, DAMPING_BEYOND = 1e-12, 1e-3

#: name in the table → (its maker, distribution, starts allowed, targets a round in reach and
#: out of reach; 0 where it has no answer)
PEERS = {
    "placo": (placo_solver, "placo", 20, 200, 20),
    "pinocchio, own LM": (pinocchio_lm, "pin", 20, 100, 10),
    "mink (daqp)": (mink_solver, "mink", 20, 8, 2),
    "pink (daqp)": (pink_solver, "pin-pink", 20, 8, 2),
    "robotics toolbox ik_LM (arms apart)": (toolbox_arms, "roboticstoolbox-python", 1, 300, 0),
    "ikpy (arms apart)": (ikpy_arms, "ikpy", 20, 3, 0),
    "scipy trf": (scipy_trf, "scipy", 20, 5, 4),
    "scipy L-BFGS-B": (lambda _: scipy_minimize("L-BFGS-B"), "scipy", 20, 5, 4),
    "scipy SLSQP": (lambda _: scipy_minimize("SLSQP"), "scipy", 20, 5, 4),
    "cma": (cma_solver, "cma", 1, 1, 0),
    "scipy differential evolution": (scipy_evolution, "scipy", 1, 1, 0),
    "pymoo GA, 42,000 evaluations": (pymoo_genetic, "pymoo", 1, 1, 0),
}

#: Peers one would expect, and why they are not here.
MISSING = {"optik": "is not in the package index that this was made with"}
