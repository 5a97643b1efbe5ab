"""Perform a gesture and draw it: a strip of moments, a film, and the paths of the hands."""

from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection
from PIL import Image

from miburi.bma.settings import Settings
from miburi.bodies.rehearsal import PERIOD, Rehearsal, rehearse
from miburi.feelings import Expression
from miburi.gestures import MovementFunction, key_poses
from miburi.robot import Array, Robot
from miburi.studies import face as faces
from miburi.studies.figures import PRINT, figure_file
from miburi.studies.film import Camera, Picture, Scene, camera, contact_sheet, write_film
from miburi.studies.gestures.check import MOST_ERROR
from miburi.studies.gestures.measures import Measures, measure

#: The width and height, in pixels, of films and of a strip's pictures.
_PIXELS = 320
#: A film shows every third record: 16.7 pictures a second.
_FILM_EVERY = 3
#: A strip shows this many moments, this many seconds apart. Together they span about the time of a
#: thrill at a low mood, without its repetition.
_MOMENTS, STRIP_STEP = 12, 0.4
_STRIP_COLUMNS = 6
#: Each moment is blended with earlier pictures, so that a still picture shows motion. Each row has
#: a picture's time before the moment, in s, and its weight.
_TRAIL = ((0.0, 0.62), (0.08, 0.19), (0.16, 0.12), (0.24, 0.07))
#: Colours of the right hand, the left hand and the head.
_COLOURS = ("#d9553f", "#2f6f9f", "#8a7f74")


@dataclass(frozen=True)
class Pictures:
    """A gesture performed at one mood, and the names of its files."""

    function: MovementFunction
    mood: float
    rehearsal: Rehearsal
    strip: str
    film: str
    paths: str

    @property
    def fault(self) -> str:
        """Why the gesture is not shown whole, in words; empty if it is."""
        stop, off = self.rehearsal.stop, self.rehearsal.ik_error
        if stop is not None:
            where = "" if stop.motor is None else f" at the {stop.motor.replace('_', ' ')}"
            return f"not shown whole: the contact rule stopped it after {stop.time:.2f} s{where}"
        return f"not as written: a pose is missed by {1e3 * off:.0f} mm" if off > MOST_ERROR else ""

    @property
    def measures(self) -> Measures:
        """Laban's effort in the motion; this needs SciPy."""
        return measure(self.rehearsal.positions, PERIOD)


def camera_on(robot: Robot) -> AbstractContextManager[Camera]:
    """Open a camera for strips; see :func:`miburi.studies.film.camera`."""
    return camera(robot, _PIXELS, _PIXELS)


def show(
    robot: Robot,
    function: MovementFunction,
    mood: float,
    folder: Path,
    camera: Camera,
    *,
    face: bool = False,
    settings: Settings | None = None,
) -> Pictures:
    """Perform a gesture and write its strip, film and hand paths into ``folder``.

    With ``face`` the phone shows the feeling's face; otherwise its screen is blank. ``settings``
    are for the inverse kinematics.
    """
    screen = faces.face(Expression(function.feeling, mood)) if face else None
    rehearsal = rehearse(robot, key_poses(robot, function, mood), settings)
    stem = f"{function.name}-{mood:g}"
    strip_file = folder / f"{stem}-strip.png"
    Image.fromarray(strip(camera, rehearsal, screen)).save(strip_file)
    return Pictures(
        function,
        mood,
        rehearsal,
        strip=strip_file.name,
        film=film(robot, rehearsal, folder / f"{stem}.mp4", screen).name,
        paths=paths(robot, rehearsal, folder / f"{stem}-paths.png").name,
    )


def strip(camera: Camera, rehearsal: Rehearsal, face: Picture | None = None) -> Picture:
    """Draw the first 4.4 s: twelve moments, 0.4 s apart, in two rows, each with a fading trail."""
    times = STRIP_STEP * np.arange(_MOMENTS)
    moments = [_moment(camera, rehearsal.angles, time, face) for time in times]
    return contact_sheet(moments, _STRIP_COLUMNS)


def film(
    robot: Robot,
    rehearsal: Rehearsal,
    path: Path,
    face: Picture | None = None,
    *,
    pixels: int = _PIXELS,
    every: int = _FILM_EVERY,
) -> Path:
    """Write a film of a performance in real time; see :func:`miburi.studies.film.write_film`.

    The film is ``pixels`` wide and high. Every ``every``-th record becomes a frame; 1 gives 50
    frames per second.
    """
    rate = 1 / (every * PERIOD)
    scenes = [Scene(angles, face=face) for angles in rehearsal.angles[::every]]
    last = [scenes[-1]] * round(rate / 2)
    return write_film(robot, [*scenes, *last], path, rate=rate, size=(pixels, pixels))


def paths(robot: Robot, rehearsal: Rehearsal, path: Path) -> Path:
    """Draw the paths of hands and head, from the front and from the robot's right."""
    size = robot.lengths
    arm = size.L23 + size.L34
    side = round(1e3 * (size.L12 + arm)) + 20
    low, high = round(1e3 * (size.L01 - arm)) - 30, round(1e3 * (size.L01 + arm)) + 30
    views = (("from the front", 1, "y"), ("from the robot's right", 0, "x"))
    with figure_file(path, (5.2, 2.7), {**PRINT, "font.size": 8}) as figure:
        axes = figure.subplots(1, 2)
        for ax, (title, across, letter) in zip(axes, views, strict=True):
            for number, (name, colour) in enumerate(
                zip(("right hand", "left hand", "head"), _COLOURS, strict=True)
            ):
                track = rehearsal.positions[:, 3 * number : 3 * number + 3][:, [across, 2]] * 1e3
                pieces = np.stack([track[:-1], track[1:]], axis=1)
                fade = np.linspace(0.25, 1.0, len(pieces))
                ax.add_collection(LineCollection(list(pieces), colors=colour, alpha=fade, lw=1.6))
                ax.plot(*track[0], "o", ms=3, color=colour, label=name)
            ax.set(xlabel=f"{letter} [mm]", xlim=(-side, side), ylim=(low, high), aspect="equal")
            ax.set_title(title, fontsize=8)
        axes[0].set(ylabel="z [mm]")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3,
                      frameon=False)  # fmt: skip
    return path


def _moment(camera: Camera, angles: Array, time: float, face: Picture | None) -> Picture:
    def at(moment: float) -> Array:
        index = min(max(round(moment / PERIOD), 0), len(angles) - 1)
        return camera.picture(Scene(angles[index], face=face)).astype(np.float64)

    faded = np.sum([share * at(time - ago) for ago, share in _TRAIL], axis=0)
    picture: Picture = faded.round().astype(np.uint8)
    return picture
