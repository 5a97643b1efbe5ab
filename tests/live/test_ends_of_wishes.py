"""Every wish ends once: gestures, sentences, releases and performances."""

import pytest
from tests.fixtures.live import block, run, until

from miburi.feelings import Expression
from miburi.live.events.event import LiveEvent
from miburi.live.runner import STEP, Runner
from miburi.live.stage import Act
from miburi.live.wishes import (
    ChangeBody,
    Pause,
    Perform,
    PerformActs,
    Release,
    Speak,
    Wish,
)
from miburi.partner import LAPSES


def ends(runner: Runner, wish: str) -> list[LiveEvent]:
    """Return the events of a wish that end it."""
    ending = ("_ended", "_broken_off", "_dropped")
    events = runner.history.after(0)
    return [event for event in events if event.wish == wish and event.kind.endswith(ending)]


def test_every_wish_ends_once(runner: Runner) -> None:
    first = runner.ask(Perform(Expression("happiness", 0.5)))
    replaced = runner.ask(Perform(Expression("anger", 0.5)))
    said = runner.ask(Speak("Hello."))
    over = runner.ask(Speak("Good morning to all of you."))
    runner.tick()
    third = runner.ask(Perform(Expression("fear", 0.5)))
    until(runner, lambda state: state.asked)
    run(runner, 0.2)
    runner.stop()
    until(runner, lambda state: state.stop)
    dropped = runner.ask(Perform(Expression("fear", 0.5)))
    run(runner, 9.0)
    told = [
        [event.kind for event in ends(runner, wish.result())]
        for wish in (first, replaced, said, over, third, dropped)
    ]
    assert told == [
        ["wish_dropped"],
        ["gesture_broken_off"],
        ["speech_broken_off"],
        ["speech_ended"],
        ["wish_dropped"],
        ["wish_dropped"],
    ]
    assert ends(runner, dropped.result())[0].name == "lapsed"


@pytest.mark.parametrize("stopped", [0.0, 5.0, 20.0])
@pytest.mark.parametrize(
    ("asked", "end"),
    [
        (Perform(Expression("fear", 0.5)), "wish_dropped"),
        (PerformActs([Act(0.0, expression=Expression("fear", 0.5))], True), "wish_dropped"),
        (
            PerformActs([Act(0.0, expression=Expression("fear", 0.5))], False),
            "performance_broken_off",
        ),
    ],
    ids=["single", "next", "now"],
)
def test_a_wish_waits_for_a_stopped_body_as_long_as_is_said_from_its_own_time(
    runner: Runner, stopped: float, asked: Wish[str], end: str
) -> None:
    runner.stop()
    run(runner, STEP + stopped)
    wish = runner.ask(asked)
    run(runner, LAPSES)
    assert ends(runner, wish.result()) == []
    run(runner, 3 * STEP)
    assert [(e.kind, e.name) for e in ends(runner, wish.result())] == [(end, "lapsed")]


def test_a_sentence_goes_on_while_the_body_is_stopped(runner: Runner) -> None:
    runner.stop()
    run(runner, LAPSES + 1.0)
    wish = runner.ask(PerformActs([Act(0.0, words="Here."), Act(0.5, words="I wait.")], False))
    run(runner, LAPSES)
    assert [e.kind for e in ends(runner, wish.result())][-1] == "performance_ended"


def test_another_body_ends_what_was_asked_of_the_last(runner: Runner) -> None:
    wish = runner.ask(Perform(Expression("surprise", 0.8)))
    until(runner, lambda state: state.asked)
    runner.ask(ChangeBody("simulated"))
    run(runner, 0.1)
    assert [event.kind for event in ends(runner, wish.result())] == ["gesture_broken_off"]


def test_a_release_has_an_end_or_is_broken_off(runner: Runner) -> None:
    block(runner)
    until(runner, lambda state: state.phase == "returning")
    runner.stop()
    until(runner, lambda state: state.held and state.phase == "stopped")
    run(runner, 0.5)
    runner.ask(Release(by_person=True))
    until(runner, lambda state: state.phase == "idle")
    runner.tick()
    kinds = [e.kind for e in runner.history.after(0) if e.kind.startswith(("stop", "release"))]
    assert kinds[:2] == ["stop", "release_begun"]
    assert kinds[2:4] == ["stop", "release_broken_off"]
    assert kinds[-2:] == ["release_begun", "release_ended"]


def test_a_release_ends_before_a_gesture_that_waited_for_it_begins(runner: Runner) -> None:
    block(runner)
    runner.stop()
    until(runner, lambda state: state.held and state.phase == "stopped")
    run(runner, 0.5)
    runner.ask(Release(by_person=True))
    until(runner, lambda state: state.phase == "returning")
    runner.ask(Perform(Expression("fear", 0.8)))
    until(runner, lambda state: state.expressed is not None)
    assert [e.kind for e in runner.history.after(0)][-2:] == ["release_ended", "gesture_begun"]


