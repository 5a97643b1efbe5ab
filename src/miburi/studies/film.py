"""Draw scenes of the simulated robot as pictures and films, with MuJoCo and without a screen.

ffmpeg writes the films; without it, a sheet of pictures takes the film's place. Drawing needs EGL
(Debian: libegl1 libegl-mesa0 libgl1-mesa-dri).
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from miburi.errors import OutputError
from miburi.hardware.shapes import shapes_if_it_can_be_built
from miburi.robot import JOINTS, Array, Robot
from miburi.robot.mjcf import FACE_PIXELS, HAND_AWAY, to_mjcf
from miburi.robot.physics import mujoco

Picture = NDArray[np.uint8]

#: The phone's screen, lit and empty.
BLANK: Picture = np.full((FACE_PIXELS, FACE_PIXELS, 3), (212, 228, 228), dtype=np.uint8)
#: The view of a person at the table, a little to the robot's left, in degrees (our choice).
AZIMUTH, ELEVATION = 212.0, -8.0
#: The camera looks at a point ``_BELOW`` m below the shoulders. So that raised arms fit, its
#: distance is the larger of two values: ``_BACK_OF_REACH`` times a hand's largest reach from the
#: body's axis, and ``_BACK_OF_HEIGHT`` times its largest height above the base (our choice).
_BELOW, _BACK_OF_REACH, _BACK_OF_HEIGHT = 0.01, 0.70 / 0.19, 0.70 / 0.26


class DrawingError(OutputError):
    """Pictures cannot be drawn on this machine."""


@dataclass(frozen=True)
class Scene:
    """The content of a picture; without a face, the phone's screen is blank."""

    angles: Array  # (8,) rad, the true joint angles
    hand: Array | None = None  # (7,), the human hand's position in m and quaternion
    caption: str = ""
    face: Picture | None = None  # (192, 192, 3), see miburi.studies.face


class Camera:
    """Draws the robot from one viewpoint; see :func:`camera`."""

    def __init__(self, robot: Robot, width: int, height: int) -> None:
        meshes, files = _real_shapes(robot)
        self._model = mujoco.MjModel.from_xml_string(to_mjcf(robot, meshes, face=True), files)
        self._data = mujoco.MjData(self._model)
        self._qpos = np.array([self._model.joint(name).qposadr[0] for name in JOINTS])
        self._renderer = mujoco.Renderer(self._model, height, width)
        self._camera = mujoco.MjvCamera()
        size = robot.lengths
        arm = size.L23 + size.L34
        self._camera.lookat[:] = (0.0, 0.0, round(size.L01 - _BELOW, 9))
        self._camera.distance = round(
            max(_BACK_OF_REACH * (size.L12 + arm), _BACK_OF_HEIGHT * (size.L01 + arm)), 9
        )
        self._camera.azimuth, self._camera.elevation = AZIMUTH, ELEVATION
        self._drawn: Picture | None = BLANK
        self._draw_face(None)

    def close(self) -> None:
        """Free the graphics memory."""
        self._renderer.close()

    def picture(self, scene: Scene) -> Picture:
        """Return a picture of a scene, (height, width, 3)."""
        data = self._data
        data.qpos[self._qpos] = scene.angles
        hand = scene.hand if scene.hand is not None else np.array([*HAND_AWAY, 1.0, 0, 0, 0])
        data.mocap_pos[0], data.mocap_quat[0] = hand[:3], hand[3:]
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_camlight(self._model, data)
        self._draw_face(scene.face)
        self._renderer.update_scene(data, self._camera)
        pixels: Picture = self._renderer.render()
        return add_caption(pixels, scene.caption) if scene.caption else pixels.copy()

    def _draw_face(self, face: Picture | None) -> None:
        if face is self._drawn:
            return
        self._drawn = face
        picture = BLANK if face is None else face
        # A cube's textures; the first side faces forwards, mirrored left to right and transposed.
        sides = self._model.tex("face").data.reshape(6, FACE_PIXELS, FACE_PIXELS, 3)
        sides[:] = picture[0, 0]
        sides[0] = picture[:, ::-1].transpose(1, 0, 2)
        self._model.tex("tint").data.reshape(-1, 3)[:] = picture[0, 0]
        self._renderer._gl_context.make_current()
        for name in ("face", "tint"):
            texture = self._model.tex(name).id
            mujoco.mjr_uploadTexture(self._model, self._renderer._mjr_context, texture)


