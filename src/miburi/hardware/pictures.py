"""Draw each step of the assembly as a line-and-tone picture, from the same solids as the parts.

MuJoCo draws the tones; lines are where its depth bends sharply or another thing begins. In goes a
robot's description; out come pictures, (height, width, 3) uint8.
"""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from miburi.hardware.build import Solid, bodies, link_frames, printed_parts
from miburi.hardware.files import stl
from miburi.hardware.solids import Manifold, moved
from miburi.robot import Robot
from miburi.robot.description import Array
from miburi.robot.physics import mujoco

__all__ = ["STEPS", "BuildStep", "draw_step", "write_png"]

Picture = NDArray[np.uint8]

_WIDTH, _HEIGHT = 1100, 820
#: How much finer is drawn than shown, for smooth lines.
_FINE = 2
#: Depth that bends by more than this, m, is an edge.
_BEND = 0.0007
_COLOURS = {
    "new": (0.96, 0.62, 0.50),
    "printed": (0.93, 0.90, 0.85),
    "servo": (0.45, 0.47, 0.50),
    "phone": (0.30, 0.33, 0.36),
}


@dataclass(frozen=True)
class BuildStep:
    """A step of the assembly.

    Attributes
    ----------
    title
        What is done.
    adds
        What comes, by name, each with the way from which it comes, mm on its own link.
    shows
        What is there already and is seen.
    screws
        What holds it, in words.
    view
        The camera's azimuth and elevation, degrees.
    """

    title: str
    adds: tuple[tuple[str, tuple[float, float, float]], ...]
    shows: tuple[str, ...]
    screws: str
    view: tuple[float, float] = (150.0, -20.0)


_FOOT = ("foot", "lid", "column", "waist servo")
_TORSO = ("torso", "neck", "head servo", "idler", "right_shoulder servo", "left_shoulder servo")
_ARM = ("left_yoke", "left_elbow servo", "left_upper_arm", "left_fingertip servo")

#: The steps in their order; the right arm is built as the left one.
STEPS: tuple[BuildStep, ...] = (
    BuildStep("The whole robot", (), ("*",), "", (150.0, -15.0)),
    BuildStep(
        "Servo 1 into the column", (("waist servo", (0, 0, -45.0)),), ("column",),
        "4 M2x8 from above, heads sunk", (130.0, 25.0),
    ),
    BuildStep(
        "Column onto the lid", (("lid", (0, 0, -45.0)),), ("column", "waist servo"),
        "4 M2.5x8 from below, through the lid", (130.0, 30.0),
    ),
    BuildStep(
        "Lid onto the foot, with the Mega and the ballast in it", (("foot", (0, 0, -70.0)),),
        ("lid", "column", "waist servo"), "4 M3x6 for the Mega; 4 M2.5x8 from above",
        (130.0, -35.0),
    ),
    BuildStep(
        "Servo 8 and its idler into the neck",
        (("head servo", (0, 45.0, 0)), ("idler", (0, -35.0, 0))), ("neck",),
        "2 M2x8 from the idler's side; M2.6x8 through the idler, which must turn freely",
        (215.0, -20.0),
    ),
    BuildStep(
        "Neck onto the torso",
        tuple((name, (0.0, 0.0, 45.0)) for name in ("neck", "head servo", "idler")),
        ("torso",), "4 M2.5x8 from inside, through the roof", (150.0, -20.0),
    ),
    BuildStep(
        "Servos 2 and 5 into the torso, horns outwards",
        (("left_shoulder servo", (60.0, 0, 0)), ("right_shoulder servo", (60.0, 0, 0))),
        ("torso", "neck", "head servo", "idler"), "4 M2x8 each, from outside, heads sunk",
        (150.0, -20.0),
    ),
    BuildStep(
        "Torso onto the horn of servo 1",
        tuple((name, (0.0, 0.0, 60.0)) for name in _TORSO), _FOOT,
        "4 M2x6 from inside the torso, downwards", (150.0, -20.0),
    ),
    BuildStep(
        "Left yoke onto the horn of servo 5", (("left_yoke", (0, 50.0, 0)),), _TORSO,
        "4 M2x6 through the empty holder", (130.0, -20.0),
    ),
    BuildStep(
        "Servo 6 and its idler into the yoke", (("left_elbow servo", (50.0, 0, 0)),),
        ("torso", "left_yoke", "left_shoulder servo"),
        "2 M2x8 from behind; the idler with its M2.6x8", (130.0, -20.0),
    ),
    BuildStep(
        "Servo 7 and its idler into the upper arm", (("left_fingertip servo", (50.0, 0, 0)),),
        ("left_upper_arm",), "2 M2x8 from behind; the idler with its M2.6x8", (130.0, -25.0),
    ),
    BuildStep(
        "Upper arm onto servo 6",
        (("left_upper_arm", (0, 55.0, 0)), ("left_fingertip servo", (0, 55.0, 0))),
        ("torso", "left_yoke", "left_elbow servo", "left_shoulder servo"),
        "4 M2x6 into the horn, 4 M2x6 into the idler", (130.0, -20.0),
    ),
    BuildStep(
        "Forearm onto servo 7", (("left_forearm", (0, 55.0, 0)),), _ARM,
        "4 M2x6 into the horn, 4 M2x6 into the idler", (130.0, -20.0),
    ),
    BuildStep(
        "Cradle onto servo 8, and its jaw", (("cradle", (45.0, 0, 0)), ("jaw", (45.0, -30.0, 0))),
        ("torso", "neck", "head servo", "idler"),
        "4 M2x6 into the horn, 4 M2x6 into the idler; 2 M3x6 hold the jaw", (215.0, -15.0),
    ),
    BuildStep(
        "Chest, after the cables", (("chest", (60.0, 0, 0)),),
        (*_FOOT, *_TORSO, "left_yoke", "right_yoke"), "4 M2x8 from the front", (150.0, -15.0),
    ),
)  # fmt: skip


