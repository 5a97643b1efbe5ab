"""What is said to a live partner: it stops, moves and answers as it was told."""

import asyncio
from datetime import datetime, timedelta
from typing import Any

import pytest
from tests.fixtures.live import until

from miburi.live.runner import Runner
from miburi.live.state import State
from miburi.live.wishes import Pause, Release
from miburi.talk.answers import Answerer
from miburi.talk.care import Care
from miburi.talk.initiative import Manners
from miburi.talk.said import SayOut
from miburi.talk.script import script
from miburi.talk.speech import Speech

NOON = datetime(2026, 11, 25, 12, 0)


class Talk:
    """Talks with a partner whose time passes while it answers."""

    def __init__(self, runner: Runner) -> None:
        self.runner, self.now = runner, NOON
        self.speech = Speech(runner, None, Care(), lambda: self.now)

    def say(self, text: str, by: str = "person") -> SayOut:
        async def both() -> SayOut:
            answer = asyncio.create_task(self.speech.take(text, by=by))
            while not answer.done():
                self.runner.tick()
                await asyncio.sleep(0)
            return await answer

        return asyncio.run(both())

    def until(self, wanted: Any) -> State:
        return until(self.runner, wanted)


@pytest.fixture
def talk(runner: Runner) -> Talk:
    return Talk(runner)


@pytest.mark.parametrize("said", ["Stop!", "ストップ", "Arrête !"])
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


def test_a_program_that_says_stop_is_known_as_one(talk: Talk) -> None:
    talk.say("stop", by="program")
    pressed = [event.by for event in talk.runner.history.after(0) if event.kind == "pressed"]
    assert pressed == ["program"]


@pytest.mark.parametrize(
    ("said", "shows"),
    [("Could you lift your arms?", None), ("wave", None), ("Dance for me!", "thrill"),
     ("手を振って", None), ("Tu peux danser ?", "thrill")],
)  # fmt: skip
def test_it_does_what_it_is_asked(talk: Talk, said: str, shows: str | None) -> None:
    talk.say(said)
    state = talk.until(lambda state: state.asked and state.phase == "moving")
    assert (state.expressed and state.expressed.feeling) == shows
    talk.until(lambda state: not state.asked and state.phase == "idle")


@pytest.mark.parametrize(
    ("first", "then", "asks", "knows"),
    [
        ("My wife was a nurse.", "Remember that her name was Maureen.",
         "What was my wife's name?", "Maureen"),
        ("My grandson came to see me on Sunday.", "Please remember that he plays the trumpet.",
         "What does my grandson play?", "trumpet"),
        ("My late husband built ships.", "Remember that he was called Tom.",
         "What was my husband called?", "Tom"),
    ],
)  # fmt: skip
def test_it_knows_whom_she_or_he_was(
    talk: Talk, first: str, then: str, asks: str, knows: str
) -> None:
    for said in (first, then, "It is cold today."):
        talk.say(said)
    assert knows in (talk.say(asks).answer or "")
    assert knows not in (talk.say("What was my uncle's name?").answer or "")


@pytest.mark.parametrize(
    ("first", "then"),
    [
        ("My brother was a nurse.", "Remember that her name was Maureen."),
        ("My sister and my wife were nurses.", "Remember that her name was Maureen."),
        ("My sister came.", "Remember that Maureen has her keys."),
        ("My sister came.", "Remember that her name is Maureen. My wife is Ann."),
    ],
)
def test_whom_she_may_be_is_not_guessed(talk: Talk, first: str, then: str) -> None:
    for said in ("My name is Dot.", first, then):
        talk.say(said)
    assert not any(told.startswith(("my wife: ", "my brother: ")) for told in facts(talk))


def test_what_one_person_said_or_long_ago_names_nobody(talk: Talk) -> None:
    talk.say("My name is Dot.")
    talk.say("My wife was a nurse.")
    talk.say("My name is Tom.")
    talk.say("Remember that her birthday is on Friday.")
    talk.say("My daughter lives in Leeds.")
    talk.now += timedelta(minutes=6)
    talk.say("Remember that she has a cat.")
    assert {"her birthday is on Friday", "she has a cat"} <= set(facts(talk))


def facts(talk: Talk) -> list[str]:
    present = talk.speech.memory.present
    return [] if present is None else [fact.text for fact in present.facts]


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
    assert begun(talk, 3600, seen=False) == []


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


QUIET = "There's a funny smell from the cooker"


