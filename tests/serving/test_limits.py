"""How much the gate lets through, and that a Stop is never held up."""

import asyncio
import itertools
from typing import Any

import pytest
from tests.fixtures.gate import TOKEN, Clock, ask, behind
from tests.fixtures.keys import keys

from miburi.serving.access import (
    AGENTS,
    BURST,
    LARGEST,
    PAGE_BURST,
    RATE,
    SOCKETS,
    STOP,
    WRONG_BURST,
    Gate,
)
from miburi.serving.allowance import Allowance


def test_many_calls_of_agents_wait_instead_of_being_refused() -> None:
    ticks = itertools.count()
    gate = Gate(behind, clock=lambda: next(ticks) / RATE / 3)
    answers = [ask(gate, AGENTS, method="POST")[0] for _ in range(int(BURST * 1.5) + 5)]
    assert set(answers) == {200}
    assert next(ticks) > len(answers) + 5  # some have waited


def exhausted(**headers: str) -> Gate:
    """A gate at which this computer's agents have used all their calls, and time stands still."""
    gate = Gate(behind, keys(TOKEN), clock=lambda: 0.0)
    allowed = {"authorization": f"Bearer {TOKEN}", **headers}
    for _ in range(int(BURST)):
        assert ask(gate, AGENTS, method="POST", **allowed)[0] == 200
    return gate


def waits(gate: Gate, client: str = "127.0.0.1", **headers: str) -> bool:
    """Whether a call of an agent at ``client`` has to wait."""
    headers = {"host": "here", "authorization": f"Bearer {TOKEN}", **headers}
    scope = {
        "type": "http",
        "path": AGENTS,
        "method": "POST",
        "client": (client, 5000),
        "headers": [(k.replace("_", "-").encode(), v.encode()) for k, v in headers.items()],
    }

    async def receive() -> Any:
        return {"type": "http.request", "body": b""}

    async def send(_: Any) -> None:
        pass

    async def turns() -> bool:
        first = asyncio.create_task(gate({**scope, "client": ("127.0.0.1", 1)}, receive, send))
        call = asyncio.create_task(gate(scope, receive, send))
        for _ in range(20):
            await asyncio.sleep(0)
        done = call.done()
        if done:
            call.result()
        first.cancel()
        call.cancel()
        await asyncio.gather(first, call, return_exceptions=True)
        return not done

    return asyncio.run(turns())


def test_an_agents_stop_waits_for_nothing() -> None:
    stop = {
        "mcp_protocol_version": "2026-07-28",
        "mcp_method": "tools/call",
        "mcp_name": "stop",
    }
    assert not waits(exhausted(), **stop)
    # What the server does not hold against the body of the call opens no lane.
    for other in ({"mcp_name": "say"}, {"mcp_method": "tools/get"}, {"mcp_protocol_version": ""}):
        assert waits(exhausted(), **{**stop, **other})


def test_a_list_of_tools_waits_for_other_lists_alone() -> None:
    """A client asks for it before its first Stop."""
    ask_for = {"mcp_protocol_version": "2026-07-28", "mcp_method": "tools/list"}
    assert not waits(exhausted(), **ask_for)
    assert waits(exhausted(**ask_for), **ask_for)
    assert not waits(exhausted(**ask_for))


def test_an_agent_that_calls_too_often_holds_up_itself_alone() -> None:
    assert waits(exhausted())
    assert not waits(exhausted(), client="192.168.1.7")


def test_wrong_tokens_are_counted() -> None:
    clock = Clock()
    gate = Gate(behind, keys(TOKEN), clock)
    answers = [ask(gate, authorization="Bearer wrong")[0] for _ in range(int(WRONG_BURST) + 3)]
    assert answers == [401] * int(WRONG_BURST) + [429] * 3
    assert ask(gate, authorization=f"Bearer {TOKEN}")[0] == 200
    clock.now = 60.0
    assert ask(gate, authorization="Bearer wrong")[0] == 401


def test_too_many_requests_are_refused_and_come_back() -> None:
    clock = Clock()
    gate = Gate(behind, clock=clock)
    answers = [ask(gate)[0] for _ in range(int(BURST) + 5)]
    assert answers == [200] * int(BURST) + [429] * 5
    assert ask(gate, "/static/face.js")[0] == 200
    clock.now = 1.0
    assert [ask(gate)[0] for _ in range(int(RATE) + 1)] == [200] * int(RATE) + [429]


