"""Forms that the studio and the face share, as HTML."""

import json
from collections.abc import Sequence
from html import escape
from typing import Literal

from miburi.feelings.catalogue import CATALOGUE
from miburi.safety.stop import StopReason
from miburi.senses.tone import tones
from miburi.serving.access import PRIVACY
from miburi.studio.words import Words
from miburi.talk.care import Care

#: Senses that show a sign while they are on.
_SIGNED = ("ears", "eyes")
#: Kinds of distress that no page names, and the service whose number a page shows instead: a person
#: of whom somebody is afraid may be in the room.
_UNNAMED: dict[str, Literal["police", "listening"]] = {"abuse": "police", "suicide": "listening"}


def senses_form(words: Words, *names: str, sounded: Sequence[str] = ()) -> str:
    """Return the switches for the voice and senses as HTML; ``static/senses.js`` handles them.

    ``sounded`` are the languages of the partner's own voice.
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
    """Return the signs that the partner listens or watches, as HTML."""
    return "".join(
        f'<p class="sign sign-{name}">{escape(words["senses"][f"{name}_on"])}</p>'
        for name in _SIGNED
    )


def banner(words: Words, care: Care, language: str) -> str:
    """Return the banner for somebody who needs help, as HTML; ``static/page.js`` shows it."""
    say = words["talk"]
    needs = {kind: say["distress"].format(kind=name) for kind, name in words["distress"].items()}
    for kind, service in _UNNAMED.items():
        needs[kind] = say["help_near"].format(number=care.number(service, language))
    return (
        f'<div class="need" role="alert" data-needs="{escape(json.dumps(needs))}" hidden>'
        f'<span></span><button type="button">{escape(say["hide"])}</button></div>'
    )


def reason(words: Words) -> str:
    """Return the box that says why the body is stopped, as HTML; ``static/why.js`` fills it."""
    told = {name: words[name] for name in ("contact", "joint", "reason")}
    passing = [each for each in StopReason if each.passes]
    given = escape(json.dumps({**told, "passes": passing}))
    return (
        f'<div class="why" role="alert" data-why="{given}" hidden><p><b></b> <small></small></p>'
        f'<button type="button">{escape(words["talk"]["hide"])}</button></div>'
    )


def talk_form(words: Words) -> str:
    """Return a field for typing to the partner, as HTML; ``static/page.js`` sends the text."""
    say = words["talk"]
    told = escape(json.dumps({**say, "feelings": words["feeling"]}))
    return (
        f'<form class="talk" data-talk="{told}"><label><span>{escape(say["label"])}</span>'
        f'<input name="text" maxlength="1000" autocomplete="off" enterkeyhint="send" required '
        f'placeholder="{escape(say["example"])}"></label><button class="plain-button">'
        f'{escape(say["send"])}</button><output role="status"></output>'
        f"<details hidden><summary>{escape(say['weights'])}</summary><span></span></details></form>"
    )
