"""Page elements that the browser draws from the live WebSocket.

Each takes the properties of its component, the JavaScript file beside it, as keyword arguments.
"""

from collections.abc import Mapping

from nicegui.element import Element
from nicegui.elements.mixins.value_element import ValueElement

__all__ = ["Choice", "Levels", "Plots", "RobotView"]


class RobotView(Element, component="robot.js", esm={"three": "vendor/three"}):
    """The robot in 3D, and a hand to drag."""

    def __init__(self, **given: object) -> None:
        super().__init__()
        self._props |= given

    def reset(self) -> None:
        """Return to the first view of the robot."""
        self.run_method("reset")

    def reach(self, place: tuple[float, float, float]) -> None:
        """Let the arrow keys move the hand, starting at ``place``, in m in the base frame."""
        self.run_method("reach", list(place))


class Levels(Element, component="levels.js"):
    """A button for each feeling, with the feeling's face and its three levels."""

    def __init__(self, **given: object) -> None:
        super().__init__()
        self._props |= given

    def set_strength(self, strength: float) -> None:
        """Set how strong a short press is, 0 to 1."""
        self._props["strength"] = strength


class Plots(Element, component="plots.js"):
    """Plots of moods, hands and speed ratios over the last minute."""

    def __init__(self, **given: object) -> None:
        super().__init__()
        self._props |= given


class Choice(ValueElement[str], component="choice.js"):
    """The browser's own drop-down list."""

    LOOPBACK = False

    def __init__(self, options: Mapping[str, str], value: str, label: str) -> None:
        super().__init__(value=value)
        self._props |= {"options": [list(option) for option in options.items()], "label": label}
