"""Live gestures: a real partner makes them in virtual time; only a whole one counts as seen."""

import itertools
import json
from collections.abc import Callable, Generator
from pathlib import Path

import numpy as np
import pytest
from starlette.testclient import TestClient
from tests.fixtures.live import block, run, until
from tests.fixtures.study import TWO_GESTURES, Lab, Robot

from miburi.client.connection import ConnectionLostError
from miburi.feelings import Expression, Stimulus
from miburi.live.events.event import Cursor, LiveEvent
from miburi.live.runner import STEP, Runner
from miburi.live.state import State
from miburi.live.wishes import ChangeBody, Feel, MoveHand, Pause, Perform, Release, Wish
from miburi.studies.study.kept import Shown
from miburi.studies.study.live import IDLE, Ending, Showing, show
from miburi.studies.study.report import write_report

FEAR = Expression("fear", 0.9)


class Stage:
    """A partner whose time passes while somebody looks on; ``then`` comes between.

    ``then`` is called with every state once the gesture has been under way for half a second.
    ``hidden`` states reach nobody, as on a slow line.
    """

    def __init__(
        self,
        runner: Runner,
        then: Callable[[], object] | None = None,
        hidden: tuple[str, ...] = (),
    ) -> None:
        self.runner, self._then, self._hidden = runner, then, hidden
        self.asked: list[Expression] = []
        #: What somebody is shown first, though it is over.
        self.before: State | None = None

    def watch(self, rate: float = 30.0, patience: float = 0.0) -> Generator[State, None, None]:
        under_way = 0
        if self.before is not None:
            yield self.before
        for step in itertools.count():
            (state,) = run(self.runner, STEP)
            under_way += state.asked
            if self._then is not None and under_way > 0.5 / STEP:
                self._then()
                self._then = None
            if step % round(1 / rate / STEP) == 0 and state.phase not in self._hidden:
                yield state

    def express(self, expression: Expression) -> None:
        self.asked.append(expression)
        done = self.runner.ask(Perform(expression))
        self.runner.tick()
        done.result(0)

    def log(self, after: str | None = None) -> list[LiveEvent]:
        return self.runner.history.since(Cursor.of(after or "0"), 1000)


def gestures(runner: Runner) -> list[str | None]:
    return [entry.feeling for entry in runner.history.after(0) if entry.kind == "gesture_begun"]


def test_nothing_is_asked_of_a_robot_that_was_stopped_just_before(runner: Runner) -> None:
    """It was: a Stop is answered before states show it. After the release, nobody looked."""
    stage = Stage(runner)
    stage.before = runner.snapshot.state
    runner.stop()
    run(runner, STEP)
    assert show(stage, FEAR) == Showing(Ending.STOPPED, begun=False)
    assert stage.asked == []


def test_a_gesture_is_made_once_from_its_beginning_to_its_end(runner: Runner) -> None:
    stage = Stage(runner)
    before = runner.snapshot.state.time
    assert show(stage, FEAR) == Showing(Ending.WHOLE, begun=True)
    assert runner.snapshot.state.time - before > 1.0
    assert runner.snapshot.state.expressed is None
    run(runner, 5.0)
    assert gestures(runner) == ["fear"]


def test_a_gesture_of_its_own_ends_before(runner: Runner) -> None:
    runner.ask(Feel(Stimulus("happiness", 1.0)))
    until(runner, lambda state: state.expressed)
    assert show(Stage(runner), FEAR) == Showing(Ending.WHOLE, begun=True)
    assert gestures(runner)[0] == "happiness"
    assert gestures(runner).count("fear") == 1


def test_another_gesture_after_it_is_noticed(runner: Runner) -> None:
    showing = show(Stage(runner), FEAR)
    assert showing.others() == 0
    runner.ask(Perform(Expression("happiness", 0.9)))
    until(runner, lambda state: state.expressed)
    assert showing.others() == 1


