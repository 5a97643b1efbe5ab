"""The reception: Stop goes past the server, all else goes to it, and silence costs little."""

import socket
from collections.abc import Iterator
from multiprocessing import Pipe

import pytest
from tests.fixtures.desk import DONE, END, FILES, LOOK, STOP, Desk, answer, desk
from tests.fixtures.keys import keys

from miburi.serving.access import CONNECTIONS, HEADER_TIME, HEADERS
from miburi.serving.crowd import GRACE, HANDSHAKES
from miburi.serving.lane import BEAT, SILENCE
from miburi.serving.passing import ENCRYPTED, PLAIN


@pytest.fixture
def at() -> Iterator[Desk]:
    with desk() as one:
        yield one


def test_a_stop_reaches_the_partner_and_not_the_server(at: Desk) -> None:
    guest = at.come(STOP + END)
    assert at.pressed() == 100.0
    assert answer(guest, within=0) == b""  # not before the body has stopped
    at.stopped()
    assert answer(guest).startswith(DONE)
    at.time[0] = 101.0
    guest.sendall(STOP + b"Content-Length: 0\r\n" + END)  # as browsers say it, over the same line
    assert at.pressed() == 101.0
    at.stopped()
    assert answer(guest).startswith(DONE)
    guest.sendall(STOP + b"Connection: close\r\n" + END)
    at.pressed()
    at.stopped()
    assert b"connection: close" in answer(guest)
    at.until(lambda: at.ended(guest))
    assert at.lines == []


def test_a_stop_in_pieces_is_one(at: Desk) -> None:
    guest = at.come()
    for byte in STOP + END:
        assert at.quiet()
        guest.send(bytes([byte]))
    assert at.pressed() == 100.0


def test_many_stops_share_the_next(at: Desk) -> None:
    first, *others = [at.come(STOP + END) for _ in range(50)]
    assert at.pressed() == 100.0
    assert at.quiet()
    at.stopped()
    assert answer(first).startswith(DONE)
    assert at.pressed() == 100.0
    assert not any(answer(guest, within=0) for guest in others)
    at.stopped()
    assert all(answer(guest).startswith(DONE) for guest in others)
    assert at.quiet()


@pytest.mark.parametrize(
    "head",
    [
        LOOK,
        b"GET /api/v1/stop HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"POST /api/v1/stop HTTP/1.0\r\nHost: localhost\r\n\r\n",
        b"POST /api/v1/stop?x HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"POST /api/v1/stopping HTTP/1.1\r\nHost: localhost\r\n\r\n",
        STOP + b"Content-Length: 5\r\n" + END,
        STOP + b"Transfer-Encoding: chunked\r\n" + END,
        STOP + b"Upgrade: websocket\r\n" + END,
        STOP + b"Expect: 100-continue\r\n" + END,
        STOP + b"no header\r\n" + END,
        STOP + b"Origin: https://evil.example\r\n" + END,
        STOP + b"Sec-Fetch-Site: cross-site\r\n" + END,
        b"POST /api/v1/stop HTTP/1.1\r\nHost: evil.example\r\n\r\n",
        b"POST /api/v1/stop HTTP/1.1\r\nHost: [\r\n\r\n",
        b"POST /api/v1/stop HTTP/1.1\r\n\r\n",
        b"\x16\x03\x01 is how TLS begins",
    ],
)
def test_whatever_is_not_plainly_a_stop_that_may_be_goes_to_the_server_whole(
    at: Desk, head: bytes
) -> None:
    at.time[0] = 123.0
    guest = at.come(head + b"and more")
    passed = at.passed()
    assert at.quiet()
    assert (passed.note.kind, passed.note.came) == (PLAIN, 123.0)
    assert passed.note.client == guest.getsockname()
    assert passed.note.server == at.plain.getsockname()
    at.quiet()
    assert answer(passed.line).startswith(head)
    at.respond(passed, b"hello")
    assert answer(guest) == b"hello"


#: Of a partner whose devices are forgotten.
LOST = "lost" * 10


def test_from_other_devices_stop_needs_the_token() -> None:
    with desk(token=LOST) as at:
        for wrong in (b"", b"Authorization: Bearer " + b"u" * 40 + b"\r\n"):
            at.come(STOP + wrong + END)
            at.passed().line.close()
            assert at.quiet()
        phone = keys(LOST).pair("iPhone").encode()
        for right in (b"Authorization: Bearer " + LOST.encode(), b"Cookie: miburi_token=" + phone):
            at.come(STOP + right + b"\r\n" + END)
            assert at.pressed() == 100.0
            at.stopped()
        keys(LOST).forget()
        at.come(STOP + b"Cookie: miburi_token=" + phone + b"\r\n" + END)
        at.passed().line.close()
        assert at.quiet()


