"""The file that keeps a partner's feelings while it is switched off.

The whole file is written every minute and at the end. When the feelings are read again, they decay
for as long as the partner was off. A file that cannot be used is renamed, so that a person can look
at it, and the partner starts afresh.
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
from miburi.ground.files import put_aside, write_whole

#: The time between two writes, and the time to wait for the loop's answer, in s (our choice).
_PERIOD, _PATIENCE = 60.0, 5.0
#: Errors that a file with unexpected content may raise.
_UNUSABLE = (ValueError, LookupError, TypeError, AttributeError, RecursionError)


def remembered(
    path: Path, temperament: Temperament, model: type[FeelingModel] = EmotionalModel
) -> FeelingModel | None:
    """Return an emotional model with the feelings in a file; None if there is no file.

    Raises InputError if the file cannot be read, or if its feelings cannot be used; in the second
    case, the file has been renamed to end in ``.bad``.
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
        kept, known = "", isinstance(error, InputError)
        with suppress(OSError):
            kept = f"; the file is kept as {put_aside(path).name}"
        raise InputError(
            f"{path}: its feelings cannot be used, so the partner starts afresh{kept}. "
            f"{'' if known else f'{type(error).__name__}: '}{str(error)[:450]}"
        ) from error


def remember(path: Path, feelings: Mapping[str, Any]) -> None:
    """Write the result of :meth:`FeelingModel.save` to a file.

    Raises OutputError if the file cannot be written; its old content remains.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, json.dumps({"when": time.time(), "feelings": feelings}))
    except OSError as error:
        raise OutputError(f"{path}: the feelings cannot be kept: {error}.") from error


def keep(
    path: Path, save: Callable[[], Future[dict[str, Any]]], wait: Callable[[float], bool]
) -> None:
    """Write the feelings to a file every minute until the partner ends; run this in a thread.

    ``save`` asks the loop for the feelings; ``wait`` waits for the given seconds, and returns
    whether the partner has ended.
    """
    while not wait(_PERIOD):
        with suppress(MiburiError, TimeoutError):  # a minute later is early enough
            remember(path, save().result(_PATIENCE))


def _moment(value: object) -> float:
    if not isinstance(value, float) or not 0 <= value < float("inf"):
        raise ValueError(f"“when” must be in seconds since 1970, got {value!r:.80}")
    return value
