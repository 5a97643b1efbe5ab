"""Write what the body did and the partner felt to an MCAP file, and read it again.

The messages are JSON with a schema, so any MCAP tool reads them. There are five topics:

- ``/joint_states``: names, positions in rad, velocities in rad/s, phase
- ``/commands``: moves, rad and rad/s
- ``/feelings``: the three levels, and the expressed feeling
- ``/contacts``: stops
- ``/stimuli``: what the partner felt at what somebody did, and why, in words or names of signs;
  never sound or pictures. Given to another emotional model at their times, they replay.
"""

import json
import os
import struct
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import IO, Any, NamedTuple, Self

from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Channel, Schema
from mcap.records import Message as Record
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer
from zstandard import ZstdError

from miburi.bodies import BodyState
from miburi.errors import InputError
from miburi.feelings import FEELINGS, FeelingModel, Stimulus
from miburi.partner import Event, MoveSent, Stopped
from miburi.robot import JOINTS
from miburi.senses import Impression
from miburi.version import __version__

__all__ = ["Felt", "RecordedMessage", "Recorder", "is_whole", "read", "step_messages"]

#: What the reader raises at the end of a broken file, or for a file that is not MCAP.
_BROKEN = (McapError, struct.error, ZstdError, ValueError)
_NUMBERS = {"type": "array", "items": {"type": "number"}}
_NAMES = {"type": "array", "items": {"type": "string"}}
_SCHEMAS: dict[str, dict[str, Any]] = {
    "/joint_states": {
        "name": _NAMES,
        "position": _NUMBERS,
        "velocity": _NUMBERS,
        "phase": {"type": "string"},
    },
    "/commands": {
        "name": _NAMES,
        "position": _NUMBERS,
        "speed": _NUMBERS,
        "ik_error_m": _NUMBERS,
    },
    "/feelings": {
        "name": _NAMES,
        "emotion": _NUMBERS,
        "feeling": _NUMBERS,
        "mood": _NUMBERS,
        "expressed": {"type": ["string", "null"]},
    },
    "/contacts": {
        "reason": {"type": "string"},
        "motor": {"type": ["string", "null"]},
        "sign": {"type": ["string", "null"]},
        "ratio": {"type": ["number", "null"]},
        "mood_before": {"type": "number"},
        "mood_after": {"type": "number"},
    },
    "/stimuli": {
        "feeling": {"type": "string"},
        "strength": {"type": "number"},
        "source": {"type": "string"},
        "why": {
            "type": "array",
            "items": {
                "type": "object",
                "properties": {"what": {"type": "string"}, "weight": {"type": "number"}},
            },
        },
    },
}


class Felt(NamedTuple):
    """What a partner felt: s on the body's clock, and what somebody had shown, if a sense knows."""

    time: float
    stimulus: Stimulus
    impression: Impression | None


class RecordedMessage(NamedTuple):
    """One line of a recording: s on the body's clock, topic, content."""

    time: float
    topic: str
    content: dict[str, Any]


class Recorder:
    """Write an MCAP file; the same messages give the same bytes.

    Use it as a context manager. When the block ends, by an exception too, the recording is whole;
    only an ``OSError``, from the disk, leaves it broken off.

    Parameters
    ----------
    file
        A file open for writing bytes; the recorder does not close it.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._writer = Writer(file, compression=CompressionType.ZSTD)
        self._writer.start(profile="", library=f"miburi {__version__}")
        self._channels = {}
        for topic, properties in _SCHEMAS.items():
            schema = {"type": "object", "properties": properties, "required": list(properties)}
            schema_id = self._writer.register_schema(
                name="miburi" + topic.replace("/", "."),
                encoding="jsonschema",
                data=json.dumps(schema).encode(),
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
        """Record what :func:`step_messages` returned."""
        for time, topic, content in messages:
            nanoseconds = round(time * 1e9)
            self._writer.add_message(
                channel_id=self._channels[topic],
                log_time=nanoseconds,
                publish_time=nanoseconds,
                data=json.dumps(content, separators=(",", ":")).encode(),
            )

    def flush(self) -> None:
        """Hand everything to the system: the file can be read up to here, whatever follows."""
        self._writer.flush()  # type: ignore[no-untyped-call]  # mcap leaves it untyped


def step_messages(
    state: BodyState,
    feelings: FeelingModel | None,
    events: Iterable[Event],
    felt: Iterable[Felt] = (),
) -> list[RecordedMessage]:
    """Return the messages of one step, as a copy that later steps do not change.

    Parameters
    ----------
    state
        The body's state.
    feelings
        The emotional model whose three levels to record; None to leave them out.
    events
        The events of the step; only moves and stops make messages.
    felt
        What the partner felt before the step.
    """
    messages = [*map(_of_stimulus, felt), _of_state(state)]
    if feelings is not None:
        messages.append(_of_feelings(state.time, feelings))
    messages += [message for event in events if (message := _of_event(event)) is not None]
    return messages


def _of_state(state: BodyState) -> RecordedMessage:
    content = {
        "name": JOINTS,
        "position": state.angles.round(6).tolist(),
        "velocity": state.velocities.round(6).tolist(),
        "phase": state.phase.value,
    }
    return RecordedMessage(state.time, "/joint_states", content)


def _of_feelings(time: float, feelings: FeelingModel) -> RecordedMessage:
    shown = feelings.express()
    content = {
        "name": FEELINGS,
        "emotion": feelings.emotion.round(6).tolist(),
        "feeling": feelings.feeling.round(6).tolist(),
        "mood": feelings.mood.round(6).tolist(),
        "expressed": shown.feeling if shown else None,
    }
    return RecordedMessage(time, "/feelings", content)


def _of_stimulus(felt: Felt) -> RecordedMessage:
    content = {
        **asdict(felt.stimulus),
        "why": [asdict(part) for part in felt.impression.why] if felt.impression else [],
    }
    return RecordedMessage(felt.time, "/stimuli", content)


def _of_event(event: Event) -> RecordedMessage | None:
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
            content = {
                "reason": stop.reason,
                "motor": stop.motor,
                "sign": stop.sign,
                "ratio": stop.ratio,
                "mood_before": before,
                "mood_after": after,
            }
            return RecordedMessage(time, "/contacts", content)
        case _:
            return None


def is_whole(file: IO[bytes]) -> bool:
    """Whether a recording was ended properly, not broken off."""
    if file.seek(0, os.SEEK_END) < 2 * len(MCAP0_MAGIC):
        return False
    file.seek(-len(MCAP0_MAGIC), os.SEEK_END)
    return file.read() == MCAP0_MAGIC


def read(path: Path | str, topics: list[str] | None = None) -> Iterator[RecordedMessage]:
    """Yield the messages of a recording in order of time; a broken one up to the break.

    Raises
    ------
    InputError
        The file cannot be read, is not MCAP, or broke off before its first second.
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
                if topics is None or channel.topic in topics:
                    yield RecordedMessage(
                        message.log_time / 1e9, channel.topic, json.loads(message.data)
                    )
        except (*_BROKEN, OSError) as error:
            raise InputError(f"{path}: this is not an MCAP recording: {error}.") from error


def _up_to_the_break(file: IO[bytes]) -> list[tuple[Schema | None, Channel, Record]]:
    records = []
    try:
        for record in NonSeekingReader(file).iter_messages(log_time_order=False):
            records.append(record)  # noqa: PERF402  # keep what came before the break
    except _BROKEN:
        if not records:
            raise
    return sorted(records, key=lambda record: record[2].log_time)
