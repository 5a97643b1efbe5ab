"""The WebSocket: states out, small commands in, and nothing that a viewer does harms others."""

import asyncio
import itertools
import json
import random
import socket
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import suppress
from threading import Event

import pytest
from tests.fixtures.live import Server, interface, serving
from tests.fixtures.waiting import PATIENCE
from tests.fixtures.waiting import until as until_true
from websockets.asyncio.client import ClientConnection as ClientConnectionAsync
from websockets.asyncio.client import connect as connect_async
from websockets.client import ClientProtocol
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.frames import Frame, Opcode
from websockets.sync.client import ClientConnection, connect
from websockets.uri import parse_uri

from miburi.interface.socket import LARGEST, MISTAKES
from miburi.live.runner import Runner
from miburi.live.state import State
from miburi.live.wishes import Pause
from miburi.serving.press import By


def address(server: Server, query: str = "") -> str:
    return "ws" + server.url.removeprefix("http") + "/api/v1/live" + query


def until(socket: ClientConnection, key: str) -> dict[str, object]:
    """The next message that has a key."""
    while True:
        message = json.loads(socket.recv(timeout=PATIENCE))
        if key in message:
            assert isinstance(message, dict)
            return message


def serials(server: Server, query: str, count: int) -> list[int]:
    """The numbers of the first states at a rate."""
    with connect(address(server, query)) as socket:
        states = [State.model_validate_json(socket.recv(timeout=PATIENCE)) for _ in range(count)]
    return [state.serial for state in states]


def test_states_come_in_order_at_the_rate_that_was_asked_for(server: Server) -> None:
    usual = serials(server, "", 10)
    assert usual == sorted(set(usual))
    until_true(lambda: server.runner.snapshot.serial > 50)
    begin = server.runner.snapshot.serial
    whole = serials(server, "?rate=50", 50)
    assert whole[0] >= begin, "it begins with an old one"
    assert whole == [*range(whole[0], whole[0] + 50)], "every step"
    assert min(b - a for a, b in itertools.pairwise(serials(server, "?rate=5", 3))) >= 3


RATES = ("0", "51", "nan", "inf", "x", "%F0%9F%A4%96" * 15)


@pytest.mark.parametrize(
    ("query", "allowed"),
    [
        *((f"rate={rate}", "0.1 to 50") for rate in RATES),
        ("events=nonsense", "BOOT:NUMBER"),
        ("nope=1", "it has rate, events"),
    ],
)
def test_a_viewer_with_a_wrong_query_is_refused_in_words(
    server: Server, query: str, allowed: str
) -> None:
    with connect(address(server, f"?{query}")) as socket:
        assert allowed in json.loads(socket.recv(timeout=PATIENCE))["refused"]
        with pytest.raises(ConnectionClosed) as closed:
            socket.recv(timeout=PATIENCE)
    assert closed.value.rcvd is not None
    assert (closed.value.rcvd.code, closed.value.rcvd.reason != "") == (1008, True)


def test_commands_are_obeyed(server: Server) -> None:
    with connect(address(server, "?rate=50")) as socket:

        def say(**command: object) -> None:
            socket.send(json.dumps(command))

        say(do="stop", by="program")
        while until(socket, "phase")["phase"] != "stopped":
            pass
        say(do="release")
        while until(socket, "phase")["phase"] == "stopped":
            pass
        say(do="hand", position=[0.1, -0.3, 0.1], along=[0, 0, 1])
        while not until(socket, "hand_out")["hand_out"]:
            pass
        say(do="hand", position=None)
        while until(socket, "hand_out")["hand_out"]:
            pass
        say(do="rate", rate=10)
        say(do="stimulus", feeling="fear", strength=0.9)
        while until(socket, "felt")["felt"] is None:
            pass
        say(do="stop", by="progam")  # a typing mistake: it stops as if a person had pressed
        assert "program" in str(until(socket, "refused")["refused"])
        while until(socket, "phase")["phase"] != "stopped":
            pass


