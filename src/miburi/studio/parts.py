"""Small parts that the studio's panels share."""

from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from typing import Any

from nicegui import ui
from nicegui.element import Element

from miburi.errors import MiburiError
from miburi.live.settle import granted
from miburi.live.view import LivePartner
from miburi.live.wishes import Wish


@contextmanager
def refusals_shown() -> Iterator[None]:
    """If something in the block is refused, end the block, and show the reason."""
    try:
        yield
    except MiburiError as error:
        ui.notify(str(error), type="warning", position="bottom")


async def attempt(partner: LivePartner, wish: Wish[Any]) -> None:
    """Send a partner a request; show the reason if it is refused."""
    with refusals_shown():
        await granted(partner, wish)


def button(label: str, hint: str, classes: str = "", key: str = "") -> ui.html:
    """Add a plain button with a label, its ``key`` and, as a tooltip, a ``hint``, if given."""
    content = escape(label) + (f"<kbd aria-hidden=true>{escape(key)}</kbd>" if key else "")
    element = ui.html(content, sanitize=False, tag="button")
    element.classes(f"plain-button {classes}").props('type="button"')
    if hint:
        element.props["title"] = hint
    return element


def set_label(element: ui.html, label: str) -> None:
    """Change the label of a button."""
    element.set_content(escape(label))


def heading(text: str) -> Element:
    """Add a heading."""
    return ui.html(escape(text), sanitize=False, tag="h2")
