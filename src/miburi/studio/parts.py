"""Small parts that the panels share."""

import json
from collections.abc import Sequence
from html import escape
from typing import Any

from nicegui import ui
from nicegui.element import Element

from miburi.errors import MiburiError
from miburi.feelings.catalogue import CATALOGUE
from miburi.live.settle import granted
from miburi.live.view import LivePartner
from miburi.live.wishes import Wish
from miburi.senses.tone import tones
from miburi.serving.access import PRIVACY
from miburi.studio.words import Words

__all__ = ["attempt", "button", "heading", "senses_form", "set_label", "signs", "talk_form"]

#: Senses that show a sign while they are on.
_SIGNED = ("ears", "eyes")


async def attempt(partner: LivePartner, wish: Wish[Any]) -> None:
    """Ask a partner for something; show the reason if it is refused."""
    try:
        await granted(partner, wish)
    except MiburiError as error:
        ui.notify(str(error), type="warning", position="bottom")


def button(label: str, hint: str, classes: str = "", key: str = "") -> ui.html:
    """Add a plain button that shows its ``key``, and its ``hint``, if any, as a tooltip."""
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


def senses_form(words: Words, *names: str, sounded: Sequence[str] = ()) -> str:
    """Return the switches for the voice and senses as HTML; ``static/senses.js`` acts on them.

    ``sounded`` are the languages for which the partner's computer has a voice of its own.
    """
    say = words["senses"]
    voices = {**CATALOGUE.voices(), "sounded": sounded}
    numbers = tones().model_dump(include={"before", "louder", "higher", "softer"})
    told = escape(
        json.dumps({"voices": voices, "tones": numbers, "refused": words["sense_refused"]})
    )
    switches = "".join(
        f'<label><input type="checkbox" role="switch" data-sense="{name}" '
        f'aria-describedby="about-{name}">{escape(say[name])}</label>'
        f'<small id="about-{name}">{escape(say[f"{name}_about"])}</small>'
        for name in names
    )
    return (
        f'<details class="senses" name="panel" data-senses="{told}">'
        f"<summary>{escape(say['title'])}</summary>"
        f'{switches}<output role="status"></output>'
        f'<a href="{PRIVACY}">{escape(words["privacy"]["link"])}</a>'
        f'<a href="/people">{escape(words["people"]["link"])}</a></details>'
    )


def signs(words: Words) -> str:
    """Return as HTML the signs shown while the partner listens or watches."""
    return "".join(
        f'<p class="sign sign-{name}">{escape(words["senses"][f"{name}_on"])}</p>'
        for name in _SIGNED
    )


def talk_form(words: Words) -> str:
    """Return a field for typing to the partner, as HTML; ``static/page.js`` sends what is typed."""
    say = words["talk"]
    told = escape(
        json.dumps({**say, "feelings": words["feeling"], "distresses": words["distress"]})
    )
    return (
        f'<form class="talk" data-talk="{told}"><label><span>{escape(say["label"])}</span>'
        f'<input name="text" maxlength="1000" autocomplete="off" enterkeyhint="send" required '
        f'placeholder="{escape(say["example"])}"></label><button class="plain-button">'
        f'{escape(say["send"])}</button><output role="status"></output>'
        f"<details hidden><summary>{escape(say['weights'])}</summary><span></span></details></form>"
    )
