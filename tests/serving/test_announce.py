"""The partner is found by multicast DNS, by a browser that shares no line with ours."""

import asyncio
import socket
from secrets import token_hex

import httpx
import pytest
from fastapi import FastAPI
from tests.fixtures.live import serving

from miburi.serving.beside import live_beside
from miburi.version import __version__

zeroconf = pytest.importorskip("zeroconf")
aio = pytest.importorskip("zeroconf.asyncio")

from miburi.serving.announce import KIND, announce  # noqa: E402

NAME = f"kitchen-{token_hex(4)}"


def test_it_is_found_with_its_address_and_its_pages_and_leaves() -> None:
    async def look() -> None:
        came, went = asyncio.Event(), asyncio.Event()

        def change(name: str, state_change: object, **_more: object) -> None:
            if name == f"{NAME}.{KIND}":
                (went if state_change is zeroconf.ServiceStateChange.Removed else came).set()

        async with asyncio.timeout(30), aio.AsyncZeroconf(interfaces=["127.0.0.1"]) as net:
            browser = aio.AsyncServiceBrowser(net.zeroconf, KIND, handlers=[change])
            telling = asyncio.create_task(announce(NAME, "https://127.0.0.1:8081"))
            await came.wait()
            while (info := await net.async_get_service_info(KIND, f"{NAME}.{KIND}", 500)) is None:
                pass
            assert (info.port, info.addresses) == (8081, [socket.inet_aton("127.0.0.1")])
            told = {key.decode(): value.decode() for key, value in info.properties.items()}
            assert told == {"path": "/", "scheme": "https", "version": __version__}
            telling.cancel()
            await went.wait()
            await asyncio.gather(telling, return_exceptions=True)  # it closes its sockets
            await browser.async_cancel()

    asyncio.run(look())


def test_without_an_address_nobody_is_told_and_it_lives_on() -> None:
    """A computer that has no network yet knows its own name alone."""
    app = FastAPI()
    live_beside(app, lambda: announce("kitchen", "http://raspberrypi:8080"))
    with serving(app, lifespan=True) as url:
        assert httpx.get(url).status_code == 404
