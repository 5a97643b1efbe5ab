"""The face for films: pictures of the phone's own face page, drawn beforehand.

``tools/draw-faces`` makes the sheet from the page's script and the faces that ship with Miburi; a
test says when it is out of date. The sheet knows the paper's eight feelings as they ship: in a
film, a user's own feeling has the face at rest.
"""

import hashlib
import json
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from miburi.feelings import Expression
from miburi.feelings.catalogue import PAPER, SHIPPED

__all__ = ["MOODS", "SHEET", "SIZE", "SOURCE", "face", "source_digest"]

#: Moods that the sheet shows, and the side of one face in pixels.
MOODS, SIZE = (0.2, 0.4, 0.6, 0.8, 1.0), 192
#: The script that the sheet is drawn with.
SOURCE = Path(__file__).parents[1] / "studio" / "static" / "face.js"
SHEET = Path(__file__).parent / "faces.png"


def face(shown: Expression | None) -> NDArray[np.uint8]:
    """Return the face nearest to what is shown, (SIZE, SIZE, 3).

    It is the face at rest for nothing, and for a feeling that is not on the sheet.
    """
    if shown is None or shown.feeling not in PAPER or shown.mood < MOODS[0] / 2:
        row = column = 0
    else:
        row = 1 + PAPER.index(shown.feeling)
        column = int(np.argmin(np.abs(np.subtract(MOODS, shown.mood))))
    return _sheet()[row * SIZE : (row + 1) * SIZE, column * SIZE : (column + 1) * SIZE]


def source_digest() -> str:
    """Return the check sum of all that the sheet is drawn from; the sheet holds its own."""
    faces = json.dumps(SHIPPED.faces())
    return hashlib.sha256((SOURCE.read_text(encoding="utf-8") + faces).encode()).hexdigest()


@lru_cache(maxsize=1)
def _sheet() -> NDArray[np.uint8]:
    with Image.open(SHEET) as image:
        return np.array(image.convert("RGB"))
