"""Make the partner happy after a number of seconds. Start one with `make run`.

python examples/tea_timer.py http://127.0.0.1:8080 180
"""

import asyncio
import sys

from miburi import Stimulus, connect_async
from miburi.wire.messages import GestureAct, SpeechAct


async def time_tea(url: str, seconds: float) -> None:
    """Wait, be glad, and end when the partner has said so."""
    async with connect_async(url) as partner:
        await asyncio.sleep(seconds)
        await partner.stimulate(Stimulus("happiness", 0.9))
        wish = await partner.perform(
            GestureAct(do="gesture", feeling="happiness", mood=0.9),
            SpeechAct(do="speech", text="Your tea is ready!", offset=0.5),
            now=True,
        )
        async for event in partner.events(after=wish):
            if event.wish == wish and event.kind.startswith("performance_"):
                print(event.kind.replace("_", " "), flush=True)
                if event.kind != "performance_begun":
                    return


asyncio.run(time_tea(sys.argv[1], float(sys.argv[2])))
