import asyncio
import json
import ssl
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import aclosing, closing
from datetime import UTC, datetime
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi import FastAPI
from fastapi.responses import PlainTextResponse
from tests.fixtures.keys import keys
from tests.fixtures.live import Server, interface, serving
from tests.fixtures.waiting import get, until
from websockets.exceptions import ConnectionClosedError
from websockets.sync.client import connect as open_socket

import miburi
from miburi.client.connection import ConnectionLostError
from miburi.client.remote import RemotePartner
from miburi.client.sending import Sender
from miburi.errors import BodyError, InputError, OutputError
from miburi.feelings import Expression, Stimulus
from miburi.gestures.effort import Effort
from miburi.live.events.event import LiveEvent
from miburi.live.runner import Runner
from miburi.live.state import State, StopOut
from miburi.safety.stop import StopReason
from miburi.serving.access import Gate
from miburi.serving.authority import Certificates


@pytest.fixture
def partner(server: Server) -> Iterator[RemotePartner]:
    with miburi.connect(server.url) as partner:
        yield partner


def test_it_speaks_the_librarys_words(partner: RemotePartner) -> None:
    partner.stimulate(Stimulus("happiness", 0.8, "speech"))
    for state in partner.watch(50):
        if state.expressed is not None and state.expressed.feeling == "happiness":
            break
    partner.express(
        Expression("surprise", 0.4),
        blend={"thrill": 0.2},
        effort=Effort(space=1, weight=0.2, time=0.5, flow=0.5),
    )
    partner.stop()
    for state in partner.watch(50):
        if state.stop is not None:
            break
    partner.release()
    events = partner.log()
    assert "stimulus" in [event.kind for event in events]
    # It goes on meanwhile, so something may have happened since.
    later = partner.log(after=events[-1].id)
    assert [event.number for event in later[:1]] in ([], [events[-1].number + 1])
    assert [motor.joint for motor in partner.motors.motors] == partner.robot.joints
    partner.place_hand((0.1, -0.3, 0.1), tuple(np.array([0, 0, 1])))
    partner.remove_hand()
    partner.temperament("calm")
    assert (partner.state.temperament, partner.state.rest) == ("calm", "still")
    partner.temperament("calm", "lively")
    assert (partner.state.temperament, partner.state.rest) == ("calm", "lively")
    partner.pause()
    partner.pause(False)
    assert {gesture.feeling for gesture in partner.gestures()} == set(partner.robot.feelings)


def test_a_partner_of_another_version_is_refused_in_words(runner: Runner) -> None:
    app = FastAPI()
    other = runner.snapshot.state.model_dump()
    del other["mood"]

    @app.get("/api/v1/state")
    def state() -> dict[str, Any]:
        return other

    with (
        serving(app) as url,
        miburi.connect(url) as partner,
        pytest.raises(InputError, match="same version of Miburi"),
    ):
        _ = partner.state


def test_words_that_only_a_newer_partner_knows_are_passed_on(runner: Runner) -> None:
    stop = StopOut(time=1.0, reason=StopReason.ASKED, mood_before=0.5, mood_after=0.5)
    newer = stop.model_dump() | {"reason": "moonlight", "phase_of_moon": 0.5}
    now = runner.snapshot.state.model_dump(mode="json") | {"phase": "dancing", "stop": newer}
    event = LiveEvent(boot="5f2c9a10", number=7, wall=datetime.now(UTC), time=1.0, kind="stop")
    happened = event.model_dump(mode="json") | {"kind": "moonrise", "by": "moon", "stop": newer}
    app = FastAPI()
    app.get("/api/v1/state")(lambda: now)
    app.get("/api/v1/log")(lambda: [happened, happened])
    app.get("/api/v1/events")(lambda: PlainTextResponse(f"data: {json.dumps(happened)}\n\n"))

    async def look(url: str) -> tuple[State, LiveEvent, LiveEvent]:
        async with (
            miburi.connect_async(url) as partner,
            aclosing(partner.events("0")) as events,
        ):
            return await partner.state(), (await partner.log())[1], await anext(events)

    with serving(app) as url, miburi.connect(url) as partner:
        seen = [(partner.state, partner.log()[1], next(partner.events("0")))]
        seen.append(asyncio.run(look(url)))
    for state, logged, heard in seen:
        assert (state.phase, state.stop and state.stop.reason) == ("dancing", "moonlight")
        for one in (logged, heard):
            assert (one.kind, one.by, one.id) == ("moonrise", "moon", "5f2c9a10:7")
            assert one.stop is not None
            reason = one.stop.reason
            assert (reason, reason.spoken, reason.passes) == ("moonlight", "moonlight", False)


