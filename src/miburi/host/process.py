"""The server's process; web libraries are loaded only there."""

import gc

from miburi.ground.cores import come_first
from miburi.host.given import Pages
from miburi.live.crossing.lanes import Lanes


def serve_pages(pages: Pages, ends: Lanes) -> None:
    """Serve until SIGTERM, or until the partner's process has ended."""
    come_first(apart=True)
    gc.disable()  # loading libraries leaves no garbage to collect
    from miburi.host.serving import serve_until_the_end  # takes a second, while the partner wakes

    serve_until_the_end(pages, ends)