@pytest.mark.parametrize("hidden", [(), ("stopped", "returning")])
def test_a_stop_by_a_person_breaks_it_off_and_stays(
    runner: Runner, hidden: tuple[str, ...]
) -> None:
    def press_stop() -> None:
        runner.stop()
        if hidden:  # a person releases it, too, before the next state comes through
            until(runner, lambda state: state.phase == "stopped")
            run(runner, 1.0)
            runner.ask(Release(by_person=True))

    assert show(Stage(runner, press_stop, hidden), FEAR) == Showing(Ending.STOPPED, begun=True)
    if not hidden:
        again = Stage(runner)
        assert show(again, FEAR) == Showing(Ending.STOPPED, begun=False)
        assert again.asked == []
        run(runner, 5.0)
        assert runner.held


def test_a_touch_breaks_it_off_and_it_can_be_shown_again(runner: Runner) -> None:
    block(runner)
    assert show(Stage(runner), FEAR) == Showing(Ending.TOUCHED, begun=False)
    runner.ask(MoveHand(None, np.array([1.0, 0.0, 0.0])))
    until(runner, lambda state: state.phase == "idle")
    assert show(Stage(runner), FEAR) == Showing(Ending.WHOLE, begun=True)


def test_a_touch_in_its_midst_is_no_whole_gesture(runner: Runner) -> None:
    wide = Expression("happiness", 1.0)

    def reach_in() -> None:
        # Where the right arm passes: it may be past where it was seen last.
        runner.ask(MoveHand(np.array([0.12, -0.11, 0.12]), np.array([1.0, 0.0, 0.0])))

    assert show(Stage(runner, reach_in), wide) == Showing(Ending.TOUCHED, begun=True)


@pytest.mark.parametrize(
    ("wish", "ending"), [(Pause(True), Ending.PAUSED), (ChangeBody("simulated"), Ending.BROKEN)]
)
def test_a_pause_or_another_body_breaks_it_off(runner: Runner, wish: Wish, ending: Ending) -> None:
    stage = Stage(runner, lambda: runner.ask(wish))
    assert show(stage, FEAR) == Showing(ending, begun=True)
    if ending is Ending.PAUSED:
        assert show(Stage(runner), FEAR) == Showing(Ending.PAUSED, begun=False)
        assert runner.snapshot.state.paused


def test_a_partner_that_goes_away_is_absent(runner: Runner) -> None:
    def go() -> None:
        raise ConnectionLostError("gone.")

    assert show(Stage(runner, go), FEAR) == Showing(Ending.ABSENT, begun=True)


def test_nobody_waits_for_it_once_all_is_over(runner: Runner) -> None:
    over: list[bool] = []
    ending = Stage(runner, lambda: over.append(True))
    assert show(ending, FEAR, lambda: bool(over)) == Showing(Ending.BROKEN, begun=True)


def test_a_wish_that_another_replaces_is_given_up(runner: Runner) -> None:
    class Crowd(Stage):
        def express(self, expression: Expression) -> None:
            self.runner.ask(Perform(expression))
            self.runner.ask(Perform(Expression("anger", 0.9)))

    assert show(Crowd(runner), FEAR) == Showing(Ending.BROKEN, begun=False)
    assert gestures(runner) == ["anger"]


# The pages, with a robot that does what the test says.


def page(lab: Lab, browser: TestClient) -> str:
    return browser.get(f"{lab.home}/page").text


