"""Import MuJoCo from here, and only from here.

MuJoCo reads how to draw when it is first loaded; this module chooses that before.
"""

import os

os.environ.setdefault("MUJOCO_GL", "egl")  # draw without a screen

import mujoco

__all__ = ["mujoco"]