def test_refusals_are_sent_and_repeated_mistakes_end_the_connection(server: Server) -> None:
    with connect(address(server)) as socket:
        for _ in range(MISTAKES + 5):
            socket.send(json.dumps({"do": "release"}))
            assert "only a stopped body" in str(until(socket, "refused")["refused"])
        with pytest.raises(ConnectionClosed) as closed:
            for _ in range(MISTAKES + 2):
                socket.send("nonsense")
                until(socket, "refused")
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1008
    with connect(address(server)) as socket, pytest.raises(ConnectionClosed):
        socket.send("x" * 200_000)
        while True:
            socket.recv(timeout=PATIENCE)


@pytest.fixture
def still(runner: Runner, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Server, Event]]:
    """A partner whose time stands still, and commands wait; tells when a Stop comes."""
    pressed, stop = Event(), runner.stop

    def press(by: By) -> Future[None]:
        answer = stop(by)
        pressed.set()
        return answer

    monkeypatch.setattr(runner, "stop", press)
    with serving(interface(runner)) as url:
        yield Server(url, runner), pressed
    runner.close(patience=0.0)


#: Each is a Stop, whatever else is in it.
STOPS = [
    '{"do":"stop","by":null}', '{"do":"stop","source":"big red button"}', '{"do":"\\u0073top"}',
    '{"do":"stop","press":12,"by":["program"]}', '{"do":"stop","by":"\\ud800"}',
    '{"do":"stop","log":"' + "x" * LARGEST + '"}',
]  # fmt: skip


@pytest.mark.parametrize("text", STOPS)
def test_a_stop_is_obeyed_whatever_comes_with_it(still: tuple[Server, Event], text: str) -> None:
    server, pressed = still
    with connect(address(server)) as socket:
        socket.send(text)
        assert pressed.wait(PATIENCE)


def test_a_flood_holds_up_its_sender_alone(still: tuple[Server, Event]) -> None:
    server, pressed = still
    with connect(address(server, "?rate=1")) as flood, connect(address(server)) as other:
        for _ in range(500):
            flood.send(json.dumps({"do": "stimulus", "feeling": "fear", "strength": 0.0}))
        other.send(json.dumps({"do": "stop"}))
        assert pressed.wait(PATIENCE), "it waits for commands that are not answered"
        server.runner.tick()
        assert server.runner.snapshot.state.phase == "stopped"


def test_stop_overtakes_the_flood_of_its_own_sender(still: tuple[Server, Event]) -> None:
    server, pressed = still
    with connect(address(server)) as flood:
        for _ in range(500):
            flood.send(json.dumps({"do": "stimulus", "feeling": "fear", "strength": 0.0}))
        flood.send(json.dumps({"do": "release"}))
        flood.send(json.dumps({"do": "stop"}))
        assert pressed.wait(PATIENCE), "it waits for commands that are not answered"
        server.runner.start()
        heard = ""
        while '"phase":"stopped"' not in heard:
            heard += str(flood.recv(timeout=PATIENCE))
        # These may come after the Stop that overtook the commands.
        while not ("too many commands" in heard and "Stop cancelled waiting commands" in heard):
            heard += str(flood.recv(timeout=PATIENCE))
        server.runner.ask(Pause(True)).result(PATIENCE)
        assert server.runner.snapshot.state.phase == "stopped"


BAD = [
    "", "x", "[]", "null", "{}", '{"do":1}', '{"do":"dance"}', '{"do":"rate","rate":0}',
    '{"do":"rate","rate":1e999}', '{"do":"rate","rate":NaN}',
    '{"do":"hand"}', '{"do":"hand","position":[0,0]}', '{"do":"hand","position":[0,0,"0"]}',
    '{"do":"hand","position":[9,9,9]}', '{"do":"hand","position":[NaN,0,0]}',
    '{"do":"hand","position":[0,0,0],"along":[0,0,0]}', '{"do":"stimulus","feeling":"x"}',
    '{"do":"stimulus","feeling":"fear","strength":-1}', '{"do":"rule","ratio":0}',
    '{"do":"stop"', "[" * 900, '{"a":' * 300, "\ud7ff\U0001f916", "x" * (LARGEST + 1),
    b"", b"\x00\xff" * 50, b'{"do":"stop"}',
]  # fmt: skip


