"""A fleet: all partners at one broker, or in one group there, and Stop for one or all.

The broker keeps each partner's last report, and reports a partner that is gone as ``offline``. The
last report of a partner that was switched off says so; any other is lost. This module needs the
extra ``mqtt``.
"""

import asyncio
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from datetime import UTC, datetime
from secrets import token_hex
from typing import NamedTuple

from pydantic import BaseModel, Field, ValidationError

from miburi.doors.broker import Broker, check_name, stay_at
from miburi.doors.topics import ALL, HomeReport, Topics
from miburi.errors import InputError, needs_extra
from miburi.live.view import UnreachableError

try:
    from aiomqtt import Client, MqttError
except ModuleNotFoundError as error:
    raise needs_extra("mqtt", error) from error


#: The largest fleet; more partners are left out (our choice).
LARGEST = 2000
#: How long, in s, to wait for the broker's stored messages, and for the bodies to stop (our
#: choice).
_GREETING, _PATIENCE = 5.0, 5.0
_LOOK = 0.05
_TOPIC = re.compile(r"miburi/(?:([^/]+)/)?([^/]+)/(available|report)")


class PartnerOut(BaseModel):
    """One partner; the report is null until it has sent one."""

    name: str
    lost: bool = Field(description="Whether it is gone, or its broker is, unless it is off.")
    off: bool = Field(description="Whether it was switched off, and is not back.")
    report: HomeReport | None
    hottest: float | None = Field(description="The highest temperature of its motors, °C.")
    age: float | None = Field(description="Time since its report by the two computers' clocks, s.")


class FleetOut(BaseModel):
    """All partners: the stopped ones, the lost ones, the rest, those that are off; each by name."""

    connected: bool = Field(description="Whether the broker can be reached.")
    partners: list[PartnerOut]


class Fleet:
    """The known state of the partners at a broker, or in its group.

    Without a group, a partner in a group is named ``GROUP/NAME``.
    """

    def __init__(self, broker: Broker) -> None:
        self._broker = broker
        self._client: Client | None = None
        self._online: dict[str, bool] = {}
        self._reports: dict[str, HomeReport] = {}
        #: Whether there are more partners than are known here.
        self.overfull = False
        #: Two events. The first is set while connected, the second once all messages that the
        #: broker retains have arrived.
        self.met, self.greeted = asyncio.Event(), asyncio.Event()
        self._echo = Topics(broker.path(f"fleet-{token_hex(4)}")).here

    async def listen(self) -> None:
        """Listen until cancelled; reconnect after the connection is lost."""
        await stay_at(self._broker, None, self._live)

    @property
    def news(self) -> FleetOut:
        """The present state of all partners."""
        connected = self._client is not None
        partners = [
            PartnerOut(
                name=name,
                lost=not (connected and self._online[name]) and not self._is_off(name),
                off=self._is_off(name),
                report=(report := self._reports.get(name)),
                hottest=max(report.temperatures.values(), default=None) if report else None,
                age=_age(report),
            )
            for name in sorted(self._online)
        ]
        # Partners that need a person come first.
        partners.sort(key=lambda one: (one.off, not _is_stopped(one), not one.lost))
        return FleetOut(connected=connected, partners=partners)

    async def stop(self, name: str = ALL) -> None:
        """Stop one partner, or all; return once the broker has the command.

        Raises InputError if there is no such partner; UnreachableError if the broker cannot be
        reached.
        """
        if self._client is not None and name != ALL and name not in self._online:
            known = ", ".join(sorted(self._online)) or "none"
            raise InputError(f"there is no partner {name!r} at this broker; there are: {known}.")
        try:
            if self._client is None:
                raise MqttError("no connection")
            await self._client.publish(Topics(self._broker.path(name)).stop, qos=1)
        except MqttError as error:
            raise UnreachableError(
                f"the broker at {self._broker.host}:{self._broker.port} cannot be reached; stop "
                "the robots at their switches."
            ) from error

    def _is_off(self, name: str) -> bool:
        report = self._reports.get(name)
        gone = self._client is not None and not self._online[name]
        return gone and report is not None and report.ended

    async def _live(self, client: Client) -> None:
        group = self._broker.group
        names = ("+", "+/+") if group is None else (f"{group}/+",)
        for topics in map(Topics, names):
            # With QoS 1 Mosquitto silently drops retained messages beyond its queue of 1,000.
            await client.subscribe([(topics.available, 0), (topics.report, 0)])
        # The broker sends the retained messages before it echoes this one.
        await client.subscribe(self._echo, 0)
        await client.publish(self._echo, qos=0)
        self._client = client
        self.met.set()
        try:
            async for message in client.messages:
                if str(message.topic) == self._echo:
                    self.greeted.set()
                elif isinstance(message.payload, bytes):
                    self._take(str(message.topic), message.payload)
        finally:
            self._client = None
            self.met.clear()
            self.greeted.clear()
            # Partners that have gone must not look alive; the others report again.
            self._online = dict.fromkeys(self._online, False)

    def _take(self, topic: str, payload: bytes) -> None:
        """Take in a message, unless it is malformed."""
        match = _TOPIC.fullmatch(topic)
        if match is None:
            return
        group, name, kind = match.groups()
        try:
            check_name(name)
            if group is not None and self._broker.group is None:
                name = f"{check_name(group)}/{name}"
            report = HomeReport.model_validate_json(payload) if kind == "report" else None
        except (InputError, ValidationError):
            return
        if kind == "available" and not payload:  # somebody has cleared the retained message
            self._online.pop(name, None)
            self._reports.pop(name, None)
        elif name in self._online or len(self._online) < LARGEST:
            if report is not None:
                self._reports[name] = report
                self._online.setdefault(name, False)
            else:
                self._online[name] = payload == b"online"
        else:
            self.overfull = True


