"""The face for films: pictures of the phone's own face page, drawn beforehand.

``tools/draw-faces`` makes the sheet from the page's script; a test says when it is out of date.
"""

from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from miburi.feelings import FEELINGS, Expression

#: Moods that the sheet shows, and the side of one face in pixels.
MOODS, SIZE = (0.2, 0.4, 0.6, 0.8, 1.0), 192
#: What the sheet is drawn from.
SOURCE = Path(__file__).parent / "studio" / "static" / "face.js"
SHEET = Path(__file__).parent / "faces.png"


def face(shown: Expression | None) -> NDArray[np.uint8]:
    """Return the face nearest to what is shown, (SIZE, SIZE, 3); at rest for nothing."""
    if shown is None or shown.mood < MOODS[0] / 2:
        row = column = 0
    else:
        row = 1 + FEELINGS.index(shown.feeling)
        column = int(np.argmin(np.abs(np.subtract(MOODS, shown.mood))))
    return _sheet()[row * SIZE : (row + 1) * SIZE, column * SIZE : (column + 1) * SIZE]


@lru_cache(maxsize=1)
def _sheet() -> NDArray[np.uint8]:
    with Image.open(SHEET) as image:
        return np.array(image.convert("RGB"))
