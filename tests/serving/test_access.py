"""Who may come in through the gate, and with which words the rest are refused."""

import asyncio
from typing import Any

import httpx
import pytest
from tests.fixtures.gate import TOKEN, ask, behind
from tests.fixtures.keys import keys

from miburi.errors import InputError
from miburi.serving.access import (
    STOP,
    Gate,
)
from miburi.serving.heads import is_loopback
from miburi.serving.keys import Keys
from miburi.serving.origins import check_origin

PHONE = keys(TOKEN).pair("iPhone")


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


@pytest.mark.parametrize(
    ("host", "answer"),
    [("127.0.0.1", True), ("localhost", True), ("::1", True), ("0.0.0.0", False),
     ("10.0.0.1", False), ("", False), ("localhost.evil.example", False)],
)  # fmt: skip
def test_loopback_is_this_computer_alone(host: str, answer: bool) -> None:
    assert is_loopback(host) is answer
