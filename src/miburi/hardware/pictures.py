"""Draw each step of the assembly as a line-and-tone picture, from the same solids as the parts.

MuJoCo renders the tones and a depth image; lines are drawn where the depth changes sharply or
another object begins. Pictures are arrays of uint8 with shape (height, width, 3).
"""

import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from math import pi
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from miburi.hardware import servo
from miburi.hardware.build import PrintedPart, Solid, bodies, link_frames, printed_parts
from miburi.hardware.exports import stl
from miburi.hardware.places import mounts
from miburi.hardware.screws import drawn_screw, screws
from miburi.hardware.solids import Manifold, moved
from miburi.hardware.wiring import ballast, buffer_board, cables, card, hub_board, wire
from miburi.robot import Robot
from miburi.robot.description import JOINTS, Array
from miburi.robot.physics import mujoco
from miburi.robot.shape import BASE

Picture = NDArray[np.uint8]

_WIDTH, _HEIGHT, _CAPTION = 1100, 730, 90
#: Pictures are drawn at this many times their final resolution, for smooth lines.
_FINE = 2
#: Where the second difference of the depth is above this, in m, an edge is drawn.
_BEND = 0.0007
_COLOURS = {
    "new": (0.96, 0.62, 0.50),
    "printed": (0.93, 0.90, 0.85),
    "servo": (0.45, 0.47, 0.50),
    "phone": (0.30, 0.33, 0.36),
    "screw": (0.20, 0.42, 0.62),
    "wire": (0.98, 0.78, 0.10),
}


@dataclass(frozen=True)
class BuildStep:
    """A step of the assembly.

    Attributes
    ----------
    title
        What is done, as the picture's heading.
    adds
        The name and the offset of each added part. The part is drawn at this offset from its final
        place, in mm in its link's frame.
    shows
        Which of the things that are already there are shown; ``*`` for all.
    groups
        The groups of screws that hold the added parts. Each group also names a part, whose offset
        the screws share; with "" the screws have no offset.
    words
        Other things to do or to check.
    view
        The camera's azimuth and elevation, degrees.
    pulled
        How far the screws are shown out of their holes, mm.
    pose
        The angles, in rad, of joints that differ from the straight pose.
    cables
        The cables to draw: each one's name, and the range of its points.
    """

    title: str
    adds: tuple[tuple[str, tuple[float, float, float]], ...]
    shows: tuple[str, ...]
    groups: tuple[tuple[str, str], ...] = ()
    words: str = ""
    view: tuple[float, float] = (150.0, -20.0)
    pulled: float = 14.0
    pose: Mapping[str, float] = field(default_factory=dict)
    cables: tuple[tuple[str, int, int], ...] = ()


_FOOT = ("foot", "lid", "column", "waist servo")
_SHOULDERS = ("right_shoulder servo", "left_shoulder servo")
_HEAD = ("neck", "head servo")
_TRUNK = ("torso", "hub_board", *_SHOULDERS, *_HEAD)
_ARM = ("left_upper_arm", "left_fingertip servo")
_WHOLE_ARM = ("left_yoke", "left_elbow servo", "left_elbow idler", *_ARM, "left_fingertip idler")
#: A left arm that points forwards, and a bowed head.
_FORWARDS, _BOWED = {"left_shoulder": pi / 2}, {"head": 0.2}
#: Offsets, in mm, of the things being added: outwards, upwards, forwards.
_OUT, _UP, _AHEAD = (0.0, 45.0, 0.0), (0.0, 0.0, 50.0), (45.0, 0.0, 0.0)

