"""The interface for laboratories: the partner talks to ROS 2 nodes over DDS, without ROS installed.

It publishes its joints at each step, its frames, description, expression, and why it stopped. It
accepts commands (feel, say, a face's expression, stop); none of them releases a stopped body. Only
the latest of several wishes on a topic counts. A reader that stops reading does not block anything.

This module needs the extra ``ros``.
"""

import asyncio
import json
import logging
import struct
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any, Generic, TypeVar

from fastapi import FastAPI
from pydantic import ValidationError

from miburi.client.asker import Asker
from miburi.doors.ros_messages import (
    diagnose,
    express,
    fixed_frames,
    frames,
    joint_state,
    read_expression,
)
from miburi.doors.ros_network import RosNetwork
from miburi.doors.ros_nodes import DISCOVERY, ENCLAVE, ParticipantEntitiesInfoMsg, node_of
from miburi.doors.ros_types import (
    DiagnosticArrayMsg,
    EmptyMsg,
    ExpressionMsg,
    JointStateMsg,
    StringMsg,
    TFMessageMsg,
    type_hash,
)
from miburi.errors import BodyError, MiburiError, needs_extra
from miburi.live.stamps import Stamps
from miburi.live.state import State
from miburi.live.view import LivePartner
from miburi.robot.shape import links
from miburi.robot.urdf import to_urdf
from miburi.serving.allowance import Allowance
from miburi.serving.beside import live_beside
from miburi.wire.messages import LookAct, PerformanceIn, SpeakIn, StimulusIn

try:
    from cyclonedds.core import DDSException
    from cyclonedds.domain import Domain, DomainParticipant
    from cyclonedds.idl import IdlStruct
    from cyclonedds.internal import InvalidSample
    from cyclonedds.pub import DataWriter
    from cyclonedds.qos import Policy, Qos
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic
except ModuleNotFoundError as error:
    raise needs_extra("ros", error) from error


#: Commands per second, and the largest burst, not counting Stop (our choice).
RATE, BURST = 5.0, 10.0
#: The time between two polls of the partner, in s; a poll publishes every step since the last poll.
_PERIOD = 0.01
_LOG = logging.getLogger(__name__)
#: The time between two diagnoses while nothing changes, in s (diagnostic_updater's default).
_DIAGNOSIS = 1.0
#: How long to wait after a failure before the connection is opened again, in s (our choice).
_PAUSE = 5.0
#: The longest wish, in characters.
_LONGEST = 4_000

_Message = TypeVar("_Message", bound=IdlStruct)
#: Errors from reading a malformed message.
_UNREADABLE = (struct.error, ValueError, IndexError, KeyError, DDSException)

# rmw_cyclonedds's settings for ROS's default profile, except that no write ever waits.
_RELIABLE = (
    Policy.Reliability.Reliable(max_blocking_time=0),
    Policy.DataRepresentation(use_cdrv0_representation=True),
    Policy.WriterDataLifecycle(autodispose=False),
)
_LATEST = Qos(*_RELIABLE, Policy.History.KeepLast(10))
_KEPT = Qos(
    *_RELIABLE,
    Policy.History.KeepLast(1),
    Policy.Durability.TransientLocal,
    Policy.DurabilityService(0, Policy.History.KeepLast(1), -1, -1, -1),
)
_WISHED = Qos(
    Policy.Reliability.Reliable(max_blocking_time=0),
    Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=True),
    Policy.History.KeepLast(1),
    # Some versions of ROS append _ to the names of members.
    Policy.TypeConsistency.AllowTypeCoercion(),
)