def test_it_asks_whether_somebody_needs_help_and_a_yes_is_distress(talk: Talk) -> None:
    asked = talk.say(QUIET)
    assert (asked.distress, asked.worry, asked.felt) == (None, "gas", [])
    assert asked.answer == Care().ask("gas", "en", 0)
    assert talk.runner.snapshot.state.distress is None
    answer = talk.say("yes, I think so")
    assert (answer.distress, answer.answer) == ("gas", Care().help("gas", "en", 0))
    assert talk.runner.snapshot.state.distress is not None


SLIGHT = "i'm in the snow by a big road and i've only got the one slipper on"


@pytest.mark.parametrize("then", ["no", "Not really."])
def test_after_a_slight_sign_a_no_is_asked_about(talk: Talk, then: str) -> None:
    wondered = talk.say(SLIGHT)
    assert (wondered.worry, wondered.answer) == (None, Care().wonder("en", 0))
    asked = talk.say(then)
    assert (asked.worry, asked.answer) == ("help", Care().ask("help", "en", 0))
    assert talk.say("yes").distress == "help"


@pytest.mark.parametrize("between", [0, 4, 5])
def test_a_second_slight_sign_soon_after_is_asked_about(talk: Talk, between: int) -> None:
    talk.say("The rent's paid to the end of the month, and that's as far as I go too.")
    for _ in range(between):
        assert talk.say("The door is open.").worry is None
    second = talk.say("Nobody would notice till the milk went off.")
    assert second.worry == ("suicide" if between < 5 else None)


@pytest.mark.parametrize("then", ["Yes, thank you.", "No, I'm fine.", "I'm all right, love."])
def test_after_a_slight_sign_who_is_all_right_is_asked_nothing_more(talk: Talk, then: str) -> None:
    talk.say(SLIGHT)
    well = talk.say(then)
    assert (well.worry, well.distress) == (None, None)


def test_a_no_long_after_a_slight_sign_is_only_a_no(talk: Talk) -> None:
    talk.say(SLIGHT)
    talk.now += timedelta(minutes=3)
    assert talk.say("no").worry is None


def test_an_order_like_a_slight_sign_is_carried_out(talk: Talk) -> None:
    sung = talk.say("Give us a song before I go out. Anything, so long as it's not modern.")
    assert (sung.meant, sung.worry) == ("song", None)


@pytest.mark.parametrize(("between", "minutes"), [("no, nothing", 0), (None, 3)])
def test_a_yes_to_something_else_is_none(talk: Talk, between: str | None, minutes: int) -> None:
    talk.say(QUIET)
    if between is not None:
        talk.say(between)
    talk.now += timedelta(minutes=minutes)
    assert talk.say("yes").distress is None


def test_who_did_not_hear_the_question_may_still_say_yes(talk: Talk) -> None:
    asked = talk.say(QUIET).answer
    again = talk.say("Pardon?")
    assert again.meant == "repeat"
    assert asked
    assert asked in (again.answer or "")
    assert talk.say("Yes.").distress == "gas"


def test_where_it_knows_an_answer_it_asks_only_what_is_clear(talk: Talk) -> None:
    """What time is it, said in words like those of trouble, gets the time."""
    said = "Right, kettle on. Don't go anywhere. What's the time?"
    assert talk.say(said).meant == "time"


def test_it_tells_what_was_meant(talk: Talk) -> None:
    assert [talk.say(said).meant for said in ("Hello!", "Wave!", "The door is open.")] == [
        "greeting", "wave", None,
    ]  # fmt: skip


@pytest.mark.parametrize("said", ["Stop!", "Wave at me!", "Can you dance?"])
def test_an_order_shows_nobodys_feeling(talk: Talk, said: str) -> None:
    answer = talk.say(said)
    assert (answer.feeling, answer.felt) == (None, [])


def test_after_a_distress_it_stays_with_it_and_then_answers_again(talk: Talk) -> None:
    """People who are well go on talking, and want to hear something else."""
    stays = {Care().stay("en", turn) for turn in range(4)}
    talk.say("I fell and cannot get up")
    told = [
        str(talk.say(text).answer)
        for text in (
            "Nobody is here.",
            "Wave to me.",
            "What is your favourite flower?",
            "What should I do?",
            "It is raining.",
            "What time is it?",
            "I had soup for lunch.",
            "What is your name?",
            "The crossword is half done.",
            "My sister rang.",
            "Can he have some water?",
            "Hello? Hello?",
            "What should I do?",
        )
    ]
    assert {told[0], told[3], told[4]} <= stays
    assert not stays.intersection(told[1:3])
    assert "12:00" in told[5]
    assert "Miburi" in told[7]
    assert len(stays.intersection(told[5:-3])) == 1
    assert set(told[-3:]) <= stays
    assert talk.say("I still cannot get up, I fell").answer == Care().help("fall", "en", 1)
    assert str(talk.say("Hello?").answer) in stays
    assert talk.runner.snapshot.state.felt is None


