"""The partner from another process: what crosses, what overtakes, and what is said of silence."""

import itertools
import threading
from collections.abc import Iterator
from concurrent.futures import Future
from functools import partial
from multiprocessing import Pipe
from pathlib import Path
from queue import SimpleQueue
from selectors import DefaultSelector, SelectorKey

import numpy as np
import pytest
from tests.fixtures.live import block, interface, run, serving
from tests.fixtures.waiting import ask, until
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from miburi.errors import BodyError, InputError, MiburiError
from miburi.feelings import Expression, Stimulus
from miburi.languages.rhythm import Rhythm
from miburi.live import granting, wishes
from miburi.live.crossing.answering import Answering
from miburi.live.crossing.far import FarPartner
from miburi.live.crossing.lanes import Answer, Ask, Hello, Lanes, Latest, lanes
from miburi.live.events.event import Cursor
from miburi.live.events.log import Log
from miburi.live.events.store import EventStore, kept_events
from miburi.live.runner import Runner
from miburi.live.view import UnreachableError
from miburi.live.wishes import (
    ChangeBody,
    ChangeTemperament,
    Feel,
    KeepTime,
    MoveHand,
    Pause,
    Perform,
    Release,
    Speak,
    Wish,
)
from miburi.serving.press import PRESSED, Press, press


def done(runner: Runner, future: Future[object]) -> object:
    """Let time pass until a command has been answered."""
    until(lambda: runner.tick() or future.done())
    return future.result()


@pytest.fixture
def far(runner: Runner) -> Iterator[FarPartner]:
    """The runner, seen through pipes; time passes when a test calls ``tick``."""
    near, ends = lanes()
    Answering(runner, near)
    yield FarPartner(ends)
    ends.close()


