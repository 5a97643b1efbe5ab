"""The server's own limits: on headers, on connections, and on who is who."""

import asyncio
import logging
import socket
import ssl
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from urllib.parse import urlsplit

import httpx
import pytest
from starlette.types import Receive, Scope, Send
from tests.fixtures.gate import behind
from tests.fixtures.live import interface, refuses_in_json, serving
from tests.fixtures.waiting import get, post

from miburi.live.runner import Runner
from miburi.serving.access import BURST, STOP, Gate
from miburi.serving.authority import Certificates

STATE = "/api/v1/state"
Serve = Callable[[Gate], AbstractContextManager[str]]


@pytest.fixture(params=["http", "https"])
def served(
    request: pytest.FixtureRequest, certificates: Certificates, monkeypatch: pytest.MonkeyPatch
) -> Serve:
    """Serves a gate, by http and by https: its limits hold for both."""
    if request.param == "http":
        return serving
    monkeypatch.setenv("SSL_CERT_FILE", str(certificates.authority))
    return partial(serving, certificate=certificates.server)


def raw(url: str, sent: bytes) -> bytes:
    """What the server answers to bytes, until it closes the connection."""
    where = urlsplit(url)
    line = socket.create_connection((where.hostname, where.port or 0), 30)
    if where.scheme == "https":
        line = ssl.create_default_context().wrap_socket(line, server_hostname=where.hostname)
    with line:
        answer = b""
        try:
            line.sendall(sent)
            while more := line.recv(65_536):
                answer += more
        except (ConnectionError, ssl.SSLEOFError):  # it has closed before it had read everything
            pass
    return answer


def test_a_header_that_anybody_can_write_lifts_no_limit(served: Serve) -> None:
    with (
        served(Gate(behind, clock=lambda: 0.0)) as url,
        httpx.Client(base_url=url, verify=False) as client,
    ):
        answers = [
            client.get(STATE, headers={"X-Forwarded-For": f"10.0.0.{i}"}).status_code
            for i in range(int(BURST) + 2)
        ]
    assert answers == [200] * int(BURST) + [429] * 2


def test_headers_that_are_too_large_or_never_end_end_the_connection(
    served: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    start = f"GET {STATE} HTTP/1.1\r\nHost: localhost\r\nX: ".encode()
    with served(Gate(behind)) as url:
        assert b" 200 " not in raw(url, start + b"x" * 2_000_000 + b"\r\n\r\n")
        assert get(url + STATE).status_code == 200
        monkeypatch.setattr("miburi.serving.http.HEADER_TIME", 0.2)
        assert raw(url, start) == b""


def test_an_address_has_only_so_many_connections_and_stop_is_answered_all_the_same(
    served: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("miburi.serving.http.CONNECTIONS", 20)
    monkeypatch.setattr("miburi.serving.http.HEADER_TIME", 1000.0)
    with served(Gate(behind)) as url:
        where = (urlsplit(url).hostname, urlsplit(url).port or 0)
        slow = [socket.create_connection(where, 15) for _ in range(60)]
        assert post(url + STOP).status_code == 200
        for line in slow[:40]:  # the oldest silent ones gave way
            assert line.recv(1) == b""
        for line in slow:
            line.close()


def test_nonsense_is_refused_in_json(runner: Runner, served: Serve) -> None:
    with served(Gate(interface(runner))) as url:
        refuses_in_json(url)
        for host in ("[", "[::1", "]", "a]b"):
            for headers in ({"Host": host}, {"Origin": f"http://{host}"}):
                assert get(url + STATE, headers=headers).status_code == 403
        for path in ("/api/v1/stimulus", "/api/v1/express"):  # its parser meets the limit
            answer = post(url + path, content=iter([b" " * 7_000] * 10))
            assert answer.status_code == 413
            assert "bytes at most" in answer.json()["detail"]


def test_a_request_that_outlasts_the_server_leaves_no_traceback() -> None:
    """As a page that is still being made when somebody presses Ctrl-C."""
    begun, said = threading.Event(), list[str]()

    async def lasts(scope: Scope, receive: Receive, send: Send) -> None:
        begun.set()
        await asyncio.Event().wait()

    listener = logging.Handler()
    listener.emit = lambda record: said.append(record.getMessage())  # type: ignore[method-assign]
    with (
        serving(lasts) as url,
        socket.create_connection(("127.0.0.1", urlsplit(url).port or 0)) as line,
    ):
        logging.getLogger("uvicorn.error").addHandler(listener)
        line.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        assert begun.wait(10)
    logging.getLogger("uvicorn.error").removeHandler(listener)
    assert said == []
