"""What lives beside the server ends with it."""

import asyncio

from fastapi import FastAPI
from tests.fixtures.live import serving

from miburi.serving.beside import live_beside


def test_a_life_that_takes_its_end_for_an_error_ends_all_the_same() -> None:
    """A connection breaks while it is being closed, and whoever lives on it connects again."""
    ends: list[int] = []

    async def life() -> None:
        while True:
            try:
                await asyncio.Event().wait()
            except asyncio.CancelledError:
                ends.append(1)
                if len(ends) == 2:
                    raise

    app = FastAPI()
    live_beside(app, life)
    with serving(app, lifespan=True):
        pass
    assert len(ends) == 2
