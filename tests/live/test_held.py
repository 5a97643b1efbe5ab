"""A Stop that only a person may end outlasts the program that it stopped."""

import sqlite3
from pathlib import Path

import pytest
from tests.fixtures.live import PATIENT, block, run, until
from tests.fixtures.waiting import until as wait_until

from miburi.errors import BodyError
from miburi.feelings import EmotionalModel, Stimulus
from miburi.live.events.event import LiveEvent
from miburi.live.events.store import EventStore, kept_events
from miburi.live.recording.archive import Archive
from miburi.live.runner import Runner
from miburi.live.wishes import Feel, Release
from miburi.robot import Robot
from miburi.serving.press import By, Hold, Press


def woken(robot: Robot, folder: Path, body: str = "simulated", hold: Hold | None = None) -> Runner:
    """Start a partner that moves at once if it may."""
    feelings, events = EmotionalModel(), kept_events(folder)
    runner = Runner(
        robot, feelings, Archive(folder), body=body, hold=hold, lateness=PATIENT, events=events
    )
    runner.ask(Feel(Stimulus("happiness", 0.9)))
    return runner


def pressed(runner: Runner) -> list[LiveEvent]:
    return [event for event in runner.history.after(0) if event.kind == "pressed"]


def press(runner: Runner, by: By) -> None:
    runner.stop(Press(by))
    until(runner, lambda state: state.held)
    run(runner, 0.5)


def release(runner: Runner, *, by_person: bool) -> None:
    released = runner.ask(Release(by_person=by_person))
    run(runner, 0.1)
    released.result(0)


def kill(runner: Runner, folder: Path) -> None:
    """Leave a partner as ``kill -9`` does, once the disk has what it was told."""
    number, store = runner.history.number, EventStore(folder / "events.sqlite")
    wait_until(lambda: store.read(number - 1, 1))
    store.close()


def wakes_held(runner: Runner) -> bool:
    states = run(runner, 2.0)
    assert len({(state.phase, state.held) for state in states}) == 1 or not states[-1].held
    return states[-1].held


@pytest.mark.parametrize("body", ["simulated", "emulated-card"])
def test_a_killed_partner_wakes_as_a_person_left_it(
    robot: Robot, tmp_path: Path, body: str, firmware: Path
) -> None:
    first = woken(robot, tmp_path, body)
    press(first, "person")
    (then,) = pressed(first)
    kill(first, tmp_path)
    for _ in range(2):
        again = woken(robot, tmp_path, body)
        assert wakes_held(again)
        state = again.snapshot.state
        assert (state.phase, state.stop and state.stop.reason) == ("stopped", "asked")
        (now,) = pressed(again)
        assert (now.by, now.detail) == ("person", then.wall.isoformat())
        kill(again, tmp_path)
    with pytest.raises(BodyError, match="a person pressed Stop"):
        release(again, by_person=False)
    release(again, by_person=True)
    kill(again, tmp_path)
    assert not wakes_held(woken(robot, tmp_path, body))


@pytest.mark.parametrize(
    ("presses", "by"),
    [
        (["home"], "home"),
        (["agent", "person"], "agent"),
        (["program", "ros"], "ros"),
        (["person", "program"], "person"),
        (["program"], None),
        (["partner"], None),
        (["person", None, "program"], None),
        (["person", None, "home"], "home"),
    ],
)
def test_what_only_a_person_may_end_is_remembered(
    robot: Robot, tmp_path: Path, presses: list[By | None], by: By | None
) -> None:
    """None stands for a person's release."""
    first = woken(robot, tmp_path)
    for one in presses:
        if one is None:
            release(first, by_person=True)
        else:
            press(first, one)
    kill(first, tmp_path)
    second = woken(robot, tmp_path)
    assert wakes_held(second) == (by is not None)
    assert [event.by for event in pressed(second)] == ([] if by is None else [by])


def test_programs_that_may_release_it_may_after_a_restart(robot: Robot, tmp_path: Path) -> None:
    first = woken(robot, tmp_path)
    press(first, "person")
    first.close(patience=0.0)
    second = woken(robot, tmp_path, hold=Hold(programs_may_release=True))
    assert wakes_held(second)
    release(second, by_person=False)
    second.close(patience=0.0)
    assert not wakes_held(woken(robot, tmp_path))


@pytest.mark.parametrize("held", [True, False])
def test_of_a_contact_only_a_stop_upon_it_is_remembered(
    robot: Robot, tmp_path: Path, held: bool
) -> None:
    first = woken(robot, tmp_path)
    block(first)
    if held:
        press(first, "person")
    kill(first, tmp_path)
    assert wakes_held(woken(robot, tmp_path)) == held


def test_no_stop_waits_for_a_disk_and_a_full_one_is_tried_again(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    first = woken(robot, tmp_path)

    def full(*_: object, **__: object) -> None:
        raise sqlite3.OperationalError("database or disk is full")

    with monkeypatch.context() as patch:
        patch.setattr(EventStore, "set_note", full)
        press(first, "person")
        wait_until(lambda: "a restart would forget" in caplog.text)
    first.close(patience=0.0)
    assert wakes_held(woken(robot, tmp_path))