#: The steps in order; the right arm is built like the left one.
STEPS: tuple[BuildStep, ...] = (
    BuildStep("The whole robot", (), ("*",), view=(150.0, -15.0)),
    BuildStep(
        "A servo: horn, notch, long and short end", (), ("left_fingertip servo",),
        words="Point the notch to the short end, near the axle: there the servo reads 2048.",
        view=(165.0, -15.0),
    ),
    BuildStep(
        "Servo 1 into the column, from below", (("waist servo", (0, 0, -50.0)),), ("column",),
        (("waist case", ""),),
        "First its cable. Screws from above, heads below the surface. Short end at the peg.",
        (120.0, -12.0), cables=(("waist", 0, 3),),
    ),
    BuildStep(
        "Column onto the lid", (("lid", (0, 0, -40.0)),), ("column", "waist servo"),
        (("column", "lid"),), "From below. The lid's FRONT lies under the column's FRONT.",
        (130.0, 30.0),
    ),
    BuildStep(
        "Arduino Mega and buffer board into the foot, then the ballast",
        (("card", (0.0, 0.0, 45.0)), ("buffer_board", _UP), ("ballast", (0.0, 0.0, 45.0))),
        ("foot",), (("card", "card"),),
        "USB faces the square hole; power wires enter by the round one. Board into its grooves.",
        (130.0, -40.0),
    ),
    BuildStep(
        "Lid onto the foot", tuple((name, _UP) for name in ("lid", "column", "waist servo")),
        ("foot", "card", "buffer_board", "ballast"), (("lid", "lid"),),
        "First servo 1 and the hub's wires to the buffer board. FRONT opposite the square hole.",
        (150.0, -20.0), cables=(("waist", 0, 5), ("feed", 0, 4)),
    ),
    BuildStep(
        "Torso onto the horn of servo 1", (("torso", _UP), ("hub_board", _UP)), _FOOT,
        (("waist horn", "torso"),),
        "Wires through the curved slot to the hub first. FRONT over FRONT; notch in its slot.",
        (150.0, -25.0), 165.0, cables=(("feed", 2, 6),),
    ),
    BuildStep(
        "Servos 2 and 5 into the torso, long ends down",
        tuple((name, (60.0, 0.0, -20.0)) for name in _SHOULDERS),
        ("torso", "hub_board"),
        tuple((f"{side}_shoulder case", "") for side in ("left", "right")),
        "First plug two cables into each: to the hub, and out at the back. Screws from outside.",
        (148.0, -15.0),
        cables=tuple((f"{side}_{joint}", 0, 5 if joint == "shoulder" else 4)
            for side in ("left", "right") for joint in ("shoulder", "elbow")),
    ),
    BuildStep(
        "Servo 8 into the neck, long end down", (("head servo", _OUT),), ("neck",),
        (("head case", ""),),
        "First its cable, out at the right. Horn left, screws from the right; H 8 at the back.",
        (290.0, -15.0), cables=(("head", 0, 5),),
    ),
    BuildStep(
        "Neck onto the torso", tuple((name, _UP) for name in _HEAD),
        ("torso", "hub_board", *_SHOULDERS), (("neck", "neck"),),
        "Screws from above. H 8 at the back. Its cable enters at the right, down through the roof.",
        (130.0, -15.0), cables=(("head", 0, 7),),
    ),
    BuildStep(
        "Left yoke onto the horn of servo 5", (("left_yoke", _OUT),), _TRUNK,
        (("left_shoulder horn", "left_yoke"),),
        "Screws through the holes in its side. LE 6 at the back, slot up: the notch is in it.",
        (130.0, -20.0), 70.0, _FORWARDS, (("left_elbow", 2, 5),),
    ),
    BuildStep(
        "Turn the yoke until LE 6 is up; servo 6 into it", (("left_elbow servo", _AHEAD),),
        ("left_yoke",), (("left_elbow case", ""),),
        "First servo 5's free cable and a new one. Horn forwards, long end up. Screws from behind.",
        (50.0, -25.0), cables=(("left_elbow", 4, 8), ("left_fingertip", 0, 3)),
    ),
    BuildStep(
        "Servo 7 into the left upper arm", (("left_fingertip servo", _AHEAD),),
        ("left_upper_arm",), (("left_fingertip case", ""),),
        "Servo 6's free cable first. Horn to the slotted cheek's side, long end to the fork.",
        (50.0, -25.0), cables=(("left_fingertip", 3, 6),),
    ),
    BuildStep(
        "Idlers onto the rear cheeks, from inside; shown: the cradle", (("idler", (0, 10.0, 0)),),
        ("cradle",), (("head idler", ""),),
        "Five times, onto the cheek without a slot. The idler set's on upper arms and forearms.",
        (300.0, -15.0),
    ),
    BuildStep(
        "Forearm onto servo 7", (("left_forearm", _OUT), ("left_fingertip idler", _OUT)),
        (*_ARM, "left_elbow idler"),
        (("left_fingertip horn", "left_forearm"), ("left_fingertip axle", "left_forearm")),
        "4 screws in front; 1 through the rear cheek, not tight. Arm straight: notch in the slot.",
        (130.0, -20.0),
    ),
    BuildStep(
        "Upper arm onto servo 6",
        tuple(
            (name, _OUT)
            for name in (*_ARM, "left_forearm", "left_fingertip idler", "left_elbow idler")
        ),
        (*_TRUNK, "left_yoke", "left_elbow servo"),
        (("left_elbow horn", "left_upper_arm"), ("left_elbow axle", "left_upper_arm")),
        "4 screws in front, 1 through the rear cheek, not tight. Arm out: notch in the slot.",
        (130.0, -20.0), cables=(("left_fingertip", 0, 6), ("left_elbow", 2, 8)),
    ),
    BuildStep(
        "Cradle onto servo 8", (("cradle", _AHEAD), ("idler", (0.0, 0.0, 0.0))),
        (*_TRUNK, *_WHOLE_ARM, "left_forearm"), (("head horn", "cradle"), ("head axle", "")),
        "4 screws left; 1 right, not tight. Head nearly down: notch in the left cheek's slot.",
        (235.0, -12.0), 14.0, _BOWED,
    ),
    BuildStep(
        "The jaw behind the cradle", (("jaw", (0.0, -25.0, 0)),), ("cradle", *_HEAD, "idler"),
        (("jaw", "jaw"),), "With washers; leave them loose until a phone is in.", (330.0, -15.0),
    ),
    BuildStep(
        "Chest, after the first power-on has gone well", (("chest", _UP[::-1]),), ("*",),
        (("chest", "chest"),), "Flat sides at the top. From the front.", (150.0, -15.0),
    ),
)  # fmt: skip


