"""Record the body's motion and the partner's feelings in an MCAP file, and read it back.

The messages are JSON with a schema, so any MCAP tool reads them. Each message has its time on
the robot's clock (``time``, in s); MCAP's own times come from the computer's clock. The topics:

- ``/joint_states``: names, positions in rad, velocities in rad/s, phase
- ``/tf``, ``/scene``: the same in Foxglove's schemas, for a view in 3D
- ``/commands``: moves, with positions in rad and speeds in rad/s
- ``/feelings``: the three levels, and the feeling that is felt or, in a requested gesture, shown
- ``/contacts``: stops
- ``/touch``: the force on the simulated human hand, in N, while there is a force
- ``/events``: the events that a running partner reports, including what the partner itself says
- ``/stimuli``: each stimulus, with what caused it (words, or the name of what was noticed; never
  sound or pictures)

To replay a recording in another emotional model, apply each stimulus at its time. No whole sentence
of a person is recorded. The metadata has the robot's name, and its description as JSON.
"""

import json
import os
import struct
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import IO, Any, NamedTuple, Self

from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Channel, Schema
from mcap.records import Message as Record
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer
from zstandard import ZstdError

from miburi.bodies import BodyState, Touch
from miburi.errors import InputError
from miburi.feelings import FEELINGS, Expression, FeelingModel, Stimulus
from miburi.live.events.event import LiveEvent, without_words
from miburi.live.recording.foxglove import SCHEMAS, Transforms, scene
from miburi.partner import Event, MoveSent, Stopped
from miburi.robot import JOINTS, Robot
from miburi.safety.stop import StopReason
from miburi.senses import Impression
from miburi.version import __version__

#: The reader's errors at the end of a broken file, or for a file that is not MCAP.
_BROKEN = (McapError, struct.error, ZstdError, ValueError)
_NUMBER, _NUMBERS = {"type": "number"}, {"type": "array", "items": {"type": "number"}}
_TEXT, _NAMES = {"type": "string"}, {"type": "array", "items": {"type": "string"}}
_TEXT_OR_NULL, _NUMBER_OR_NULL = {"type": ["string", "null"]}, {"type": ["number", "null"]}
_WEIGHT = _NUMBER | {"description": "log-odds"}
_WHY = {"type": "object", "properties": {"what": _TEXT, "weight": _WEIGHT}}
_FRAMES, _SCENE = "foxglove.FrameTransforms", "foxglove.SceneUpdate"
_SECONDS, _NEWTONS = _NUMBER | {"description": "s"}, _NUMBER | {"description": "N"}
_ANGLES, _SPEEDS = _NUMBERS | {"description": "rad"}, _NUMBERS | {"description": "rad/s"}
_ERRORS = _NUMBERS | {"description": "m, for right hand, left hand and head"}
_ZERO_TO_ONE = {"description": "from 0 to 1"}
_LEVELS, _LEVEL_OR_NULL = _NUMBERS | _ZERO_TO_ONE, _NUMBER_OR_NULL | _ZERO_TO_ONE
_RATIO = _NUMBER_OR_NULL | {"description": "measured travel over expected travel"}
_CONTENTS: dict[str, dict[str, Any]] = {
    "/joint_states": {"name": _NAMES, "position": _ANGLES, "velocity": _SPEEDS, "phase": _TEXT},
    "/commands": {"name": _NAMES, "position": _ANGLES, "speed": _SPEEDS, "ik_error_m": _ERRORS},
    "/feelings": {
        "name": _NAMES, "emotion": _LEVELS, "feeling": _LEVELS, "mood": _LEVELS,
        "expressed": _TEXT_OR_NULL, "expressed_mood": _LEVEL_OR_NULL,
    },
    "/contacts": {
        "reason": _TEXT, "motor": _TEXT_OR_NULL, "sign": _TEXT_OR_NULL, "ratio": _RATIO,
        "force": _NUMBER_OR_NULL | {"description": "N"}, "part": _TEXT_OR_NULL,
        "mood_before": _LEVEL_OR_NULL, "mood_after": _LEVEL_OR_NULL,
    },
    "/touch": {"force": _NEWTONS, "part": _TEXT_OR_NULL},
    "/stimuli": {
        "feeling": _TEXT, "strength": _NUMBER | _ZERO_TO_ONE, "source": _TEXT,
        "why": {"type": "array", "items": _WHY},
    },
}  # fmt: skip
_SCHEMAS: dict[str, dict[str, Any]] = {
    topic: {
        "type": "object",
        "properties": (fields := {"time": _SECONDS, **content}),
        "required": list(fields),
    }
    for topic, content in _CONTENTS.items()
}
_SCHEMAS["/events"] = LiveEvent.model_json_schema(mode="serialization")


