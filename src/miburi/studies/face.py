"""Pictures of the face on the phone, for films.

The pictures come from one sheet, which ``tools/draw-faces`` draws with the face page's script and
the faces that ship with Miburi; a test checks that it is up to date. The sheet has only the paper's
eight feelings: in a film, a user's own feeling has the face at rest.
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

#: The moods on the sheet, and the side of one face in pixels.
MOODS, SIZE = (0.2, 0.4, 0.6, 0.8, 1.0), 192
#: The script that draws the sheet.
SOURCE = Path(__file__).parents[1] / "studio" / "static" / "face.js"
SHEET = Path(__file__).parent / "faces.png"


def face(shown: Expression | None) -> NDArray[np.uint8]:
    """Return the face on the sheet nearest to an expression, (SIZE, SIZE, 3).

    Return the face at rest for None, and for a feeling that is not on the sheet.
    """
    if shown is None or shown.feeling not in PAPER or shown.mood < MOODS[0] / 2:
        row = column = 0
    else:
        row = 1 + PAPER.index(shown.feeling)
        column = int(np.argmin(np.abs(np.subtract(MOODS, shown.mood))))
    return _sheet()[row * SIZE : (row + 1) * SIZE, column * SIZE : (column + 1) * SIZE]


def source_digest() -> str:
    """Return the checksum of the sheet's sources; the sheet stores this checksum, too."""
    faces = json.dumps(SHIPPED.faces())
    return hashlib.sha256((SOURCE.read_text(encoding="utf-8") + faces).encode()).hexdigest()


@lru_cache(maxsize=1)
def _sheet() -> NDArray[np.uint8]:
    with Image.open(SHEET) as image:
        return np.array(image.convert("RGB"))