@lru_cache(maxsize=4)
def _things(robot: Robot, fit: float) -> tuple[Solid, ...]:
    """Return the robot's parts, with servos as a builder sees them, and with separate idlers."""
    things = [one for one in bodies(robot, printed_parts(robot, fit)) if "servo" not in one.name]
    for mount in mounts(robot):
        solid = moved(servo.portrait(), mount.frame)
        things.append(Solid(f"{mount.joint} servo", mount.link, solid))
        if mount.idler and mount.joint != "head":
            idler = moved(servo.idler(0.0), mount.frame)
            things.append(Solid(f"{mount.joint} idler", mount.link, idler))
    boards = ((card, BASE), (ballast, BASE), (buffer_board, BASE), (hub_board, "torso"))
    things += [Solid(made.__name__, link, made(robot)) for made, link in boards]
    return tuple(things)


def draw_step(robot: Robot, fit: float, number: int) -> Picture:
    """Return the picture of a step of :data:`STEPS`.

    Raises
    ------
    OutputError
        This machine cannot draw.
    """
    step = STEPS[number]
    # The assembly is shown with straight arms; the whole robot at neutral.
    pose = np.array(robot.neutral)
    if step.shows != ("*",):
        pose[:-1] = 0.0
    for joint, angle in step.pose.items():
        pose[JOINTS.index(joint)] = angle
    frames = link_frames(robot, pose)
    adds = dict(step.adds)
    shown: list[tuple[Manifold, str]] = []
    for thing in _things(robot, fit):
        if thing.name in adds:
            away = thing.solid.translate(adds[thing.name])
            shown.append((moved(away, frames[thing.link]), "new"))
        elif thing.name in step.shows or step.shows == ("*",):
            kind = (
                "phone"
                if thing.name == "phone"
                else "printed"
                if isinstance(thing, PrintedPart)
                else "servo"
            )
            shown.append((moved(thing.solid, frames[thing.link]), kind))
    ways = cables(robot)
    for name, first, last in step.cables:
        points = [
            frames[link] @ [*np.add(place, adds.get(thing, (0.0, 0.0, 0.0))), 1.0]
            for thing, link, place in ways[name][first:last]
        ]
        shown.append((wire(points), "wire"))
    groups, kinds = screws(robot), Counter[str]()
    for name, carrier in step.groups:
        for screw in groups[name]:
            kinds[screw.kind] += 1
            solid = drawn_screw(screw, step.pulled).translate(adds.get(carrier, (0.0, 0.0, 0.0)))
            shown.append((moved(solid, frames[screw.link]), "screw"))
    counted = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
    words = " ".join(part for part in (counted and f"{counted}.", step.words) if part)
    title = f"{number}. {step.title}" if number else step.title
    return _captioned(_draw(shown, step.view), [title, words])


