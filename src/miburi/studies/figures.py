"""Write figures for print, without a screen."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any

import matplotlib
from matplotlib.figure import Figure

INK, CORAL, BLUE, GREY = "#2b2b2b", "#d9553f", "#2f6f9f", "#9a9a9a"
#: Small type, and no line above or to the right of a plot.
PRINT: Any = {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}


@contextmanager
def figure_file(
    path: Path,
    size: tuple[float, float],
    style: Any = None,
    dpi: int = 130,
    about: Mapping[str, str] = MappingProxyType({}),
) -> Iterator[Figure]:
    """Yield a figure; write it to ``path`` at the end of the block. ``size`` is in inches.

    ``about`` becomes the picture's metadata.
    """
    with matplotlib.rc_context(style):
        figure = Figure(figsize=size, layout="constrained")
        yield figure
        figure.savefig(path, dpi=dpi, metadata={"Software": None, **about})
