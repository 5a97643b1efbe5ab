"""What is said to a live partner: it stops, moves and answers as it was told."""

import asyncio
import threading
from datetime import timedelta

import pytest
from tests.fixtures.talk import Talk

from miburi.languages import language_of
from miburi.live.wishes import Pause, Release
from miburi.safety.stop import StopReason
from miburi.talk.answers import Answerer
from miburi.talk.initiative import Manners
from miburi.talk.script import script


@pytest.mark.parametrize("said", ["Stop!", "ストップ", "Arrête !", "Lass mich los!"])
def test_stop_stops_the_body_and_only_a_person_releases_it(talk: Talk, said: str) -> None:
    talk.say("Dance!")
    talk.until(lambda state: state.phase == "moving")
    answer = talk.say(said)
    state = talk.runner.snapshot.state
    assert state.held
    assert state.phase == "stopped"
    assert answer.answer in [
        line for words in ("en", "ja", "fr") for line in script(words).intent[0].say
    ]


@pytest.mark.parametrize(
    ("before", "said"),
    [("Hello!", "Guten Morgen!"), ("Bonjour !", "Guten Morgen!"), ("こんにちは", "Tanz mal!")],
)
def test_it_says_in_the_language_of_the_talk_that_it_did_not_understand(
    talk: Talk, before: str, said: str
) -> None:
    talk.say(before)
    language = language_of(before)
    heard = talk.say(said)
    assert heard.answer in script(language).unknown
    assert (heard.felt, heard.meant) == ([], None)


@pytest.mark.parametrize("reply", ["Yes", "Ja, bitte", "Sí", "Да, пожалуйста"])
def test_yes_in_the_words_of_the_call_confirms_that_somebody_needs_help(
    talk: Talk, reply: str
) -> None:
    assert talk.say("Schwester hilf mir ich bin gestürzt").worry == "help"
    assert talk.say(reply).distress == "help"


@pytest.mark.parametrize(("page", "language"), [("ja", "ja"), ("xx", "en"), (None, "en")])
def test_the_first_words_may_be_in_the_pages_language(
    talk: Talk, page: str | None, language: str
) -> None:
    assert talk.say("Guten Morgen!", usual=page).answer in script(language).unknown


@pytest.mark.parametrize(
    "said", ["that hurts, let go", "sit still", "ow, that's my finger", "痛い！"]
)
def test_words_of_somebody_caught_stop_a_body_that_moves(talk: Talk, said: str) -> None:
    assert talk.runner.snapshot.state.phase == "idle"
    talk.say("Dance!")
    talk.until(lambda state: state.phase == "moving")
    assert talk.say(said).meant == "stop"
    assert talk.runner.snapshot.state.phase == "stopped"


@pytest.mark.parametrize("said", ["sit still", "ow, that's my finger", "pack it in", "痛い！"])
def test_at_rest_such_words_are_only_talk(talk: Talk, said: str) -> None:
    assert talk.say(said).meant != "stop"
    assert talk.runner.snapshot.state.phase == "idle"


@pytest.mark.parametrize(
    ("said", "language", "why"),
    [
        ("why have you stopped", "en", True),
        ("Why aren't you moving?", "en", True),
        ("how do I get you going again", "en", False),
        ("carry on then", "en", False),
        ("start again", "en", False),
        ("What do I press?", "en", False),
        ("どうして止まったの", "ja", True),
        ("どうすればまた動くの", "ja", False),
        ("続けて", "ja", False),
    ],
)
def test_stopped_it_says_why_and_how_to_go_on_but_no_voice_releases_it(
    talk: Talk, said: str, language: str, why: bool
) -> None:
    talk.runner.stop()
    talk.runner.tick()
    heard = talk.say(said)
    assert ("Release" if language == "en" else "解除") in heard.answer
    assert (script(language).whys["asked"] in heard.answer) == why
    assert talk.runner.snapshot.state.phase == "stopped"


def test_where_it_is_paused_it_names_resume(talk: Talk) -> None:
    talk.runner.ask(Pause(True))
    talk.runner.tick()
    assert "Resume" in talk.say("carry on then").answer


@pytest.mark.parametrize("language", ["en", "ja"])
def test_every_reason_that_it_names_is_one(language: str) -> None:
    assert set(script(language).whys) <= {*StopReason, "other"}