def write_png(path: Path, picture: Picture) -> None:
    """Write a picture with few colours, so that it stays small."""
    # An octree keeps rare colours, such as those of screws and wires; a median cut would not.
    image = Image.fromarray(picture).quantize(128, Image.Quantize.FASTOCTREE)
    image.save(path, optimize=True)


def _draw(shown: Sequence[tuple[Manifold, str]], view: tuple[float, float]) -> Picture:
    root = ET.Element("mujoco")
    visual = ET.SubElement(root, "visual")
    width, height = _WIDTH * _FINE, _HEIGHT * _FINE
    ET.SubElement(visual, "global", offwidth=str(width), offheight=str(height), fovy="20")
    ET.SubElement(
        visual, "headlight", ambient="0.55 0.55 0.55", diffuse="0.45 0.45 0.45", specular="0 0 0"
    )
    ET.SubElement(visual, "map", znear="0.05", zfar="50")
    asset, world = ET.SubElement(root, "asset"), ET.SubElement(root, "worldbody")
    ET.SubElement(
        asset, "texture", type="skybox", builtin="flat", rgb1="1 1 1", width="8", height="8"
    )
    files = {}
    for number, (solid, kind) in enumerate(shown):
        name = f"thing{number}"
        files[f"{name}.stl"] = stl(solid)
        ET.SubElement(
            asset, "mesh", name=name, file=f"{name}.stl", scale="0.001 0.001 0.001", inertia="shell"
        )
        colour = " ".join(str(value) for value in _COLOURS[kind])
        ET.SubElement(world, "geom", type="mesh", mesh=name, rgba=f"{colour} 1")
    model = mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"), files)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    boxes = np.array([solid.bounding_box() for solid, _ in shown]) / 1000
    low, high = boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)
    camera = mujoco.MjvCamera()
    camera.lookat[:] = (low + high) / 2
    camera.distance = 2.7 * float(np.linalg.norm(high - low))
    camera.azimuth, camera.elevation = view
    renderer = mujoco.Renderer(model, height, width)
    try:
        renderer.update_scene(data, camera)
        tones = renderer.render().astype(np.float64)
        renderer.enable_depth_rendering()
        depth = renderer.render().astype(np.float64)
        renderer.disable_depth_rendering()
        renderer.enable_segmentation_rendering()
        which = renderer.render()[..., 0]
    finally:
        renderer.close()
    tones[which < 0] = 255.0
    tones[_lines(depth, which)] = 40.0
    smooth = tones.reshape(_HEIGHT, _FINE, _WIDTH, _FINE, 3).mean(axis=(1, 3))
    picture: Picture = smooth.astype(np.uint8)
    return picture


def _lines(depth: Array, which: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return where lines are drawn: where another thing begins, or the surface bends."""
    found = np.zeros(depth.shape, dtype=bool)
    near = np.where(which < 0, depth.max(), depth)
    for axis in (0, 1):
        before, after = np.roll(near, 1, axis), np.roll(near, -1, axis)
        found |= np.abs(before + after - 2 * near) > _BEND
        found |= np.roll(which, 1, axis) != which
    return found


def _captioned(picture: Picture, words: Sequence[str]) -> Picture:
    image = Image.new("RGB", (_WIDTH, _HEIGHT + _CAPTION), "white")
    image.paste(Image.fromarray(picture), (0, _CAPTION))
    pen = ImageDraw.Draw(image)
    for row, (text, size) in enumerate(zip(words, (30, 22), strict=False)):
        pen.text((24, 18 + 42 * row), text, fill=(40, 40, 40), font=ImageFont.load_default(size))
    return np.asarray(image)
