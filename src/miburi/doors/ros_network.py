"""The settings of a ROS 2 network: the DDS domain, its range, and a partner's namespace.

The settings come from ROS's own environment variables: ROS_DOMAIN_ID,
ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_LOCALHOST_ONLY and CYCLONEDDS_URI. Unlike a ROS node, a partner
is visible only on its own computer unless SUBNET is set. DDS asks for no token, so with SUBNET
anybody on the network can make the partner feel, speak and stop.
"""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass

import ifaddr

from miburi.errors import InputError

#: The largest domain: in a larger one DDS would run out of ports.
LARGEST_DOMAIN = 232
#: The largest accepted message, in bytes (our choice); a robot's description has some 20,000 bytes.
_LARGEST_MESSAGE = 200_000
#: The number of participants to look for on this computer, the same as in rmw_cyclonedds.
_PARTICIPANTS = 32
#: The time between two announcements, in s (our choice): a node that starts later waits no longer
#: than this.
_ANNOUNCED = 2
_HERE = (
    '<General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General>"
)


@dataclass(frozen=True)
class RosNetwork:
    """A DDS domain, and a partner's namespace in it."""

    domain: int = 0
    everywhere: bool = False  # whether the whole network hears it, not only this computer
    name: str | None = None  # the partner's name; None: its topics have no namespace
    more: str = ""  # further configuration of Cyclone DDS, from CYCLONEDDS_URI

    @property
    def config(self) -> str:
        """The configuration of Cyclone DDS, as rmw_cyclonedds makes it."""
        return (
            f"<CycloneDDS><Domain>{'' if self.everywhere else _HERE}<Discovery>"
            "<ParticipantIndex>auto</ParticipantIndex>"
            f"<MaxAutoParticipantIndex>{_PARTICIPANTS}</MaxAutoParticipantIndex>"
            f"<SPDPInterval>{_ANNOUNCED} s</SPDPInterval>"
            f"{'' if self.everywhere else _peers()}</Discovery>"
            f"<Internal><MaxSampleSize>{_LARGEST_MESSAGE} B</MaxSampleSize></Internal>"
            f"</Domain></CycloneDDS>,{self.more}"
        )

    def topic(self, name: str) -> str:
        """Return the name of a topic in DDS; one that begins with / belongs to all partners."""
        if name.startswith("/") or self.name is None:
            return f"rt/{name.removeprefix('/')}"
        return f"rt/{self.name}/{name}"

    def frame(self, link: str) -> str:
        """Return the name of a link's frame."""
        return link if self.name is None else f"{self.name}/{link}"


def _peers() -> str:
    """Return this computer's addresses as peers: a ROS node listens only on its own address."""
    own = {
        str(address.ip)
        for adapter in ifaddr.get_adapters()
        for address in adapter.ips
        if address.is_IPv4
    }
    peers = "".join(f'<Peer address="{one}"/>' for one in sorted(own | {"127.0.0.1"}))
    return f"<Peers>{peers}</Peers>"


def find_ros(name: str | None = None, environment: Mapping[str, str] = os.environ) -> RosNetwork:
    """Return the network that ROS's environment variables describe.

    The partner's ``name`` becomes the namespace, with _ for -.

    Raises InputError if a variable has a value that is not allowed, or ROS does not allow the name.
    """
    domain = environment.get("ROS_DOMAIN_ID") or "0"
    if not re.fullmatch(r"\d{1,3}", domain) or int(domain) > LARGEST_DOMAIN:
        raise InputError(f"ROS_DOMAIN_ID must be 0 to {LARGEST_DOMAIN}, got {domain!r}.")
    reach = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE") or "LOCALHOST"
    if reach not in ("LOCALHOST", "SUBNET"):
        raise InputError(
            f"ROS_AUTOMATIC_DISCOVERY_RANGE must be LOCALHOST or SUBNET, got {reach!r}."
        )
    if name is not None and not name[0].isalpha():
        raise InputError(f"in ROS a partner's name begins with a letter, got {name!r}.")
    return RosNetwork(
        int(domain),
        reach == "SUBNET" and environment.get("ROS_LOCALHOST_ONLY") != "1",
        None if name is None else name.replace("-", "_"),
        environment.get("CYCLONEDDS_URI", ""),
    )
