"""The gate, asked by hand: what passes, and with which words the rest does not."""

import asyncio
import itertools
import json
from collections.abc import Iterable
from typing import Any

import httpx
import pytest
from tests.fixtures.keys import keys

from miburi.errors import InputError
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
from miburi.serving.heads import is_loopback
from miburi.serving.keys import Keys
from miburi.serving.origins import check_origin

TOKEN = "a-token-of-at-least-thirty-two-letters"
PHONE = keys(TOKEN).pair("iPhone")


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


async def behind(scope: Any, receive: Any, send: Any) -> None:
    """What the gate guards: reads everything, answers 200 or accepts."""
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.accept"})
        return
    more = True
    while more:
        more = (await receive()).get("more_body", False)
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"behind"})


def ask(
    gate: Gate,
    path: str = "/api/v1/state",
    *,
    kind: str = "http",
    method: str = "GET",
    body: Iterable[bytes] = (b"",),
    scheme: str = "http",
    at: str = "127.0.0.1",
    **headers: str,
) -> tuple[Any, str]:
    """Return the status (or the WebSocket's answer) and the words."""
    headers = {"host": "127.0.0.1:8080", **headers}
    scope = {
        "type": kind,
        "scheme": scheme if kind == "http" else scheme.replace("http", "ws"),
        "server": (at, 8080),
        "path": path,
        "method": method,
        "client": ("127.0.0.1", 5000),
        "headers": [(k.replace("_", "-").encode(), v.encode()) for k, v in headers.items()],
    }
    parts = list(body)
    incoming = [
        {"type": "http.request", "body": part, "more_body": i + 1 < len(parts)}
        for i, part in enumerate(parts)
    ]
    if kind == "websocket":
        incoming = [{"type": "websocket.connect"}]
    sent: list[Any] = []

    async def receive() -> Any:
        return incoming.pop(0)

    async def send(message: Any) -> None:
        sent.append(message)

    asyncio.run(gate(scope, receive, send))
    if kind == "websocket":
        return sent[0]["type"], sent[0].get("reason", "")
    content = sent[1]["body"].decode()
    return sent[0]["status"], json.loads(content)["detail"] if sent[0]["status"] > 299 else content


@pytest.mark.parametrize("host", ["127.0.0.1:8080", "localhost", "[::1]:8080", "127.0.0.2"])
def test_this_computer_may(host: str) -> None:
    assert ask(Gate(behind), host=host)[0] == 200


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", "192.168.1.4", ""])
def test_a_name_that_only_points_here_may_not(host: str) -> None:
    status, words = ask(Gate(behind), host=host)
    assert status == 403
    assert "--host" in words


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    "origin", ["https://evil.example", "null", "http://127.0.0.1:9999", "http://localhost:8080"]
)
@pytest.mark.parametrize("token", [None, TOKEN])
def test_pages_of_other_sites_may_not(kind: str, origin: str, token: str | None) -> None:
    allowed = {"authorization": f"Bearer {token}"} if token else {}
    status, words = ask(Gate(behind, token and keys(token)), kind=kind, origin=origin, **allowed)
    assert status in (403, "websocket.close")
    assert "other sites" in words


FRIEND = "http://localhost:5173"


def fetch(origin: str, path: str = "/api/v1/state", method: str = "GET") -> httpx.Response:
    """Return what a browser gets that asks for a page of an origin."""
    gate = Gate(behind, keys(TOKEN), origins=frozenset({FRIEND}))

    async def ask_once() -> httpx.Response:
        transport = httpx.ASGITransport(app=gate)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
            return await client.request(method, path, headers={"origin": origin})

    return asyncio.run(ask_once())


def test_pages_of_an_allowed_origin_may_use_the_interface_and_nothing_else() -> None:
    gate = Gate(behind, keys(TOKEN), origins=frozenset({FRIEND}))
    bearer = {"authorization": f"Bearer {TOKEN}", "origin": FRIEND, "sec-fetch-site": "cross-site"}
    assert ask(gate, **bearer)[0] == 200
    assert ask(gate, kind="websocket", path="/api/v1/live", **bearer)[0] == "websocket.accept"
    assert ask(gate, origin=FRIEND)[0] == 401, "it needs the token as everybody does"
    phone = keys(TOKEN).pair("iPhone")
    assert ask(gate, cookie=f"miburi_token={phone}")[0] == 200
    assert ask(gate, cookie=f"miburi_token={phone}", origin=FRIEND)[0] == 401, "no cookie counts"
    for path in ("/", "/face", "/mcp", "/api/v10", "/privacy"):
        assert ask(gate, path, **bearer)[0] == 403
    assert ask(gate, **bearer | {"origin": "http://localhost:5174"})[0] == 403
    assert ask(gate, **bearer | {"host": "evil.example"})[0] == 200, "by its token"
    assert (
        ask(Gate(behind, origins=frozenset({FRIEND})), host="evil.example", origin=FRIEND)[0] == 403
    )

    asked = fetch(FRIEND, "/api/v1/stimulus", "OPTIONS")
    assert (asked.status_code, asked.headers["access-control-allow-origin"]) == (204, FRIEND)
    assert "authorization" in asked.headers["access-control-allow-headers"]
    for origin, path in (("https://evil.example", "/api/v1/stimulus"), (FRIEND, "/mcp")):
        refused = fetch(origin, path, "OPTIONS")
        assert refused.status_code == 403
        assert "access-control-allow-origin" not in refused.headers


