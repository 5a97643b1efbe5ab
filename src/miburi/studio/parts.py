"""Small parts that all panels are made of."""

from concurrent.futures import Future
from html import escape

from nicegui import ui
from nicegui.element import Element

from miburi.errors import MiburiError
from miburi.interface.api import done

__all__ = ["attempt", "button", "heading", "set_label"]


async def attempt(future: Future[None]) -> None:
    """Wait for a command; say why it was refused, if it was."""
    try:
        await done(future)
    except MiburiError as error:
        ui.notify(str(error), type="warning", position="bottom")


def button(label: str, hint: str, classes: str = "", key: str = "") -> ui.html:
    """Add a plain button; a hint is shown when it is pointed at, and its key if it has one."""
    shown = escape(label) + (f"<kbd aria-hidden=true>{escape(key)}</kbd>" if key else "")
    made = ui.html(shown, sanitize=False, tag="button")
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