def test_the_stop_of_a_page_that_is_allowed_goes_past_the_server_too() -> None:
    friend = b"http://localhost:5173"
    with desk(origins=frozenset({friend.decode()})) as at:
        guest = at.come(STOP + b"Origin: " + friend + b"\r\n" + END)
        told = at.delivered(guest)
        assert told.startswith(DONE)
        assert b"access-control-allow-origin: " + friend in told
        at.come(STOP + b"Origin: http://localhost:5174\r\n" + END)
        at.passed().line.close()
        assert at.quiet()


def test_a_connection_comes_back_and_its_next_stop_goes_past_the_server(at: Desk) -> None:
    guest = at.come(LOOK)
    passed = at.passed()
    assert answer(passed.line) == LOOK
    at.respond(passed, b"hello")
    assert answer(guest) == b"hello"
    at.stop(guest)
    guest.sendall(LOOK)
    again = at.passed()
    assert answer(again.line) == LOOK
    again.line.close()


def test_while_the_server_takes_nothing_stop_is_answered(at: Desk) -> None:
    """A Stop also overtakes a request that waits for the server."""
    at.serves = False
    waiting = [at.come(LOOK) for _ in range(CONNECTIONS + 20)]
    assert sum(map(at.ended, waiting)) == 20  # and they are forgotten
    waiting[-1].sendall(STOP + END)
    told = at.delivered(waiting[-1])
    assert told.startswith(b"HTTP/1.1 503 Service Unavailable\r\n")
    assert DONE in told
    at.stop(at.come())
    at.serves = True
    for _ in range(CONNECTIONS - 2):
        at.passed().line.close()


def test_by_https_a_connection_is_passed_on_with_its_first_bytes(at: Desk) -> None:
    guest = at.come(listener=at.encrypted)
    assert at.lines == []
    guest.sendall(b"\x16")
    passed = at.passed()
    at.quiet()
    assert (passed.note.kind, answer(passed.line)) == (ENCRYPTED, b"\x16")
    passed.line.close()
    at.come(STOP + END, at.encrypted)  # unencrypted words where https is spoken
    assert at.quiet()


def test_who_says_nothing_does_not_reach_the_server_and_is_not_waited_for(at: Desk) -> None:
    silent, slow = at.come(), at.come(LOOK[:-2])
    at.time[0] += HEADER_TIME + 0.1
    at.until(lambda: at.ended(silent) and at.ended(slow))
    assert at.lines == []


def test_headers_that_are_too_large_are_refused(at: Desk) -> None:
    guest = at.come(LOOK[:-2] + b"X: " + b"x" * HEADERS)
    assert answer(guest).startswith(b"HTTP/1.1 431 Request Header Fields Too Large\r\n")
    at.until(lambda: at.ended(guest))
    assert at.lines == []


def test_silent_strangers_give_way_and_never_the_newest(at: Desk) -> None:
    known = at.come()
    at.stop(known)
    strangers = [at.come() for _ in range(CONNECTIONS - 1)]
    at.time[0] += GRACE + 0.1
    strangers += [at.come() for _ in range(21)]
    at.until(lambda: sum(map(at.ended, strangers)) == 21)
    assert all(map(at.ended, strangers[:21]))
    at.stop(at.come())
    at.stop(known)


def test_a_new_connection_has_half_a_second_before_it_gives_way(at: Desk) -> None:
    pollers = [at.come() for _ in range(CONNECTIONS)]
    for poller in pollers:
        at.stop(poller)
    new = [at.come() for _ in range(50)]  # each at the cost of a poller that rests
    assert not any(map(at.ended, new))
    assert sum(map(at.ended, pollers)) == 50
    at.stop(new[0])


def test_a_flood_of_new_connections_ends_no_stop_of_the_same_address(at: Desk) -> None:
    """All are new, so none is an old stranger: neither who presses nor who rests gives way."""
    known, pressing = at.come(), at.come()
    at.stop(known)
    pressing.sendall(STOP + END)
    assert at.pressed()
    strangers = [at.come(LOOK[:-2]) for _ in range(CONNECTIONS + 50)]
    assert sum(map(at.ended, strangers)) == 52
    at.stopped()
    assert answer(pressing).startswith(b"HTTP/1.1 204")
    at.stop(known)


def test_what_a_new_connection_has_said_is_heard_before_it_gives_way(at: Desk) -> None:
    strangers = [at.come() for _ in range(CONNECTIONS - 1)]
    pressing = at.come()
    at.time[0] += GRACE / 2
    pressing.sendall(STOP + END)  # it lies there, unread, when more come than may
    at.guests += [socket.create_connection(at.plain.getsockname(), 10) for _ in range(CONNECTIONS)]
    assert at.delivered(pressing).startswith(b"HTTP/1.1 204")
    assert sum(map(at.ended, strangers)) > 100


def test_the_address_with_the_most_connections_gives_way_first() -> None:
    with desk(most=20) as at:
        alone = at.come()
        crowd = [
            socket.create_connection(at.plain.getsockname(), 10, ("127.0.0.2", 0))
            for _ in range(30)
        ]
        at.guests += crowd
        at.time[0] += GRACE + 0.1
        at.until(lambda: sum(map(at.ended, crowd)) == 11)
        at.stop(alone)


