"""Asynchronous requests to the interface, for doors that serve many clients at once.

An :class:`Asker` sends requests to ``/api/v1``: over the network, or inside the server's process,
without its access check. So a door that uses it can do what HTTP can, and nothing else.
"""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Self
from urllib.parse import quote

import httpx
from pydantic_core import PydanticSerializationError, to_json

from miburi.client.answers import Answer, read
from miburi.client.connection import CLOSED, PATIENCE, ConnectionLostError, accepted, plain
from miburi.client.trusting import bearer, distrust, trust
from miburi.errors import InputError
from miburi.live.events.event import LiveEvent
from miburi.live.state import MotorsOut, State
from miburi.senses.tone import Tone
from miburi.serving.press import BY, By
from miburi.talk.said import SayOut
from miburi.wire.messages import GestureOut, SayIn, WishOut

if TYPE_CHECKING:  # a program that only talks to a partner needs no server
    from fastapi import FastAPI

#: The status for too many requests. Then how often a request is tried at most if it gets this
#: status, and the time between two tries, in s (our choice).
_TOO_MANY, _TRIES, _BREATH = 429, 20, 0.1

#: A streamed answer counts as lost after this time, in s, without a sign of life.
_STREAM_TIME = 30.0


class Asker:
    """Sends requests to one partner; raises the errors of :class:`miburi.RemotePartner`.

    ``url`` is the partner's address, for messages; the base URL of ``http`` ends with ``/api/v1``.
    """

    def __init__(self, url: str, http: httpx.AsyncClient) -> None:
        self._url, self._http = url, http

    @classmethod
    def within(cls, app: "FastAPI", by: By) -> Self:
        """Return an asker for an application in this process; its Stops are recorded as ``by``."""
        transport = httpx.ASGITransport(app, raise_app_exceptions=False)
        http = httpx.AsyncClient(
            transport=transport, base_url="http://127.0.0.1/api/v1", headers={BY: by}
        )
        return cls("the partner", http)

    @classmethod
    def at(
        cls,
        url: str,
        token: str | None = None,
        authority: Path | str | None = None,
        by: By = "agent",
    ) -> Self:
        """Return an asker for a server; see :func:`miburi.client.remote.connect`."""
        verify = trust(url, authority)
        url = url.rstrip("/")
        headers = {BY: str(by)} | bearer(token)
        return cls(url, httpx.AsyncClient(base_url=url + "/api/v1", headers=headers, verify=verify))

    async def state(self) -> State:
        """Return the partner's present state."""
        return await self._get(State, "/state")

    async def log(self, after: str | None = None) -> list[LiveEvent]:
        """Return up to 1,000 events after the one with this id; without an id, the latest."""
        known = "" if after is None else f"?after={quote(after)}"
        return await self._get(list[LiveEvent], f"/log{known}")

    async def say(self, text: str, tone: Tone = "plain") -> SayOut:
        """Say something to the partner; return the feeling it heard, the reason, and its answer."""
        said = SayIn.model_construct(text=text, tone=tone)
        return read(SayOut, await self._ask("POST", "/say", said), self._url)

    @asynccontextmanager
    async def stream(self, path: str) -> AsyncIterator[AsyncIterator[str]]:
        """Open a streamed answer, and yield an iterator over its lines.

        Raises httpx.HTTPError if the server does not answer, or stops answering.
        """
        async with self._http.stream("GET", path, timeout=_STREAM_TIME) as answer:
            if not answer.is_success:
                await answer.aread()
            yield accepted(self._url, answer).aiter_lines()

    async def close(self) -> None:
        """Close the connection."""
        await self._http.aclose()

    async def motors(self) -> MotorsOut:
        """Return the motors' temperatures, supply and calibration."""
        return await self._get(MotorsOut, "/motors")

    async def gestures(self) -> list[GestureOut]:
        """Return the movement functions."""
        return await self._get(list[GestureOut], "/gestures")

    async def tell(self, path: str, wish: object = None) -> None:
        """Send a command, such as ``/stop``."""
        await self._ask("POST", path, wish)

    async def wish(self, path: str, wish: object) -> str:
        """Send a command, such as ``/express``; return its id, by which its events refer to it."""
        return read(WishOut, await self._ask("POST", path, wish), self._url).id

    async def _get(self, kind: type[Answer], path: str) -> Answer:
        return read(kind, await self._ask("GET", path), self._url)

    async def _ask(self, method: str, path: str, wish: object = None) -> bytes:
        headers = {} if wish is None else {"Content-Type": "application/json"}
        try:
            content = None if wish is None else to_json(wish, fallback=plain)
            for _ in range(_TRIES):
                response = await self._http.request(
                    method, path, content=content, headers=headers, timeout=PATIENCE
                )
                if response.status_code != _TOO_MANY:
                    break
                await asyncio.sleep(_BREATH)
        except PydanticSerializationError as error:
            raise InputError(f"this cannot be sent: {error}.") from error
        except RuntimeError as error:
            if not self._http.is_closed:
                raise
            raise InputError(CLOSED) from error
        except httpx.HTTPError as error:
            words = f"{self._url} does not answer; is `miburi run` running there?"
            raise ConnectionLostError(distrust(self._url, error) or words) from error
        return accepted(self._url, response).content