def test_recordings_come_home(partner: RemotePartner, live: Runner, tmp_path: Path) -> None:
    partner.record()
    partner.record(False)
    (listed,) = partner.recordings()
    saved = partner.download(listed.name, tmp_path / "saved.mcap")
    assert saved.stat().st_size == listed.bytes
    partner.delete(listed.name)
    assert partner.recordings() == []
    live.recordings.limit = 0
    with pytest.raises(OutputError, match="delete old ones"):
        partner.record()


def test_refusals_and_mistakes_are_the_librarys_errors(partner: RemotePartner) -> None:
    cases: list[tuple[Callable[[], object], type[Exception], str]] = [
        (partner.release, BodyError, "only a stopped body"),
        (lambda: partner.temperament("wild"), InputError, "default, calm"),
        (lambda: partner.use_body("marble"), InputError, "marble"),
        (lambda: partner.delete("miburi-0042.mcap"), InputError, "there is no recording"),
        (lambda: partner.download("miburi-0042.mcap", "x"), InputError, "there is no recording"),
        (lambda: next(partner.watch(rate=60)), InputError, r"0\.1 to 50"),
        (lambda: partner.stimulate("happiness"), InputError, "Stimulus"),  # type: ignore[arg-type]
        (lambda: partner.express("surprise"), InputError, "Expression"),  # type: ignore[arg-type]
        (partner.perform, InputError, "acts"),
        (lambda: partner.poses({"duration": 2}), InputError, "pose"),  # type: ignore[arg-type]
        (lambda: partner.look("left", nan), InputError, "cannot be sent"),
        (lambda: partner.sense("pat", object()), InputError, "no form"),  # type: ignore[arg-type]
        (lambda: partner.delete("\n"), InputError, "cannot be sent"),
        (lambda: partner.say("x" * 70_000), InputError, "65536 bytes"),
        (lambda: partner.say("\ud800"), InputError, "half a character"),
    ]
    for attempt, kind, words in cases:
        with pytest.raises(kind, match=words):
            attempt()


def test_mistakes_in_an_asynchronous_program_are_the_same_errors(server: Server) -> None:
    async def work() -> None:
        async with miburi.connect_async(server.url) as partner:
            for attempt, words in (
                (partner.express("surprise"), "Expression"),  # type: ignore[arg-type]
                (partner.say("x" * 70_000), "65536 bytes"),
                (partner.say("\ud800"), "cannot be sent"),
                (partner.look("back"), "left"),  # type: ignore[arg-type]
                (partner.look("left", nan), "seconds"),
                (partner.perform(), "acts"),
                (partner.sense("pat", object()), "no form"),  # type: ignore[arg-type]
                (partner.poses({"duration": 2}), "pose"),  # type: ignore[arg-type]
            ):
                with pytest.raises(InputError, match=words):
                    await attempt
        for after_its_end in (partner.state(), anext(partner.events("0"))):
            with pytest.raises(InputError, match="connect again"):
                await after_its_end

    asyncio.run(work())


def test_after_its_end_a_connection_says_so_but_stops_the_body(server: Server) -> None:
    with miburi.connect(server.url) as partner:
        pass
    for attempt in (
        lambda: partner.state,
        partner.pause,
        lambda: next(partner.watch()),
        lambda: next(partner.events("0")),
    ):
        with pytest.raises(InputError, match="connect again"):
            attempt()
    partner.stop()
    until(lambda: server.runner.snapshot.state.stop)


def test_a_watch_ends_with_its_connection(server: Server) -> None:
    """It went on, and the program never ended."""
    with miburi.connect(server.url) as partner, ThreadPoolExecutor() as pool:
        idle, waiting = partner.watch(), partner.watch(0.1)
        next(idle)
        next(waiting)
        other = pool.submit(next, waiting)
        partner.close()
        for attempt in (lambda: next(idle), other.result):
            with pytest.raises(InputError, match="connect again"):
                attempt()


