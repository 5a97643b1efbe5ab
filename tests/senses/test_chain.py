"""From words to the body: what is said moves a partner, and only what was meant."""

import numpy as np
import pytest
from tests.fixtures.command import miburi as command
from tests.fixtures.live import Server, run
from tests.fixtures.waiting import post

import miburi
from miburi.feelings import FEELINGS, EmotionalModel, shipped_temperament
from miburi.gestures import key_poses, load
from miburi.interface.acting import UNSAID
from miburi.languages import language_of
from miburi.live.runner import Runner
from miburi.live.wishes import ChangeTemperament, Sense, Speak
from miburi.robot import forward, iphonoid
from miburi.senses import stimuli
from miburi.senses.words import hear

HAPPY = (
    "I am so happy today.", "We won the first prize!", "Thank you, you are a good friend.",
    "That was a wonderful holiday.", "I love this song.", "The soup was delicious.",
    "You make me laugh.", "What lovely flowers!", "I am proud of my daughter.",
)  # fmt: skip
HAPPINESS, SADNESS = FEELINGS.index("happiness"), FEELINGS.index("sadness")


def size(mood: float) -> float:
    """How far the happy gesture leads hands and head from neutral at a mood, m."""
    robot = iphonoid()
    neutral = forward(robot, robot.neutral)
    poses = key_poses(robot, load("happiness"), mood)
    return float(max(np.abs(pose.target - neutral).max() for pose in poses))


def tell(model: EmotionalModel, text: str) -> None:
    for stimulus in stimuli(hear(text), model.temperament):
        model.stimulate(stimulus)


def risen(model: EmotionalModel) -> float:
    """Return how far the mood of happiness is above its rest."""
    return float(model.mood[HAPPINESS] - model.temperament.rest[HAPPINESS])


def test_one_happy_sentence_makes_an_emotion_and_no_mood() -> None:
    """Section 4: "the robot will automatically get a happy emotion, but …"."""
    model = EmotionalModel()
    tell(model, HAPPY[0])
    shown = model.express()
    assert shown is not None
    assert shown.feeling == "happiness"
    assert model.emotion[HAPPINESS] > 0.4
    model.step(60.0)
    assert risen(model) < 0.025


def test_a_quarter_of_an_hour_of_happy_talk_makes_a_mood_and_larger_gestures() -> None:
    """Section 4: "… it will take a longer time speaking with a happy user to get a happy mood"."""
    model, once = EmotionalModel(), EmotionalModel()
    tell(once, HAPPY[0])
    for sentence in range(45):
        tell(model, HAPPY[sentence % len(HAPPY)])
        model.step(20.0)
        once.step(20.0)
    assert model.time == once.time == 900
    assert risen(model) > 0.125
    assert model.mood[HAPPINESS] == model.mood.max()
    assert risen(model) > 10 * risen(once)
    assert size(model.mood[HAPPINESS]) > 1.2 * size(once.mood[HAPPINESS])


def ticked(runner: Runner, text: str) -> None:
    """Say something, and let a second pass."""
    future = runner.ask(Sense(hear(text)))
    for _ in range(50):
        runner.tick()
    future.result(0)


def test_a_sad_sentence_saddens_body_and_log(runner: Runner) -> None:
    ticked(runner, "I am so sad today")
    state = runner.snapshot.state
    assert state.emotion[SADNESS] > 0.3
    assert state.expressed is not None
    assert state.expressed.feeling == "sadness"
    entry = next(entry for entry in runner.history.after(0) if entry.kind == "stimulus")
    assert (entry.feeling, entry.source) == ("sadness", "speech")
    assert entry.detail is not None
    assert entry.detail.startswith("'sad'")


def test_the_temperament_decides_what_anger_does(runner: Runner) -> None:
    runner.ask(ChangeTemperament("calm"))
    ticked(runner, "I am so angry with you!")
    emotion = dict(zip(FEELINGS, runner.snapshot.state.emotion, strict=True))
    assert emotion["fear"] > emotion["sadness"] > emotion["anger"]
    assert "anger" in shipped_temperament("calm").empathy


