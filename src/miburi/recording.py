"""Recordings: what the body did and what the partner felt, as MCAP files and back.

Topics, all JSON with a schema, so that any MCAP tool reads them: ``/joint_states`` (names,
positions in rad, velocities in rad/s, phase), ``/commands`` (moves: rad and rad/s),
``/feelings`` (the three levels and what is expressed) and ``/contacts`` (stops).
"""

import json
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import IO, Any, NamedTuple, Self

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from miburi.bodies import BodyState
from miburi.errors import InputError
from miburi.feelings import FEELINGS, FeelingModel
from miburi.partner import Event, MoveSent, Stopped
from miburi.robot import JOINTS
from miburi.version import __version__

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
}


class Message(NamedTuple):
    """One line of a recording: s on the body's clock, topic, content."""

    time: float
    topic: str
    content: dict[str, Any]


class Recorder:
    """Write an MCAP file; the same messages give the same bytes.

    Use it as a context manager: the recording is whole when the block ends, however it ends.

    Parameters
    ----------
    file
        Open for writing bytes; it is not closed.
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
        self._writer.finish()  # type: ignore[no-untyped-call]  # mcap leaves it untyped

    def state(self, state: BodyState) -> None:
        """Record what the motors say."""
        content = {
            "name": JOINTS,
            "position": state.angles.round(6).tolist(),
            "velocity": state.velocities.round(6).tolist(),
            "phase": state.phase.value,
        }
        self._write(state.time, "/joint_states", content)

    def feelings(self, time: float, feelings: FeelingModel) -> None:
        """Record the three levels."""
        shown = feelings.express()
        content = {
            "name": FEELINGS,
            "emotion": feelings.emotion.round(6).tolist(),
            "feeling": feelings.feeling.round(6).tolist(),
            "mood": feelings.mood.round(6).tolist(),
            "expressed": shown.feeling if shown else None,
        }
        self._write(time, "/feelings", content)

    def event(self, event: Event) -> None:
        """Record a command or a stop; other events are seen in the states."""
        match event:
            case MoveSent(time, _, move, solution):
                content = {
                    "name": JOINTS,
                    "position": move.angles.round(6).tolist(),
                    "speed": move.speeds.round(6).tolist(),
                    "ik_error_m": solution.error.round(9).tolist(),
                }
                self._write(time, "/commands", content)
            case Stopped(time, stop, before, after):
                content = {
                    "reason": stop.reason,
                    "motor": stop.motor,
                    "sign": stop.sign,
                    "ratio": stop.ratio,
                    "mood_before": before,
                    "mood_after": after,
                }
                self._write(time, "/contacts", content)
            case _:
                pass

    def _write(self, time: float, topic: str, content: dict[str, Any]) -> None:
        nanoseconds = round(time * 1e9)
        self._writer.add_message(
            channel_id=self._channels[topic],
            log_time=nanoseconds,
            publish_time=nanoseconds,
            data=json.dumps(content, separators=(",", ":")).encode(),
        )


def read(path: Path | str, topics: list[str] | None = None) -> Iterator[Message]:
    """Read a recording, in the order of time.

    Raises
    ------
    InputError
        The file cannot be read, or is not MCAP.
    """
    try:
        file = Path(path).open("rb")  # noqa: SIM115  # closed below
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}.") from error
    with file:
        try:
            for _, channel, message in make_reader(file).iter_messages(topics=topics):
                yield Message(message.log_time / 1e9, channel.topic, json.loads(message.data))
        except (McapError, OSError) as error:  # seeking before a file's start is an OSError
            raise InputError(f"{path}: this is not a whole MCAP recording: {error}") from error
