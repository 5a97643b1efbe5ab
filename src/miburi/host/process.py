"""The process of the server, and how it begins; web libraries stay in there."""

import gc

from miburi.ground.cores import come_first
from miburi.host.given import Pages
from miburi.live.crossing import Lanes

__all__ = ["serve_pages"]


def serve_pages(pages: Pages, ends: Lanes) -> None:
    """Serve until SIGTERM, or until the partner's process has ended."""
    come_first(apart=True)
    gc.disable()  # nothing of a library that is being loaded is waste
    from miburi.host.serving import serve_until_the_end  # takes a second; the partner wakes

    serve_until_the_end(pages, ends)
