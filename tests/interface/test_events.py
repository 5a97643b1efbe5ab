"""Events at the doors: the list, the stream, the WebSocket, and both clients."""

import asyncio
import itertools
import json
from collections.abc import Iterator
from contextlib import aclosing, closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx
import pytest
from tests.fixtures.live import PATIENT, Server, interface, serving
from tests.fixtures.waiting import get, post, until
from websockets.sync.client import connect as open_socket

import miburi
from miburi.client.sending import WAITING
from miburi.errors import BodyError, InputError
from miburi.feelings import EmotionalModel, Expression, Stimulus
from miburi.gestures.movement import Posture
from miburi.live.events.event import EndOfWish, LiveEvent
from miburi.live.events.store import kept_events
from miburi.live.recording.archive import Archive
from miburi.live.runner import Runner
from miburi.live.wishes import Release
from miburi.robot import Robot
from miburi.wire.messages import GestureAct, PosesAct, PosesIn, SpeechAct

LIMIT = 30.0
RAISED = Posture(phase=0.5, right=[0.7, 0.5, 0.3], left=[0.7, 0.5, 0.3], head=[0.6, 0.3, 0.74])
ARMS_APART = PosesIn(pose=[RAISED], duration=2.0)


def streamed(url: str, query: str = "", **headers: str) -> Iterator[dict[str, str]]:
    """Yield the events of a stream, as any reader of server-sent events takes them."""
    told = f"{url}/api/v1/events{query}"
    with httpx.stream("GET", told, headers=headers, timeout=LIMIT, verify=False) as it:
        assert it.headers["content-type"].startswith("text/event-stream")
        fields: dict[str, str] = {}
        for line in it.iter_lines():
            if not line and "data" in fields:
                yield fields
                fields = {}
            name, _, value = line.partition(": ")
            fields[name] = value


def test_a_stream_sends_each_event_and_a_reader_that_returns_misses_none(
    server: Server,
) -> None:
    with closing(streamed(server.url, "?after=0")) as events, miburi.connect(server.url) as partner:
        first = next(events)
        told = json.loads(first["data"])
        assert (told["kind"], first["id"]) == ("started", f"{told['boot']}:{told['number']}")
        assert told["wall"].endswith("+00:00")
        partner.stimulate(Stimulus("happiness", 0.5))
        last = partner.state.cursor
        partner.stop()
        stop = next(one for one in (json.loads(e["data"]) for e in events) if one.get("stop"))
        assert (stop["kind"], stop["stop"]["reason"]) == ("stop", "asked")
    for query, headers in (
        (f"?after={last}&kinds=stop", {}),
        ("?kinds=stop", {"Last-Event-ID": last}),
    ):
        with closing(streamed(server.url, query, **headers)) as events:
            assert json.loads(next(events)["data"])["kind"] == "stop"
    for query in ("after=x", "after=-1", "kinds=explosion", "after=5f2c9a10:"):
        answer = get(f"{server.url}/api/v1/events?{query}")
        assert answer.status_code == 400
        assert answer.json()["detail"]
        assert answer.headers["connection"] == "close", "nothing may follow on that connection"


def test_the_socket_tells_events_beside_its_states(server: Server) -> None:
    address = server.url.replace("http", "ws") + "/api/v1/live?rate=10&events="
    with open_socket(address + "0") as socket:
        told: dict[str, Any] = {}
        while not {"serial", "event"} <= told.keys():
            told = json.loads(socket.recv(LIMIT)) | told
    assert told["event"]["kind"] == "started"


def awake(robot: Robot, folder: Path, boot: str) -> Runner:
    store = kept_events(folder)
    runner = Runner(
        robot, EmotionalModel(), Archive(folder), lateness=PATIENT, events=store, boot=boot
    )
    runner.start()
    return runner


def test_over_a_restart_the_clients_come_back_and_miss_nothing(
    robot: Robot, tmp_path: Path
) -> None:
    """The logger of an earlier version kept the number 26, and heard none of three stops."""
    runner = awake(robot, tmp_path, "00000001")
    with serving(interface(runner)) as url:
        port = int(url.rsplit(":", 1)[1])
        partner = miburi.connect(url)
        events, states = partner.events(patience=LIMIT), partner.watch(50, patience=LIMIT)
        next(states)
        partner.stop()
        heard = [next(event.id for event in events if event.kind == "stop")]
        runner.ask(Release(by_person=True)).result(LIMIT)
    runner.close(patience=0.0)
    runner = awake(robot, tmp_path, "00000002")
    runner.stop().result(LIMIT)
    until(lambda: runner.snapshot.state.stop)
    with serving(interface(runner), port=port):
        heard += [next(event.id for event in events if event.kind == "stop")]
        assert next(state.boot for state in states if state.boot != "00000001") == "00000002"
        events.close()
        states.close()
    runner.close(patience=0.0)
    partner.close()
    assert [one.partition(":")[0] for one in heard] == ["00000001", "00000002"]


