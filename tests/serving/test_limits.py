"""How much the gate lets through, and that a Stop is never held up."""

import asyncio
import itertools
from typing import Any

import pytest
from tests.fixtures.gate import TOKEN, Clock, ask, behind, receive, scope_of, send
from tests.fixtures.keys import keys

from miburi.serving.access import (
    AGENTS,
    BURST,
    LARGEST,
    PAGE_BURST,
    PAGE_RATE,
    RATE,
    SOCKETS,
    STOP,
    WRONG_BURST,
    WRONG_RATE,
    Gate,
)
from miburi.serving.allowance import Allowance
from miburi.serving.files import for_connections, lasting_of

STATE = "/api/v1/state"
MINE = {"authorization": f"Bearer {TOKEN}"}
HERE, THERE = "127.0.0.1", "192.168.1.7"
#: Headers of an agent's calls.
STOPPING = {"mcp_protocol_version": "2026-07-28", "mcp_method": "tools/call", "mcp_name": "stop"}
LISTING = {"mcp_protocol_version": "2026-07-28", "mcp_method": "tools/list"}


def test_many_calls_of_agents_wait_instead_of_being_refused() -> None:
    ticks = itertools.count()
    gate = Gate(behind, clock=lambda: next(ticks) / RATE / 3)
    answers = [ask(gate, AGENTS, method="POST")[0] for _ in range(int(BURST * 1.5) + 5)]
    assert set(answers) == {200}
    assert next(ticks) > len(answers) + 5  # some have waited


@pytest.mark.parametrize(
    ("used_up", "call", "client", "waits"),
    [
        ({}, {}, HERE, True),
        ({}, {}, THERE, False),  # one client's calls delay only that client
        ({}, STOPPING, HERE, False),
        # Headers that the server does not check against the call's body open no lane.
        ({}, STOPPING | {"mcp_name": "say"}, HERE, True),
        ({}, STOPPING | {"mcp_method": "tools/get"}, HERE, True),
        ({}, STOPPING | {"mcp_protocol_version": ""}, HERE, True),
        # A client asks for the list of tools before its first Stop.
        ({}, LISTING, HERE, False),
        (LISTING, LISTING, HERE, True),
        (LISTING, {}, HERE, False),
    ],
)
def test_an_agents_call_waits_for_calls_of_its_kind_and_a_stop_for_nothing(
    used_up: dict[str, str], call: dict[str, str], client: str, waits: bool
) -> None:
    gate = Gate(behind, keys(TOKEN), clock=lambda: 0.0)  # time stands still
    for _ in range(int(BURST)):
        assert ask(gate, AGENTS, method="POST", **MINE, **used_up)[0] == 200
    scope = scope_of(AGENTS, method="POST", **MINE, **call)

    async def is_done() -> bool:
        calls = [
            asyncio.create_task(gate({**scope, "client": (who, 1)}, receive, send))
            for who in (HERE, client)
        ]
        for _ in range(20):
            await asyncio.sleep(0)
        done = calls[1].done() and calls[1].result() is None
        for one in calls:
            one.cancel()
        await asyncio.gather(*calls, return_exceptions=True)
        return done

    assert asyncio.run(is_done()) is not waits


@pytest.mark.parametrize(
    ("path", "token", "rate", "burst", "answer", "other"),
    [
        (STATE, TOKEN, RATE, BURST, 200, "/static/face.js"),
        (STATE, "wrong", WRONG_RATE, WRONG_BURST, 401, STATE),
        # A page costs the server a hundred times what a state does.
        ("/", TOKEN, PAGE_RATE, PAGE_BURST, 200, STATE),
        ("/face", TOKEN, PAGE_RATE, PAGE_BURST, 200, STATE),
    ],
)
def test_too_frequent_requests_are_refused_for_a_while(
    monkeypatch: pytest.MonkeyPatch,
    path: str,
    token: str,
    rate: float,
    burst: float,
    answer: int,
    other: str,
) -> None:
    monkeypatch.setattr("miburi.serving.access.PAGE_BREATH", 0.0)
    clock = Clock()
    gate = Gate(behind, keys(TOKEN), clock)

    def answers(count: float) -> list[int]:
        return [ask(gate, path, authorization=f"Bearer {token}")[0] for _ in range(int(count))]

    assert answers(burst + 3) == [answer] * int(burst) + [429] * 3
    assert ask(gate, other, **MINE)[0] == 200
    clock.now = 2.01 / rate
    assert answers(3) == [answer, answer, 429]


