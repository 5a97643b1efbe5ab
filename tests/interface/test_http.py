"""The server's own limits: on headers, on connections, and on who is who."""

import socket
from urllib.parse import urlsplit

import httpx
import pytest
from tests.fixtures.live import interface, refuses_in_json, serving

from miburi.interface.access import BURST, Gate
from miburi.live.runner import Runner


def test_a_header_that_anybody_can_write_lifts_no_limit(runner: Runner) -> None:
    gate = Gate(interface(runner), clock=lambda: 0.0)
    with serving(gate) as url, httpx.Client(base_url=url) as client:
        answers = [
            client.get("/api/v1/state", headers={"X-Forwarded-For": f"10.0.0.{i}"}).status_code
            for i in range(int(BURST) + 2)
        ]
    assert answers == [200] * int(BURST) + [429] * 2


def raw(url: str, sent: bytes) -> bytes:
    """What the server answers to bytes, until it closes the connection."""
    with socket.create_connection((urlsplit(url).hostname, urlsplit(url).port or 0), 30) as line:
        answer = b""
        try:
            line.sendall(sent)
            while more := line.recv(65_536):
                answer += more
        except ConnectionError:  # it has closed before it had read everything
            pass
    return answer


def test_headers_that_are_too_large_end_the_connection(runner: Runner) -> None:
    with serving(Gate(interface(runner))) as url:
        start = b"GET /api/v1/state HTTP/1.1\r\nHost: localhost\r\nX: "
        assert b" 200 " not in raw(url, start + b"x" * 10_000_000 + b"\r\n\r\n")
        assert httpx.get(url + "/api/v1/state").status_code == 200


def test_who_says_nothing_is_not_waited_for(
    runner: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("miburi.interface.http.HEADER_TIME", 0.2)
    with serving(Gate(interface(runner))) as url:
        assert raw(url, b"GET /api/v1/state HTTP/1.1\r\nHost: local") == b""


def test_an_address_has_only_so_many_connections_and_stop_is_answered_all_the_same(
    runner: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("miburi.interface.http.CONNECTIONS", 20)
    monkeypatch.setattr("miburi.interface.http.HEADER_TIME", 1000.0)
    runner.start()
    with serving(Gate(interface(runner))) as url:
        where = (urlsplit(url).hostname, urlsplit(url).port or 0)
        slow = [socket.create_connection(where, 15) for _ in range(60)]
        assert httpx.post(url + "/api/v1/stop").status_code == 204
        for line in slow[:40]:  # the oldest silent ones gave way
            assert line.recv(1) == b""
        for line in slow:
            line.close()
    runner.close(patience=0.0)


@pytest.mark.parametrize("host", ["[", "[::1", "]", "a]b"])
def test_a_host_that_is_no_name_is_refused(runner: Runner, host: str) -> None:
    with serving(Gate(interface(runner))) as url:
        for headers in ({"Host": host}, {"Origin": f"http://{host}"}):
            assert httpx.get(url + "/api/v1/state", headers=headers).status_code == 403


def test_what_is_not_there_is_said_in_json(runner: Runner) -> None:
    with serving(Gate(interface(runner))) as url:
        refuses_in_json(url)


def test_a_large_body_in_chunks_is_refused_as_one_in_one_piece(runner: Runner) -> None:
    with serving(Gate(interface(runner))) as url:
        for path in ("/api/v1/stimulus", "/api/v1/express"):
            answer = httpx.post(url + path, content=iter([b" " * 7_000] * 10))
            assert answer.status_code == 413
            assert "bytes at most" in answer.json()["detail"]