def test_a_program_can_wait_for_the_end_of_what_it_asked_for(server: Server) -> None:
    with miburi.connect(server.url) as partner, closing(partner.events()) as events:
        assert partner.until_ended(partner.speak("Hello.")).kind == "speech_ended"
        wish = partner.perform(
            GestureAct(do="gesture", feeling="happiness", mood=0.3),
            SpeechAct(do="speech", text="Look!", offset=0.2),
            PosesAct(do="poses", **ARMS_APART.model_dump()),
            now=True,
        )
        assert partner.until_ended(wish).kind == "performance_ended"
        ours = (event.kind for event in events if event.wish == wish)
        kinds = [*itertools.takewhile("performance_ended".__ne__, ours)]
        assert kinds[0] == "performance_begun"
        assert kinds.count("gesture_ended") == 2
        assert "speech_begun" in kinds
        wish = partner.express(Expression("fear", 0.3))
        partner.stop()
        assert partner.until_ended(wish).kind in ("gesture_broken_off", "wish_dropped")
        asked = next(event for event in partner.log() if event.id == wish)
        with pytest.raises(BodyError, match="still stopped"):
            partner.wait(timeout=0.0)
        felt = partner.stimulate(Stimulus("fear", 0.1))
        for other, words in ((felt, "kind stimulus"), (wish.split(":")[0] + ":9999", "not exist")):
            with pytest.raises(InputError, match=words):
                partner.until_ended(other)
    assert asked.by == "program"


def test_events_say_who_asked(server: Server) -> None:
    with miburi.connect(server.url) as partner:
        partner.sense("stroke")
        partner.pause()
        partner.pause(False)
        kinds = ("stimulus", "paused", "resumed")
        told = [(event.kind, event.by) for event in partner.log() if event.kind in kinds]
    assert told == [(kind, "program") for kind in kinds]


def test_the_end_of_a_wish_is_unknown_after_a_new_start() -> None:
    wish = EndOfWish("5f2c9a10:7")
    about = {"number": 9, "wall": datetime.now(UTC), "time": 0.0, "kind": "started"}
    with pytest.raises(miburi.MiburiError, match="unknown"):
        wish.is_in(LiveEvent.model_validate({"boot": "00000001", **about}))
    with pytest.raises(miburi.MiburiError, match="unknown"):
        wish.is_in(LiveEvent.model_validate({**about, "boot": "5f2c9a10", "kind": "gap"}))
    with pytest.raises(InputError, match="BOOT:NUMBER"):
        EndOfWish("7")


def test_key_poses_that_the_robot_cannot_do_are_refused(server: Server) -> None:
    changes: list[tuple[dict[str, list[float]], str]] = [
        ({"head": [-0.9, 0.1, 0.3]}, "head .* may turn by"),
        ({"right": [-0.6, -0.75, 0.0]}, "out of reach"),
        ({"right": [0.6, -0.7, 0.1], "left": [0.6, -0.7, 0.1]}, "would meet|out of reach"),
    ]
    repeated = [RAISED.model_copy(update={"phase": 0.2, "until": 0.4}), RAISED]
    slow = {"repeat": {"first": 1, "last": 2, "times": 8, "back": 0.5}, "duration": 20.0}
    wrong = [({"pose": [RAISED.model_copy(update=change)]}, why) for change, why in changes]
    with miburi.connect(server.url) as partner:
        for change, why in (*wrong, ({"pose": repeated, **slow}, "at most 30 s")):
            poses = ARMS_APART.model_dump() | change
            poses["pose"] = [pose.model_dump() for pose in change["pose"]]
            with pytest.raises(InputError, match=why):
                partner.poses(PosesIn.model_validate(poses))


def test_words_are_told_only_if_the_user_allows(server: Server) -> None:
    with miburi.connect(server.url) as partner:
        partner.say("My marmalade makes me sad")
        post(f"{server.url}/api/v1/words", json={"allowed": True}).raise_for_status()
        partner.say("My hyacinth makes me sad")
        post(f"{server.url}/api/v1/words", json={"allowed": False}).raise_for_status()
        said = str(partner.log())
        assert "marmalade" not in said
        assert "hyacinth" not in said
        assert [event.by for event in partner.log() if event.kind == "heard"] == ["program"] * 2
        post(f"{server.url}/api/v1/words", json={"allowed": True}).raise_for_status()
        said = str(partner.log())
        assert "sad'" not in said, "allowed again, what was said before stays untold"
        assert "hyacinth" not in said


def test_a_client_never_waits_without_a_word(server: Server) -> None:
    with miburi.connect(server.url) as partner:
        with pytest.raises(miburi.MiburiError):
            next(partner.events(after="nonsense"))
        taken = [partner.soon(partner.stimulate, Stimulus("fear", 0.01)) for _ in range(200)]
        assert taken[:WAITING] == [True] * WAITING
        assert not all(taken), "more than a few are left out"
        until(lambda: sum(e.kind == "stimulus" for e in partner.log()) == sum(taken))
    with miburi.connect("http://127.0.0.1:9") as nobody, pytest.raises(miburi.MiburiError):
        next(nobody.events(after="1"))


def test_an_asynchronous_program_asks_and_hears(server: Server) -> None:
    async def work() -> None:
        async with miburi.connect_async(server.url) as partner:
            wish = await partner.express(Expression("surprise", 0.6), blend={"thrill": 0.2})
            assert (await partner.until_ended(wish)).kind == "gesture_ended"
            await partner.stop()
            async with aclosing(partner.events(wish)) as events:
                async for event in events:  # a Stop is answered before the state shows it
                    if event.kind == "stop":
                        break
            await partner.release()

    asyncio.run(work())