@asynccontextmanager
async def listening_to(fleet: Fleet) -> AsyncIterator[None]:
    """Keep a fleet listening while the block runs."""
    task = asyncio.create_task(fleet.listen())
    try:
        yield
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


class StopAnswers(NamedTuple):
    """Names of partners: held, as they report; switched off, with when; and the others."""

    held: list[str]
    off: dict[str, datetime | None]
    unknown: list[str]


async def stop_and_look(broker: Broker, name: str = ALL) -> StopAnswers:
    """Stop one partner or all; return which have stopped.

    Raises InputError if there is no such partner; UnreachableError if the broker cannot be reached,
    or knows no partner, or more than ``LARGEST``.
    """
    fleet = Fleet(broker)
    async with listening_to(fleet):
        with suppress(TimeoutError):  # a broker may forbid the echo
            async with asyncio.timeout(_GREETING):
                # Stopping all works even before any partner is known.
                await (fleet.met if name == ALL else fleet.greeted).wait()
        await fleet.stop(name)
        stopped: list[str] = []
        for _ in range(round(_PATIENCE / _LOOK)):
            partners = [one for one in fleet.news.partners if name in (ALL, one.name)]
            # A body that a contact stopped goes on by itself, so a contact's stop does not answer a
            # Stop.
            held = [one for one in partners if one.report is not None and one.report.held]
            stopped = [one.name for one in held if not (one.lost or one.off)]
            there = sum(not (one.lost or one.off) for one in partners)
            if fleet.greeted.is_set() and len(stopped) == there:
                break
            await asyncio.sleep(_LOOK)
    where = f"the broker at {broker.host}:{broker.port}"
    if not partners:
        raise UnreachableError(f"{where} knows of no partner; check that all are connected to it.")
    if name == ALL and fleet.overfull:
        raise UnreachableError(
            f"{where} has more than {LARGEST} partners; all were told to stop, but nobody has "
            "seen whether the others did. Look at them, or use several brokers."
        )
    off = {one.name: one.report.wall for one in partners if one.off and one.report is not None}
    known = {*stopped, *off}
    return StopAnswers(stopped, off, [one.name for one in partners if one.name not in known])


def _age(report: HomeReport | None) -> float | None:
    if report is None or report.wall is None:
        return None
    return max(0.0, (datetime.now(UTC) - report.wall).total_seconds())


def _is_stopped(partner: PartnerOut) -> bool:
    return partner.report is not None and partner.report.stopped is not None