@pytest.mark.parametrize(("token", "scheme"), [(None, "http"), (TOKEN, "http"), (TOKEN, "https")])
def test_stop_is_never_refused_to_its_users(token: str | None, scheme: str) -> None:
    gate = Gate(behind, token and keys(token), Clock(), https=scheme == "https")
    mine = {"scheme": scheme, **({"authorization": f"Bearer {token}"} if token else {})}
    while ask(gate, **mine)[0] == 200:
        pass
    while token and ask(gate, scheme=scheme, authorization="Bearer wrong")[0] != 429:
        pass
    assert {ask(gate, STOP, method="POST", **mine)[0] for _ in range(1000)} == {200}
    assert ask(gate, STOP, method="POST", content_length=str(LARGEST + 1), **mine)[0] == 200
    assert ask(gate, STOP, **mine)[0] == 429  # a page elsewhere can send no POST of ours, but GETs
    assert ask(gate, STOP, method="POST", origin="https://evil.example", **mine)[0] == 403
    if token:
        assert ask(gate, STOP, method="POST", scheme=scheme)[0] == 401


def test_refused_requests_use_up_no_allowance() -> None:
    gate = Gate(behind, clock=Clock())
    for _ in range(2 * int(BURST)):
        assert ask(gate, sec_fetch_site="cross-site")[0] == 403
    assert ask(gate)[0] == 200


def test_pages_are_made_one_at_a_time_and_a_stop_waits_for_one_at_most() -> None:
    told: list[str] = []

    async def app(scope: Any, receive: Any, send: Any) -> None:
        told.append(f"begin {scope['path']}")
        for _ in range(5):
            await asyncio.sleep(0)
        told.append(f"end {scope['path']}")
        await behind(scope, receive, send)

    async def flood() -> None:
        gate = Gate(app)

        async def receive() -> Any:
            return {"type": "http.request"}

        async def send(message: Any) -> None:
            pass

        def asked(path: str) -> Any:
            headers = [(b"host", b"localhost")]
            scope = {"type": "http", "method": "POST", "path": path, "headers": headers}
            return asyncio.create_task(gate(scope, receive, send))

        await asyncio.gather(*[asked("/") for _ in range(4)], asked(STOP))

    asyncio.run(flood())
    pages = [words for words in told if words.endswith(" /")]
    assert pages == ["begin /", "end /"] * 4
    assert told.index(f"end {STOP}") <= 3


def test_only_so_many_pages_are_made_and_they_come_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """A page costs the server a hundred times what a state does."""
    monkeypatch.setattr("miburi.serving.access.PAGE_BREATH", 0.0)
    clock = Clock()
    gate = Gate(behind, clock=clock)
    for path in ("/", "/face"):
        answers = [ask(gate, path)[0] for _ in range(int(PAGE_BURST) + 5)]
        assert answers == [200] * int(PAGE_BURST) + [429] * 5
        assert ask(gate)[0] == 200
        clock.now += 100.0


def test_large_requests_are_refused_whether_they_say_so_or_not() -> None:
    gate = Gate(behind)
    assert ask(gate, content_length=str(LARGEST))[0] == 200
    assert ask(gate, content_length=str(LARGEST + 1))[0] == 413
    assert ask(gate, body=[b"x" * (LARGEST // 2), b"x" * (LARGEST // 2)])[0] == 200
    assert ask(gate, body=[b"x" * (LARGEST // 2), b"x" * (LARGEST // 2), b"x"])[0] == 413


def test_only_so_many_sockets_are_open() -> None:
    async def forever(scope: Any, receive: Any, send: Any) -> None:
        await asyncio.sleep(3600)

    async def fill() -> None:
        gate = Gate(forever)
        scope = {"type": "websocket", "path": "/x", "headers": [(b"host", b"localhost")]}
        tasks = [asyncio.create_task(gate(scope, None, None)) for _ in range(SOCKETS)]
        await asyncio.sleep(0)
        sent: list[Any] = []

        async def receive() -> Any:
            return {"type": "websocket.connect"}

        async def send(message: Any) -> None:
            sent.append(message)

        await gate(scope, receive, send)
        assert sent[0]["type"] == "websocket.close"
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        sent.clear()
        again = [asyncio.create_task(gate(scope, receive, send)) for _ in range(SOCKETS)]
        await asyncio.sleep(0)
        assert sent == [], "each that went has left its place"
        for task in again:
            task.cancel()
        await asyncio.gather(*again, return_exceptions=True)

    asyncio.run(fill())


def test_an_allowance_never_holds_more_than_its_burst() -> None:
    clock = Clock()
    allowance = Allowance(1.0, 3.0, clock)
    clock.now = 1e6
    assert [allowance.take("a") for _ in range(4)] == [True, True, True, False]
    assert allowance.take("b")
    clock.now += 1.0
    assert [allowance.take("a") for _ in range(2)] == [True, False]