def test_wrong_tokens_are_logged_once_a_minute_and_never_shown(
    caplog: pytest.LogCaptureFixture,
) -> None:
    clock = Clock()
    gate = Gate(behind, keys(TOKEN), clock)
    for minute in (0.0, 61.0):
        clock.now = minute
        for client in (HERE, THERE):
            for _ in range(int(WRONG_BURST) + 3):
                ask(gate, client=(client, 5000), authorization="Bearer guessed")
    assert ask(gate)[0] == 401  # without a token, as a new browser
    assert ask(gate, **MINE)[0] == 200
    assert caplog.messages == [
        f"requests with a wrong token from {who}: {count}"
        for count in (1, int(WRONG_BURST) + 3)
        for who in (HERE, THERE)
    ]


@pytest.mark.parametrize(("token", "scheme"), [(None, "http"), (TOKEN, "http"), (TOKEN, "https")])
def test_stop_is_never_refused_to_its_users(token: str | None, scheme: str) -> None:
    gate = Gate(behind, token and keys(token), Clock(), https=scheme == "https")
    mine = {"scheme": scheme, **(MINE if token else {})}
    while ask(gate, **mine)[0] == 200:
        pass
    while token and ask(gate, scheme=scheme, authorization="Bearer wrong")[0] != 429:
        pass
    assert {ask(gate, STOP, method="POST", **mine)[0] for _ in range(2 * int(BURST))} == {200}
    assert ask(gate, STOP, method="POST", content_length=str(LARGEST + 1), **mine)[0] == 200
    assert ask(gate, STOP, **mine)[0] == 429  # a page elsewhere can send no POST of ours, but GETs
    assert ask(gate, STOP, method="POST", origin="https://evil.example", **mine)[0] == 403
    if token:
        assert ask(gate, STOP, method="POST", scheme=scheme)[0] == 401


def test_refused_requests_use_up_no_allowance() -> None:
    gate = Gate(behind, clock=Clock())
    for _ in range(int(BURST) + 1):
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

        def asked(path: str) -> Any:
            return asyncio.create_task(gate(scope_of(path, method="POST"), receive, send))

        await asyncio.gather(*[asked("/") for _ in range(4)], asked(STOP))

    asyncio.run(flood())
    pages = [words for words in told if words.endswith(" /")]
    assert pages == ["begin /", "end /"] * 4
    assert told.index(f"end {STOP}") <= 3


def test_large_requests_are_refused_whether_they_say_so_or_not() -> None:
    gate, half = Gate(behind), b"x" * (LARGEST // 2)
    assert ask(gate, content_length=str(LARGEST))[0] == 200
    assert ask(gate, content_length=str(LARGEST + 1))[0] == 413
    assert ask(gate, body=[half, half])[0] == 200
    assert ask(gate, body=[half, half, b"x"])[0] == 413


def test_only_so_many_sockets_are_open() -> None:
    sent: list[Any] = []

    async def forever(scope: Any, receive: Any, send: Any) -> None:
        await asyncio.Event().wait()

    async def tell(message: Any) -> None:
        sent.append(message)

    async def fill() -> None:
        gate = Gate(forever)
        scope = scope_of("/x", kind="websocket")
        most = min(SOCKETS, lasting_of(for_connections()))
        for _ in range(2):  # a WebSocket that ends frees its place
            tasks = [asyncio.create_task(gate(scope, receive, tell)) for _ in range(most)]
            await asyncio.sleep(0)
            assert sent == []
            await gate(scope, receive, tell)
            start, _ = sent
            assert (start["type"], start["status"]) == ("websocket.http.response.start", 503)
            sent.clear()
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    asyncio.run(fill())


def test_an_allowance_never_holds_more_than_its_burst() -> None:
    clock = Clock()
    allowance = Allowance(1.0, 3.0, clock)
    clock.now = 1e6
    assert [allowance.take("a") for _ in range(4)] == [True, True, True, False]
    assert allowance.take("b")
    clock.now += 1.0
    assert [allowance.take("a") for _ in range(2)] == [True, False]
