"""Load the studio when a browser first requests it, and answer addresses without a page.

NiceGUI takes a second of processor time (several on a Raspberry Pi) and 50 MB, which a partner
without visitors in the studio never needs.
"""

import asyncio
import gc
from collections.abc import AsyncIterator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager

from fastapi import FastAPI, Request
from starlette.types import Receive, Scope, Send

from miburi.live.view import LivePartner
from miburi.serving.reach import Reach
from miburi.studio.pages import missing_page
from miburi.talk.care import Care

#: The studio's pages, and the prefix of NiceGUI's files and WebSocket.
_PAGES, _FILES = ("/", "/favicon.ico"), "/_nicegui"


class OnDemand:
    """An ASGI application: the studio at ``/``, and a "no such page" at other addresses."""

    def __init__(
        self, runner: LivePartner, reach: Reach, sounded: Sequence[str], care: Care
    ) -> None:
        self._given = (runner, reach, sounded, care)
        self._loading = asyncio.Lock()
        self._studio: FastAPI | None = None
        self._served = AsyncExitStack()

    @asynccontextmanager
    async def while_served(self) -> AsyncIterator[None]:
        """End the studio, if it was loaded, when the server ends."""
        async with self._served:
            yield

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or serve a WebSocket."""
        path: str = scope["path"]
        if path in _PAGES or path.startswith(_FILES):
            await (await self._loaded())(scope, receive, send)
        elif scope["type"] == "http":
            await (await missing_page(Request(scope, receive)))(scope, receive, send)
        else:
            await send({"type": "websocket.close"})

    async def _loaded(self) -> FastAPI:
        async with self._loading:
            if self._studio is None:
                self._studio = await asyncio.to_thread(self._load)
                await self._served.enter_async_context(
                    self._studio.router.lifespan_context(self._studio)
                )
                gc.freeze()  # else a Stop may wait for a garbage collection of all this
            return self._studio

    def _load(self) -> FastAPI:
        from miburi.studio.studio_page import make_studio

        return make_studio(*self._given)
