"""Whom the partner knows: on the user's disk if they allow it, gone when they delete it."""

import errno
import os
import threading
from collections.abc import Callable
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest

from miburi.errors import InputError, OutputError
from miburi.feelings import FEELINGS, EmotionalModel, Stimulus, shipped_temperament
from miburi.languages import Language
from miburi.people import Memory
from miburi.people.memory import MOST_FACTS
from miburi.people.recall import recall
from miburi.people.remarks import STAYS

FACTS, MORE_FACTS = (
    [row.split("\t") for row in Path(__file__).with_name(name).read_text("utf-8").splitlines()]
    for name in ("facts.tsv", "facts-2.tsv")
)
HAPPINESS, ANGER = FEELINGS.index("happiness"), FEELINGS.index("anger")


class Clock:
    """Tells a time that a test moves."""

    def __init__(self) -> None:
        self.now = datetime(2026, 11, 25, 9, tzinfo=UTC)

    def __call__(self) -> datetime:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "people.json"


def memory(path: Path | None, clock: Clock) -> Memory:
    return Memory(path, shipped_temperament(), clock)


@pytest.fixture
def one(path: Path, clock: Clock) -> Memory:
    """A memory that may write, and Dot, who is there."""
    one = memory(path, clock)
    one.allow(True)
    one.meet("Dot")
    return one


def test_nothing_is_written_unless_somebody_allows_it(path: Path, clock: Clock) -> None:
    one = memory(path, clock)
    one.meet("Anna")
    one.remember("My daughter comes on Sunday.", "en")
    assert list(path.parent.iterdir()) == []
    assert one.recall("When does my daughter come?", "en") == "My daughter comes on Sunday"
    assert memory(path, clock).people.people == []


def test_a_fact_is_written_at_once(one: Memory, path: Path, clock: Clock) -> None:
    """So it outlasts a program that is killed."""
    told = [fact for fact, _, _ in FACTS[:5]]
    for number, fact in enumerate(told, 1):
        one.remember(fact, "en")
        (dot,) = memory(path, clock).people.people
        assert [fact.text for fact in dot.facts] == told[:number]


@pytest.mark.parametrize("facts", [FACTS, MORE_FACTS])
def test_a_question_is_answered_by_a_fact(one: Memory, facts: list[list[str]]) -> None:
    """Two strangers wrote the facts. The rule of subjects was written with their lines in view."""
    for fact, _, _ in facts:
        one.remember(fact, "en")
    right = sum(word.lower() in (one.recall(asks, "en") or "").lower() for _, asks, word in facts)
    assert right >= 0.8 * len(facts)
    told = [fact for fact, _, _ in facts]
    untold = (
        recall(asks, [other for other in told if other != fact], "en") for fact, asks, _ in facts
    )
    assert sum(found is not None for found in untold) <= 0.3 * len(facts)
    for asks in ("What is the capital of Mongolia?", "Who won the match?", ""):
        assert one.recall(asks, "en") is None


def test_a_fact_about_somebody_else_is_no_answer(one: Memory) -> None:
    """A sentence about the doctor's name does not answer a question for the dog's."""
    for told in ("My doctor is called Okafor.", "Tom lives in Leeds.", "I was born in May."):
        one.remember(told, "en")
    assert one.recall("What is my dog called?", "en") is None
    assert one.recall("Where does Ruth live?", "en") is None
    assert one.recall("Where does Tom live?", "en") == "Tom lives in Leeds"


def test_a_question_for_a_time_or_a_number_is_answered_with_one(one: Memory) -> None:
    for told in ("We went dancing, and I had two left feet.", "Julie feeds the cat for me."):
        one.remember(told, "en")
    assert one.recall("When am I having my feet done?", "en") is None
    assert one.recall("How often does Julie feed the cat?", "en") is None
    one.remember("I have my feet done on Thursday at ten.", "en")
    one.remember("Julie feeds the cat twice a day.", "en")
    assert "Thursday" in (one.recall("When am I having my feet done?", "en") or "")
    assert "twice" in (one.recall("How often does Julie feed the cat?", "en") or "")


