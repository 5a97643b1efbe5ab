"""The privacy page (``/privacy``): what is on, what leaves a page or the computer, what is kept.

It needs no token, so that anybody in front of the partner can read it.
"""

from typing import NamedTuple
from urllib.parse import urlsplit

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from miburi.doors.doors import Doors
from miburi.live.view import LivePartner
from miburi.serving.access import PRIVACY
from miburi.serving.reach import Reach
from miburi.studio.pages import page
from miburi.studio.preferences import Preferences
from miburi.studio.words import words

#: The stored kinds of data; each has two texts on the page (``_kept``, ``_about``).
_KEPT = ("memory", "people", "feelings", "recordings", "keys", "browser", "delete")


class Switch(NamedTuple):
    """A switch that shares data, and whether it is on now.

    ``name`` is the key of the switch's text on the page; with ``_on`` or ``_off``, it is the key of
    the text for this state. ``where`` has the hosts or origins that get the data, if the text needs
    them.
    """

    name: str
    on: bool
    where: str = ""


def switches(doors: Doors, reach: Reach, *, said: bool, recording: bool) -> list[Switch]:
    """Return the present switches of a partner's computer."""
    encrypted, broker, talk = reach.authority is not None, doors.broker, doors.talk
    return [
        Switch("https", encrypted),
        Switch("http", reach.keys is not None and not encrypted),
        Switch("talk", talk is not None, (urlsplit(talk.url).hostname or "") if talk else ""),
        Switch("agents", doors.agents),
        Switch("broker", broker is not None, broker.host if broker else ""),
        Switch("ros", doors.ros is not None),
        Switch("packages", bool(doors.packages), ", ".join(doors.packages)),
        Switch("origins", bool(doors.origins), ", ".join(sorted(doors.origins))),
        Switch("voice", doors.voice is not None),
        Switch("said", said),
        Switch("recording", recording),
    ]


def privacy_router(runner: LivePartner, reach: Reach, doors: Doors) -> APIRouter:
    """Return the route of the page."""
    router = APIRouter(include_in_schema=False)

    @router.get(PRIVACY)
    async def privacy(request: Request) -> HTMLResponse:
        state = runner.snapshot.state
        recording = state.recording is not None
        all_words = words(Preferences.of(request).language)
        say, senses = all_words["privacy"], all_words["senses"]
        abouts = [key for key in senses if key.endswith("_about")]
        return page(
            request,
            "privacy",
            senses=[(senses[key.removesuffix("_about")], senses[key]) for key in abouts],
            switches=[
                (
                    say[each.name],
                    each.on,
                    say[f"{each.name}_{'on' if each.on else 'off'}"].format(where=each.where),
                    each.name == "said",
                )
                for each in switches(doors, reach, said=state.words, recording=recording)
            ],
            kept=[(say[f"{name}_kept"], say[f"{name}_about"]) for name in _KEPT],
        )

    return router
