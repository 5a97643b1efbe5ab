"""The gallery: every gesture at three moods, on one page."""

from collections.abc import Callable
from html import escape
from pathlib import Path

import numpy as np
from PIL import Image

from miburi.files import whole_files
from miburi.film import captioned, contact_sheet
from miburi.gestures import Repertoire
from miburi.gestures.measures import Measures
from miburi.gestures.pictures import STRIP_STEP, Shown, camera_on, show
from miburi.robot import Robot

MOODS = (0.3, 0.6, 0.9)

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
    """Write films, strips and hand paths of every gesture at 0.3, 0.6 and 0.9, and a page.

    Returns
    -------
    The page, ``index.html``; all else lies beside it. ``overview.png`` shows the strips at 0.9.

    Raises
    ------
    OutputError
        The place cannot be written to, or this machine cannot draw.
    """
    shown: dict[str, list[Shown]] = {}
    with whole_files(out) as draft, camera_on(robot) as camera:
        for function in repertoire.functions:
            shown[function.name] = []
            for mood in MOODS:
                progress(f"{function.name} {mood}")
                shown[function.name].append(show(robot, function, mood, draft, camera, face=face))
        (draft / "index.html").write_text(_page(shown), encoding="utf-8")
        strips = {name: draft / cells[-1].strip for name, cells in shown.items()}
        _overview(strips).save(draft / "overview.png")
    return Path(out) / "index.html"


def _overview(strips: dict[str, Path]) -> Image.Image:
    """Put strips under each other at half their size, each with its name."""
    rows = []
    for name, path in strips.items():
        strip = Image.open(path).convert("RGB").reduce(2)
        rows.append(captioned(np.array(strip), name))
    return Image.fromarray(contact_sheet(rows, 1))


def _page(shown: dict[str, list[Shown]]) -> str:
    links = " ".join(f'<a href="#{name}">{escape(name)}</a>' for name in shown)
    sections = "".join(_section(name, cells) for name, cells in shown.items())
    rows = "".join(_row(name, cell) for name, cells in shown.items() for cell in cells)
    heads = "".join(f"<th>{h}{f'<small>{u}</small>' if u else ''}</th>"
                    for h, u, _, _ in _COLUMNS.values())  # fmt: skip
    return f"""<!doctype html>
<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>Miburi: the gestures</title>
<style>{_STYLE}</style>
<header><h1>The gestures</h1>
<p>Every gesture at three moods, performed by the simulated body. Each strip shows six moments,
{STRIP_STEP} s apart; a fading trail shows the quarter of a second before.</p>
<nav>{links} <a href="#measures">measures</a></nav></header>
{sections}
<section id="measures"><h2>Laban's effort, measured</h2>
<div class="wide"><table><tr><th>gesture</th><th>mood μ</th>{heads}</tr>{rows}</table></div>
</section>
</html>
"""


def _section(name: str, cells: list[Shown]) -> str:
    return f'<section id="{name}"><h2>{escape(name)}</h2>{"".join(map(_cell, cells))}</section>'


def _cell(cell: Shown) -> str:
    mood = cell.measured.mood
    what = f"{escape(cell.measured.feeling)} at {mood}"
    moving = (
        f'<video src="{cell.film}" controls loop muted playsinline preload="metadata" '
        f'aria-label="film of {what}"></video>'
        if cell.film.endswith(".mp4")
        else f'<img src="{cell.film}" alt="pictures from the film of {what}">'
    )
    return f"""<article><h3>μ = {mood}</h3>
<img class="strip" src="{cell.strip}" alt="six moments of {what}">
<div class="pair">{moving}<img src="{cell.paths}" alt="paths of hands and head, {what}"></div>
</article>"""


def _row(name: str, cell: Shown) -> str:
    measured = cell.measured
    start = f"<td>{escape(name)}</td><td>{measured.mood}</td>"
    return f"<tr>{start}{_numbers(measured.measures)}</tr>"


def _numbers(measures: Measures) -> str:
    return "".join(
        f"<td>{factor * getattr(measures, key):.{decimals}f}</td>"
        for key, (_, _, factor, decimals) in _COLUMNS.items()
    )


_STYLE = """
:root { color-scheme: light; }
body { margin: 0 auto; max-width: 72rem; padding: 2rem 1.5rem 4rem; background: #faf6f0;
  color: #3c302a; font: 16px/1.5 system-ui, sans-serif; }
h1 { margin: 0; font-size: 2rem; } h2 { margin: 3rem 0 0; text-transform: capitalize; }
h3 { margin: 1.2rem 0 .4rem; font-size: 1rem; font-weight: 600; color: #93786a; }
nav a { color: #c2503c; margin-right: .8rem; white-space: nowrap; }
img, video { display: block; max-width: 100%; height: auto; border-radius: 10px; }
.strip { width: 100%; }
.pair { display: grid; grid-template-columns: 2fr 3fr; gap: 1rem; margin-top: .6rem;
  align-items: start; }
.pair img { background: #fff; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; margin-top: 1rem; }
th, td { padding: .3rem .7rem; text-align: right; border-bottom: 1px solid #e6dccf; }
th { font-size: .8rem; vertical-align: bottom; font-weight: 600; }
th small { display: block; font-weight: 400; color: #93786a; }
td:first-child, th:first-child { text-align: left; }
@media (max-width: 40rem) { .pair { grid-template-columns: 1fr; } }
"""