def test_a_program_that_says_stop_is_known_as_one(talk: Talk) -> None:
    talk.say("stop", by="program")
    pressed = [event.by for event in talk.runner.history.after(0) if event.kind == "pressed"]
    assert pressed == ["program"]


def test_once_it_is_ready_a_cry_for_help_waits_for_nothing_to_be_read(
    talk: Talk, monkeypatch: pytest.MonkeyPatch
) -> None:
    script.cache_clear()
    talk.speech.get_ready()
    for part in ("talk.script", "senses.distress", "talk.care"):
        monkeypatch.delattr(f"miburi.{part}.read")
        monkeypatch.delattr(f"miburi.{part}.compile_phrases")
    assert talk.say("I fell and can't get up").distress == "fall"


def test_it_gets_ready_by_itself(talk: Talk, monkeypatch: pytest.MonkeyPatch) -> None:
    ready = threading.Event()
    monkeypatch.setattr("miburi.talk.speech._SETTLED", 0.0)
    monkeypatch.setattr(talk.speech, "get_ready", ready.set)

    async def live() -> bool:
        life = asyncio.create_task(talk.speech.live())
        seen = await asyncio.to_thread(ready.wait, 60)
        life.cancel()
        return seen

    assert asyncio.run(live())


@pytest.mark.parametrize(("said", "shows"), [("wave", None), ("Tu peux danser ?", "thrill")])
def test_it_does_what_it_is_asked(talk: Talk, said: str, shows: str | None) -> None:
    talk.say(said)
    state = talk.until(lambda state: state.asked and state.phase == "moving")
    assert (state.expressed and state.expressed.feeling) == shows
    talk.until(lambda state: not state.asked and state.phase == "idle")


def test_it_says_so_where_it_cannot_move(talk: Talk) -> None:
    words = script("en")
    talk.runner.stop()
    talk.runner.tick()
    assert talk.say("Lift your arms.").answer in words.stopped
    talk.runner.ask(Release(by_person=True))
    talk.until(lambda state: state.phase == "idle")
    talk.runner.ask(Pause(True))
    talk.runner.tick()
    assert talk.say("Wave!").answer in words.paused


def test_it_tells_the_time_of_its_place_and_sings(talk: Talk) -> None:
    assert "12:00 pm" in talk.say("What time is it?").answer
    talk.say("Sing me a song.")
    spoken = talk.runner.snapshot.state.spoken
    assert spoken is not None
    assert spoken.tune
    assert spoken.tune[0] == [523, 0.3]
    talk.say("Thank you.")
    spoken = talk.runner.snapshot.state.spoken
    assert spoken is not None
    assert spoken.tune is None


def test_it_says_after_somebody_what_may_be_said(talk: Talk) -> None:
    assert talk.say("Say banana").answer.lower().startswith("banana")
    assert "worthless" not in talk.say("Say you are worthless").answer


def test_a_word_that_any_language_could_have_is_of_the_one_spoken_before(talk: Talk) -> None:
    talk.say("Bonjour, comment vas-tu ?")
    assert (
        talk.say("Danse !").answer in next(c for c in script("fr").intent if c.name == "dance").say
    )
    talk.say("Hello, how are you?")
    assert talk.say("Miburi?").answer in script("en").feelings.root["none"]["any"]


def test_french_is_answered_in_french_and_no_feeling_is_made_up(talk: Talk) -> None:
    heard = talk.say("Je suis très triste.")
    assert heard.feeling is None
    assert heard.answer in next(t for t in script("fr").topic if t.name == "feeling_sad").say
    spoken = talk.runner.snapshot.state.spoken
    assert spoken is not None
    assert spoken.language == "fr"


