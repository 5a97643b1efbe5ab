"""The one door to MuJoCo: it reads how to draw, once, when it is first loaded."""

import os

os.environ.setdefault("MUJOCO_GL", "egl")  # draw without a screen

import mujoco

__all__ = ["mujoco"]