def test_a_slow_program_sees_the_newest_states(partner: RemotePartner, server: Server) -> None:
    """States waited for it, so that each was older than the one before."""

    def steps() -> int:
        return server.runner.snapshot.state.serial

    def behind() -> int:
        begin = steps()
        until(lambda: steps() > begin + 5)
        return steps() - next(states).serial

    with closing(partner.watch(50)) as states:
        assert min([behind() for _ in range(20)][15:]) < 20


def test_a_mistake_in_one_wish_loses_no_later_one(partner: RemotePartner) -> None:
    """The thread that sends wishes ended with a traceback, and nobody heard of the later ones."""
    partner.soon(partner.stimulate)
    partner.soon(partner.stimulate, Stimulus("surprise", 1.0))
    assert until(lambda: partner.state.felt is not None)


def test_what_was_sent_soon_arrives_before_the_end(server: Server) -> None:
    with miburi.connect(server.url) as partner:
        assert partner.soon(partner.stimulate, Stimulus("surprise", 1.0))
        assert partner.soon(partner.temperament, "calm")
    assert server.runner.snapshot.state.felt is not None
    assert server.runner.snapshot.state.temperament == "calm"


def test_nothing_is_accepted_after_the_end(server: Server) -> None:
    partner = miburi.connect(server.url)
    assert partner.soon(partner.close)
    with pytest.raises(InputError, match="closed"):
        while True:
            partner.soon(partner.stimulate, Stimulus("surprise", 1.0))


def test_what_was_not_sent_before_the_end_is_said(caplog: pytest.LogCaptureFixture) -> None:
    begun, over = threading.Event(), threading.Event()
    sender = Sender()
    for wish in (begun.set, over.wait, over.set, over.set):
        assert sender.send(wish)
    begun.wait()
    sender.close(patience=0.0)
    over.set()
    assert caplog.messages == ["not sent, because the partner took too long: the last 2 wishes"]


def test_a_wrong_address_is_said(tmp_path: Path) -> None:
    for url in ("127.0.0.1:8080", "http://127.0.0.1:8o80", "http://127.0.0.1:8080/api/v1"):
        with pytest.raises(InputError, match="http://"):
            miburi.connect(url)
    with (
        miburi.connect("http://127.0.0.1:9") as nobody,
        pytest.raises(ConnectionLostError, match="miburi run"),
    ):
        nobody.stop()


def test_stop_has_a_connection_of_its_own() -> None:
    """However many threads of a program wait for answers, its Stop does not."""
    busy, over = threading.Semaphore(0), asyncio.Event()
    app = FastAPI()

    @app.get("/api/v1/gestures")
    async def gestures() -> list[str]:
        busy.release()
        await over.wait()
        return []

    @app.post("/api/v1/stop", status_code=204)
    async def stop() -> None:
        over.set()

    with serving(app) as url, miburi.connect(url) as partner, ThreadPoolExecutor(110) as pool:
        asked = [pool.submit(partner.gestures) for _ in range(110)]
        for _ in range(100):  # as many connections as the client opens
            busy.acquire()
        partner.stop()
        assert [one.result() for one in asked] == [[]] * 110


def test_a_partner_with_feelings_of_its_own_is_understood(server: Server) -> None:
    """Whoever only looks on needs no file of its feelings."""
    state = get(server.url + "/api/v1/state").json()
    for level in ("emotion", "feeling", "mood", "face"):
        state[level].append(0.5)
    state["expressed"] = {"feeling": "pride", "mood": 0.5}
    gesture = get(server.url + "/api/v1/gestures").json()[0] | {"feeling": "pride"}
    app = FastAPI()
    app.get("/api/v1/state")(lambda: state)
    app.get("/api/v1/gestures")(lambda: [gesture])
    with serving(app) as url, miburi.connect(url) as partner:
        assert partner.state.expressed is not None
        assert (partner.state.expressed.feeling, partner.state.mood[8]) == ("pride", 0.5)
        assert partner.gestures()[0].feeling == "pride"


