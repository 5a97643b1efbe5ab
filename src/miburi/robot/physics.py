"""Import MuJoCo from here, and only from here.

MuJoCo reads how to draw when it is first loaded, and does not load at all if it cannot draw that
way; this module chooses the way first.
"""

import ctypes
import os
import sys
from collections.abc import Callable

__all__ = ["drawing_backend", "mujoco"]


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def drawing_backend(
    platform: str = sys.platform, loads: Callable[[str], bool] = _loads
) -> str | None:
    """Return MuJoCo's word for what can draw here without a screen; None to let it choose.

    On Linux that is EGL, else OSMesa, else ``off``: physics runs, and pictures are refused.
    """
    if platform != "linux":
        return None
    libraries = {"egl": "libEGL.so.1", "osmesa": "libOSMesa.so.8"}
    return next((word for word, library in libraries.items() if loads(library)), "off")


if "MUJOCO_GL" not in os.environ and (_chosen := drawing_backend()):
    os.environ["MUJOCO_GL"] = _chosen

import mujoco  # noqa: E402  (it reads what was chosen)