def test_a_page_of_an_allowed_origin_can_read_refusals() -> None:
    answer = fetch(FRIEND)
    assert answer.status_code == 401
    assert answer.headers["access-control-allow-origin"] == FRIEND


@pytest.mark.parametrize(
    "text",
    ["*", "null", "example.org", "https://example.org/", "https://a b", "ftp://a", "http://a:x"],
)
def test_what_is_no_origin_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="an origin is"):
        check_origin(text)


def test_an_origin_is_named_as_browsers_name_it() -> None:
    assert check_origin("https://Example.org:443") == "https://example.org"
    assert check_origin("http://localhost:8000") == "http://localhost:8000"


def test_our_own_pages_may() -> None:
    assert ask(Gate(behind), origin="http://127.0.0.1:8080")[0] == 200
    assert ask(Gate(behind), kind="websocket", origin="http://127.0.0.1:8080")[0] == (
        "websocket.accept"
    )


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


@pytest.mark.parametrize("path", ["/", "/face", "/api/v1/stop", "/static/face.js", "/pair/", "/x"])
@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_without_the_token_nothing_answers(path: str, kind: str) -> None:
    for headers in ({}, {"authorization": "Bearer wrong"}, {"cookie": "miburi_token=wrong"}):
        status, words = ask(Gate(behind, keys(TOKEN)), path, kind=kind, **headers)
        assert status in (401, "websocket.close")
        assert "token" in words


@pytest.mark.parametrize(
    "headers",
    [
        {"authorization": f"Bearer {TOKEN}"},
        {"authorization": f"bearer {TOKEN}"},
        {"cookie": f"other=1; miburi_token={PHONE}"},
    ],
)
def test_with_the_token_all_does(headers: dict[str, str]) -> None:
    gate = Gate(behind, keys(TOKEN))
    assert ask(gate, host="192.168.1.4:8080", **headers)[0] == 200
    assert ask(gate, kind="websocket", **headers)[0] == "websocket.accept"


@pytest.mark.parametrize("cookie", ["a b=c; ", "{x}=1; ", 'a="; ', "=; ", "é=1; ", "bad[]=1; "])
def test_a_foreign_cookie_locks_nobody_out(cookie: str) -> None:
    for text in (f"{cookie}miburi_token={PHONE}", f"miburi_token={PHONE}; {cookie}"):
        assert ask(Gate(behind, keys(TOKEN)), cookie=text)[0] == 200


