"""The partner is found by multicast DNS, by a browser that shares no line with ours."""

import asyncio
import socket

import pytest

from miburi.version import __version__

zeroconf = pytest.importorskip("zeroconf")
aio = pytest.importorskip("zeroconf.asyncio")

from miburi.interface.announce import KIND, announced  # noqa: E402


def test_it_is_found_with_its_address_and_its_pages_and_leaves() -> None:
    async def look() -> None:
        found: dict[str, object] = {}
        came, went = asyncio.Event(), asyncio.Event()

        def change(name: str, state_change: object, **_more: object) -> None:
            (went if state_change is zeroconf.ServiceStateChange.Removed else came).set()
            found[name] = state_change

        async with aio.AsyncZeroconf(interfaces=["127.0.0.1"]) as net:
            browser = aio.AsyncServiceBrowser(net.zeroconf, KIND, handlers=[change])
            async with announced("kitchen", "https://127.0.0.1:8081"), asyncio.timeout(30):
                await came.wait()
                info = await net.async_get_service_info(KIND, f"kitchen.{KIND}", 3000)
                assert (info.port, info.addresses) == (8081, [socket.inet_aton("127.0.0.1")])
                told = {key.decode(): value.decode() for key, value in info.properties.items()}
                assert told == {"path": "/", "scheme": "https", "version": __version__}
            async with asyncio.timeout(30):
                await went.wait()
            await browser.async_cancel()

    asyncio.run(look())
