"""Control a live partner from an asynchronous program, as :mod:`miburi.client.remote` does.

>>> from miburi import Stimulus, connect_async
>>> async def greet() -> None:
...     async with connect_async("http://127.0.0.1:8080") as partner:
...         await partner.stimulate(Stimulus("happiness", 0.8))
...         async for event in partner.events():
...             print(event.kind)
"""

import asyncio
from collections.abc import AsyncGenerator, Mapping
from contextlib import aclosing
from pathlib import Path
from types import TracebackType
from typing import Self

import httpx

from miburi.client.answers import read
from miburi.client.asker import Asker
from miburi.client.connection import CLOSED, ConnectionLostError
from miburi.client.trusting import distrust
from miburi.errors import InputError
from miburi.feelings import Expression, Stimulus
from miburi.gestures import Direction
from miburi.gestures.effort import Effort
from miburi.live.attention import Turn
from miburi.live.events.event import EndOfWish, LiveEvent
from miburi.wire.messages import AnyAct, PosesIn, fields_of

#: The time between two attempts to reconnect, in s (our choice).
_AGAIN = 0.5
_DATA = "data: "


def connect_async(
    url: str, token: str | None = None, authority: Path | str | None = None
) -> "AsyncPartner":
    """Return a live partner at ``url``, for an asynchronous program; see :func:`miburi.connect`.

    Raises InputError if the address does not start with ``http://`` or ``https://``, the token is
    not one line of ASCII, or the file is not a certificate.
    """
    return AsyncPartner.at(url, token, authority, by="program")


class AsyncPartner(Asker):
    """A live partner at the other end of a connection; made by :func:`miburi.connect_async`.

    Use it as an asynchronous context manager, or call :meth:`close`. Its methods raise the errors
    of :class:`miburi.RemotePartner`. If a method returns a ``str``, that is the request's id, which
    events carry as ``wish``.
    """

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        await self.close()

    async def events(
        self, after: str | None = None, patience: float = 60.0
    ) -> AsyncGenerator[LiveEvent, None]:
        """Yield the events after an id, or from now on; see :meth:`RemotePartner.events`."""
        cursor = after or (await self.state()).cursor
        loop = asyncio.get_running_loop()
        heard: float | None = None
        while True:
            failure: Exception = ConnectionLostError("the connection was closed")
            try:
                async with self.stream(f"/events?after={cursor}") as lines:
                    async for line in lines:
                        heard = loop.time()
                        if line.startswith(_DATA):
                            event = read(LiveEvent, line.removeprefix(_DATA), self._url)
                            cursor = event.id
                            yield event
            except RuntimeError as error:
                if not self._http.is_closed:
                    raise
                raise InputError(CLOSED) from error
            except (httpx.HTTPError, ConnectionLostError) as error:
                failure = error
            if heard is None or loop.time() - heard > patience:
                words = f"the partner does not answer: {failure}."
                raise ConnectionLostError(distrust(self._url, failure) or words) from failure
            await asyncio.sleep(min(_AGAIN, patience))

    async def until_ended(self, wish: str, patience: float = 60.0) -> LiveEvent:
        """Wait until a wish has ended; see :meth:`RemotePartner.until_ended`.

        For a time limit, use ``asyncio.timeout``.
        """
        end = EndOfWish(wish)
        end.check(await self.log(end.before))
        async with aclosing(self.events(wish, patience)) as events:
            async for event in events:
                if end.is_in(event):
                    return event
        raise ConnectionLostError("the events ended.")

    async def stimulate(self, stimulus: Stimulus) -> str:
        """Make the partner feel something."""
        return await self.wish("/stimulus", fields_of(stimulus, Stimulus))

    async def sense(self, kind: str, clearness: float = 1.0) -> None:
        """Report something that has happened, such as a pat; see :meth:`RemotePartner.sense`."""
        await self.tell("/sense", {"kind": kind, "clearness": clearness})

    async def speak(self, text: str) -> str:
        """Have the partner say something through pages whose voice is switched on."""
        return await self.wish("/speak", {"text": text})

    async def express(
        self,
        expression: Expression,
        *,
        blend: Mapping[str, float] | None = None,
        effort: Effort | None = None,
    ) -> str:
        """Perform a gesture once; see :meth:`RemotePartner.express`."""
        mixed = {"blend": dict(blend or {}), "effort": effort}
        return await self.wish("/express", fields_of(expression, Expression) | mixed)

    async def look(self, at: Direction, seconds: float = 2.0) -> str:
        """Look at the ``user`` (ahead), left, right, up, down or ``aside`` for ``seconds`` s."""
        return await self.wish("/look", {"at": at, "seconds": seconds})

    async def attend(self, turn: Turn = "listening") -> None:
        """Turn to somebody who will speak, or (``thinking``) show that an answer is on its way."""
        await self.tell("/attend", {"turn": turn})

    async def poses(self, poses: PosesIn) -> str:
        """Perform your own key poses once, written as in a gesture file."""
        return await self.wish("/poses", poses)

    async def perform(self, *acts: AnyAct, now: bool = False) -> str:
        """Perform gestures, looks, key poses and sentences together, each at its offset."""
        wish = {"acts": acts, "when": "now" if now else "next"}
        return await self.wish("/performance", wish)

    async def stop(self) -> None:
        """Stop all motors until :meth:`release`."""
        await self.tell("/stop")

    async def release(self) -> None:
        """Release a stopped body: it returns to neutral and continues.

        By default, only a person can end a person's Stop.
        """
        await self.tell("/release")

    async def pause(self, paused: bool = True) -> None:
        """Pause the partner at neutral, or let it continue."""
        await self.tell("/pause", {"paused": paused})
