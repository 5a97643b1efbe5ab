"""Write figures that are readable in print; this needs no screen."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

INK, CORAL, BLUE, GREY = "#2b2b2b", "#d9553f", "#2f6f9f", "#9a9a9a"
#: Small type, and no line above or to the right of a plot.
PRINT: Any = {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}


@contextmanager
def figure_file(
    path: Path, size: tuple[float, float], style: Any = None, dpi: int = 130
) -> Iterator[Figure]:
    """Yield a figure of a size in inches to draw on; when the block ends, write it to ``path``."""
    with matplotlib.rc_context(style):
        figure = Figure(figsize=size, layout="constrained")
        yield figure
        figure.savefig(path, dpi=dpi, metadata={"Software": None})
