"""Check that a robot can be built from its parts, before anybody prints one.

This module takes a robot's description and the poses of its gestures, and returns findings, each
with a measured figure. The checks of screws and of the arms' gaps compare sizes that are the same
for every robot, cables are assumed to lie as in the pictures, and no check replaces a test print.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from miburi.errors import InputError
from miburi.hardware import balance, meetings, servo
from miburi.hardware.build import (
    FIT,
    PrintedPart,
    bodies,
    check_fit,
    link_frames,
    printed_parts,
)
from miburi.hardware.dimensions import dimensions
from miburi.hardware.exports import triangles
from miburi.hardware.head import clamp
from miburi.hardware.places import mounts
from miburi.hardware.solids import Manifold, moved, rod
from miburi.hardware.wiring import cables
from miburi.robot import Robot
from miburi.robot.description import JOINTS, Array
from miburi.robot.geometry import arm_reach
from miburi.robot.loads import GRAVITY
from miburi.robot.shape import links

#: The force of a push, in N: the 95th percentile, over the contacts in the trials, of the largest
#: mean force over 0.1 s in a contact.
_PUSH = 2.6
#: A joint may need at most these shares of the servo's stall torque, at rest and in motion.
_STANDING, _MOVING = 1 / 3, 1 / 2
#: The length of the servo maker's cable, and how much of it is inside the plugs, in mm; and the
#: ratio of a cable's true length to its length as drawn.
_CABLE, _BENDS, _WAY = 180.0, 15.0, 1.15
#: The share by which a mass may differ from the mass in the description.
_MASS = 0.10
#: Points on a part at which its wall is measured.
_POINTS = 10_000
#: Largest zero-moment radius that counts as stable, as a share of the foot's radius (our choice).
_EDGE = 0.9
#: The number of random poses in which the torques are checked.
_POSES = 5000
#: The least depth of a 2 mm screw in plastic or in a case, mm.
_GRIP = 2.0


@dataclass(frozen=True)
class Finding:
    """The result of one check.

    Attributes
    ----------
    check
        The thing that was checked.
    ok
        Whether it is as it should be.
    words
        The measured value, the allowed range, and how to correct a fault.
    """

    check: str
    ok: bool
    words: str


def check(
    robot: Robot,
    motions: Mapping[str, Array],
    period: float,
    fit: float = FIT,
    stopped: Sequence[str] = (),
) -> Iterator[Finding]:
    """Yield a finding for each property that a robot must have to be built.

    ``motions`` has the poses of each gesture, by name, one every ``period`` s: eight angles in rad.
    The gestures in ``stopped`` end where the contact rule stopped them. ``fit`` is the gap on each
    side of a pocket, in mm. If no parts can be made for this robot, the first finding says why, and
    is the only one.

    Raises
    ------
    InputError
        ``fit`` is out of range.
    """
    check_fit(fit)
    try:
        parts = printed_parts(robot, fit)
    except InputError as error:
        yield Finding("parts", False, str(error).rstrip("."))
        return
    table = meetings.by_link(bodies(robot, parts))
    poses = sum(map(len, motions.values()))
    # The quick checks come first.
    yield Finding("parts", True, f"{len(parts)} parts, each one closed solid")
    pairs = [f"{one} and {other}" for one, other in meetings.in_one_link(table)]
    yield _no("fit", pairs, "no two parts on a link overlap")
    yield _fingers(robot)
    yield _screws()
    yield _no(
        "contact rule", stopped, "it stops no gesture where nothing is touched",
        "it stops these gestures though nothing is touched; lighter or shorter links, a lower "
        "acceleration, or `miburi calibrate` help: ",
    )  # fmt: skip
    yield from _loads(robot, parts, motions, period)
    yield _cables(robot, motions)
    yield _drivers(robot, parts)
    met = [
        f"{name}: {one} and {other}"
        for name, motion in motions.items()
        for one, other in meetings.in_poses(robot, table, motion)
    ]
    yield _no("gestures", met, f"no two parts collide in {poses} poses of {len(motions)} gestures")
    loose = _angles(meetings.stops_hold(robot, table))
    yield _no("stops", loose, "each joint is stopped within 9° beyond its range", "no stop: ")
    yield _walls(printed_parts(robot, fit, engraved=False))
    met = _angles(meetings.over_the_range(robot, table, float(np.radians(5.0))))
    yield _no(
        "joints", met,
        "each link is clear of the one that carries it, over its joint's range and 5° beyond",
    )  # fmt: skip


def _no(check: str, faults: Sequence[str], otherwise: str, prefix: str = "") -> Finding:
    """Return the finding of a check: its faults, or ``otherwise`` if there are none."""
    return Finding(check, not faults, prefix + "; ".join(faults) if faults else otherwise)


def _angles(found: Iterable[tuple[str, float]]) -> list[str]:
    return [f"{joint} at {np.degrees(angle):.0f}°" for joint, angle in found]


def _walls(parts: Sequence[PrintedPart]) -> Finding:
    least = dimensions().wall.least
    thinnest, name = min((_thinnest(part.solid), part.name) for part in parts)
    words = (
        f"thinnest {thinnest:.2f} mm ({name}), at least {least:.1f} mm are needed; the plastic "
        "between engraved letters does not count"
    )
    return Finding("walls", thinnest >= least - 0.01, words)


def _thinnest(solid: Manifold) -> float:
    """Return the least distance in mm between two faces that face away from each other.

    The distance is measured at pseudo-random points with a fixed seed.
    """
    corners, faces = triangles(solid)
    a, b, c = np.moveaxis(corners[faces], 1, 0)
    normals = np.cross(b - a, c - a)
    areas = np.linalg.norm(normals, axis=1)
    rng = np.random.default_rng(0)
    chosen = rng.choice(len(faces), _POINTS, p=areas / areas.sum())
    root, share = np.sqrt(rng.random((_POINTS, 1))), rng.random((_POINTS, 1))
    points = (1 - root) * a[chosen] + root * (1 - share) * b[chosen] + root * share * c[chosen]
    inwards = -normals[chosen] / areas[chosen, None]
    found = [10.0]
    for point, way in zip(points, inwards, strict=True):
        hits = solid.ray_cast((point + 1e-3 * way).tolist(), (point + 6.0 * way).tolist())
        if hits and np.dot(hits[0].normal, way) > 0.9:
            found.append(float(np.linalg.norm(np.array(hits[0].position) - point)))
    return min(found)


def _fingers(robot: Robot) -> Finding:
    w, low, high = dimensions().wall, *dimensions().wall.joint_gap
    gaps = {
        "elbows and fingertips": w.web - w.knuckle,
        "head": min(w.web, clamp(robot).plate) - w.knuckle,
    }
    words = ", ".join(f"{name} {gap:.1f} mm" for name, gap in gaps.items())
    return Finding(
        "finger gaps", not any(low <= gap <= high for gap in gaps.values()),
        f"{words}; a joint's gap must be under {low:g} mm, too small "
        f"for a finger, or over {high:g} mm",
    )  # fmt: skip


def _loads(
    robot: Robot, parts: Sequence[PrintedPart], motions: Mapping[str, Array], period: float
) -> Iterator[Finding]:
    table = balance.weights(robot, parts)
    made = balance.description_masses(table)
    has = robot.masses.model_dump()
    off = {key: mass for key, mass in made.items() if abs(mass / has[key] - 1) > _MASS}
    said = ", ".join(f"{key} = {mass:.3f}" for key, mass in (off or made).items())
    yield Finding(
        "masses", not off, f"in the robot's file, [masses] should be {said} kg" if off
        else f"the masses in the description are within {100 * _MASS:.0f} % of the parts' masses: "
        f"{said} kg",
    )  # fmt: skip
    stall = robot.servo.model.data_sheet.stall_torque
    anywhere = np.random.default_rng(0).uniform(robot.lower, robot.upper, (_POSES, len(JOINTS)))
    poses = np.concatenate([anywhere, *motions.values()])
    for name, values, share in zip(
        ("torque standing", "torque moving"), balance.torques(robot, poses),
        (_STANDING, _MOVING), strict=True,
    ):  # fmt: skip
        worst = int(np.argmax(values))
        yield Finding(
            name, bool(values[worst] <= share * stall),
            f"greatest torque, at the {JOINTS[worst].replace('_', ' ')}: {values[worst]:.3f} N·m, "
            f"at most {share * stall:.3f} N·m ({share:.2g} of the stall torque)",
        )  # fmt: skip
    foot = 1000 * robot.shape.pedestal_radius
    far = max(balance.zero_moment_radius(robot, table, m, period) for m in motions.values())
    mass = sum(weight.mass for weight in table)
    yield Finding(
        "tipping", far < _EDGE * foot,
        f"{mass:.2f} kg on a foot of {foot:.0f} mm radius: the zero-moment point moves from "
        f"the foot's middle by {far:.0f} mm at most",
    )  # fmt: skip
    high = 1000 * (robot.shape.pedestal_height + robot.lengths.L01 + arm_reach(robot))
    push = mass * GRAVITY * (foot - 1.5) / high  # the foot's edge is cut off
    words = (
        f"a horizontal push of {push:.1f} N on a raised hand tips the robot; 95 % of contacts "
        f"push with at most {_PUSH} N"
    )
    # The robot can be built all the same, so this is not a defect.
    yield Finding(
        "push", True, words + ("" if push > _PUSH else ": tape or clamp the foot to the table")
    )


def _screws() -> Finding:
    s, w = dimensions().servo, dimensions().wall
    under = 1.3  # the plastic that remains under a recessed screw head
    grips = {
        "horn (M2x6)": 6.0 - w.plate,
        "case, front (M2x8)": 8.0 - under - s.grip_front,
        "case, back (M2x8)": 8.0 - under - s.grip_back,
    }
    words = ", ".join(f"{name} {grip:.1f} mm" for name, grip in grips.items())
    ok = min(grips.values()) >= _GRIP and grips["horn (M2x6)"] <= s.horn_depth + 1e-9
    return Finding(
        "screws", ok, f"grip {words}; a screw may go at most {s.horn_depth} mm into a horn"
    )


def _drivers(robot: Robot, parts: Sequence[PrintedPart]) -> Finding:
    """Check that a screwdriver reaches the screws of each horn before the next servo is put in."""
    s, w = dimensions().servo, dimensions().wall
    neutral = link_frames(robot, np.zeros(len(JOINTS)))
    carried = {link.joint: link.name for link in links(robot)}
    blocked = set()
    for mount in mounts(robot):
        near = s.horn_face + w.plate + 0.2
        # The chest is fitted last.
        around = {
            thing.name: moved(thing.solid, neutral[thing.link])
            for thing in parts
            if thing.link == carried[mount.joint] and thing.name not in {"chest", "neck"}
        }
        for x, z in servo.circle():
            way = rod((x, near, z), (x, near + 50.0, z), 1.9)
            way = moved(moved(way, mount.frame), neutral[mount.link])
            blocked |= {
                f"{mount.joint} ({name})"
                for name, solid in around.items()
                if (way ^ solid).volume() > 1.0
            }
    if blocked:
        words = f"no screwdriver reaches: {', '.join(sorted(blocked))}"
    else:
        words = "a screwdriver of 3.8 mm reaches the screws of all horns"
    return Finding("drivers", not blocked, words)


def _cables(robot: Robot, motions: Mapping[str, Array]) -> Finding:
    ways = {name: way for name, way in cables(robot).items() if name in JOINTS}
    poses = np.concatenate([np.array([robot.neutral]), *motions.values()])[::5]
    longest: dict[str, float] = {}
    for pose in poses:
        frames = link_frames(robot, pose)
        for joint, way in ways.items():
            points = [frames[link][:, :3] @ place + frames[link][:, 3] for _, link, place in way]
            legs = np.linalg.norm(np.diff(points, axis=0), axis=1)
            longest[joint] = max(longest.get(joint, 0.0), _WAY * float(legs.sum()) + _BENDS)
    needs, worst = max((length, joint.replace("_", " ")) for joint, length in longest.items())
    return Finding(
        "cables", needs <= _CABLE,
        f"the longest route, to the {worst}, needs {needs:.0f} mm; the servo's cable has "
        f"{_CABLE:.0f} mm" + ("" if needs <= _CABLE else "; make a longer one"),
    )  # fmt: skip
