"""The parts of the pages that the browser draws itself, from the live WebSocket."""

from collections.abc import Mapping
from typing import Any

from nicegui.element import Element


class RobotView(Element, component="robot.js", esm={"three": "vendor/three"}):
    """The robot in 3D, and a hand that can be dragged."""

    def __init__(
        self, robot: Mapping[str, Any], faces: Mapping[str, object], label: str, without: str
    ) -> None:
        super().__init__()
        self._props |= {
            "robot": dict(robot),
            "faces": dict(faces),
            "label": label,
            "without": without,
        }

    def reset(self) -> None:
        """Look at the robot as at the beginning."""
        self.run_method("reset")


class Levels(Element, component="levels.js"):
    """A button with a face for each feeling, and its three levels."""

    def __init__(
        self, words: Mapping[str, Any], faces: Mapping[str, object], strength: float
    ) -> None:
        super().__init__()
        self._props |= {"words": dict(words), "faces": dict(faces), "strength": strength}

    def set_strength(self, strength: float) -> None:
        """Set how strong a short press is, 0 to 1."""
        self._props["strength"] = strength


class Plots(Element, component="plots.js"):
    """Moods, hands and speed ratios over the last minute."""

    def __init__(
        self, words: Mapping[str, str], feelings: list[str], colours: list[str], joints: list[str]
    ) -> None:
        super().__init__()
        self._props |= {
            "words": dict(words),
            "feelings": feelings,
            "colours": colours,
            "joints": joints,
        }
