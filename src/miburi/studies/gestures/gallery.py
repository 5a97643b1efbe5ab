"""The gallery: one page with films of every gesture at three moods."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

from miburi.gestures import Repertoire
from miburi.ground.files import whole_files
from miburi.ground.templates import render
from miburi.robot import Robot
from miburi.studies.film import add_caption, contact_sheet
from miburi.studies.gestures.measures import Measures
from miburi.studies.gestures.pictures import STRIP_STEP, Pictures, camera_on, show

MOODS = (0.3, 0.6, 0.9)
_PAGE = Path(__file__).with_suffix(".html")
#: The files that show all gestures.
_LAST = ("overview.png", "index.html")

#: The table's columns: heading, unit, factor from SI, decimals.
_COLUMNS: dict[str, tuple[str, str, float, int]] = {
    "duration": ("duration", "s", 1, 2),
    "volume": ("hull volume", "cm³", 1e6, 0),
    "path": ("path of the hands", "m", 1, 2),
    "mean_speed": ("mean speed", "m/s", 1, 3),
    "mean_acceleration": ("mean |acceleration|", "m/s²", 1, 2),
    "mean_jerk": ("mean |jerk|", "m/s³", 1, 1),
    "directness": ("directness", "", 1, 2),
    "curvature": ("curvature", "1/m", 1, 1),
}


def write_gallery(
    robot: Robot,
    repertoire: Repertoire,
    out: Path | str,
    *,
    face: bool = False,
    progress: Callable[[str], None] = lambda _: None,
) -> Path:
    """Write a page with films, strips and hand paths of every gesture at three moods.

    Return the path of ``index.html``; its pictures are in the same folder. There, ``overview.png``
    has the strips at mood 0.9, at half their size. The films and pictures of a gesture are written
    as soon as they are drawn, so an interruption leaves them there. The page and the overview come
    last; an earlier run's are deleted first.

    Raises OutputError if the folder cannot be written to, or this machine cannot draw.
    """
    out = Path(out)
    gestures: dict[str, list[Pictures]] = {}
    with camera_on(robot) as camera:
        with whole_files(out):
            for name in _LAST:
                (out / name).unlink(missing_ok=True)
        for function in repertoire.functions:
            cells = gestures[function.name] = []
            for mood in MOODS:
                progress(f"{function.name} {mood}")
                with whole_files(out) as draft:
                    cells.append(show(robot, function, mood, draft, camera, face=face))
                if cells[-1].fault:
                    progress(f"{function.name} {mood}: {cells[-1].fault}")
    page = render(
        _PAGE,
        shown=gestures,
        strip_step=STRIP_STEP,
        heads=[(heading, unit) for heading, unit, _, _ in _COLUMNS.values()],
        rows=[
            (name, cell.mood, _numbers(cell.measures))
            for name, cells in gestures.items()
            for cell in cells
        ],
    )
    with whole_files(out) as draft:
        strips = {name: Image.open(out / each[-1].strip) for name, each in gestures.items()}
        halves = {name: strip.convert("RGB").reduce(2) for name, strip in strips.items()}
        titled = [add_caption(np.array(half), name) for name, half in halves.items()]
        Image.fromarray(contact_sheet(titled, 2)).save(draft / _LAST[0])
        (draft / _LAST[1]).write_text(page, encoding="utf-8")
    return out / _LAST[1]


def _numbers(measures: Measures) -> list[str]:
    return [
        f"{factor * getattr(measures, key):.{decimals}f}"
        for key, (_, _, factor, decimals) in _COLUMNS.items()
    ]
