"""The file that keeps a partner's feelings while it is switched off.

The feelings are written every minute and at the end, always as a whole file. When they are read
again, they decay for as long as the partner was off. A file that cannot be read is renamed, for a
person to look at, and the partner starts afresh.
"""

import json
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path
from typing import Any

from miburi.errors import InputError, MiburiError, OutputError
from miburi.feelings import EmotionalModel, FeelingModel, Temperament
from miburi.ground.files import write_whole

#: Time between two writes, and how long to wait for the loop's answer, s (our choice).
_PERIOD, _PATIENCE = 60.0, 5.0
#: Errors that a file with unexpected content may raise.
_UNUSABLE = (ValueError, LookupError, TypeError, AttributeError, RecursionError)


def remembered(
    path: Path, temperament: Temperament, model: type[FeelingModel] = EmotionalModel
) -> FeelingModel | None:
    """Return the feelings of an emotional model in a file; None if there is no file.

    Raises
    ------
    InputError
        The file cannot be read, or its feelings cannot be used; then it has been renamed to end in
        ``.bad``.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise InputError(f"{path}: cannot be read, the partner starts afresh: {error}.") from error
    try:
        # A whole number too large for a float becomes inf, and is refused like any wrong value.
        kept = json.loads(content, parse_int=float)
        away = max(0.0, time.time() - _moment(kept["when"]))
        return model.load(kept["feelings"], temperament, away=away)
    except (*_UNUSABLE, InputError) as error:
        aside, known = path.with_name(f"{path.name}.bad"), isinstance(error, InputError)
        with suppress(OSError):
            path.replace(aside)
        raise InputError(
            f"{path}: its feelings cannot be used, so the partner starts afresh; the file is kept "
            f"as {aside.name}. {'' if known else f'{type(error).__name__}: '}{str(error)[:450]}"
        ) from error


def remember(path: Path, feelings: Mapping[str, Any]) -> None:
    """Write what :meth:`FeelingModel.save` returned to a file.

    Raises
    ------
    OutputError
        The file cannot be written; its old content is still there.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, json.dumps({"when": time.time(), "feelings": feelings}))
    except OSError as error:
        raise OutputError(f"{path}: the feelings cannot be kept: {error}.") from error


def keep(
    path: Path, save: Callable[[], Future[dict[str, Any]]], wait: Callable[[float], bool]
) -> None:
    """Write the feelings to a file every minute until the partner ends; run it in a thread.

    ``save`` asks the loop for their state; ``wait`` waits for the given seconds, and returns True
    when the partner has ended.
    """
    while not wait(_PERIOD):
        with suppress(MiburiError, TimeoutError):  # a minute later is early enough
            remember(path, save().result(_PATIENCE))


def _moment(value: object) -> float:
    if not isinstance(value, float) or not 0 <= value < float("inf"):
        raise ValueError(f"“when” must be in seconds since 1970, got {value!r:.80}")
    return value
