"""The privacy page (``/privacy``): what is on, what leaves a page or the computer, what is kept.

It shows the switches as they are now, and needs no token: anybody in front of the partner may read
it before pairing.
"""

from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from miburi.doors.doors import Doors
from miburi.ground.templates import render
from miburi.live.view import LivePartner
from miburi.serving.access import PRIVACY
from miburi.serving.policy import own_page
from miburi.serving.reach import Reach
from miburi.studio.preferences import Preferences
from miburi.studio.words import Words, words

__all__ = ["Switch", "privacy_router", "switches"]

_PAGE = Path(__file__).with_suffix(".html")
#: The kinds of data that are kept; each is the stem of two keys in the page's texts (``_kept``,
#: ``_about``).
_KEPT = ("memory", "people", "feelings", "recordings", "keys", "browser", "delete")


@dataclass(frozen=True)
class Switch:
    """A switch that shares something with others, and whether it is on now.

    Attributes
    ----------
    name
        The key of its text on the page; with ``_on`` or ``_off``, it is the key of the text for
        that state.
    on
        Whether it is on.
    where
        The host or origins with which it shares; empty if its text already names them.
    """

    name: str
    on: bool
    where: str = ""


def switches(doors: Doors, reach: Reach, *, said: bool, recording: bool) -> list[Switch]:
    """Return all switches of a partner's computer, as they are."""
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
        preferences = Preferences.of(request)
        state = runner.snapshot.state
        recording = state.recording is not None
        return own_page(
            _page(preferences, switches(doors, reach, said=state.words, recording=recording))
        )

    return router


def _page(preferences: Preferences, now: list[Switch]) -> str:
    all_words = words(preferences.language)
    say = all_words["privacy"]
    return render(
        _PAGE,
        language=preferences.language,
        words=say,
        scheme=preferences.scheme,
        senses=_senses(all_words),
        switches=[
            (
                say[each.name],
                each.on,
                say[f"{each.name}_{'on' if each.on else 'off'}"].format(where=each.where),
                each.name == "said",
            )
            for each in now
        ],
        kept=[(say[f"{name}_kept"], say[f"{name}_about"]) for name in _KEPT],
    )


def _senses(all_words: Words) -> list[tuple[str, str]]:
    """Return each of a page's senses, with the explanation beside its switch."""
    say = all_words["senses"]
    names = [key.removesuffix("_about") for key in say if key.endswith("_about")]
    return [(say[name], say[f"{name}_about"]) for name in names]
