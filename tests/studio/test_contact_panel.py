"""What people read about a stop, in their language."""

import re

import pytest

from miburi.feelings import Stimulus
from miburi.live.events.event import LiveEvent
from miburi.live.runner import Runner
from miburi.live.state import StopOut
from miburi.live.wishes import Feel, Sense
from miburi.safety.stop import StopReason
from miburi.senses.happenings import notice
from miburi.senses.tone import coloured
from miburi.senses.words import hear
from miburi.studio.contact_panel import line, measurements, why
from miburi.studio.words import page_languages, words


def read(runner: Runner, reason: StopReason, motor: str | None, language: str) -> str:
    """All that the studio says of a stop: above the robot, and in the log."""
    nothing = dict.fromkeys(
        ("ratio", "moved", "due", "measured", "expected", "force", "part"), None
    )
    moods = {"mood_before": 0.5, "mood_after": 0.5}
    stop = StopOut(time=1.0, reason=reason, motor=motor, sign=None, **nothing, **moods)
    state = runner.snapshot.state.model_copy(update={"stop": stop, "phase": "stopped"})
    entry = LiveEvent.model_validate(
        {"boot": "5f2c9a10", "number": 1, "wall": "2026-11-24T10:00:00Z", "time": 1.0}
        | {"kind": "stop", "name": reason, "stop": stop}
    )
    return " ".join((*why(state, words(language)), line(entry, words(language))))


@pytest.mark.parametrize("language", page_languages())
@pytest.mark.parametrize("motor", [None, "left_elbow"])
def test_every_stop_is_told_in_words_and_none_by_its_key(
    runner: Runner, motor: str | None, language: str
) -> None:
    told = {reason: read(runner, reason, motor, language) for reason in StopReason}
    assert len(set(told.values())) == len(StopReason)
    for text in told.values():
        assert not any(reason in text for reason in StopReason if "_" in reason)
        assert language == "en" or not re.search("[A-Za-z]{2}", text)


def test_a_move_that_shows_no_feeling_is_told_by_its_name() -> None:
    entry = LiveEvent.model_validate(
        {"boot": "5f2c9a10", "number": 1, "wall": "2026-11-24T10:00:00Z", "time": 1.0}
        | {"kind": "gesture_begun", "name": "wave"}
    )
    assert line(entry, words("en")) == "“wave” begins"


@pytest.mark.parametrize(
    ("language", "told"),
    [
        ("en", "Stop was pressed by the smart home before this start, at 2026-11-23 "),
        ("ja", "今回の起動より前、2026-11-23 "),
    ],
)
def test_a_stop_from_before_the_start_is_told_with_its_day(language: str, told: str) -> None:
    entry = LiveEvent.model_validate(
        {"boot": "5f2c9a10", "number": 1, "wall": "2026-11-24T10:00:00Z", "time": 0.0}
        | {"kind": "pressed", "by": "home", "detail": "2026-11-23T12:00:00.412000+00:00"}
    )
    assert line(entry, words(language)).startswith(told)


@pytest.mark.parametrize(
    ("force", "told"), [(12.34, "12.3 N"), (1300.9, "over 60 N: a drawn hand")]
)
def test_no_force_is_told_that_no_motor_can_press_with(force: float, told: str) -> None:
    stop = StopOut(
        time=1.0, reason=StopReason.CONTACT, motor="waist", sign="tracking", part="left_hand",
        ratio=0.5, moved=0.1, due=0.2, measured=None, expected=None, force=force,
        mood_before=0.5, mood_after=0.4,
    )  # fmt: skip
    assert told in measurements(stop, 0.9372, words("en"))


@pytest.mark.parametrize(
    ("language", "said", "touched"),
    [
        (
            "en",
            "A remark: sadness, strength 1.00, because of “sad”",
            "A touch: happiness, strength 0.60, because of a stroke",
        ),
        (
            "ja",
            "声かけ：悲しみ、強さ 1.00（「sad」）",
            "触れ合い：喜び、強さ 0.60（なでられたこと）",
        ),
    ],
)
def test_the_log_says_why_it_felt_something(
    runner: Runner, language: str, said: str, touched: str
) -> None:
    runner.ask(Sense(hear("I am so sad today")))
    runner.ask(Sense(notice("stroke")))
    runner.ask(Feel(Stimulus("anger", 0.5, "touch")))
    runner.tick()
    first, second, third = (
        line(entry, words(language))
        for entry in runner.history.after(0)
        if entry.kind == "stimulus"
    )
    assert (first, second) == (said, touched)
    assert third.startswith(words(language)["source"]["touch"])
    assert third.endswith("0.50")


@pytest.mark.parametrize(
    ("language", "told"),
    [
        ("en", "A remark: thrill, strength 0.97, because of “happy”, a raised voice"),
        ("ja", "声かけ：興奮、強さ 0.97（「happy」, 大きく高い声）"),
    ],
)
def test_a_tone_of_voice_is_told_in_words(runner: Runner, language: str, told: str) -> None:
    runner.ask(Sense(coloured(hear("I am so happy today"), "raised")))
    runner.tick()
    (entry,) = [one for one in runner.history.after(0) if one.kind == "stimulus"]
    assert line(entry, words(language)) == told