def _real_shapes(robot: Robot) -> tuple[dict[tuple[str, str], str] | None, dict[str, bytes]]:
    """Return the names and contents of a robot's shape files; none if the robot can't be built."""
    solids = shapes_if_it_can_be_built(robot)
    if not solids:
        return None, {}
    from miburi.hardware.exports import stl  # which needs the extra ``hardware``

    names = {key: f"{'-'.join(key)}.stl" for key in solids}
    return names, {names[key]: stl(solid) for key, solid in solids.items()}


@contextmanager
def camera(robot: Robot, width: int = 640, height: int = 480) -> Iterator[Camera]:
    """Open a camera on the robot; width and height are even numbers of pixels.

    Raises DrawingError if this machine cannot draw; the message names the missing packages.
    """
    try:
        opened = Camera(robot, width, height)
    except Exception as error:  # each graphics layer has its own errors
        why = "no EGL" if os.environ.get("MUJOCO_GL") == "off" else error
        advice = (
            "On Debian: apt install libegl1 libegl-mesa0 libgl1-mesa-dri"
            if sys.platform == "linux"
            else "It needs a screen and a graphics driver with OpenGL."
        )
        raise DrawingError(f"cannot draw pictures here ({why}). {advice}") from error
    try:
        yield opened
    finally:
        opened.close()


def write_film(
    robot: Robot,
    scenes: Sequence[Scene],
    path: Path,
    *,
    rate: float = 25,
    size: tuple[int, int] = (640, 480),
    progress: Callable[[int], None] = lambda _: None,
) -> Path:
    """Write an MP4 film of scenes with ``rate`` frames per second; ``size`` is in pixels.

    Return the file: ``path`` with the suffix ``.mp4``. Without ffmpeg, the file is a sheet of
    twelve pictures instead, with the suffix ``.sheet.png``.

    Raises DrawingError if this machine cannot draw; OutputError if ffmpeg fails.
    """
    with camera(robot, *size) as opened:
        program = shutil.which("ffmpeg")
        if program is None:
            chosen = [scenes[i] for i in np.linspace(0, len(scenes) - 1, 12).astype(int)]
            sheet = path.with_suffix(".sheet.png")
            Image.fromarray(contact_sheet([opened.picture(s) for s in chosen], 4)).save(sheet)
            return sheet
        film = path.with_suffix(".mp4")
        shown, drawn = scenes[0], opened.picture(scenes[0])
        command = [
            program, "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24",
            "-s", f"{drawn.shape[1]}x{drawn.shape[0]}", "-r", str(rate), "-i", "-",
            "-c:v", "libx264", "-preset", "veryfast", "-pix_fmt", "yuv420p", "-crf", "23",
            "-movflags", "+faststart", str(film),
        ]  # fmt: skip
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:  # noqa: S603  (no shell)
            stdin, stderr = process.stdin, process.stderr
            if stdin is None or stderr is None:
                raise OutputError("ffmpeg has no input")
            try:
                for index, scene in enumerate(scenes):
                    if scene is not shown:  # a held scene is drawn once
                        shown, drawn = scene, opened.picture(scene)
                    stdin.write(drawn.tobytes())
                    progress(index + 1)
                stdin.close()
            except BrokenPipeError:
                pass  # ffmpeg has ended; its message comes below
            words = stderr.read().decode().strip()
            if process.wait() != 0:
                raise OutputError(f"{film}: ffmpeg could not write the film: {words}")
        return film


def contact_sheet(pictures: Sequence[Picture], columns: int) -> Picture:
    """Return pictures of one size in rows of ``columns``; empty places are white."""
    blank = np.full_like(pictures[0], 255)
    padded = [*pictures, *[blank] * (-len(pictures) % columns)]
    rows = [np.hstack(padded[i : i + columns]) for i in range(0, len(padded), columns)]
    sheet: Picture = np.vstack(rows)
    return sheet


def add_caption(picture: Picture, caption: str) -> Picture:
    """Return a picture with lines of text in its upper left corner."""
    # This font ships with Matplotlib, so pictures look the same on every machine.
    path = Path(matplotlib.get_data_path()) / "fonts/ttf/DejaVuSans.ttf"
    font = ImageFont.truetype(str(path), max(12, picture.shape[0] // 24))
    image = Image.fromarray(picture)
    margin = font.size / 2
    ImageDraw.Draw(image).multiline_text(
        (margin, margin), caption, font=font, fill=(60, 48, 42), spacing=margin / 2
    )
    return np.array(image)
