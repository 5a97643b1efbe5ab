"""The home-automation interface: the partner reports to an MQTT broker, and accepts commands.

Home Assistant finds the partner through MQTT discovery. Each stop and each event of distress is
reported at least once, even if it happened while the broker or the partner was away. Reports are
rare, because a home system stores each of them. The last will says that the partner is gone. The
commands are feel, say and stop; none releases the body. Refusals are published on a separate topic.

This module needs the extra ``mqtt``.
"""

import asyncio
import json
import secrets
import time
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, date, datetime

from fastapi import FastAPI
from pydantic import BaseModel, ValidationError

from miburi.client.asker import Asker
from miburi.doors.broker import Broker, stay_at
from miburi.doors.home_discovery import About, discovery, discovery_topic, text_of
from miburi.doors.topics import (
    ALL,
    DistressNews,
    GapNews,
    HomeReport,
    StopNews,
    Topics,
    make_report,
)
from miburi.errors import InputError, MiburiError, needs_extra
from miburi.live.events.event import Cursor, LiveEvent
from miburi.live.state import State
from miburi.live.view import LivePartner
from miburi.serving.allowance import Allowance
from miburi.serving.beside import live_beside
from miburi.version import __version__
from miburi.wire.messages import SpeakIn, StimulusIn

try:
    from aiomqtt import Client, Message, MqttError, Will
except ModuleNotFoundError as error:
    raise needs_extra("mqtt", error) from error


#: The topic on which Home Assistant announces its start.
BIRTH = "homeassistant/status"
#: Wishes of each kind but Stop per second, and in a burst (our choice).
RATE, BURST = 5.0, 10.0
#: The time between two polls of the partner, in s (our choice).
_PERIOD = 0.25
_ONLINE, _OFFLINE = "online", "offline"
#: Refusals published per second: no more than a person can read (our choice).
_TOLD_RATE = 1.0
#: Reports published per second: of values that change often, and of urgent values. Then how many of
#: each kind may be published in a burst. Together these make at most ten reports a minute, not
#: counting Stops (our choice).
_REPORT_RATE, _URGENT_RATE, _REPORT_BURST = 3 / 60, 3 / 60, 2.0
#: The history's key for the last event reported to the broker.
_WHO = "home"
#: How long, in s, to wait for an answer when asking whether a name is taken (our choice).
_ANSWER = 1.5
#: How long, in s, to wait at startup for a broker that does not answer (our choice).
_PATIENCE = 4.0


