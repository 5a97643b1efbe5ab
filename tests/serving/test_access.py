"""Who may come in through the gate, and with which words the rest are refused."""

from typing import Any

import pytest
from tests.fixtures.gate import TOKEN, ask, behind, exchange, scope_of
from tests.fixtures.keys import keys

from miburi.errors import InputError
from miburi.serving.access import AGENTS, AUTHORITY, HEALTH, PAIRING, PRIVACY, STOP, Gate
from miburi.serving.keys import Keys
from miburi.serving.origins import check_origin

COOKIE = f"miburi_token={keys(TOKEN).pair('iPhone')}"
STATE = "/api/v1/state"
HOME, FRIEND = "192.168.1.4", "http://localhost:5173"
MINE = {"authorization": f"Bearer {TOKEN}"}
#: The gates of three partners, and of one that lets another site's pages use the interface.
NEAR: dict[str, Any] = {}
OPEN = {"keys": keys(TOKEN)}
SAFE = OPEN | {"https": True}
FRIENDLY = OPEN | {"origins": frozenset({FRIEND})}

BY_HTTPS = [{"scheme": "https", "at": at, "host": f"{at}:8081"} for at in (HOME, "127.0.0.1")]
#: A client can write any host into its request.
PLAINLY = [{"at": HOME, "host": host} for host in (HOME, "127.0.0.1:8080")]
TOKENLESS = [{}, {"authorization": "Bearer wrong"}, {"cookie": "miburi_token=wrong"}]
ELSEWHERE = [
    *({"origin": origin} for origin in ("https://evil.example", "null", "http://127.0.0.1:9999",
                                        "http://localhost:8080")),
    {"sec_fetch_site": "cross-site"},
    {"sec_fetch_site": "same-site"},
]  # fmt: skip
BY_FRIEND = MINE | {"origin": FRIEND, "sec_fetch_site": "cross-site"}
COOKIES = ["other=1", "a b=c", "{x}=1", 'a="', "=", "é=1", "bad[]=1"]

