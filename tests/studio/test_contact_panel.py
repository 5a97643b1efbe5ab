"""What people read about a stop, in their language."""

import re

import pytest

from miburi.live.runner import Runner
from miburi.live.state import Entry, StopOut
from miburi.safety.stop import StopReason
from miburi.studio.contact_panel import line, why
from miburi.studio.words import LANGUAGES, words


def read(runner: Runner, reason: StopReason, motor: str | None, language: str) -> str:
    """All that the studio says of a stop: above the robot, and in the log."""
    nothing = dict.fromkeys(
        ("ratio", "moved", "due", "measured", "expected", "force", "part"), None
    )
    moods = {"mood_before": 0.5, "mood_after": 0.5}
    stop = StopOut(time=1.0, reason=reason, motor=motor, sign=None, **nothing, **moods)
    state = runner.snapshot.state.model_copy(update={"stop": stop, "phase": "stopped"})
    entry = Entry(number=1, time=1.0, kind="stopped", name=reason, stop=stop)
    return " ".join((*why(state, words(language)), line(entry, words(language))))


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("motor", [None, "left_elbow"])
def test_every_stop_is_told_in_words_and_none_by_its_key(
    runner: Runner, motor: str | None, language: str
) -> None:
    told = {reason: read(runner, reason, motor, language) for reason in StopReason}
    assert len(set(told.values())) == len(StopReason)
    for text in told.values():
        assert not any(reason in text for reason in StopReason if "_" in reason)
        assert language == "en" or not re.search("[A-Za-z]{2}", text)
