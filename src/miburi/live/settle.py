"""Wait for a partner's answers without blocking other clients."""

import asyncio
from concurrent.futures import Future
from typing import TypeVar

from miburi.live.commands import BusyError
from miburi.live.crossing.lanes import LONG
from miburi.live.view import LivePartner
from miburi.live.wishes import Granted, Wish

Result = TypeVar("Result")

#: A command that no step has run within this time, in s, counts as failed.
_PATIENCE = 5.0


async def done(future: Future[Result], patience: float = _PATIENCE) -> Result:
    """Wait until the loop has run a command; return its result, or raise its refusal.

    Raises BusyError if no step has run the command within ``patience`` s.
    """
    try:
        return await asyncio.wait_for(asyncio.wrap_future(future), patience)
    except TimeoutError:
        raise BusyError("the partner did not answer in time; look at its log.") from None


async def granted(partner: LivePartner, wish: Wish[Granted]) -> Granted:
    """Send a partner a request; return the answer, or raise the refusal.

    Raises BusyError if no step has run the request in time.
    """
    if not wish.slow:
        return await done(partner.ask(wish))
    return await done(await asyncio.to_thread(partner.ask, wish), LONG)