def test_the_question_comes_when_the_gesture_has_been_seen(tmp_path: Path) -> None:
    robot = Robot()
    lab = Lab(tmp_path, TWO_GESTURES, robot)
    browser = lab.begin()
    for step, answer in enumerate(["fear", "shaky", "fear", "shaky"]):
        if step % 2 == 0:
            shown = page(lab, browser)
            assert "Watch the robot" in shown
            assert 'name="answer"' not in shown
            assert lab.post(browser, step=str(step), answer=answer).status_code == 303
            assert len(lab.store.answers()) == step  # nobody answers what they have not seen
            assert lab.post(browser, "/perform").headers["location"] == f"{lab.home}/page"
        shown = page(lab, browser)
        assert 'name="answer"' in shown
        assert "Show me the gesture again" in shown
        assert "<video" not in shown
        lab.post(browser, step=str(step), answer=answer)
    asked = [answer.film for answer in lab.store.answers() if answer.question == "feeling"]
    assert [f"{each.feeling}-{each.mood:g}-live" for each in robot.shown] == asked
    lab.post(browser, "/perform")  # after the end
    lab.post(lab.visitor(), "/perform")  # nobody's
    assert len(robot.shown) == 2


@pytest.mark.parametrize(
    ("ending", "words"),
    [
        (Ending.TOUCHED, "The robot was touched"),
        (Ending.STOPPED, "they will look at the robot and let it go on"),
        (Ending.PAUSED, "The robot is resting"),
        (Ending.ABSENT, "The robot is not answering"),
        (Ending.BROKEN, "could not show you the whole gesture"),
    ],
)
def test_what_was_broken_off_is_shown_again_and_marked(
    tmp_path: Path, ending: Ending, words: str
) -> None:
    lab = Lab(tmp_path, TWO_GESTURES, Robot(Ending.WHOLE, ending, ending))
    browser, japanese = lab.begin(), lab.visitor()
    lab.post(browser, "/perform")
    lab.post(browser, step="0", answer="fear")
    lab.post(browser, step="1", answer="shaky")
    refused = lab.post(browser, "/perform")
    assert (refused.status_code, words in refused.text) == (503, True)
    assert "safe" in refused.text
    assert "Watch the robot" in page(lab, browser)
    assert len(lab.store.answers()) == 2  # nothing is lost
    write_report(lab.study, tmp_path, tmp_path / "report")
    broken = int(ending is not Ending.PAUSED)  # that one had not begun
    told = (tmp_path / "report" / "index.html").read_text(encoding="utf-8")
    assert f"shown again before a question came: {broken}." in told
    lab.post(browser, "/next")
    lab.post(japanese, "", agree="yes", language="ja")
    shown = lab.post(japanese, "/perform").text
    assert 'lang="ja"' in shown
    assert "安" in shown or "保存" in shown


def test_a_report_says_how_often_gestures_were_shown(tmp_path: Path) -> None:
    lab = Lab(tmp_path, TWO_GESTURES, Robot(Ending.TOUCHED))
    browser = lab.begin()
    assert [lab.post(browser, "/perform").status_code for _ in range(2)] == [503, 303]
    lab.post(browser, step="0", answer="fear")
    write_report(lab.study, tmp_path, tmp_path / "report")
    row = (tmp_path / "report" / "answers.csv").read_text(encoding="utf-8").splitlines()[-1]
    assert row.split(",")[7:9] == ["1", "1"]
    told = (tmp_path / "report" / "index.html").read_text(encoding="utf-8")
    assert "The robot showed 1 whole gestures live." in told


def test_an_answer_after_another_gesture_is_marked(tmp_path: Path) -> None:
    others = [0]
    lab = Lab(tmp_path, TWO_GESTURES, lambda _: Showing(Ending.WHOLE, True, lambda: others[0]))
    browser = lab.begin()
    lab.post(browser, "/perform")
    lab.post(browser, step="0", answer="fear")
    others[0] = 1
    lab.post(browser, step="1", answer="shaky")
    lab.post(browser, "/perform")  # of the next trial, which began after the other gesture
    assert lab.store.showings() == {(1, 0): Shown(whole=1, others=1), (1, 1): Shown(whole=1)}
    write_report(lab.study, tmp_path, tmp_path / "report")
    told = (tmp_path / "report" / "index.html").read_text(encoding="utf-8")
    assert "After 1 of them it made another gesture before the answer" in told