def test_streams_that_would_take_all_files_give_way_to_a_stop(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """The server hangs, so that it refuses none of them."""
    stream = b"GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n"
    with desk(most=60) as at:
        streams = [at.come(stream) for _ in range(40)]
        at.stop(at.come())
        assert sum(map(at.ended, streams)) >= 10
        at.until(lambda: caplog.messages)
    (said,) = caplog.messages
    assert "no more than 60 files" in said


def test_handshakes_are_limited_and_a_flood_loses_its_own_first() -> None:
    """Each half-open one keeps 0.33 MB of the server; the limit of an address is higher."""
    with desk(most=500) as at:
        phone = at.come(b"\x16", at.encrypted)  # the oldest, and alone at its address
        for number in range(HANDSHAKES + 40):
            home = f"127.0.0.{2 + number % 20}"
            stranger = socket.create_connection(at.encrypted.getsockname(), 10, (home, 0))
            at.guests.append(stranger)
            stranger.sendall(b"\x16")
            at.turn()
        at.until(lambda: sum(map(at.ended, at.guests)) == 41)
        assert not at.ended(phone)
        at.stop(at.come())


def test_a_half_closed_connection_costs_nothing(at: Desk) -> None:
    guest = at.come(b"GET /")
    guest.shutdown(socket.SHUT_WR)
    at.until(lambda: at.ended(guest))
    assert at.lines == []


@pytest.mark.parametrize("answered", [b"", b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n"])
def test_stop_overtakes_a_request_that_the_server_has_not_ended(at: Desk, answered: bytes) -> None:
    """The server hangs: before its answer, or between its answer and letting go of the request."""
    guest = at.come(LOOK)
    passed = at.passed()
    passed.line.send(answered)
    at.quiet()
    assert answer(guest, within=0) == b""
    guest.sendall(STOP + END)
    told = at.delivered(guest)
    assert told.startswith(b"HTTP/1.1 503 Service Unavailable\r\n")
    assert DONE in told
    passed.line.close()
    at.stop(guest)


def test_a_body_goes_to_the_server_and_is_no_stop(at: Desk) -> None:
    body = (STOP + END) * 10
    head = b"POST /api/v1/say HTTP/1.1\r\nHost: localhost\r\nContent-Length: %d\r\n\r\n"
    guest = at.come(head % len(body))
    passed = at.passed()
    for piece in (body[:50], body[50:]):
        guest.sendall(piece)
        at.turn(0.05)
        assert at.quiet()
    assert answer(passed.line) == head % len(body) + body
    guest.sendall(LOOK)
    large = b"x" * 300_000
    at.respond(passed, large[:100_000])
    heard = b""
    while len(heard) < 100_000:
        heard += answer(guest)
    assert heard == large[:100_000]
    again = at.passed()
    assert answer(again.line) == LOOK
    again.line.close()


def test_while_it_serves_it_gives_signs_of_life(at: Desk) -> None:
    for _ in range(3):
        at.time[0] += BEAT
        at.reception.turn()
        assert at.partner.recv() is None
        assert not at.partner.poll()
        at.stopped()


def test_a_stop_that_reaches_nobody_says_so_and_still_waits_for_the_partner(at: Desk) -> None:
    first, second = at.come(STOP + END), at.come(STOP + END)
    at.time[0] += SILENCE + 0.3
    at.quiet()
    for guest in (first, second):
        assert b"503 Service Unavailable" in answer(guest)
    assert at.pressed() == 100.0  # once the partner looks at last
    at.stopped()
    assert at.pressed() == at.time[0]  # the second, too
    at.stopped()
    third = at.come(STOP + END)
    assert at.pressed() == at.time[0]
    at.stopped()
    assert answer(third).startswith(DONE)


def test_it_ends_with_the_partner(at: Desk) -> None:
    at.partner.close()
    at.reception.serve()
    at.partner, _ = Pipe()


def test_no_open_file_is_left_behind(at: Desk) -> None:
    before = sorted(FILES.iterdir())
    for sent in (b"", LOOK, STOP + END, b"\x16", LOOK[:-2] + b"x" * HEADERS):
        guest = at.come(sent)
        for passed in at.lines:
            passed.line.close()
        at.lines.clear()
        if at.stops:
            at.stops.clear()
            at.stopped()
        at.guests.remove(guest)
        guest.close()
        at.turn(0.05)
        at.quiet()
    assert sorted(FILES.iterdir()) == before


@pytest.mark.parametrize(
    "head",
    [
        b"GET /api/v1/events?after=5f2c9a10:42 HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"GET /api/v1/live HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n\r\n",
    ],
)
def test_what_lasts_comes_as_it_is_sent_and_ends_with_the_server(at: Desk, head: bytes) -> None:
    guest = at.come(head)
    passed = at.passed()
    for piece in (b"one", b"two"):
        passed.line.sendall(piece)
        at.until(lambda piece=piece: answer(guest, within=0) == piece)  # type: ignore[misc]
    passed.line.close()
    at.until(lambda: at.ended(guest))