def test_hundreds_of_bad_messages_change_nothing(server: Server) -> None:
    rng = random.Random(1)
    before = server.runner.snapshot.state

    async def pester() -> int:
        sent = 0
        while sent < 500:
            async with connect_async(address(server, "?rate=0.1"), max_queue=None) as socket:
                for _ in range(MISTAKES + 1):
                    bad = rng.choice(BAD)
                    if rng.random() < 0.3 and isinstance(bad, str):
                        bad = "".join(rng.choice((c, c, c, "\x00", "9", "}")) for c in bad[:200])
                        bad = bad.replace('"stop"', '"stopp"')
                    await socket.send(bad)
                    sent += 1
        return sent

    assert asyncio.run(pester()) >= 500
    with connect(address(server)) as socket:
        state = State.model_validate_json(socket.recv(timeout=PATIENCE))
    assert state.serial > before.serial
    assert state.phase != "stopped"
    assert {entry.kind for entry in server.runner.history.after(0)} <= {
        "started",
        "stimulus",
        "gesture_begun",
        "gesture_ended",
    }


def deaf_viewer(server: Server) -> tuple[socket.socket, ClientProtocol]:
    """A viewer that reads only when the test does."""
    raw = socket.create_connection(("127.0.0.1", int(server.url.rsplit(":", 1)[1])))
    viewer = ClientProtocol(parse_uri(address(server, "?rate=30")))
    viewer.send_request(viewer.connect())
    raw.sendall(b"".join(viewer.data_to_send()))
    return raw, viewer


def test_a_viewer_that_read_nothing_for_a_while_gets_what_is_new(server: Server) -> None:
    """It was sent everything, as long as the kernels' buffers had room: that was for minutes."""
    raw, viewer = deaf_viewer(server)
    with raw:
        begin = server.runner.snapshot.state.serial
        until_true(lambda: server.runner.snapshot.state.serial > begin + 125)
        seen: list[int] = []
        while not seen or seen[-1] < begin + 125:
            viewer.receive_data(raw.recv(65_536))
            raw.sendall(b"".join(viewer.data_to_send()))
            seen += [
                State.model_validate_json(frame.data).serial
                for frame in viewer.events_received()
                if isinstance(frame, Frame) and frame.opcode is Opcode.TEXT
            ]
    assert max(b - a for a, b in itertools.pairwise(seen)) > 25, "it misses those between"


def test_a_viewer_that_reads_nothing_is_dropped(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("miburi.interface.socket.PATIENCE", 0.2)
    monkeypatch.setattr("miburi.serving.access.SOCKETS", 1)
    raw, _ = deaf_viewer(server)

    def there_is_room() -> bool:
        with suppress(InvalidStatus), connect(address(server)):
            return True
        return False

    with raw:
        until_true(lambda: not there_is_room())
        until_true(there_is_room)


def test_viewers_that_are_deaf_or_dead_harm_no_other(server: Server) -> None:
    """Some never read, some vanish without a word: the others get their states all the same."""
    deaf = [deaf_viewer(server)[0] for _ in range(5)]

    async def watch() -> list[int]:
        sockets = [await connect_async(address(server, "?rate=10")) for _ in range(20)]
        for dying in sockets[:5]:
            dying.transport.abort()

        async def states(viewer: ClientConnectionAsync) -> int:
            serials = [json.loads(await viewer.recv())["serial"] for _ in range(10)]
            return len(set(serials))

        seen = await asyncio.gather(*(states(viewer) for viewer in sockets[5:]))
        await asyncio.gather(*(viewer.close() for viewer in sockets[5:]))
        return list(seen)

    before = server.runner.snapshot.state.serial
    assert asyncio.run(watch()) == [10] * 15
    assert server.runner.snapshot.state.serial > before + 10
    for raw in deaf:
        raw.close()