#: The gate, the paths and the requests; the status of each answer, and part of its message.
CASES: dict[str, tuple[dict[str, Any], list[str], list[dict[str, str]], int, str]] = {
    "this computer": (
        NEAR, [STATE], [{"host": host} for host in ("127.0.0.1:8080", "localhost", "[::1]:8080",
                                                    "127.0.0.2")], 200, "",
    ),
    "a name that only points here": (
        NEAR, [STATE, AGENTS],
        [{"host": host} for host in ("evil.example", "127.0.0.1.evil.example", HOME, "0.0.0.0",
                                     "")],
        403, "--host",
    ),
    "our own pages": (
        NEAR, [STATE], [{"origin": "http://127.0.0.1:8080"}, {"sec_fetch_site": "same-origin"},
                        {"sec_fetch_site": "none"}], 200, "",
    ),
    "pages of other sites": (NEAR, [STATE], ELSEWHERE, 403, "other sites"),
    "pages of other sites, with the token": (
        OPEN, [STATE], [one | MINE for one in ELSEWHERE], 403, "other sites",
    ),
    "no token": (
        OPEN, ["/", "/face", STOP, "/static/face.js", "/pair/", "/x"], TOKENLESS, 401, "token",
    ),
    "the token, or a device's key": (
        OPEN, [STATE, "/face"], [MINE | {"host": f"{HOME}:8080"},
                                 {"authorization": f"bearer {TOKEN}"}], 200, "",
    ),
    "a foreign cookie beside the key": (
        OPEN, [STATE], [{"cookie": text} for foreign in COOKIES
                        for text in (f"{foreign}; {COOKIE}", f"{COOKIE}; {foreign}")], 200, "",
    ),
    "pairing, privacy and health": (OPEN, [PAIRING, PRIVACY, HEALTH], [{}], 200, ""),
    "an authority where there is none": (OPEN, [AUTHORITY], [{"at": HOME}], 401, "token"),
    "https without the token": (SAFE, [STATE], BY_HTTPS, 401, "token"),
    "https with the token": (SAFE, [STATE], [one | MINE for one in BY_HTTPS], 200, ""),
    "how to pair, by https": (SAFE, [PAIRING, AUTHORITY], BY_HTTPS, 200, ""),
    "how to pair, by http": (SAFE, [PAIRING, PRIVACY, HEALTH, AUTHORITY], PLAINLY, 200, ""),
    "http beside https, here": (SAFE, [STATE], [{}], 200, ""),
    "http beside https, by a name that points here": (
        SAFE, [STATE], [{"host": HOME}, {"host": "evil.example"}], 403, "--host",
    ),
    "http beside https, from elsewhere": (
        SAFE, ["/", "/face", STATE, STOP, "/static/live.js"],
        [where | method | key for where in PLAINLY for method in ({}, {"method": "POST"})
         for key in ({}, MINE, {"cookie": COOKIE})], 426, "https",
    ),
    "a token given away by http": (
        SAFE, [PAIRING, PRIVACY, HEALTH, AUTHORITY],
        [MINE | {"method": "POST"} | PLAINLY[0]], 426, "https",
    ),
    "by https, a page of ours that came by http": (  # somebody in the middle could have made it
        SAFE, [STATE], [MINE | BY_HTTPS[0] | {"origin": f"http://{HOME}:8081"}], 403, "other sites",
    ),
    "by https, a page of ours": (
        SAFE, [STATE], [MINE | BY_HTTPS[0] | {"origin": f"https://{HOME}:8081"}], 200, "",
    ),
    "an allowed origin": (
        FRIENDLY, [STATE, "/api/v1/live"], [BY_FRIEND, BY_FRIEND | {"host": "evil.example"}], 200,
        "",
    ),
    "an allowed origin without the token": (  # no cookie counts
        FRIENDLY, [STATE], [{"origin": FRIEND} | key for key in ({}, {"cookie": COOKIE})], 401,
        "token",
    ),
    "an allowed origin, beyond the interface": (
        FRIENDLY, ["/", "/face", AGENTS, "/api/v10", PRIVACY], [BY_FRIEND], 403, "other sites",
    ),
    "another origin than the allowed": (
        FRIENDLY, [STATE], [BY_FRIEND | {"origin": "http://localhost:5174"}], 403, "other sites",
    ),
    "an allowed origin, by a name that points here": (
        {"origins": frozenset({FRIEND})}, [STATE], [{"host": "evil.example", "origin": FRIEND}],
        403, "--host",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_the_gate_admits_the_right_requests(case: str) -> None:
    """The gate treats a WebSocket like a request."""
    partner, paths, requests, status, words = CASES[case]
    for path in paths:
        for request in requests:
            given, said = ask(Gate(behind, **partner), path, **request)
            assert (given, words in said) == (status, True), (path, request)
            answer, _ = ask(Gate(behind, **partner), path, kind="websocket", **request)
            assert (answer == "websocket.accept") == (status == 200), (path, request)


def answered(gate: Gate, path: str, **request: str) -> tuple[int, dict[str, str]]:
    """Return the status and the headers of an answer."""
    start = exchange(gate, scope_of(path, **request))[0]
    return start["status"], {k.decode(): v.decode() for k, v in start["headers"]}


@pytest.mark.parametrize(
    ("method", "origin", "path", "status"),
    [
        ("OPTIONS", FRIEND, "/api/v1/stimulus", 204),
        ("GET", FRIEND, STATE, 401),  # its page can read the refusal
        ("OPTIONS", "https://evil.example", "/api/v1/stimulus", 403),
        ("OPTIONS", FRIEND, "/mcp", 403),
    ],
)
def test_a_browser_learns_what_an_allowed_origin_may_do(
    method: str, origin: str, path: str, status: int
) -> None:
    given, headers = answered(Gate(behind, **FRIENDLY), path, method=method, origin=origin)
    assert given == status
    assert headers.get("access-control-allow-origin") == (None if status == 403 else FRIEND)
    allowed = headers.get("access-control-allow-headers", "")
    assert ("authorization" in allowed) == (status == 204)


@pytest.mark.parametrize(
    ("path", "accept", "status"),
    [
        ("/face", "text/html,*/*;q=0.8", 303),
        ("/", "text/html", 303),
        ("/", "*/*", 401),
        (STATE, "text/html", 401),
    ],
)
def test_a_person_without_a_token_is_led_to_the_pairing_page(
    path: str, accept: str, status: int
) -> None:
    for partner, refused in ((OPEN, 401), (SAFE, 426)):  # it comes by plain http
        where = {"at": HOME, "host": f"{HOME}:8080", "accept": accept}
        given, headers = answered(Gate(behind, **partner), path, **where)
        assert given == (refused if status == 401 else status)
        assert headers.get("location") == (f"{PAIRING}#{path}" if status == 303 else None)


def test_an_origin_is_named_as_browsers_name_it() -> None:
    assert check_origin("https://Example.org:443") == "https://example.org"
    assert check_origin("http://localhost:8000") == "http://localhost:8000"
    for text in ("*", "null", "example.org", "https://example.org/", "https://a b", "ftp://a",
                 "http://a:x"):  # fmt: skip
        with pytest.raises(InputError, match="an origin is"):
            check_origin(text)


def test_no_request_has_many_keys_looked_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each key is read from the disk; a header has room for a thousand keys."""
    read: list[str] = []
    monkeypatch.setattr(Keys, "fits", lambda _, given: bool(read.append(given)))
    ask(Gate(behind, **OPEN), cookie="; ".join(f"miburi_token=x{n}" for n in range(1000)))
    assert len(read) < 10


def test_methods_that_nothing_here_has_are_refused_in_json() -> None:
    for method in ("PUT", "PATCH", "OPTIONS", "TRACE", "QUERY", "NONSENSE"):
        for path in ("/", STATE, "/api/v1/nothing"):
            refusal = (405, f"{method} is not allowed at this address.")
            assert ask(Gate(behind), path, method=method) == refusal