def performed(runner: Runner, wish: str) -> list[LiveEvent]:
    """Let time pass until a performance has ended; return its events."""
    until(runner, lambda _: any(e.kind.startswith("perf") for e in ends(runner, wish)))
    return [event for event in runner.history.after(0) if event.wish == wish]


ACTS = [
    Act(0.0, expression=Expression("happiness", 0.6)),
    Act(0.5, words="Look at this!"),
    Act(1.0, expression=Expression("surprise", 0.6)),
]


def test_a_performance_does_all_in_order_and_ends_once(runner: Runner) -> None:
    wish = runner.ask(PerformActs(ACTS, True))
    runner.tick()
    told = [(e.kind, e.feeling) for e in performed(runner, wish.result())]
    assert [one for one in told if "speech" not in one[0]] == [
        ("performance_begun", None),
        ("gesture_begun", "happiness"),
        ("gesture_ended", "happiness"),
        ("gesture_begun", "surprise"),
        ("gesture_ended", "surprise"),
        ("performance_ended", None),
    ]
    kinds = [kind for kind, _ in told]
    assert kinds.index("gesture_begun") < kinds.index("speech_begun") < kinds.index("gesture_ended")


def test_what_belongs_together_begins_together_while_it_breathes(runner: Runner) -> None:
    """At rest it breathes: the body must end that, and the sentence waits for it."""
    acts = [Act(0.0, words="Hello."), Act(0.0, expression=Expression("surprise", 0.5))]
    until(runner, lambda state: state.phase == "moving")
    wish = runner.ask(PerformActs(acts, queued=True))
    runner.tick()
    begun = {e.kind: e.time for e in performed(runner, wish.result())}
    assert begun["speech_begun"] == pytest.approx(begun["gesture_begun"], abs=2.5 * STEP)


def returning(runner: Runner) -> None:
    """Release a stopped body: nothing begins before it is back at neutral."""
    until(runner, lambda state: state.phase == "moving")
    run(runner, 0.2)
    runner.stop()
    until(runner, lambda state: state.phase == "stopped")
    runner.ask(Release(by_person=True))
    until(runner, lambda state: state.phase == "returning")


def test_a_pause_ends_what_has_not_begun(runner: Runner) -> None:
    """A body that goes home takes no act: the pause comes before it."""
    returning(runner)
    acts = [Act(0.0, expression=Expression("surprise", 0.5)), Act(0.5, words="Hello.")]
    wish = runner.ask(PerformActs(acts, queued=True))
    run(runner, 3 * STEP)
    runner.ask(Pause(True))
    run(runner, 1.0)
    assert [e.kind for e in ends(runner, wish.result())] == ["performance_broken_off"]


def test_what_is_replaced_before_it_begins_is_never_performed(runner: Runner) -> None:
    returning(runner)
    first = runner.ask(PerformActs([Act(0.0, expression=Expression("sadness", 0.5))], queued=True))
    run(runner, 3 * STEP)
    runner.ask(PerformActs([Act(0.0, words="No, wait.")], queued=False))
    until(runner, lambda state: state.phase == "idle")
    run(runner, 1.0)
    kinds = [e.kind for e in runner.history.after(0) if e.wish == first.result()]
    assert "gesture_begun" not in kinds
    assert kinds[-1] == "performance_broken_off"


def test_performances_wait_for_one_another_and_now_comes_before_all(runner: Runner) -> None:
    first, second = runner.ask(PerformActs(ACTS[:1], True)), runner.ask(PerformActs(ACTS[2:], True))
    until(runner, lambda state: state.asked)
    now = runner.ask(PerformActs([Act(0.0, expression=Expression("fear", 0.9))], False))
    until(runner, lambda state: state.expressed and state.expressed.feeling == "fear", seconds=2.0)
    performed(runner, now.result())
    told = [
        [e.kind for e in ends(runner, wish.result()) if "gesture" not in e.kind]
        for wish in (first, second, now)
    ]
    assert told == [["performance_broken_off"], ["wish_dropped"], ["performance_ended"]]


def test_a_contact_breaks_a_performance_off_and_stop_drops_those_that_wait(runner: Runner) -> None:
    block(runner)
    until(runner, lambda state: state.phase == "idle", seconds=30.0)
    wide = [Act(0.0, expression=Expression("happiness", 1.0)), *ACTS]
    first, second = runner.ask(PerformActs(wide, True)), runner.ask(PerformActs(wide, True))
    until(runner, lambda state: state.stop)
    run(runner, 0.1)
    assert [e.kind for e in ends(runner, first.result())][-1] == "performance_broken_off"
    runner.stop()
    run(runner, 0.2)
    assert [e.kind for e in ends(runner, second.result())] == ["wish_dropped"]
    assert runner.history.latest is not None