class Felt(NamedTuple):
    """A stimulus, its time in s on the body's clock, and the impression that caused it, if any."""

    time: float
    stimulus: Stimulus
    impression: Impression | None


class RecordedMessage(NamedTuple):
    """A message of a recording.

    Attributes
    ----------
    time
        The time in s on the body's clock.
    wall
        The time in ns since 1970; if None, MCAP's times are those of the body's clock.
    """

    time: float
    topic: str
    content: dict[str, Any]
    wall: int | None = None


class RecordingAbout(NamedTuple):
    """The metadata of a recording: its robot, and further details."""

    robot: Robot | None = None
    more: Mapping[str, str] = MappingProxyType({})


class Recorder:
    """Write an MCAP file; the same messages give the same bytes.

    Use it as a context manager. The recording is completed when the block ends, even by an
    exception; only an ``OSError`` from the disk leaves it incomplete.

    Parameters
    ----------
    file
        A file open for writing bytes; the recorder does not close it.
    """

    def __init__(self, file: IO[bytes], about: RecordingAbout | None = None) -> None:
        about = about or RecordingAbout()
        self._robot, self._drawn = about.robot, False
        self._transforms = about.robot and Transforms(about.robot)
        self._writer = Writer(file, compression=CompressionType.ZSTD)
        self._writer.start(profile="", library=f"miburi {__version__}")
        robot = {}
        if about.robot is not None:
            robot = {"robot": about.robot.name, "description": about.robot.model_dump_json()}
        self._writer.add_metadata("miburi", {"version": __version__, **robot, **about.more})
        self._channels: dict[str, int] = {}
        for topic, schema in _SCHEMAS.items():
            self._add_channel(topic, "miburi" + topic.replace("/", "."), schema)
        for topic, name in (("/tf", _FRAMES), ("/scene", _SCENE)):
            self._add_channel(topic, name, SCHEMAS[name])

    def _add_channel(self, topic: str, name: str, schema: dict[str, Any]) -> None:
        schema_id = self._writer.register_schema(
            name=name, encoding="jsonschema", data=json.dumps(schema).encode()
        )
        self._channels[topic] = self._writer.register_channel(topic, "json", schema_id)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if not isinstance(error, OSError):
            self._writer.finish()  # type: ignore[no-untyped-call]  # mcap leaves it untyped

    def write(self, messages: Iterable[RecordedMessage]) -> None:
        """Record messages."""
        for message in messages:
            wall = round(message.time * 1e9) if message.wall is None else message.wall
            self._add(message.topic, wall, {"time": message.time, **message.content})
            if message.topic == "/joint_states" and self._robot and self._transforms:
                if not self._drawn:
                    self._drawn = True
                    self._add("/scene", wall, scene(self._robot, wall))
                self._add("/tf", wall, self._transforms.at(wall, message.content["position"]))

    def _add(self, topic: str, wall: int, content: dict[str, Any]) -> None:
        self._writer.add_message(
            channel_id=self._channels[topic],
            log_time=wall,
            publish_time=wall,
            data=json.dumps(content, separators=(",", ":")).encode(),
        )

    def flush(self) -> None:
        """Pass everything to the operating system, so that the file is readable up to here."""
        self._writer.flush()  # type: ignore[no-untyped-call]  # mcap leaves it untyped


def step_messages(
    state: BodyState,
    feelings: FeelingModel | None,
    events: Iterable[Event],
    felt: Iterable[Felt] = (),
    *,
    asked: Expression | None = None,
    touch: Touch | None = None,
    met: Touch | None = None,
    told: Iterable[LiveEvent] = (),
    wall: int | None = None,
) -> list[RecordedMessage]:
    """Return the messages of one step, as a copy that later steps do not change.

    Parameters
    ----------
    feelings
        The emotional model whose three levels to record; None to leave them out.
    events
        The events of the step; only moves and stops make messages.
    felt
        The stimuli before the step.
    asked
        The expression of a requested gesture, if one is performed now; it is recorded instead
        of the felt one.
    touch
        What touches the body now, if that is known.
    met
        The largest force until the body stopped, and the part touched, if it stopped in this step;
        otherwise None.
    told
        The events that were reported since the last step; people's words in them are not recorded.
    wall
        The time of the step, in ns since 1970; None if only the body's clock is known.
    """
    messages = [*map(_of_stimulus, felt), _of_state(state)]
    if feelings is not None:
        messages.append(_of_feelings(state.time, feelings, asked or feelings.express()))
    if touch is not None and touch.force > 0:
        content = {"force": round(touch.force, 3), "part": touch.part}
        messages.append(RecordedMessage(state.time, "/touch", content))
    messages += [message for event in events if (message := _of_event(event, met)) is not None]
    messages = [one._replace(wall=wall) for one in messages]
    messages += map(_of_live_event, told)
    return messages