def add_home(
    app: FastAPI,
    partner: LivePartner,
    broker: Broker,
    name: str,
    studio: str | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> None:
    """Connect a partner to a home's broker while the server runs, and reconnect after a loss.

    Parameters
    ----------
    broker, name
        The broker, and the partner's name there, which must be unique.
    studio
        The address at which other devices reach the partner's pages.
    clock
        Returns the time in s.
    """
    about = About(broker.path(name), partner.robot.name, studio)
    home = _Home(Asker.within(app, "home"), partner, about, clock)

    async def admit() -> None:
        # Two partners with one name would keep disconnecting each other; Stop would reach only one.
        if await _is_taken(broker, about.name, home.instance):
            raise InputError(
                f"another partner has taken the name {about.name!r} there, so this one is not "
                "connected to it, and the home's Stop does not reach it. Start it with another "
                "--name."
            )

    live_beside(app, lambda: stay_at(broker, f"miburi-{about.key}", home.live, home.will, admit))


async def check_free(broker: Broker, name: str) -> None:
    """Check that no other partner uses a name; if the broker cannot be reached, do nothing.

    Raises InputError if another partner uses the name; the message proposes a free one.
    """
    others = [f"{name[:37]}-{number}" for number in range(2, 6)]
    try:
        async with asyncio.timeout(_PATIENCE):
            names = map(broker.path, (name, *others))
            first, *rest = await asyncio.gather(*(_is_taken(broker, one) for one in names))
    except (MqttError, OSError, TimeoutError):
        return
    if first:
        free = [one for one, is_gone in zip(others, rest, strict=True) if not is_gone]
        proposed = f", such as --name {free[0]}" if free else ""
        raise InputError(
            f"another partner has taken the name {name!r} at {broker.host}:{broker.port}. Start "
            f"this one with another name{proposed}."
        )


async def _is_taken(broker: Broker, name: str, instance: str = "") -> bool:
    """Return whether a running partner other than ``instance`` uses a name."""
    topics = Topics(name)
    async with broker.client(None) as client:
        await client.subscribe(topics.here, qos=1)
        await client.publish(topics.who, qos=1)
        with suppress(TimeoutError):
            async with asyncio.timeout(_ANSWER):
                async for message in client.messages:
                    if message.payload != instance.encode():
                        return True
    return False


class _Home:
    """One partner at one broker, across all reconnections."""

    def __init__(
        self, asker: Asker, partner: LivePartner, about: About, clock: Callable[[], float]
    ) -> None:
        self._partner, self._history, self._about = asker, partner.history, about
        self._runs = {"version": __version__, "since": partner.since}
        self._urgent = Allowance(_URGENT_RATE, _REPORT_BURST, clock)
        self._reports = Allowance(_REPORT_RATE, _REPORT_BURST, clock)
        self._wishes = Allowance(RATE, BURST, clock)
        self._refusals = Allowance(_TOLD_RATE, 1.0, clock)
        self._refused: tuple[str, str] | None = None  # the latest refusal that is not published
        self._unsaid = 0  # refusals before it that are not published either
        self._topics = Topics(about.name)
        group, _, _ = about.name.rpartition("/")
        #: The topics that stop all partners, or all partners of this one's group.
        self._stops_of_all = {Topics(ALL).stop, Topics(f"{group}/{ALL}" if group else ALL).stop}
        #: Distinguishes this partner from another partner of the same name.
        self.instance = secrets.token_hex(8)
        self._contradicted = False  # whether somebody has published that it is not online
        self._told: Cursor | None = None  # the last event that the broker knows
        self._day, self._stops = date.today(), 0
        self._stopping: asyncio.Task[None] | None = None
        self._online = False
        self._reported: HomeReport | None = None
        self._announced: list[str] | None = None  # the joints whose temperatures are known

    @property
    def will(self) -> Will:
        """The broker's message if we vanish without disconnecting."""
        return Will(self._topics.available, _OFFLINE, qos=1, retain=True)

    async def live(self, client: Client) -> None:
        """Publish reports, and carry out commands, until the connection ends."""
        self._online, self._reported, self._announced = False, None, None
        topics = self._topics
        heard = (topics.feel, topics.say, topics.stop, topics.who, topics.available)
        for topic in (*heard, *self._stops_of_all, BIRTH):
            await client.subscribe(topic, qos=1)
        try:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self._report(client))
                tasks.create_task(self._obey(client, tasks))
        except asyncio.CancelledError:
            with suppress(MqttError, MiburiError):  # if it cannot be reached, it is lost
                report = await self._report_of(await self._partner.state())
                await self._publish(client, report, ended=True)
            raise
        finally:
            with suppress(MqttError):  # it may be the broker that has gone
                await self._say_whether(client, _OFFLINE)

    async def _say_whether(self, client: Client, online: str) -> None:
        await client.publish(self._topics.available, online, qos=1, retain=True)

    async def _report(self, client: Client) -> None:
        while True:
            try:
                await self._tell_refusals(client)
                await self._look(client)
            except MiburiError:  # the partner cannot be reached
                if self._online:
                    self._online = False
                    await self._say_whether(client, _OFFLINE)
            await asyncio.sleep(_PERIOD)

    async def _look(self, client: Client) -> None:
        state = await self._partner.state()
        if self._told is None:
            self._told = await asyncio.to_thread(self._history.recall, _WHO)
        if self._told is None:
            await self._remember(Cursor(state.boot, state.latest))
        now = Cursor(state.boot, state.latest)
        events = [] if self._told == now else await self._partner.log(str(self._told))
        report = await self._report_of(state)
        if self._announced != [*report.temperatures]:
            self._announced = [*report.temperatures]
            message = json.dumps(discovery(self._about, self._announced))
            await client.publish(discovery_topic(self._about), message, qos=1, retain=True)
        if not self._online or self._contradicted:
            self._online, self._contradicted = True, False
            await self._say_whether(client, _ONLINE)
        for event in events:
            await self._tell(client, event)
            self._told = event.cursor
        if self._day != (today := date.today()):
            self._day, self._stops = today, 0
        report = report.model_copy(update={"stops_today": self._stops})
        if self._may_report(report):
            await self._publish(client, report)
            self._reported = report

    async def _report_of(self, state: State) -> HomeReport:
        report = make_report(state, await self._partner.motors(), self._about.studio)
        return report.model_copy(update={"stops_today": self._stops, **self._runs})

    async def _publish(self, client: Client, report: HomeReport, *, ended: bool = False) -> None:
        more = {"wall": datetime.now(UTC), "ended": ended}
        content = report.model_copy(update=more).model_dump_json()
        await client.publish(self._topics.report, content, qos=1, retain=True)

    def _may_report(self, report: HomeReport) -> bool:
        """Return whether to report now: urgent changes at once, others rarely."""
        before = self._reported
        if report == before:
            return False
        if before is None or report.held != before.held:  # a fleet's Stop waits for this
            return True
        if (report.stopped, report.paused) != (before.stopped, before.paused):
            return self._urgent.take("all")
        return self._reports.take("all")

    async def _tell(self, client: Client, event: LiveEvent) -> None:
        """Publish a stop, distress or a gap; return once the broker has it."""
        about = {"id": event.id, "wall": event.wall}
        match event.kind:
            case "distress":
                content: dict[str, object] = {"event_type": event.name, "words": event.text}
                topic = self._topics.distress
                news: BaseModel = DistressNews.model_validate(content | about)
            case "stop" if event.stop is not None and event.detail is None:  # else it was told
                stop = event.stop
                content = {"event_type": stop.reason, "motor": stop.motor, "force": stop.force}
                topic, news = self._topics.stops, StopNews.model_validate(content | about)
            case "gap":
                topic = self._topics.gaps
                news = GapNews.model_validate({"why": event.detail} | about)
            case _:
                return
        await client.publish(topic, news.model_dump_json(), qos=1)
        if event.kind == "stop":
            self._stops += event.wall.astimezone().date() == date.today()
        await self._remember(event.cursor)

    async def _remember(self, cursor: Cursor) -> None:
        self._told = cursor
        await asyncio.to_thread(self._history.remember, _WHO, cursor)

    async def _obey(self, client: Client, tasks: asyncio.TaskGroup) -> None:
        async for message in client.messages:
            topic = str(message.topic)
            if topic == BIRTH:
                if message.payload == _ONLINE.encode():
                    self._announced = self._reported = None
            elif topic == self._topics.who:
                tasks.create_task(client.publish(self._topics.here, self.instance, qos=1))
            elif topic == self._topics.available:
                self._contradicted |= message.payload != _ONLINE.encode()
            elif message.retain:
                pass  # an old wish that was retained
            elif topic in (self._topics.stop, *self._stops_of_all):
                if self._stopping is None or self._stopping.done():
                    self._stopping = tasks.create_task(self._do(client, message))
            elif self._wishes.take(topic):
                tasks.create_task(self._do(client, message))
            else:
                tasks.create_task(self._refuse(client, topic, "too many wishes at once."))

    async def _do(self, client: Client, message: Message) -> None:
        topic, payload = str(message.topic), message.payload
        try:
            if topic == self._topics.feel:
                wish = StimulusIn.model_validate_json(text_of(payload))
                await self._partner.tell("/stimulus", wish)
            elif topic == self._topics.say:
                await self._partner.tell("/speak", SpeakIn(text=text_of(payload)))
            else:
                await self._partner.tell("/stop")
        except ValidationError as error:
            item = error.errors(include_url=False, include_input=False)[0]
            where = ".".join(str(part) for part in item["loc"])
            await self._refuse(client, topic, f"{where}: {item['msg']}".removeprefix(": "))
        except MiburiError as error:
            await self._refuse(client, topic, str(error))

    async def _refuse(self, client: Client, topic: str, why: str) -> None:
        self._unsaid += self._refused is not None
        self._refused = topic, why
        await self._tell_refusals(client)

    async def _tell_refusals(self, client: Client) -> None:
        """Publish the latest refusal with the number of those left out, once a second at most."""
        if self._refused is not None and self._refusals.take("all"):
            topic, why = self._refused
            told = {"topic": topic, "why": why, "unsaid": self._unsaid}
            self._refused, self._unsaid = None, 0
            await client.publish(self._topics.refused, json.dumps(told))