@lru_cache(maxsize=4)
def _things(robot: Robot, fit: float) -> tuple[Solid, ...]:
    return tuple(bodies(robot, printed_parts(robot, fit)))


def draw_step(robot: Robot, fit: float, number: int) -> Picture:
    """Return the picture of a step of :data:`STEPS`.

    Raises
    ------
    OutputError
        This machine cannot draw.
    """
    step = STEPS[number]
    # The assembly is shown with straight arms; the whole robot at neutral.
    pose = np.array(robot.neutral) if step.shows == ("*",) else _straight(robot)
    frames = link_frames(robot, pose)
    adds = dict(step.adds)
    shown: list[tuple[Manifold, str]] = []
    for thing in _things(robot, fit):
        if thing.name in adds:
            away = thing.solid.translate(adds[thing.name])
            shown.append((moved(away, frames[thing.link]), "new"))
        elif thing.name in step.shows or step.shows == ("*",):
            kind = "phone" if thing.name == "phone" else "printed" if thing.printed else "servo"
            shown.append((moved(thing.solid, frames[thing.link]), kind))
    words = [f"{number}. {step.title}" if number else step.title, step.screws]
    return _captioned(_draw(shown, step.view), [word for word in words if word])


def _straight(robot: Robot) -> Array:
    """Return the pose with straight arms and the head at neutral, (8,) rad."""
    pose = np.zeros(len(robot.neutral))
    pose[7] = robot.neutral[7]
    return pose


def write_png(path: Path, picture: Picture) -> None:
    """Write a picture with few colours, so that it stays small."""
    Image.fromarray(picture).quantize(64).save(path, optimize=True)


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
    camera.distance = 2.9 * float(np.linalg.norm(high - low))
    camera.azimuth, camera.elevation = view
    renderer = mujoco.Renderer(model, height, width)
    try:
        renderer.update_scene(data, camera)
        tones = renderer.render().astype(np.float64)
        renderer.enable_depth_rendering()
        renderer.update_scene(data, camera)
        depth = renderer.render().astype(np.float64)
        renderer.disable_depth_rendering()
        renderer.enable_segmentation_rendering()
        renderer.update_scene(data, camera)
        which = renderer.render()[..., 0]
    finally:
        renderer.close()
    tones[which < 0] = 255.0
    lines = _lines(depth, which)
    tones[lines] = 40.0
    smooth = tones.reshape(_HEIGHT, _FINE, _WIDTH, _FINE, 3).mean(axis=(1, 3))
    picture: Picture = smooth.astype(np.uint8)
    return picture


def _lines(depth: Array, which: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return where a line is drawn: another thing begins, or the surface bends."""
    found = np.zeros(depth.shape, dtype=bool)
    near = np.where(which < 0, depth.max(), depth)
    for axis in (0, 1):
        before, after = np.roll(near, 1, axis), np.roll(near, -1, axis)
        found |= np.abs(before + after - 2 * near) > _BEND
        found |= np.roll(which, 1, axis) != which
    return found


def _captioned(picture: Picture, words: Sequence[str]) -> Picture:
    image = Image.fromarray(picture)
    pen = ImageDraw.Draw(image)
    for row, (text, size) in enumerate(zip(words, (30, 22), strict=False)):
        pen.text((24, 18 + 42 * row), text, fill=(40, 40, 40), font=ImageFont.load_default(size))
    return np.asarray(image)
