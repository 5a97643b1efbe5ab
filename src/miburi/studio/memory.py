"""What a partner remembers while it is switched off: its feelings, aged by the time away."""

import json
import time
from contextlib import suppress
from pathlib import Path

from miburi.errors import InputError
from miburi.feelings import EmotionalModel, FeelingModel, Temperament


def remembered(path: Path, temperament: Temperament) -> EmotionalModel | None:
    """Return the feelings kept in a file; None where there are none that can be read."""
    try:
        kept = json.loads(path.read_text())
        away = max(0.0, time.time() - float(kept["when"]))
        return EmotionalModel.load(kept["feelings"], temperament, away=away)
    except (OSError, ValueError, KeyError, TypeError, InputError):
        return None


def remember(path: Path, feelings: FeelingModel) -> None:
    """Keep the feelings in a file; where that cannot be done, the partner forgets."""
    draft = path.with_suffix(".new")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draft.write_text(json.dumps({"when": time.time(), "feelings": feelings.save()}))
        draft.replace(path)
    except OSError:
        with suppress(OSError):
            draft.unlink()