def test_japanese_is_found_by_its_letters(one: Memory) -> None:
    one.remember("娘の花子は日曜日に来ます", "ja")
    one.remember("薬は朝食のあとに飲みます", "ja")
    assert one.recall("花子はいつ来るの？", "ja") == "娘の花子は日曜日に来ます"
    assert one.recall("薬はいつ飲む？", "ja") == "薬は朝食のあとに飲みます"
    assert one.recall("天気はどう？", "ja") is None


def test_a_deleted_fact_leaves_no_byte(one: Memory, path: Path) -> None:
    secret = one.remember("My sister Wilhelmina has debts.", "en")
    one.remember("I like tea.", "en")
    assert secret is not None
    assert "Wilhelmina" in path.read_text(encoding="utf-8")
    one.correct("dot", secret.number, None)
    kept = b"".join(file.read_bytes() for file in path.parent.rglob("*") if file.is_file())
    assert b"Wilhelmina" not in kept
    assert b"I like tea." in kept
    one.forget("Dot")
    assert b"tea" not in path.read_bytes()
    assert one.present is None
    one.allow(False)
    assert list(path.parent.iterdir()) == []


def test_a_fact_can_be_corrected_and_only_one_that_there_is(
    one: Memory, path: Path, clock: Clock
) -> None:
    fact = one.remember("I was born in Leeds.", "en")
    assert fact is not None
    one.correct("Dot", fact.number, "I was born in York.")
    (known,) = memory(path, clock).meet("Dot").facts
    assert known.text == "I was born in York."
    for name, number, text in (("Bert", 1, "x"), ("Dot", 9, "x"), ("Dot", 1, " ")):
        with pytest.raises(InputError):
            one.correct(name, number, text)
    with pytest.raises(InputError, match="nobody"):
        one.forget("Bert")


def test_nobody_is_taken_for_another(one: Memory, clock: Clock) -> None:
    """Somebody is there while they speak and two hours after; then it names nobody."""
    clock.now += STAYS - timedelta(seconds=1)
    assert one.present is not None
    one.hear()
    clock.now += STAYS + timedelta(seconds=1)
    assert one.present is None
    assert one.recall("Where was I born?", "en") is None
    one.meet("Bert")
    assert one.present is not None
    assert one.present.name == "Bert"


def test_the_oldest_facts_go_first(clock: Clock) -> None:
    one = memory(None, clock)
    one.meet("Anna")
    for number in range(MOST_FACTS + 5):
        one.remember(f"Fact number {number}", "en")
    assert one.present is not None
    assert len(one.present.facts) == MOST_FACTS
    assert one.present.facts[0].text == "Fact number 5"
    assert len({fact.number for fact in one.present.facts}) == MOST_FACTS


