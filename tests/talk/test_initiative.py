"""It begins by itself, with manners: seldom, never at night, less when nobody wants it."""

from collections import Counter
from collections.abc import Callable
from datetime import datetime, timedelta

import numpy as np
import pytest
from pydantic import ValidationError

from miburi.talk.initiative import Initiative, Manners, Presence, Reason

MORNING = datetime(2026, 11, 25, 9)
ON = Manners(on=True)


def there(
    initiative: Initiative,
    hours: float,
    speaks: Callable[[datetime, bool], bool] = lambda now, begun: False,
    due: bool = False,
    presence: Presence | None = None,
    now: datetime = MORNING,
) -> list[tuple[datetime, Reason]]:
    """Let somebody be seen for some hours; return when it began, and why."""
    begun: list[tuple[datetime, Reason]] = []
    presence = presence or Presence()
    for _ in range(round(hours * 720)):
        just_begun = bool(begun) and now - begun[-1][0] == timedelta(seconds=5)
        presence.notice(now, words=speaks(now, just_begun))
        if (reason := initiative.look(now, presence, due)) is not None:
            begun.append((now, reason))
        now += timedelta(seconds=5)
    return begun


def test_it_is_off_at_first() -> None:
    assert there(Initiative(), 8) == []


def test_somebody_who_comes_is_greeted_once() -> None:
    begun = there(Initiative(ON), 0.5)
    assert begun == [(MORNING, "greeting")]


def test_whoever_speaks_first_is_not_greeted() -> None:
    begun = there(Initiative(ON), 0.5, speaks=lambda now, _: now == MORNING)
    assert begun == []


def test_after_a_long_silence_it_asks_and_not_while_somebody_talks() -> None:
    silent = there(Initiative(ON), 1.0)
    assert [reason for _, reason in silent] == ["greeting", "question"]
    assert silent[1][0] - silent[0][0] > timedelta(minutes=45)
    talks = there(Initiative(ON), 3.0, speaks=lambda now, _: now.minute % 20 == 0)
    assert talks == []


def test_an_absent_person_is_asked_nothing() -> None:
    initiative, presence = Initiative(ON), Presence()
    presence.notice(MORNING, words=True)
    for minutes in range(11, 600):
        assert initiative.look(MORNING + timedelta(minutes=minutes), presence, due=True) is None


def test_of_a_day_that_it_was_told_it_speaks_to_the_one_who_told() -> None:
    begun = there(Initiative(ON), 1.0, speaks=lambda now, _: now == MORNING, due=True)
    assert begun[0] == (MORNING, "date")


@pytest.mark.parametrize("most", [1, 10])
def test_never_more_often_than_allowed_and_at_least_half_an_hour_apart(most: int) -> None:
    manners = Manners(on=True, most=most)
    begun = there(Initiative(manners), 12.0, speaks=lambda _, begun: begun)
    assert len(begun) == min(most, len(begun))
    assert most == 1 or len(begun) >= 4
    apart = np.diff([when for when, _ in begun])
    assert all(gap >= timedelta(minutes=30) for gap in apart)


def test_two_that_nobody_took_up_halve_them() -> None:
    initiative = Initiative(Manners(on=True, most=8))
    begun = there(initiative, 12.0)
    assert initiative.allowance < 8
    assert len(begun) <= 4
    heard = Presence(seen=MORNING + timedelta(hours=12), heard=MORNING + timedelta(hours=12))
    initiative.look(MORNING + timedelta(hours=12), heard, due=False)
    wanted = Initiative(Manners(on=True, most=8))
    there(wanted, 6.0, speaks=lambda _, begun: begun)
    assert wanted.allowance == 8


def test_a_week_has_no_beginning_in_quiet_hours() -> None:
    """Somebody comes and goes at all hours, and answers half the time."""
    rng, initiative, presence = np.random.default_rng(7), Initiative(ON), Presence()
    now, days = MORNING.replace(hour=0), Counter[int]()
    for _ in range(7 * 24 * 60):
        if rng.random() < 0.4:
            presence.notice(now, words=bool(rng.random() < 0.05))
        if initiative.look(now, presence, due=bool(rng.random() < 0.1)) is not None:
            assert not ON.quiet(now)
            assert 8 <= now.hour < 21
            days[now.day] += 1
        now += timedelta(minutes=1)
    assert 0 < max(days.values()) <= ON.most
    assert len(days) == 7


def test_quiet_hours_may_cross_midnight_or_not_be() -> None:
    night = Manners(quiet_from=22, quiet_to=7)
    assert night.quiet(MORNING.replace(hour=23))
    assert night.quiet(MORNING.replace(hour=3))
    assert not night.quiet(MORNING)
    assert not Manners(quiet_from=8, quiet_to=8).quiet(MORNING)
    noon = Manners(quiet_from=12, quiet_to=14)
    assert noon.quiet(MORNING.replace(hour=13))
    assert not noon.quiet(MORNING)


def test_wrong_manners_are_refused() -> None:
    for wrong in ({"most": 0}, {"most": 11}, {"often": True}):
        with pytest.raises(ValidationError):
            Manners.model_validate(wrong)