UNPLAIN = "There's a cockerel by the kettle been stood on his head ever since."


@pytest.mark.parametrize("fun", ["Do you know any jokes?", "Give us a wave, go on.", "Sing!"])
def test_who_wants_fun_after_words_that_were_hardly_of_distress_is_well(
    talk: Talk, fun: str
) -> None:
    stays = {Care().stay("en", turn) for turn in range(4)}
    assert talk.say(UNPLAIN).distress is not None
    assert talk.say("It's a nice kettle.").answer in stays
    later = [talk.say(said) for said in (fun, "My sister rang.", "Why is an egg oval?")]
    assert not stays.intersection(str(one.answer) for one in later)
    talk.say(UNPLAIN)
    assert talk.say("My sister rang.").answer in stays


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


def test_what_somebody_asked_it_to_keep_is_said_back_before_what_was_told(talk: Talk) -> None:
    asks = "Wasn't there something you were meant to remind me about?"
    assert "nothing" in talk.say(asks).answer
    talk.say("Remind me about the bins tonight, will you?")
    talk.say("My daughter Anna lives in Leeds.")
    assert "the bins tonight" in talk.say("Say it back to me.").answer
    kept = talk.say(asks).answer
    assert "the bins tonight" in kept
    assert "Leeds" not in kept


def test_it_takes_a_correction_and_repeats_what_it_said_not_that_it_said_it(talk: Talk) -> None:
    talk.say("I've got the hospital on Thursday, so remember that for me please.")
    assert talk.say("No, hang on, it's Friday, not Thursday.").meant == "amend"
    when = talk.say("So when's my appointment?").answer
    assert "Thursday" in when
    assert "Friday" in when
    first = talk.say("Say that again.").answer
    assert talk.say("Say that again.").answer.endswith(first.split(": ", 1)[1])


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("Can you hang on to that for me?", "remember_last"),
        ("Remember that, will you, because I shall ask you later.", "remember_last"),
        ("Go ahead and lift your arm up. Let's see it.", "lift_right"),
        ("Lift up your two arms there.", "lift_arms"),
        ("And now just the left one.", "lift_left"),
        ("Whisht now a minute till I hear the race.", "quiet"),
        ("Are you awake there at all?", "awake"),
        ("Cross your fingers for me.", "luck"),
        ("It's not the same on a screen, you can't give them a cuddle.", None),
        ("What should I ask her about, so I don't just moan about my knee?", "advice"),
    ],
)
def test_strangers_words_for_what_it_knows(talk: Talk, said: str, meant: str | None) -> None:
    talk.say("My granddaughter's name is Katie.")
    assert talk.say(said).meant == meant


def test_what_it_keeps_is_written_as_it_was_said(talk: Talk) -> None:
    kept = talk.say("Remind me to take the soup to Marjorie, she's got a cold.").answer
    assert "take the soup to Marjorie, she's got a cold" in kept


def test_what_it_was_not_told_is_not_answered_with_something_else(talk: Talk) -> None:
    talk.say("I've got the dentist on Thursday at ten, so remember that for me.")
    assert "dentist" not in talk.say("What was I going to do with the sheets?").answer


def test_what_follows_a_wish_to_remember_is_kept(talk: Talk) -> None:
    kept = talk.say("Remember something for me, would you? The hint is purple otter.").answer
    assert "The hint is purple otter" in kept
    assert "purple otter" in talk.say("What was that hint I gave you?").answer


def test_a_correction_of_what_was_only_said_is_told_with_it(talk: Talk) -> None:
    talk.say("And I've got to ring the garage about the van, it's the MOT on the third.")
    talk.say("No, not the third, the thirteenth. Third's the dentist.")
    assert "the thirteenth" in talk.say("So when's the MOT?").answer