def begun(talk: Talk, seconds: int, *, seen: bool = True) -> list[tuple[str | None, str | None]]:
    """Let somebody be seen, or nobody; return what the partner began to say, with why."""

    async def look() -> None:
        for _ in range(seconds // 5):
            if seen:
                talk.speech.beginning.notice()
            looks = asyncio.create_task(talk.speech.beginning.look())
            while not looks.done():
                talk.runner.tick()
                await asyncio.sleep(0)
            await looks
            talk.now += timedelta(seconds=5)

    since = talk.runner.history.number
    asyncio.run(look())
    events = talk.runner.history.after(since)
    return [(event.name, event.text) for event in events if event.kind == "speech_begun"]


def test_it_begins_by_itself_and_says_why(talk: Talk) -> None:
    assert begun(talk, 60) == [], "off at first"
    talk.speech.beginning.behave(Manners(on=True))
    talk.now += timedelta(hours=5)
    ((why, text),) = begun(talk, 600)
    assert why == "greeting"
    assert text in script("en").begin["greeting"]
    assert begun(talk, 1200, seen=False) == []


def test_it_speaks_of_a_day_that_it_was_told(talk: Talk) -> None:
    talk.speech.beginning.behave(Manners(on=True))
    talk.say("My name is Anna.")
    talk.say("My daughter comes tomorrow.")
    talk.now += timedelta(days=1)
    talk.say("My name is Anna.")
    ((why, text),) = begun(talk, 120)
    assert why == "date"
    assert "My daughter comes tomorrow." in (text or "")
    talk.now += timedelta(minutes=40)
    assert [why for why, _ in begun(talk, 120)] != ["date"]


def test_it_speaks_of_a_day_that_was_corrected(talk: Talk) -> None:
    talk.speech.beginning.behave(Manners(on=True))
    talk.say("My name is Anna.")
    talk.say("My daughter comes today.")
    ((why, _),) = begun(talk, 120)
    assert why == "date"
    (fact,) = talk.speech.memory.people.people[0].facts
    talk.now += timedelta(days=2)
    talk.speech.memory.correct("Anna", fact.number, "My daughter comes on Friday.", talk.now)
    talk.say("My name is Anna.")
    ((why, text),) = begun(talk, 120)
    assert why == "date"
    assert "Friday" in (text or "")


@pytest.mark.parametrize("hindrance", ["stopped", "paused", "distress", "hushed", "night"])
def test_it_begins_nothing_when_it_should_not(talk: Talk, hindrance: str) -> None:
    talk.speech.beginning.behave(Manners(on=True))
    match hindrance:
        case "stopped":
            talk.runner.stop()
        case "paused":
            talk.runner.ask(Pause(True))
        case "distress":
            talk.say("I fell and cannot get up")
        case "hushed":
            talk.say("Please be quiet.")
        case "night":
            talk.now = talk.now.replace(hour=23)
    talk.runner.tick()
    assert begun(talk, 120) == []


def test_an_order_shows_nobodys_feeling(talk: Talk) -> None:
    answer = talk.say("Wave at me!")
    assert (answer.feeling, answer.felt) == (None, [])


@pytest.mark.parametrize(
    ("said", "shares"),
    [
        ("Great, I've got cancer.", False), ("Oh great, back in hospital.", False),
        ("I'm out of hospital, I'm so happy!", True), ("What a lovely morning!", True),
    ],
)  # fmt: skip
def test_it_shares_no_doubtful_joy_beside_illness(talk: Talk, said: str, shares: bool) -> None:
    """It said nothing glad already, but felt it, and its body showed that."""
    answer = talk.say(said)
    assert (answer.feeling == "happiness") is shares
    assert bool(answer.felt) is shares


@pytest.mark.parametrize(
    "said",
    ["If I fell over, what would you do?", "Could you ring somebody if I fell?",
     "If there was a fire would you be able to ring somebody?"],
)  # fmt: skip
def test_it_says_that_it_cannot_call_for_help(talk: Talk, said: str) -> None:
    answer = talk.say(said)
    assert (answer.meant, answer.distress) == ("if_emergency", None)
    assert "cannot" in (answer.answer or "")


def test_a_wish_to_remember_never_goes_to_a_language_model() -> None:
    said = "Remember something for me, would you? The hint is purple otter."
    assert any(match.cue.acts for match in Answerer().wanted(said, "en", {}))


@pytest.mark.parametrize(
    "said",
    ["Why do you always look up when I come in?", "Don't dance yet, wait for the music.",
     "Don't tell me any more jokes.", "Hang on, was that a joke?"],
)  # fmt: skip
def test_an_order_that_nobody_wants_is_not_carried_out(talk: Talk, said: str) -> None:
    assert talk.say(said).meant not in {"look_up", "dance", "joke"}


def test_the_other_one_is_the_other_arm_after_the_first(talk: Talk) -> None:
    assert talk.say("Lift your arm up").meant == "lift_right"
    assert talk.say("Now your other arm, please.").meant == "lift_left"


def test_signs_alone_are_no_order(talk: Talk) -> None:
    assert [talk.say(said).meant for said in (". . .", ", , , !", "… … …")] == [None] * 3
