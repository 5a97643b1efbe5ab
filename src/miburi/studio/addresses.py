"""The addresses at which other devices in the same networks reach this computer."""

import socket
from ipaddress import IPv4Address

import ifaddr

__all__ = ["own_addresses"]

#: What the names of interfaces begin with that lead to machines and tunnels, not to a phone.
_VIRTUAL = (
    "br-",
    "docker",
    "tailscale",
    "tap",
    "tun",
    "vbox",
    "veth",
    "virbr",
    "vmnet",
    "wg",
    "zt",
)


def own_addresses() -> list[str]:
    """Return this computer's IPv4 addresses but loopback, the likeliest for a phone first."""
    found = {
        str(address.ip): adapter.nice_name.lower().startswith(_VIRTUAL)
        for adapter in ifaddr.get_adapters()
        for address in adapter.ips
        if isinstance(address.ip, str) and not IPv4Address(address.ip).is_loopback
    }
    leading = _leading()

    def unlikely(ip: str) -> tuple[bool, bool, bool]:
        return ip != leading, found[ip], IPv4Address(ip).is_link_local

    return sorted(found, key=unlikely)


def _leading() -> str | None:
    """Return the address of the interface that leads outside, if one does."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # sends nothing
        except OSError:
            return None
        return str(probe.getsockname()[0])