@pytest.fixture
def asleep(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """Let the first waits end late and with nothing, as after a sleep; tell when they are over."""
    waits, over = itertools.count(1), threading.Event()

    class Selector(DefaultSelector):
        def select(self, timeout: float | None = None) -> list[tuple[SelectorKey, int]]:
            if next(waits) <= 3:
                return []
            over.set()
            return super().select(timeout)

    monkeypatch.setattr("miburi.live.crossing.far.DefaultSelector", Selector)
    monkeypatch.setattr("miburi.live.crossing.far.SILENCE", 600.0)
    return over


@pytest.fixture
def pair(runner: Runner) -> Iterator[tuple[FarPartner, Lanes]]:
    """A far partner whose other side is the test itself."""
    (near, ends), own = lanes(), runner.own_temperament
    near.asking.send(Hello(runner.robot, runner.repertoire, ["calm"], own, 5, "5f2c9a10", 1))
    near.asking.send(Latest(1, runner.snapshot.json, [], [], [], runner.motors))
    ticks = itertools.count(0.0)
    yield FarPartner(ends, clock=lambda: next(ticks)), near
    near.close()


def test_a_store_in_which_the_partner_could_not_begin_is_not_read(
    runner: Runner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The numbers of its events would be taken for those of this start."""
    monkeypatch.setattr("miburi.live.events.log.LOGGED", 1)
    log = Log(EventStore(tmp_path / "events.sqlite"))
    log.note(1.0, "paused")
    log.close()
    near, ends = lanes()
    Answering(runner, near)
    far = FarPartner(ends, open_store=partial(kept_events, tmp_path))
    done(runner, far.ask(Feel(Stimulus("happiness", 0.9, "speech"))))
    until(lambda: far.history.number == runner.history.number > 1)
    assert "paused" not in [event.kind for event in far.history.since(Cursor(None, 0), 100)]
    ends.close()


def test_it_shows_what_the_runner_has(runner: Runner, far: FarPartner) -> None:
    assert (far.robot.name, far.temperaments) == (runner.robot.name, runner.temperaments)
    done(runner, far.ask(Feel(Stimulus("happiness", 0.9, "speech"))))
    assert block(runner).stop
    run(runner, 0.5)
    until(lambda: far.snapshot.json == runner.snapshot.json)
    assert far.snapshot.state == runner.snapshot.state
    until(lambda: far.history.after(0) == runner.history.after(0))
    until(lambda: far.samples_after(0) == runner.samples_after(0))
    assert len(far.samples_after(0)) >= 20
    assert far.history.after(1) == runner.history.after(1)
    until(lambda: far.motors == runner.motors)
    assert far.body_name == "simulated"


def test_everything_that_can_be_asked_crosses(runner: Runner, far: FarPartner) -> None:
    done(runner, far.ask(Speak("I am glad that you came to see me today.")))
    said = runner.snapshot.state.spoken
    assert said is not None
    done(runner, far.ask(KeepTime(said.number, Rhythm((0.5,), 3.0))))
    done(runner, far.ask(Perform(Expression("happiness", 1.0))))
    until(lambda: runner.tick() or runner.snapshot.state.asked)
    done(runner, far.ask(Pause(True)))
    done(runner, far.ask(MoveHand(np.array([0.05, -0.24, 0.16]), np.array([0.0, 1.0, 0.0]))))
    done(runner, far.ask(ChangeTemperament("calm")))
    state = runner.snapshot.state
    assert (state.paused, state.hand_out, state.temperament) == (True, True, "calm")
    done(runner, far.stop())
    assert runner.snapshot.state.phase == "stopped"
    run(runner, 1.0)
    with pytest.raises(BodyError, match="was pressed after"):  # it may have come before the Stop
        done(runner, far.ask(Release(by_person=True)))
    far.beat()
    far.beat()
    done(runner, far.ask(Release(by_person=True)))
    assert runner.snapshot.state.phase == "returning"


class Somersault(Wish[None]):
    """What no partner is able to do."""


def test_a_wish_that_nobody_knows_is_refused_and_the_next_one_granted(
    runner: Runner, far: FarPartner
) -> None:
    with pytest.raises(MiburiError, match="Somersault"):
        far.ask(Somersault()).result(60)
    done(runner, far.ask(Pause()))
    assert runner.snapshot.state.paused


def test_each_wish_can_be_granted() -> None:
    kinds = {
        kind
        for kind in vars(wishes).values()
        if isinstance(kind, type) and kind.__module__ == wishes.__name__
    }
    assert kinds - set(granting.command.registry) == {Wish}


def test_recordings_are_started_listed_and_deleted_from_afar(
    runner: Runner, far: FarPartner
) -> None:
    far.recordings.start()
    run(runner, 1.0)
    until(lambda: far.recordings.current == "miburi-0001.mcap")
    far.recordings.end()
    assert [(kept.name, kept.whole) for kept in far.recordings.kept()] == [
        ("miburi-0001.mcap", True)
    ]
    assert far.recordings.find("miburi-0001.mcap").is_file()
    runner.tick()
    until(lambda: far.recordings.current is None)
    far.recordings.delete("miburi-0001.mcap")
    assert far.recordings.kept() == []
    with pytest.raises(InputError, match="no recording"):
        far.recordings.find("miburi-0001.mcap")


def test_refusals_keep_their_kind_and_words(runner: Runner, far: FarPartner) -> None:
    with pytest.raises(BodyError, match="only a stopped body"):
        done(runner, far.ask(Release()))
    with pytest.raises(InputError, match="one of simulated"):
        done(runner, far.ask(ChangeBody("marble")))
    with pytest.raises(InputError, match="along"):
        done(runner, far.ask(MoveHand(np.zeros(3), np.zeros(3))))


def test_who_gives_up_waiting_takes_a_command_back_but_no_stop(
    runner: Runner, far: FarPartner
) -> None:
    far.ask(Pause(True)).cancel()
    far.recordings.kept()  # answered after what was sent before it, while no time passes
    done(runner, far.ask(Feel(Stimulus("fear", 0.1))))  # it came later
    assert not runner.snapshot.state.paused
    far.stop().cancel()
    until(lambda: runner.tick() or runner.snapshot.state.phase == "stopped")


def test_a_stop_makes_a_release_void_that_it_has_overtaken(runner: Runner) -> None:
    near, ends = lanes()
    Answering(runner, near)
    assert isinstance(ends.asking.recv(), Hello)
    ends.stopping.send((1.0, PRESSED))
    until(lambda: runner.tick() or ends.stopping.poll())
    run(runner, 1.0)
    ends.asking.send(Ask(1, Release(by_person=True), 0.9))  # pressed before the Stop
    until(lambda: runner.tick() or ends.asking.poll())
    refused = ends.asking.recv()
    assert isinstance(refused, Answer)
    assert "Stop was pressed after" in str(refused.error)
    ends.asking.send(Ask(2, Release(by_person=True), 1.1))
    until(lambda: runner.tick() or ends.asking.poll())
    assert ends.asking.recv().error is None
    ends.close()


def test_a_page_releases_the_stop_that_it_shows_and_no_later_one(
    runner: Runner, far: FarPartner
) -> None:
    done(runner, far.stop())
    run(runner, 1.0)
    shown = runner.snapshot.state.serial
    done(runner, far.ask(Release(by_person=True, seen=shown)))  # however early the wish came
    done(runner, far.stop())
    run(runner, 1.0)
    with pytest.raises(BodyError, match="Stop was pressed after"):
        done(runner, far.ask(Release(by_person=True, seen=shown)))
    now = runner.snapshot.state.serial
    with pytest.raises(BodyError, match="Stop was pressed after"):
        done(runner, far.ask(Release(seen=now + 1000)))  # nobody has seen that yet
    assert runner.snapshot.state.phase == "stopped"
    done(runner, far.ask(Release(by_person=True, seen=now)))


def test_the_second_copy_of_a_press_undoes_no_release(runner: Runner, far: FarPartner) -> None:
    """A page sends each press on two ways, and one of them may be slow."""
    first, second = (press("person", name) for name in ("a" * 16, "b" * 16))
    done(runner, far.stop(first))
    run(runner, 1.0)
    release = runner.ask(Release(by_person=True, seen=runner.snapshot.state.serial))
    runner.stop(first)  # while the release waits for its step
    runner.tick()
    release.result(0)
    done(runner, far.stop(first))  # and after it
    assert runner.snapshot.state.phase != "stopped"
    done(runner, far.stop(second))
    assert runner.snapshot.state.phase == "stopped"
    run(runner, 1.0)
    for name in ("", "short", "c" * 65):  # what was not drawn for this press names none
        release = runner.ask(Release(by_person=True, seen=runner.snapshot.state.serial))
        runner.stop(press("person", name))
        runner.tick()
        with pytest.raises(BodyError, match="Stop was pressed after"):
            release.result(0)


def test_a_press_without_a_name_among_named_ones_counts() -> None:
    first, second = (press("person", name) for name in ("a" * 16, "b" * 16))
    assert Press.both(first, second).names == {"a" * 16, "b" * 16}
    assert Press.both(first, PRESSED).names is None
    assert Press.both(PRESSED, first).names is None


def test_a_flood_of_stops_fills_no_pipe_and_none_is_lost(
    pair: tuple[FarPartner, Lanes],
) -> None:
    far, near = pair
    futures = {id(future): future for future in (far.stop() for _ in range(1000))}
    assert len(futures) == 2
    first, second = futures.values()
    assert near.stopping.recv() == (1, PRESSED)
    assert not near.stopping.poll()
    near.stopping.send(None)
    first.result(60)
    assert near.stopping.recv() == (1000, PRESSED)
    assert not second.done()
    near.stopping.send(None)
    second.result(60)


def test_a_stop_is_sent_even_to_a_partner_that_does_not_answer(
    pair: tuple[FarPartner, Lanes], monkeypatch: pytest.MonkeyPatch
) -> None:
    far, near = pair
    monkeypatch.setattr("miburi.live.crossing.far.SILENCE", 0.0)
    until(lambda: not far.reachable)
    with pytest.raises(UnreachableError, match="cannot be reached"):
        far.stop()
    assert near.stopping.recv() == (1, PRESSED)


def test_silence_is_said_and_ends_with_news(
    runner: Runner, pair: tuple[FarPartner, Lanes], monkeypatch: pytest.MonkeyPatch
) -> None:
    far, near = pair
    monkeypatch.setattr("miburi.live.crossing.far.SILENCE", 0.2)
    until(lambda: not far.reachable)
    with pytest.raises(UnreachableError):
        far.ask(Feel(Stimulus("fear", 0.1)))
    with serving(interface(far)) as url:
        for method, path in (("GET", "/state"), ("POST", "/stop"), ("POST", "/release")):
            refused = ask(method, f"{url}/api/v1{path}")
            assert (refused.status_code, "cannot be reached" in refused.text) == (503, True)
        address = url.replace("http", "ws") + "/api/v1/live"
        with connect(address) as socket, pytest.raises(ConnectionClosed):
            socket.recv(5)
    monkeypatch.setattr("miburi.live.crossing.far.SILENCE", 60.0)
    near.asking.send(Latest(1, runner.snapshot.json, [], [], [], None))
    until(lambda: far.reachable)


def test_a_sleep_of_the_server_itself_is_not_the_partners_silence(
    asleep: threading.Event, pair: tuple[FarPartner, Lanes]
) -> None:
    assert asleep.wait(60)
    assert pair[0].reachable


def test_who_has_been_answered_from_afar_reads_a_state_that_shows_it(live: Runner) -> None:
    near, ends = lanes()
    Answering(live, near)
    far = FarPartner(ends)
    for paused in (True, False) * 10:
        far.ask(Pause(paused)).result(60)
        assert far.snapshot.state.paused == paused
    ends.close()


def test_an_answer_waits_for_the_state_that_shows_it(
    runner: Runner, pair: tuple[FarPartner, Lanes]
) -> None:
    far, near = pair
    future = far.ask(Pause(True))
    state, motors = runner.snapshot.json, runner.motors.model_copy(update={"port": "new"})
    near.asking.send(Answer(1, None, None, serial=3))
    near.asking.send(Latest(2, state, [], [], [], motors))  # of the step before
    until(lambda: far.motors == motors)
    assert not future.done()
    near.asking.send(Latest(3, state, [], [], [], None))
    future.result(60)


def test_nobody_waits_for_a_process_that_has_ended(pair: tuple[FarPartner, Lanes]) -> None:
    far, near = pair
    waiting: list[Future[None]] = [far.ask(Pause(True)), far.stop()]
    near.close()
    assert far.over.wait(60)
    for future in waiting:
        with pytest.raises(UnreachableError):
            future.result(60)
    assert not far.reachable


def test_the_body_is_stopped_while_the_server_serves_nobody(
    live: Runner, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("miburi.live.crossing.answering.UNSERVED", 0.0)
    near, ends = lanes()
    Answering(live, near)
    far = FarPartner(ends)
    far.tell_ready()
    until(lambda: live.held)
    until(lambda: "the server does not respond" in caplog.text)
    ends.close()


@pytest.mark.parametrize("first", ["server", "reception"])
def test_it_is_ready_when_the_server_and_the_reception_are(runner: Runner, first: str) -> None:
    """Else a reception that hangs before its first sign of life would never be missed."""
    (near, ends), (reception, ours) = lanes(), Pipe()
    ready = SimpleQueue[None]()
    Answering(runner, near, on_ready=lambda: ready.put(None), reception=reception)
    far = FarPartner(ends)

    def tell(who: str) -> None:
        if who == "server":
            far.tell_ready()
            done(runner, far.ask(Pause(True)))  # which is asked after it, so that it has been heard
        else:
            ours.send(None)
            ours.recv()

    tell(first)
    run(runner, 0.1)
    assert ready.empty()
    tell("reception" if first == "server" else "server")
    ready.get(timeout=60)
    ends.close()
    ours.close()