def _of_state(state: BodyState) -> RecordedMessage:
    content = {
        "name": JOINTS,
        "position": state.angles.round(6).tolist(),
        "velocity": state.velocities.round(6).tolist(),
        "phase": state.phase.value,
    }
    return RecordedMessage(state.time, "/joint_states", content)


def _of_feelings(time: float, feelings: FeelingModel, shown: Expression | None) -> RecordedMessage:
    content = {
        "name": FEELINGS,
        "emotion": feelings.emotion.round(6).tolist(),
        "feeling": feelings.feeling.round(6).tolist(),
        "mood": feelings.mood.round(6).tolist(),
        "expressed": shown and shown.feeling,
        "expressed_mood": shown and round(shown.mood, 6),
    }
    return RecordedMessage(time, "/feelings", content)


def _of_stimulus(felt: Felt) -> RecordedMessage:
    content = {
        **asdict(felt.stimulus),
        "why": [asdict(part) for part in felt.impression.why] if felt.impression else [],
    }
    return RecordedMessage(felt.time, "/stimuli", content)


def _of_live_event(event: LiveEvent) -> RecordedMessage:
    content = without_words(event).model_dump(mode="json")
    return RecordedMessage(event.time, "/events", content, round(event.wall.timestamp() * 1e9))


def _of_event(event: Event, met: Touch | None) -> RecordedMessage | None:
    match event:
        case MoveSent(time, _, move, solution):
            content = {
                "name": JOINTS,
                "position": move.angles.round(6).tolist(),
                "speed": move.speeds.round(6).tolist(),
                "ik_error_m": solution.error.round(9).tolist(),
            }
            return RecordedMessage(time, "/commands", content)
        case Stopped(time, stop, before, after):
            contact = stop.reason is StopReason.CONTACT
            content = {
                "reason": stop.reason,
                "motor": stop.motor,
                "sign": stop.sign,
                "ratio": stop.ratio,
                "force": met and round(met.force, 3),
                "part": met and met.part,
                "mood_before": before if contact else None,
                "mood_after": after if contact else None,
            }
            return RecordedMessage(time, "/contacts", content)
        case _:
            return None


def is_whole(file: IO[bytes]) -> bool:
    """Whether a recording was completed."""
    if file.seek(0, os.SEEK_END) < 2 * len(MCAP0_MAGIC):
        return False
    file.seek(-len(MCAP0_MAGIC), os.SEEK_END)
    return file.read() == MCAP0_MAGIC


def recorded_about(path: Path | str) -> dict[str, str]:
    """Return the metadata of a recording; empty if it has none, or is no recording."""
    with suppress(*_BROKEN, OSError), Path(path).open("rb") as file:
        for metadata in NonSeekingReader(file).iter_metadata():
            return metadata.metadata
    return {}


def read(path: Path | str, topics: list[str] | None = None) -> Iterator[RecordedMessage]:
    """Yield the messages of a recording in order of time; if it is broken, those before the break.

    The topics in Foxglove's schemas are left out, as they only repeat data.

    Raises InputError if the file cannot be read, is not MCAP, or broke off within its first second.
    """
    try:
        file = Path(path).open("rb")  # noqa: SIM115  # closed below
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}.") from error
    with file:
        try:
            whole = is_whole(file)
            file.seek(0)
            records = make_reader(file).iter_messages(topics) if whole else _up_to_the_break(file)
            for _, channel, message in records:
                topic, wall = channel.topic, message.log_time
                if topic in _SCHEMAS and (topics is None or topic in topics):
                    content = json.loads(message.data)
                    time = content.pop("time", wall / 1e9)
                    yield RecordedMessage(time, topic, content, wall)
        except (*_BROKEN, OSError) as error:
            raise InputError(
                f"{path}: this is not a recording by Miburi, or it is cut off or damaged."
            ) from error


def _up_to_the_break(file: IO[bytes]) -> list[tuple[Schema | None, Channel, Record]]:
    records = []
    try:
        for record in NonSeekingReader(file).iter_messages(log_time_order=False):
            records.append(record)  # noqa: PERF402  # keep the messages before the break
    except _BROKEN:
        if not records:
            raise
    return sorted(records, key=lambda record: record[2].log_time)