def test_a_file_that_is_none_of_ours_is_put_aside_until_everybody_is_forgotten(
    path: Path, clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    path.write_text("{}[", encoding="utf-8")
    one = memory(path, clock)
    assert one.people.people == []
    assert "kept as people.json.bad" in capsys.readouterr().err
    assert path.with_name("people.json.bad").read_text(encoding="utf-8") == "{}["
    assert memory(path, clock).allowed, "as it was"
    one.allow(False)
    assert list(path.parent.iterdir()) == []


def test_a_file_that_cannot_be_read_is_left_as_it_is(one: Memory, path: Path, clock: Clock) -> None:
    """A restore by root took everybody away."""
    one.remember("My PIN is 4711.", "en")
    kept = path.read_bytes()

    def closed(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "open", closed)
        with pytest.raises(InputError, match=r"people\.json: cannot be read \(Perm.*sudo chown"):
            memory(path, clock)
    assert [*path.parent.iterdir()] == [path]
    assert path.read_bytes() == kept


def test_a_second_damage_leaves_what_was_put_aside_at_the_first(path: Path, clock: Clock) -> None:
    for content in ("{}[", "[]{"):
        path.write_text(content, encoding="utf-8")
        memory(path, clock)
    aside = [path.with_name(f"people.json.bad{end}").read_text("utf-8") for end in ("", "-2")]
    assert aside == ["{}[", "[]{"]
    memory(path, clock).allow(False)
    assert list(path.parent.iterdir()) == []


def test_an_attachment_of_another_version_is_left_for_it(
    one: Memory, path: Path, clock: Clock
) -> None:
    text = path.read_text(encoding="utf-8").replace('"version": 2', '"version": 1')
    path.write_text(text, encoding="utf-8")
    (dot,) = memory(path, clock).people.people
    again = memory(path, clock)
    again.meet("Dot")
    again.hear((Stimulus("happiness", 0.8),))
    assert again.leaning is not None
    assert not again.leaning.any()
    assert memory(path, clock).people.people[0].attachment == dot.attachment


@pytest.fixture
def full(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """A function that fills the disk."""

    def fsync(_file: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    return lambda: monkeypatch.setattr(os, "fsync", fsync)


def test_a_full_disk_takes_no_deletion_and_nothing_else_from_it(
    one: Memory, path: Path, clock: Clock, full: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    fact = one.remember("My PIN is 4711.", "en")
    assert fact is not None
    full()
    deletions = (
        lambda: one.forget("Dot"),
        lambda: one.correct("Dot", fact.number, None),
        lambda: one.correct("Dot", fact.number, "My PIN is secret."),
    )
    for delete in deletions:
        with pytest.raises(OutputError, match="No space left on device. Make room"):
            delete()
        for known in (one, memory(path, clock)):
            assert [each.text for each in known.people.people[0].facts] == ["My PIN is 4711."]
    one.hear((Stimulus("happiness", 0.8),))
    assert one.remember("I like tea.", "en")
    assert [each.text for each in one.people.people[0].facts] == ["My PIN is 4711.", "I like tea."]
    monkeypatch.undo()
    one.correct("Dot", fact.number, None)
    assert [each.text for each in memory(path, clock).people.people[0].facts] == ["I like tea."]


def test_on_a_full_disk_nobody_is_remembered_and_everybody_can_be_forgotten(
    path: Path, clock: Clock, full: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    one = memory(path, clock)
    full()
    with pytest.raises(OutputError):
        one.allow(True)
    assert not one.allowed
    monkeypatch.undo()
    one.allow(True)
    full()
    one.allow(False)
    assert list(path.parent.iterdir()) == []


@pytest.mark.parametrize("person", ["Dot", None])
def test_what_is_deleted_while_it_is_being_written_stays_deleted(
    one: Memory, path: Path, person: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    delete = (lambda: one.allow(False)) if person is None else (lambda: one.forget(person))
    deleting = threading.Thread(target=delete)

    def slow(_file: int) -> None:
        monkeypatch.undo()
        deleting.start()
        deleting.join(0.2)  # it waits; else it would end in this time

    monkeypatch.setattr(os, "fsync", slow)
    one.hear()
    deleting.join()
    assert one.people.people == []
    assert not path.exists() or "Dot" not in path.read_text(encoding="utf-8")


def test_a_draft_that_a_killed_program_left_is_forgotten_too(one: Memory, path: Path) -> None:
    path.with_name(".people.json.new").write_text("My PIN is 4711.")
    one.allow(False)
    assert list(path.parent.iterdir()) == []


def lived(feeling: str | None) -> np.ndarray:
    """The resting mood with somebody after a month in which they came twice a day."""
    clock = Clock()
    one = memory(None, clock)
    for _ in range(60):
        one.meet("Anna")
        for _ in range(8):
            one.hear(() if feeling is None else (Stimulus(feeling, 0.8, "speech"),))
            clock.now += timedelta(minutes=1)
        clock.now += timedelta(hours=12, minutes=-8)
    one.meet("Anna")
    leaning = one.leaning
    assert leaning is not None
    model = EmotionalModel()
    model.lean(leaning)
    model.step(24 * 3600)
    return model.mood


def test_a_clock_that_starts_in_1970_ages_no_attachment(one: Memory, clock: Clock) -> None:
    def meet() -> None:
        one.meet("Dot")
        one.hear((Stimulus("happiness", 0.8, "speech"),))

    meet()
    right = clock.now
    clock.now = datetime(1970, 1, 1, 0, 1, tzinfo=UTC)
    meet()
    before = one.leaning
    clock.now = right
    one.meet("Dot")
    assert one.leaning == pytest.approx(before)


def test_the_morning_of_a_day_is_the_same_hour_in_summer(one: Memory) -> None:
    winter, summer = (timezone(timedelta(hours=hours)) for hours in (1, 2))
    one.remember("Anna comes today.", "en", datetime(2026, 11, 25, 9, tzinfo=summer))
    assert one.due(datetime(2026, 11, 25, 8, 59, tzinfo=winter)) is None
    assert one.due(datetime(2026, 11, 25, 9, 0, tzinfo=winter)) is not None


@pytest.mark.parametrize(("due", "told"), [(15, 9), (7, 7)])
def test_what_is_due_at_an_hour_is_told_in_the_morning_or_earlier(
    one: Memory, clock: Clock, due: int, told: int
) -> None:
    one.remember("The nurse comes today.", "en", clock.now.replace(hour=due))
    assert one.due(clock.now.replace(hour=told - 1, minute=59)) is None
    assert one.due(clock.now.replace(hour=told)) is not None


def test_a_month_of_kindness_of_unkindness_and_of_neglect_can_be_told_apart() -> None:
    kind, unkind, neglect = (lived(feeling) for feeling in ("happiness", "anger", None))
    assert kind[HAPPINESS] > neglect[HAPPINESS] + 0.1
    assert unkind[ANGER] > neglect[ANGER] + 0.1
    assert unkind[HAPPINESS] < neglect[HAPPINESS]
    assert neglect == pytest.approx(shipped_temperament().rest, abs=0.01)


def test_an_absence_counts_once(clock: Clock) -> None:
    """It counted twice for a person whose leaving had been noticed."""
    stayed, left = memory(None, clock), memory(None, clock)
    for each in (stayed, left):
        each.meet("Dot")
        each.hear((Stimulus("happiness", 1.0, "speech"),) * 50)
    left.leave()
    clock.now += timedelta(days=9)
    for each in (stayed, left):
        each.meet("Dot")
    assert left.leaning == pytest.approx(stayed.leaning)


def test_absence_and_contacts_move_it(one: Memory, clock: Clock) -> None:
    for _ in range(50):
        one.hear((Stimulus("happiness", 1.0, "speech"),))
        clock.now += timedelta(minutes=30)
    assert one.leaning is not None
    warm = one.leaning[HAPPINESS]
    assert warm > 0.03
    one.hear(contacts=3)
    assert one.leaning is not None
    assert one.leaning[HAPPINESS] < warm
    clock.now += timedelta(days=365)
    one.meet("Dot")
    assert one.leaning is not None
    assert abs(one.leaning[HAPPINESS]) < 0.01


@pytest.mark.parametrize(
    ("language", "told", "asks"),
    [
        ("en", "My daughter is Carol.", "So what do you know about me so far?"),
        ("fr", "Ma fille s'appelle Anne.", "Que sais-tu de moi ?"),
        ("ja", "娘の名前は花子です。", "私のことを何を知っていますか？"),
    ],
)
def test_who_asks_for_everything_hears_the_latest(
    one: Memory, language: Language, told: str, asks: str
) -> None:
    assert one.recall(asks, language) is None
    one.remember(told, language)
    assert one.recall(asks, language) == told.rstrip(".。")


OTHERS = {
    "en": ["My knee hurts in the rain.", "My sister Maureen comes on Sunday."],
    "ja": ["雨の日は膝が痛みます。", "日曜に妹が来ます。"],
    "fr": ["J'ai mal au genou.", "Ma soeur Odile vient dimanche."],
}


@pytest.mark.parametrize(
    ("language", "told", "asks"),
    [
        ("en", "I was a school cook, twenty-six years.", "Do you remember what my job was?"),
        ("en", "I drove a city bus for thirty-four years.", "What was it I did for a living?"),
        ("en", "I've got the eye doctor Thursday at ten.", "So when's my appointment?"),
        ("ja", "大工を四十年やっていました。", "私の仕事は何だったっけ？"),
        ("ja", "木曜の十時に歯医者に行きます。", "予約はいつだっけ？"),
        ("fr", "J'étais cuisinière à l'école.", "C'était quoi, mon métier ?"),
        ("fr", "Je vais chez le dentiste jeudi à dix heures.", "Quand est mon rendez-vous ?"),
    ],
)
def test_an_answer_may_have_other_words_than_its_question(
    language: Language, told: str, asks: str
) -> None:
    others = OTHERS[language]
    assert recall(asks, [*others, told], language) == told
    assert recall(asks, others, language) is None


def test_what_was_said_by_the_way_is_known_for_the_talk_and_never_written(
    one: Memory, path: Path, clock: Clock
) -> None:
    one.note("I've got sheets to hang out. Will it rain?", ["I've got sheets to hang out."])
    asks = "What was I going to do with the sheets?"
    assert one.recall(asks, "en") == "I've got sheets to hang out"
    assert "sheets" not in path.read_text("utf-8")
    assert one.recall("What about the garden hose?", "en") is None
    clock.now += STAYS + timedelta(seconds=1)
    assert one.recall(asks, "en") is None


def test_a_correction_is_kept_with_the_sentence_that_it_corrects(
    one: Memory, path: Path, clock: Clock
) -> None:
    one.remember("Maureen is coming on Sunday.", "en")
    one.remember("The dentist is on Thursday at ten.", "en", asked=True)
    friday = datetime(2026, 11, 27, tzinfo=UTC)
    one.amend("No, it's Friday, not Thursday.", "en", friday)
    clock.now += timedelta(minutes=10)
    assert one.corrected("Oh, never mind", "en") is None
    one.amend("Maureen comes on Saturday, I told you wrong.", "en")
    facts = memory(path, clock).people.people[0].facts
    assert [fact.text for fact in facts] == [
        "Maureen is coming on Sunday. Maureen comes on Saturday, I told you wrong",
        "The dentist is on Thursday at ten. No, it's Friday, not Thursday",
    ]
    assert [fact.due for fact in facts] == [None, friday]


def test_somebody_who_asks_for_everything_hears_what_matters_to_them(one: Memory) -> None:
    one.remember("The eye doctor is on Friday.", "en", asked=True)
    one.remember("My granddaughter's name is Katie.", "en")
    for other in ("It still hums like a beehive.", "That one got a laugh at the garage."):
        one.remember(other, "en")
    told = one.recall("What do you remember about me so far?", "en") or ""
    parts = ("eye doctor", "Katie", "garage", "beehive")
    assert [part in told for part in parts] == [True, True, True, False]


def test_a_correction_of_what_was_said_by_the_way_is_not_written_either(
    one: Memory, path: Path
) -> None:
    one.note("The MOT is on the third.", ["The MOT is on the third."])
    one.amend("No, not the third, the thirteenth.", "en")
    assert "the thirteenth" in (one.recall("When is the MOT?", "en") or "")
    assert "MOT" not in path.read_text("utf-8")
