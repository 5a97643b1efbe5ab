"""Announce the partner's pages in the local network, by multicast DNS (``_miburi._tcp``).

The announcement has an address and a name, but no token. It needs the extra ``https``, and a
partner that other devices can reach.
"""

import asyncio
from ipaddress import ip_address
from secrets import token_hex
from urllib.parse import urlsplit

from miburi.errors import needs_extra
from miburi.ground.log import log_once
from miburi.version import __version__

try:
    from zeroconf import ServiceInfo
    from zeroconf.asyncio import AsyncZeroconf
except ModuleNotFoundError as error:
    raise needs_extra("https", error) from error


#: The service's type.
KIND = "_miburi._tcp.local."


async def announce(name: str, address: str) -> None:
    """Announce a partner and the URL of its pages until cancelled; a failure is logged.

    If another partner has the name, a number is added to it. If the URL's host is not an IP
    address, nothing is announced.
    """
    url = urlsplit(address)
    service = None
    try:
        host = ip_address(url.hostname or "")
        info = ServiceInfo(
            KIND,
            f"{name}.{KIND}",
            port=url.port,
            addresses=[host.packed],
            properties={"path": "/", "scheme": url.scheme, "version": __version__},
            server=f"miburi-{token_hex(4)}.local.",
        )
        service = AsyncZeroconf(interfaces=[str(host)])
        await service.async_register_service(info, allow_name_change=True)
        await asyncio.Event().wait()
    except Exception as error:  # the partner runs without it
        log_once("the partner cannot be announced by mDNS", error)
    finally:
        if service is not None:
            await service.async_unregister_all_services()
            await service.async_close()
