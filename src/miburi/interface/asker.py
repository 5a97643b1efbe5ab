"""Ask the interface without waiting in a thread: for doors that serve many at once.

An :class:`Asker` sends the requests of ``/api/v1``, either within the server, past its gate, or to
a server elsewhere. So a door that asks by it can do what HTTP can, and nothing else.
"""

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path
from typing import Self

import httpx
from fastapi import FastAPI
from pydantic import BaseModel, TypeAdapter

from miburi.interface.client import PATIENCE, ConnectionLostError, accepted, distrust, trust
from miburi.interface.wire import GestureOut
from miburi.live.press import BY, By
from miburi.live.state import Entry, MotorsOut, State

__all__ = ["Asker", "beside", "live_beside"]

#: When there are too many requests at once: how often we ask, and s between (ours).
_TOO_MANY, _TRIES, _BREATH = 429, 20, 0.1
_ENTRIES = TypeAdapter(list[Entry])
_GESTURES = TypeAdapter(list[GestureOut])

#: s between two cancellations of a task that does not end (ours).
_CANCELLED_AGAIN = 1.0


class Asker:
    """Asks one partner; every method raises what :class:`miburi.interface.client` raises.

    Parameters
    ----------
    url
        The partner's address, for messages.
    http
        Sends requests; it begins at ``/api/v1``.
    """

    def __init__(self, url: str, http: httpx.AsyncClient) -> None:
        self._url, self._http = url, http

    @classmethod
    def within(cls, app: FastAPI, by: By) -> Self:
        """Return one that asks an application of the same process; ``by`` is who presses Stop."""
        transport = httpx.ASGITransport(app, raise_app_exceptions=False)
        http = httpx.AsyncClient(
            transport=transport, base_url="http://127.0.0.1/api/v1", headers={BY: by}
        )
        return cls("the partner", http)

    @classmethod
    def at(cls, url: str, token: str | None = None, authority: Path | str | None = None) -> Self:
        """Return one that asks a server; see :func:`miburi.interface.client.connect`."""
        verify = trust(url, authority) or True
        url = url.rstrip("/")
        headers = {BY: "agent"} | ({"Authorization": f"Bearer {token}"} if token else {})
        return cls(url, httpx.AsyncClient(base_url=url + "/api/v1", headers=headers, verify=verify))

    async def state(self) -> State:
        """Return everything about the partner, now."""
        return State.model_validate_json(await self._ask("GET", "/state"))

    async def log(self, after: int) -> list[Entry]:
        """Return the log's entries after number ``after``, the oldest first."""
        return _ENTRIES.validate_json(await self._ask("GET", f"/log?after={after}"))

    async def motors(self) -> MotorsOut:
        """Return the motors' temperatures, supply and calibration."""
        return MotorsOut.model_validate_json(await self._ask("GET", "/motors"))

    async def gestures(self) -> list[GestureOut]:
        """Return the movement functions."""
        return _GESTURES.validate_json(await self._ask("GET", "/gestures"))

    async def tell(self, path: str, wish: BaseModel | None = None) -> None:
        """Send a wish, such as ``/stop``."""
        await self._ask("POST", path, None if wish is None else wish.model_dump_json())

    async def _ask(self, method: str, path: str, content: str | None = None) -> bytes:
        headers = {} if content is None else {"Content-Type": "application/json"}
        try:
            for _ in range(_TRIES):
                response = await self._http.request(
                    method, path, content=content, headers=headers, timeout=PATIENCE
                )
                if response.status_code != _TOO_MANY:
                    break
                await asyncio.sleep(_BREATH)
        except httpx.HTTPError as error:
            words = f"{self._url} does not answer; is `miburi run` running there?"
            raise ConnectionLostError(distrust(self._url, error) or words) from error
        return accepted(self._url, response).content


def beside(app: FastAPI, work: Callable[[], AbstractAsyncContextManager[None]]) -> None:
    """Let ``work`` begin and end with the server of an application."""
    inner = app.router.lifespan_context

    @asynccontextmanager
    async def both(served: FastAPI) -> AsyncIterator[None]:
        async with work(), inner(served):
            yield

    app.router.lifespan_context = both


def live_beside(app: FastAPI, life: Callable[[], Coroutine[None, None, None]]) -> None:
    """Let ``life`` run for as long as the server of an application serves."""

    @asynccontextmanager
    async def living() -> AsyncIterator[None]:
        task = asyncio.create_task(life())
        try:
            yield
        finally:
            # An error raised while a task is cancelled, for example by a closing connection, can
            # replace the cancellation. A task that survives errors must then be cancelled again.
            while not task.done():
                task.cancel()
                await asyncio.wait({task}, timeout=_CANCELLED_AGAIN)

    beside(app, living)