def test_a_name_that_follows_a_fact_is_told_with_it(talk: Talk) -> None:
    talk.say("My grandson would have filmed that. Oliver, he's nineteen, he's at Leeds.")
    assert "Oliver" in talk.say("What was my grandson called, do you remember?").answer


@pytest.mark.parametrize(
    "asked", ["What train is Maureen on?", "You told me about Maureen. Which train is she on?"]
)
def test_a_question_about_somebody_who_was_named_is_answered(talk: Talk, asked: str) -> None:
    talk.say("My sister Maureen is coming on Friday, she's getting the ten forty train.")
    assert "ten forty" in talk.say(asked).answer


def test_a_correction_of_a_name_does_not_rename_who_is_there(talk: Talk) -> None:
    talk.say("She lives in Vancouver with her boyfriend, Tom.")
    talk.say("No, not Tom, what am I saying, Tom was the last one. It's Luke.")
    assert talk.speech.memory.present is None


def test_it_tells_the_date_of_tomorrow(talk: Talk) -> None:
    assert "Thursday, November 26" in talk.say("What's the date tomorrow?").answer


def test_a_wish_to_remember_never_goes_to_a_language_model() -> None:
    said = "Remember something for me, would you? The hint is purple otter."
    assert any(match.cue.acts for match in Answerer().wanted(said, "en", {}))


def test_a_name_that_is_to_be_remembered_is_only_a_name(talk: Talk) -> None:
    talk.say("My name's Maureen, but everybody calls me Mo. Will you remember that?")
    present = talk.speech.memory.present
    assert present is not None
    assert present.name == "Mo"


@pytest.mark.parametrize(
    ("said", "asked", "holds"),
    [
        (["I've a geranium out there on its last legs.", "He's called Gerald."],
         "What's the name of my geranium?", "Gerald"),
        (["His nan's coming on Saturday.", "She's called Nana Pat.", "She has a dog, too."],
         "What is his nan called?", "Nana Pat"),
        (["Can you remember something for me, his library book's due back on Thursday."],
         "When did I say that library book was due?", "Thursday"),
        (["I've put the spare key in the blue teapot, and I want you to remember that because I "
          "shan't."], "Where'd I tell you my spare key was?", "blue teapot"),
    ],
)  # fmt: skip
def test_what_was_told_in_two_remarks_or_on_the_way_is_recalled(
    talk: Talk, said: list[str], asked: str, holds: str
) -> None:
    for each in said:
        talk.say(each)
    answer = talk.say(asked)
    assert (answer.meant, holds in (answer.answer or "")) == ("recall", True), answer.answer


@pytest.mark.parametrize(
    ("asked", "answer"),
    [("So how long is it till our Janet comes?", "days away"),
     ("How many sleeps till tomorrow?", "tomorrow"), ("How long is it till supper?", "")],
)  # fmt: skip
def test_it_counts_the_days_until_what_was_told(talk: Talk, asked: str, answer: str) -> None:
    talk.say("Our Janet's coming on Monday with the little one.")
    said = talk.say(asked)
    assert (said.meant == "days_left") == bool(answer)
    assert answer in (said.answer or "")


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("Lift your left one up slow for me, I want to listen to it.", "lift_left"),
        ("Stick both of them right up in the air, come on.", "lift_arms"),
        ("A nice big smile for Grandma, please.", "show_happiness"),
        ("Now do grumpy.", "show_anger"),
        ("Twist yourself all the way over to the one side.", "turn"),
        ("My neighbour waved at me this morning.", None),
        ("I used to lift both arms above my head.", None),
        ("He sang to me on our wedding day.", None),
    ],
)
def test_orders_that_nobody_wrote_a_pattern_for(talk: Talk, said: str, meant: str | None) -> None:
    assert talk.say(said).meant == meant


def test_an_order_in_words_like_those_of_trouble_is_carried_out(talk: Talk) -> None:
    waved = talk.say("Wave me off then, and don't touch my crossword while I'm gone.")
    assert (waved.meant, waved.worry) == ("wave", None)


def test_it_is_somebodys_turn_does_not_turn_it(talk: Talk) -> None:
    kept = talk.say("Can you remember it's Callum's turn to do the bins on Wednesday?")
    assert kept.meant == "remember"
    assert "bins" in (talk.say("What was I meant to remember about the bins?").answer or "")


@pytest.mark.parametrize("said", [". . .", ", , , !", "… … …", "- - - -"])
def test_signs_alone_are_no_order(talk: Talk, said: str) -> None:
    assert talk.say(said).meant is None
