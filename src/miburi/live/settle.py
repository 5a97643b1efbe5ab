"""Wait for what a partner was asked, without holding up the others that are served."""

import asyncio
from concurrent.futures import Future
from typing import TypeVar

from miburi.live.commands import BusyError

__all__ = ["done"]

Result = TypeVar("Result")

#: A command that no step has taken up within this many seconds has failed.
_PATIENCE = 5.0


async def done(future: Future[Result]) -> Result:
    """Return what a command returns when the loop has taken it up; its refusal is raised here.

    Raises
    ------
    BusyError
        No step has taken it up in time.
    """
    try:
        return await asyncio.wait_for(asyncio.wrap_future(future), _PATIENCE)
    except TimeoutError:
        raise BusyError("the partner did not answer in time; look at its log.") from None