def add_ros(
    app: FastAPI,
    partner: LivePartner,
    network: RosNetwork,
    clock: Callable[[], float] = time.monotonic,
) -> None:
    """Publish a partner's state on a ROS network, and take wishes there, while the server runs.

    After a failure, which is logged, the connection is opened again. ``clock`` returns the time in
    s, for the rate of wishes.
    """
    asker = Asker.within(app, "ros")

    async def live() -> None:
        while True:
            try:
                domain = Domain(network.domain, network.config)
                try:
                    await _Door(asker, partner, network, Allowance(RATE, BURST, clock)).live()
                finally:
                    del domain  # this closes it and everything in it
            except Exception as error:  # a failure here must not end the rest
                known = isinstance(error, MiburiError)
                _LOG.error("ROS 2: %s. Trying again.", error, exc_info=not known)
            await asyncio.sleep(_PAUSE)

    live_beside(app, live)


class _Inlet(Generic[_Message]):
    """A topic for wishes.

    While one wish is being forwarded, only the newest of those that arrive is kept.
    """

    def __init__(
        self,
        door: "_Door",
        name: str,
        kind: type[_Message],
        do: Callable[[_Message], Awaitable[None]],
        *,
        limited: bool = True,
    ) -> None:
        self._door, self._name, self._do, self._limited = door, name, do, limited
        self.reader = DataReader(
            door.participant, door.topic(name, kind), qos=_endpoint(_WISHED, kind)
        )
        self._task: asyncio.Task[None] | None = None

    def look(self, tasks: asyncio.TaskGroup) -> None:
        """Forward the latest wish, if any, unless another is being forwarded."""
        if self._task is not None and not self._task.done():
            return
        try:
            wishes = [one for one in self.reader.take() if not isinstance(one, InvalidSample)]
        except _UNREADABLE as error:
            self._door.refuse(self._name, f"the message cannot be read: {error}")
            return
        for wish in wishes:
            if self._limited and not self._door.wishes.take("all"):
                self._door.refuse(self._name, "too many wishes at once.")
            else:
                self._task = tasks.create_task(self._pass_on(wish))

    async def _pass_on(self, wish: _Message) -> None:
        try:
            await self._do(wish)
        except ValidationError as error:
            item = error.errors(include_url=False, include_input=False)[0]
            where = ".".join(str(part) for part in item["loc"])
            self._door.refuse(self._name, f"{where}: {item['msg']}".removeprefix(": "))
        except MiburiError as error:
            self._door.refuse(self._name, str(error))


