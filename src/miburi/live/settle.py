"""Wait for a partner's answers without holding up other clients."""

import asyncio
from concurrent.futures import Future
from typing import TypeVar

from miburi.live.commands import BusyError
from miburi.live.crossing.lanes import LONG
from miburi.live.view import LivePartner
from miburi.live.wishes import Granted, Wish

Result = TypeVar("Result")

#: A command that no step has taken up within this many seconds has failed.
_PATIENCE = 5.0


async def done(future: Future[Result], patience: float = _PATIENCE) -> Result:
    """Wait until the loop has run a command; return its result, or raise its refusal.

    Raises
    ------
    BusyError
        No step has taken it up within ``patience`` s.
    """
    try:
        return await asyncio.wait_for(asyncio.wrap_future(future), patience)
    except TimeoutError:
        raise BusyError("the partner did not answer in time; look at its log.") from None


async def granted(partner: LivePartner, wish: Wish[Granted]) -> Granted:
    """Ask a partner for something; return its answer, or raise its refusal.

    Raises
    ------
    BusyError
        No step has taken it up in time.
    """
    if not wish.slow:
        return await done(partner.ask(wish))
    return await done(await asyncio.to_thread(partner.ask, wish), LONG)