def test_the_findings_name_the_partners_that_performed(tmp_path: Path) -> None:
    lab = Lab(tmp_path, TWO_GESTURES, Robot())
    calm, playful = {"temperament": "calm"}, {"temperament": "playful"}
    for partner in (playful, calm, calm, playful):  # nobody saw the first
        lab.store.note_partner(partner)
        if partner is calm:
            lab.begin()
    write_report(lab.study, tmp_path, tmp_path / "report")
    found = json.loads((tmp_path / "report" / "findings.json").read_text(encoding="utf-8"))
    partners = [{"first_participant": 1, **calm}, {"first_participant": 3, **playful}]
    assert found["made_with"]["partners"] == partners


def test_one_robot_is_with_one_person_at_a_time(tmp_path: Path) -> None:
    now = [0.0]
    lab = Lab(tmp_path, TWO_GESTURES, Robot(), clock=lambda: now[0])
    first, second = lab.begin(), lab.begin()
    lab.post(first, "/perform")
    for told in second.get(f"{lab.home}/page"), lab.post(second, "/perform"):
        assert told.status_code == 409
        assert "Somebody else is with the robot" in told.text
    for step, answer in enumerate(["fear", "shaky", "fear"]):
        now[0] += IDLE - 1
        if step == 2:
            assert lab.post(first, "/perform").status_code == 303
        page(lab, first)
        lab.post(first, step=str(step), answer=answer)
    assert lab.post(second, "/perform").status_code == 409
    lab.post(first, step="3", answer="shaky")
    assert "Thank you" in page(lab, first)
    assert lab.post(second, "/perform").status_code == 303
    assert {a.participant for a in lab.store.answers()} == {1}


@pytest.mark.parametrize("leave", ["/next", "/withdraw", ""])
def test_who_leaves_the_robot_makes_room(tmp_path: Path, leave: str) -> None:
    now = [0.0]
    lab = Lab(tmp_path, TWO_GESTURES, Robot(), clock=lambda: now[0])
    first, second = lab.begin(), lab.begin()
    code = first.cookies["miburi_study"]
    lab.post(first, "/perform")
    if leave:
        lab.post(first, leave, code=code)
    else:
        now[0] += IDLE  # they only went away
    assert "Watch the robot" in page(lab, second)
    assert lab.post(second, "/perform").status_code == 303
    if leave == "/withdraw":
        assert set(lab.store.showings()) == {(2, 0)}
    if not leave:  # who comes back answers what they have seen, and is told to wait then
        assert "Question 1 of 4" in page(lab, first)
        lab.post(first, step="0", answer="fear")
        lab.post(first, step="1", answer="shaky")
        assert "Somebody else is with the robot" in page(lab, first)


def test_a_second_press_while_it_moves_starts_nothing(tmp_path: Path) -> None:
    shown: list[str] = []

    def perform(_: Expression) -> Showing:
        shown.append(lab.post(lab.visitor(code), "/perform").text)  # in another tab
        shown.append(lab.post(second, "/perform").text)
        return Showing(Ending.WHOLE, begun=True)

    lab = Lab(tmp_path, TWO_GESTURES, perform)
    browser, second = lab.begin(), lab.begin()
    code = browser.cookies["miburi_study"]
    assert lab.post(browser, "/perform").status_code == 303
    assert "The robot is moving" in shown[0]
    assert "Somebody else is with the robot" in shown[1]
    assert len(shown) == 2


def test_after_a_fault_of_ours_the_button_works_again(tmp_path: Path) -> None:
    faults = [RuntimeError("ours")]

    def perform(_: Expression) -> Showing:
        if faults:
            raise faults.pop()
        return Showing(Ending.WHOLE, begun=True)

    lab = Lab(tmp_path, TWO_GESTURES, perform)
    browser = lab.begin()
    with pytest.raises(RuntimeError):
        lab.post(browser, "/perform")
    assert lab.post(browser, "/perform").status_code == 303