class _Door:
    """One participant, its writers and its inlets."""

    def __init__(
        self, asker: Asker, partner: LivePartner, network: RosNetwork, wishes: Allowance
    ) -> None:
        self._asker, self._partner, self._network = asker, partner, network
        self._stamps, self._links = Stamps(), links(partner.robot)
        self.wishes = wishes
        self.participant = DomainParticipant(network.domain, Qos(Policy.Userdata(ENCLAVE)))
        self._writers: list[DataWriter[Any]] = []
        self._joints = self._writer("joint_states", JointStateMsg)
        self._frames = self._writer("/tf", TFMessageMsg)
        self._fixed = self._writer("/tf_static", TFMessageMsg, _KEPT)
        self._description = self._writer("robot_description", StringMsg, _KEPT)
        self._diagnoses = self._writer("/diagnostics", DiagnosticArrayMsg)
        self._expression = self._writer("expression", ExpressionMsg, _KEPT)
        self._refused = self._writer("refused", StringMsg)
        self._inlets = (
            _Inlet(self, "stop", EmptyMsg, self._stop, limited=False),
            _Inlet(self, "feel", StringMsg, self._feel),
            _Inlet(self, "say", StringMsg, self._say),
            _Inlet(self, "robot_face/expression", ExpressionMsg, self._show),
        )
        self._nodes = DataWriter(
            self.participant,
            Topic(self.participant, DISCOVERY, ParticipantEntitiesInfoMsg),
            qos=_endpoint(_KEPT, ParticipantEntitiesInfoMsg),
        )
        self._serial, self._time = -1, -1.0  # of the latest step published
        self._expressed: object = "nothing yet"
        self._diagnosed: object = None
        self._diagnosis_due = 0.0

    def topic(self, name: str, kind: type[_Message]) -> Topic[_Message]:
        """Return a topic of this partner, or of all partners."""
        return Topic(self.participant, self._network.topic(name), kind)

    def refuse(self, name: str, why: str) -> None:
        """Publish why a wish was refused."""
        words = {"topic": self._network.topic(name).removeprefix("rt"), "why": why}
        _write(self._refused, StringMsg(json.dumps(words)))

    async def live(self) -> None:
        """Publish, and forward wishes, until cancelled."""
        robot, now = self._partner.robot, self._stamps.now()
        readers = [inlet.reader for inlet in self._inlets]
        node = node_of(self.participant, self._network.name, readers, self._writers)
        _write(self._nodes, node)
        _write(self._description, StringMsg(to_urdf(robot)))
        _write(self._fixed, fixed_frames(robot, self._network, now))
        async with asyncio.TaskGroup() as tasks:
            while True:
                self._look()
                for inlet in self._inlets:
                    inlet.look(tasks)
                await asyncio.sleep(_PERIOD)

    def _writer(self, name: str, kind: type[_Message], qos: Qos = _LATEST) -> DataWriter[_Message]:
        writer = DataWriter(self.participant, self.topic(name, kind), qos=_endpoint(qos, kind))
        self._writers.append(writer)
        return writer

    def _look(self) -> None:
        state = None
        if self._partner.reachable:
            state = self._partner.snapshot.state
            for step in self._partner.steps_after(self._serial):
                self._serial = step.serial
                if step.state.time != self._time:  # else its stamp would repeat the last
                    self._time = step.state.time
                    self._tell_motion(step.state)
            self._tell_expression(state)
        self._tell_diagnosis(state)

    def _tell_motion(self, state: State) -> None:
        stamp = self._stamps.of(state.time)
        _write(self._joints, joint_state(stamp, state.angles, state.velocities))
        _write(self._frames, frames(self._links, self._network, stamp, state.angles))

    def _tell_expression(self, state: State) -> None:
        shown = state.expressed if state.asked and state.expressed else state.felt
        expressed = None if shown is None else (shown.feeling, round(shown.mood, 2))
        if expressed != self._expressed:
            self._expressed = expressed
            message = express(self._stamps.now(), shown)
            if message is not None:
                _write(self._expression, message)

    def _tell_diagnosis(self, state: State | None) -> None:
        """Publish stops and releases at once, and everything else once a second."""
        present = None if state is None else (state.stop, state.held, state.paused)
        if present != self._diagnosed or time.monotonic() >= self._diagnosis_due:
            self._diagnosed, self._diagnosis_due = present, time.monotonic() + _DIAGNOSIS
            motors = self._partner.motors
            _write(self._diagnoses, diagnose(self._network, self._stamps.now(), state, motors))

    async def _stop(self, _wish: EmptyMsg) -> None:
        await self._asker.tell("/stop")

    async def _feel(self, wish: StringMsg) -> None:
        await self._asker.tell("/stimulus", StimulusIn.model_validate_json(wish.data[:_LONGEST]))

    async def _say(self, wish: StringMsg) -> None:
        await self._asker.tell("/speak", SpeakIn(text=wish.data[:_LONGEST]))

    async def _show(self, wish: ExpressionMsg) -> None:
        gesture = read_expression(wish)
        if self._partner.snapshot.state.held:  # else it would wait, and the sender would not know
            raise BodyError("nothing was done: the body is stopped until a person releases it.")
        if gesture is None:  # neutral ends the current performance
            ahead = LookAct(do="look", at="user", seconds=1.0)
            await self._asker.tell("/performance", PerformanceIn(acts=[ahead], when="now"))
        else:
            await self._asker.tell("/express", gesture)


def _endpoint(qos: Qos, kind: type[IdlStruct]) -> Qos:
    """Return a writer's or reader's QoS with the hash of its type, as ROS does since Iron."""
    return Qos(Policy.Userdata(f"typehash={type_hash(kind)};".encode()), base=qos)


def _write(writer: DataWriter[_Message], message: _Message) -> None:
    """Send a message, unless a reader has stopped reading and the buffer is full."""
    with suppress(DDSException):
        writer.write(message)