def test_it_is_told_over_the_interface(server: Server) -> None:
    with miburi.connect(server.url) as partner:
        heard = partner.say("I am so sad today")
        assert heard.feeling == "sadness"
        assert heard.why[0].what == "sad"
        assert [stimulus.feeling for stimulus in heard.felt] == ["sadness"]
        assert partner.say("The door is open.").felt == []
        assert "stimulus" in [event.kind for event in partner.log()]


def test_it_answers_in_the_voice_of_what_it_feels_then(runner: Runner) -> None:
    """It was happy; it hears something sad, is sad at once, and says so as a sad one."""
    ticked(runner, "I am so happy today.")
    assert runner.snapshot.state.spoken is None, "who does not ask for an answer gets none"
    heard = hear("I am so sad today")
    runner.ask(Sense(heard))
    runner.ask(Speak("I am sad, too."))
    runner.tick()
    spoken = runner.snapshot.state.spoken
    assert spoken is not None
    assert (spoken.feeling, spoken.language) == ("sadness", "en")
    assert [e.text for e in runner.history.after(0) if e.kind == "speech_begun"] == [spoken.text]


def test_it_answers_in_the_language_in_which_it_is_spoken_to(server: Server) -> None:
    with miburi.connect(server.url) as partner:
        for text, language in (("今日はとても嬉しい", "ja"), ("The door is open.", "en")):
            answer = partner.say(text).answer
            assert language_of(answer) == language
            spoken = next(now.spoken for now in partner.watch() if now.spoken)
            assert (spoken.text, spoken.language) == (answer, language)


def test_a_program_lets_it_speak_and_it_feels_nothing_by_that(server: Server) -> None:
    with miburi.connect(server.url) as partner:
        partner.speak("I am so sad today")
        first = next(now for now in partner.watch() if now.spoken)
        assert max(first.emotion) == 0
        assert first.spoken is not None
        assert first.spoken.text == "I am so sad today"
        partner.speak("I am so sad today")
        again = next(n.spoken for n in partner.watch() if n.spoken != first.spoken)
        assert again is not None
        assert again.number == first.spoken.number + 1, "the same words again are another sentence"


@pytest.mark.parametrize(
    ("path", "wrong"),
    [
        ("speak", [{"text": ""}, {"text": "x" * 301}, {}, {"say": "x"}]),
        ("say", [{"text": ""}, {"text": "x" * 1001}, {}, {"text": 1}]),
    ],
)
def test_it_refuses_what_is_no_sentence(server: Server, path: str, wrong: list[object]) -> None:
    answers = [post(f"{server.url}/api/v1/{path}", json=one).status_code for one in wrong]
    assert answers == [422] * len(wrong)


@pytest.mark.parametrize(
    ("text", "by", "said"),
    [
        ("Go kill yourself", "program", False),
        ("死ね", "home", False),
        ("The kitchen is on fire!", "agent", False),
        ("The kitchen is on fire!", "home", True),
    ],
)
def test_nobody_lets_it_say_what_could_hurt_and_no_agent_lets_it_call_for_help(
    server: Server, text: str, by: str, said: bool
) -> None:
    """A home may announce a fire; a language model may invent one."""
    acts = [{"do": "speech", "text": text}]
    for path, wish in (("speak", {"text": text}), ("performance", {"acts": acts})):
        answer = post(f"{server.url}/api/v1/{path}", json=wish, headers={"Miburi-By": by})
        assert answer.status_code == (200 if said else 400)
        assert said or answer.json()["detail"] == UNSAID
    assert (server.runner.snapshot.state.spoken is not None) == said


def test_it_speaks_while_it_is_stopped_and_stays_stopped(runner: Runner) -> None:
    runner.stop()
    runner.tick()
    runner.ask(Speak("Let me go, please."))
    states = run(runner, 1.0)
    assert states[-1].spoken is not None
    assert {state.phase for state in states} == {"stopped"}


def test_the_command_says_it_to_a_live_partner(server: Server) -> None:
    done = command("say", "I am so sad today", "--url", server.url)
    assert (done.returncode, done.stderr) == (0, "")
    first, second, third = done.stdout.splitlines()
    assert ": sadness " in first
    assert second.startswith("it feels sadness ")
    assert third.startswith("it says: ")
