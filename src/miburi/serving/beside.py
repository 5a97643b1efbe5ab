"""Work that starts and ends with the server of an application."""

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import AbstractAsyncContextManager, asynccontextmanager

from fastapi import FastAPI

#: The interval, in s, between two cancellations of a task that does not end (our choice).
_CANCELLED_AGAIN = 1.0


def beside(app: FastAPI, work: Callable[[], AbstractAsyncContextManager[None]]) -> None:
    """Run ``work`` while the server of an application is up."""
    inner = app.router.lifespan_context

    @asynccontextmanager
    async def both(served: FastAPI) -> AsyncIterator[None]:
        async with work(), inner(served):
            yield

    app.router.lifespan_context = both


def live_beside(app: FastAPI, life: Callable[[], Coroutine[None, None, None]]) -> None:
    """Run the background task ``life`` while the server of an application is up."""

    @asynccontextmanager
    async def living() -> AsyncIterator[None]:
        task = asyncio.create_task(life())
        try:
            yield
        finally:
            # An error during a cancellation, such as one from a closing connection, can take the
            # cancellation's place. A task that survives errors must then be cancelled again.
            while not task.done():
                task.cancel()
                await asyncio.wait({task}, timeout=_CANCELLED_AGAIN)

    beside(app, living)