def test_no_request_has_many_keys_looked_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is read from the disk; a header has room for a thousand."""
    read: list[str] = []
    monkeypatch.setattr(Keys, "fits", lambda _, given: bool(read.append(given)))
    ask(Gate(behind, keys(TOKEN)), cookie="; ".join(f"miburi_token=x{n}" for n in range(1000)))
    assert len(read) < 10


@pytest.mark.parametrize("path", ["/pair", "/privacy"])
def test_the_pairing_and_the_privacy_page_need_none(path: str) -> None:
    assert ask(Gate(behind, keys(TOKEN)), path)[0] == 200


@pytest.mark.parametrize(
    ("path", "accept", "status"),
    [
        ("/face", "text/html,*/*;q=0.8", 303),
        ("/", "text/html", 303),
        ("/", "*/*", 401),
        ("/api/v1/state", "text/html", 401),
    ],
)
@pytest.mark.parametrize("https", [False, True])
def test_a_person_without_a_token_is_led_to_the_pairing_page(
    path: str, accept: str, status: int, https: bool
) -> None:
    status = 426 if https and status == 401 else status  # it comes by plain http
    sent: list[Any] = []

    async def send(message: Any) -> None:
        sent.append(message)

    async def receive() -> Any:
        return {"type": "http.request"}

    headers = [(b"host", b"192.168.1.4:8080"), (b"accept", accept.encode())]
    scope = {"type": "http", "path": path, "method": "GET", "headers": headers}
    asyncio.run(Gate(behind, keys(TOKEN), https=https)(scope, receive, send))
    assert sent[0]["status"] == status
    assert ((b"location", f"/pair#{path}".encode()) in sent[0]["headers"]) == (status == 303)


HOME = "192.168.1.4"
MINE = {"authorization": f"Bearer {TOKEN}"}


@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_by_https_the_token_is_needed_at_every_address(kind: str) -> None:
    gate = Gate(behind, keys(TOKEN), https=True)
    for at in (HOME, "127.0.0.1"):
        refused, _ = ask(gate, kind=kind, scheme="https", at=at, host=f"{at}:8081")
        assert refused in (401, "websocket.close")
        passed, _ = ask(gate, kind=kind, scheme="https", at=at, host=f"{at}:8081", **MINE)
        assert passed in (200, "websocket.accept")
    assert ask(gate, "/pair", scheme="https", at=HOME)[0] == 200
    assert ask(gate, "/ca.pem", scheme="https", at=HOME)[0] == 200


@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_beside_https_plain_http_is_for_this_computer_alone(kind: str) -> None:
    gate = Gate(behind, keys(TOKEN), https=True)
    assert ask(gate, kind=kind)[0] in (200, "websocket.accept")
    for host in (HOME, "evil.example"):  # a name that points here, in a browser at this computer
        assert ask(gate, kind=kind, host=host)[0] in (403, "websocket.close")
    for path in ("/", "/face", "/api/v1/state", STOP, "/static/live.js"):
        for method in ("GET", "POST"):
            for headers in ({}, MINE, {"cookie": f"miburi_token={TOKEN}"}):
                for host in (HOME, "127.0.0.1:8080"):  # whoever asks writes the host
                    status, words = ask(
                        gate, path, kind=kind, method=method, at=HOME, host=host, **headers
                    )
                    assert status in (426, "websocket.close")
                    assert "https" in words


def test_by_plain_http_a_device_is_told_of_https_and_gives_no_token_away() -> None:
    gate = Gate(behind, keys(TOKEN), https=True)
    for path in ("/pair", "/privacy", "/ca.pem"):
        assert ask(gate, path, at=HOME, host=HOME)[0] == 200
        assert ask(gate, path, method="POST", at=HOME, host=HOME, **MINE)[0] == 426
    assert ask(Gate(behind, keys(TOKEN)), "/ca.pem", at=HOME)[0] == 401, "there is no authority"


@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_a_page_of_ours_that_came_by_plain_http_may_not_ask_by_https(kind: str) -> None:
    """Whoever is on the way could have made it."""
    gate = Gate(behind, keys(TOKEN), https=True)
    where = {"kind": kind, "scheme": "https", "at": HOME, "host": f"{HOME}:8081"}
    status, words = ask(gate, origin=f"http://{HOME}:8081", **where, **MINE)
    assert status in (403, "websocket.close")
    assert "other sites" in words
    ours, _ = ask(gate, origin=f"https://{HOME}:8081", **where, **MINE)
    assert ours in (200, "websocket.accept")


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
def test_stop_is_never_refused_to_who_may_use_the_partner(token: str | None, scheme: str) -> None:
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


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_what_a_page_elsewhere_asks_for_without_an_origin_is_refused(kind: str, site: str) -> None:
    status, words = ask(Gate(behind), kind=kind, sec_fetch_site=site)
    assert status in (403, "websocket.close")
    assert "other sites" in words
    for ours in ("same-origin", "none"):
        assert ask(Gate(behind), sec_fetch_site=ours)[0] == 200


@pytest.mark.parametrize("method", ["PUT", "PATCH", "OPTIONS", "TRACE", "QUERY", "NONSENSE"])
def test_methods_that_nothing_here_has_are_refused_in_json(method: str) -> None:
    for path in ("/", "/api/v1/state", "/api/v1/nothing"):
        status, words = ask(Gate(behind), path, method=method)
        assert (status, words) == (405, f"{method} is not allowed at this address.")


def test_who_is_refused_takes_nothing_from_who_may_come_in() -> None:
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


@pytest.mark.parametrize(
    ("host", "answer"),
    [("127.0.0.1", True), ("localhost", True), ("::1", True), ("0.0.0.0", False),
     ("10.0.0.1", False), ("", False), ("localhost.evil.example", False)],
)  # fmt: skip
def test_loopback_is_this_computer_alone(host: str, answer: bool) -> None:
    assert is_loopback(host) is answer