async def hear_one(url: str, token: str | None, authority: Path | None) -> None:
    async with (
        miburi.connect_async(url, token, authority) as partner,
        aclosing(partner.events("0")) as events,
    ):
        await anext(events)


@pytest.mark.parametrize("scheme", ["http", "https"])
def test_the_token_opens_the_door(live: Runner, certificates: Certificates, scheme: str) -> None:
    https = scheme == "https"
    gate = Gate(interface(live), keys("t" * 40), https=https)
    authority = certificates.authority if https else None
    with serving(gate, certificate=certificates.server if https else None) as url:
        with miburi.connect(url, "t" * 40 + "\n", authority) as friend:
            assert next(iter(friend.watch())).body == "simulated"
            friend.stop()  # answered as soon as it is done, a step before the state shows it
            until(lambda: friend.state.phase, "stopped".__eq__)
        for wrong in (None, "wrong"):
            with miburi.connect(url, wrong, authority) as stranger:
                for attempt in (
                    lambda: stranger.state,
                    lambda: next(stranger.watch()),
                    lambda: next(stranger.events("0")),
                ):
                    with pytest.raises(InputError, match="token.*QR code.*connect"):
                        attempt()
            with pytest.raises(InputError, match="token"):
                asyncio.run(hear_one(url, wrong, authority))


@pytest.mark.parametrize("token", ["two\nlines", "schlüssel"])
def test_a_token_that_no_header_can_carry_is_refused_and_not_repeated(token: str) -> None:
    for connect in (miburi.connect, miburi.connect_async):
        with pytest.raises(InputError, match="a token is one line") as refused:
            connect("http://127.0.0.1:9", token)
        assert token not in str(refused.value)


def test_a_program_whose_token_is_withdrawn_ends_at_once(live: Runner) -> None:
    """It tried again for a minute, and so was locked out for wrong tokens."""
    ours = keys("w" * 40)
    with serving(Gate(interface(live), ours)) as url, miburi.connect(url, "w" * 40) as friend:
        watching, hearing = friend.watch(), friend.events("0")
        next(watching)
        next(hearing)
        ours.forget()
        for following in (watching, hearing):
            with pytest.raises(InputError, match="withdrawn"):
                for _ in following:
                    pass


def test_without_the_authority_it_says_what_to_do(live: Runner, certificates: Certificates) -> None:
    gate = Gate(interface(live), keys("t" * 40), https=True)
    with serving(gate, certificate=certificates.server) as url:
        with miburi.connect(url, "t" * 40) as stranger:
            for attempt in (lambda: stranger.state, stranger.stop, lambda: next(stranger.watch())):
                with pytest.raises(ConnectionLostError, match="does not trust.*authority=FILE"):
                    attempt()
        with pytest.raises(ConnectionLostError, match="does not trust.*MIBURI_AUTHORITY"):
            asyncio.run(hear_one(url, "t" * 40, None))


@pytest.mark.parametrize("content", [None, "nonsense"])
def test_a_file_that_is_no_authority_is_said(tmp_path: Path, content: str | None) -> None:
    path = tmp_path / "ca.pem"
    if content:
        path.write_text(content)
    with pytest.raises(InputError, match="ca.pem: this is not an authority's certificate"):
        miburi.connect("https://127.0.0.1:8081", authority=path)


def test_two_threads_that_meet_in_a_socket_by_tls_are_no_lost_partner(
    live: Runner, certificates: Certificates, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As seen once: the first connection ended with "[SSL] internal error", and the program too."""
    left = [1]

    def fails(*where: Any, **how: Any) -> Any:
        if left[0]:
            left[0] -= 1
            raise ConnectionClosedError(None, None) from ssl.SSLError("internal error")
        return open_socket(*where, **how)

    monkeypatch.setattr("miburi.client.connection.open_socket", fails)
    gate = Gate(interface(live), keys("t" * 40), https=True)
    with (
        serving(gate, certificate=certificates.server) as url,
        miburi.connect(url, "t" * 40, certificates.authority) as friend,
    ):
        assert next(iter(friend.watch())).body == "simulated"
        left[0] = 1_000
        with pytest.raises(ConnectionLostError, match="does not answer"):
            next(iter(friend.watch(patience=0.0)))
    assert left == [999]
