"""Import MuJoCo from here, and only from here.

MuJoCo looks for a graphics backend when it is first loaded, and fails to load if the chosen backend
is missing; this module chooses one first.
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
    """Return MuJoCo's name for a graphics backend that works here without a screen, or None.

    On Linux, the backend is EGL, or else OSMesa. If neither works, the name is ``off``: physics
    runs, but drawing pictures raises an error.
    """
    if platform != "linux":
        return None
    libraries = {"egl": "libEGL.so.1", "osmesa": "libOSMesa.so.8"}
    return next((word for word, library in libraries.items() if loads(library)), "off")


if "MUJOCO_GL" not in os.environ and (_chosen := drawing_backend()):
    os.environ["MUJOCO_GL"] = _chosen

import mujoco  # noqa: E402  (it reads what was chosen)
