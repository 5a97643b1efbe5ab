"""Small parts that all panels are made of."""

from html import escape

from nicegui import ui
from nicegui.element import Element


def button(label: str, hint: str, classes: str = "") -> ui.html:
    """Add a plain button; a hint is shown when it is pointed at."""
    made = ui.html(escape(label), sanitize=False, tag="button")
    made.classes(f"plain-button {classes}").props('type="button"')
    if hint:
        made.props["title"] = hint
    return made


def set_label(made: ui.html, label: str) -> None:
    """Change what a button says."""
    made.set_content(escape(label))


def heading(text: str) -> Element:
    """Add a heading of a panel."""
    return ui.html(escape(text), sanitize=False, tag="h2")
