"""The server as a user starts it: how it begins, whom it lets in, and what it does if it hangs."""

import itertools
import json
import os
import re
import signal
import socket
import ssl
import sys
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from functools import partial
from http.client import HTTPResponse
from pathlib import Path
from urllib.error import URLError
from urllib.parse import urlsplit
from urllib.request import Request, urlopen

import httpx
import pytest
from tests.fixtures.command import miburi as command
from tests.fixtures.live import refuses_in_json
from tests.fixtures.program import (
    RECEPTION,
    SERVER,
    TERMINAL,
    Program,
    address,
    helpers_of,
    running,
)
from tests.fixtures.waiting import PATIENCE, get, post, until
from typer.testing import CliRunner
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

import miburi
from miburi.cli.commands import app
from miburi.errors import InputError, OutputError
from miburi.feelings import shipped_temperament
from miburi.gestures import shipped_repertoire
from miburi.ground.files import alone_in
from miburi.host.server import Launch, serve
from miburi.robot import iphonoid
from miburi.serving.access import AGENTS
from miburi.serving.addresses import listening_plainly, listening_twice
from miburi.serving.reach import qr_for_terminal


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Program]:
    """A program for what leaves it as it was; nothing that its tests have not looked at is said."""
    with running(tmp_path_factory.mktemp("shared"), "--forget", headless=False) as program:
        program.url = address(program.out.next("Miburi is awake"))
        yield program
        code, said, errors = program.end()
    assert (code, errors) == (0, "")
    assert "Good-bye. " in said


@pytest.fixture
def there(shared: Program) -> Program:
    """The same, with a body that moves."""
    if get(shared.url + "/api/v1/state").json()["held"]:
        page = {"Origin": shared.url}
        release = partial(post, shared.url + "/api/page/release", json={}, headers=page)
        until(release, lambda answer: answer.status_code == 204)  # after its pause
        until(lambda: get(shared.url + "/api/v1/state").json()["phase"] in ("idle", "moving"))
    return shared


def test_on_this_computer_it_answers_at_once_and_moves(there: Program) -> None:
    url = there.url
    page = get(url)
    assert page.status_code == 200
    assert "Miburi" in page.text
    assert (
        "Simulated, with constants that other people measured on a servo XL330-M288-T." in page.text
    )
    for source in ("http://", "https://"):
        assert source not in page.text.replace("http://www.w3.org", "")
    assert get(url + "/face").status_code == 200
    # It breathes, and is about to greet.
    shown = until(lambda: get(url + "/api/v1/state").json()["expressed"])
    assert shown["feeling"] == "happiness"
    assert get(url, headers={"Host": "evil.example"}).status_code == 403
    evil = {"Origin": "https://evil.example"}
    assert post(url + "/api/v1/stop", headers=evil).status_code == 403
    with pytest.raises(InvalidStatus):
        connect(url.replace("http", "ws") + "/api/v1/live", additional_headers=evil)
    socket_io = url + "/_nicegui_ws/socket.io/?EIO=4&transport=polling"
    assert get(socket_io, headers=evil).status_code == 403
    assert post(url + AGENTS, json={}).status_code == 404, "agents come in where they are let in"
    refuses_in_json(url)


def test_where_no_browser_can_be_opened_it_is_said(shared: Program) -> None:
    words = "No browser could be opened here"  # the line after its greeting
    until(lambda: any(words in line for line in shared.out.all))


def test_an_address_without_a_page_shows_the_ways_back_and_tells_the_terminal_nothing(
    there: Program,
) -> None:
    for language, words in (("en", "nothing at this address"), ("ja", "何もありません")):
        page = get(there.url + "/mistyped", headers={"Accept-Language": language})
        assert (page.status_code, words in page.text) == (404, True)
        assert 'href="/"' in page.text
    assert not any("mistyped" in line for line in (*there.out.all, *there.errors.all))


def code_leads_to_this_computer(program: Program) -> None:
    """Check that the code in the terminal leads to an address that a phone can reach."""
    said = program.out.next("On a phone")
    found = re.search(r"http://([\w.-]+):\d+/pair#[\w-]+/$", said)
    assert found, said
    assert found[1] not in ("127.0.0.1", "localhost", "0.0.0.0")
    code = "".join(program.out.next() for _ in range(8))
    assert qr_for_terminal(found[0]).startswith(code)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has other terminals")
def test_a_terminal_shows_the_token(tmp_path: Path) -> None:
    with running(tmp_path, "--host", "0.0.0.0", "--forget", within=TERMINAL) as program:
        token = program.out.next("Token for programs").split()[-1]
        code_leads_to_this_computer(program)
    assert token == (tmp_path / "token").read_text().strip()


def test_elsewhere_nothing_but_the_pairing_page_answers_without_the_token(tmp_path: Path) -> None:
    with (
        running(tmp_path, "--host", "0.0.0.0", "--forget") as program,
        httpx.Client(timeout=PATIENCE) as stranger,
    ):
        url = address(program.out.next())
        assert "/pair and type the token" in program.out.next("On a phone")
        token = (tmp_path / "token").read_text().strip()
        described = get(
            url + "/api/openapi.json", headers={"Authorization": f"Bearer {token}"}
        ).json()
        paths = [
            (method, path) for path in described["paths"] for method in described["paths"][path]
        ]
        pages = ["/", "/face", "/static/live.js", "/static/nothing", "/api/openapi.json", "/docs",
                 "/_nicegui_ws/socket.io/?EIO=4&transport=polling", "/_nicegui/client", "/pair/",
                 "/api/v1/live", "/x/../pair/../api/v1/state", "//pair"]  # fmt: skip
        assert len(paths) >= 17
        for method, path in [*paths, *(("get", page) for page in pages)]:
            for headers in ({}, {"Cookie": "miburi_token=" + "x" * 43}):
                status = stranger.request(method, url + path, headers=headers).status_code
                assert status in (401, 429), (method, path)
        with pytest.raises(InvalidStatus):
            connect(url.replace("http", "ws") + "/api/v1/live")
        assert get(url + "/pair").status_code == 200
        assert get(url + "/health").json() == {"alive": True}
        assert post(url + "/pair", json={"token": "wrong"}).status_code == 401
        program.errors.next("requests with a wrong token from 127.0.0.1: 1")
        with httpx.Client(base_url=url) as phone:
            assert phone.post("/pair", json={"token": token}).status_code == 204
            cookie = next(iter(phone.cookies.jar))
            assert cookie.has_nonstandard_attr("HttpOnly")
            assert phone.get("/face").status_code == 200
            assert phone.post("/api/v1/stop").status_code == 204
            lost = {"Cookie": f"{cookie.name}={cookie.value}", "User-Agent": "iPhone Safari"}
            with connect(url.replace("http", "ws") + "/api/v1/live", additional_headers=lost) as it:
                it.recv(PATIENCE)
                said = devices("forget", "--all", folder=tmp_path)
                with pytest.raises(ConnectionClosed) as closed:
                    while True:
                        it.recv(PATIENCE)
            assert closed.value.rcvd is not None
            assert (closed.value.rcvd.code, "forgotten" in closed.value.rcvd.reason) == (1008, True)
            assert phone.post("/api/v1/stop").status_code in (401, 429)
            assert phone.post("/pair", json={"token": token}).status_code in (401, 429)
            assert token not in "".join(program.out.all + program.errors.all), "it may be a log"
            token = (tmp_path / "token").read_text().strip()
            assert token in said
            assert phone.post("/pair", json={"token": token}).status_code == 204


def devices(*words: str, folder: Path) -> str:
    """Return what `miburi devices` says."""
    return CliRunner().invoke(app, ["devices", *words, "--folder", str(folder)]).output


@pytest.mark.proof("test_elsewhere_nothing_but_the_pairing_page_answers_without_the_token")
def test_by_https_a_phone_comes_in_and_by_http_only_this_computer(tmp_path: Path) -> None:
    """The authority of last time is broken, so it is made again, and that is said."""
    authority = tmp_path / "https" / "ca.pem"
    authority.parent.mkdir()
    authority.with_name("authority.pem").write_text("nonsense")
    with running(tmp_path, "--https") as program:
        program.errors.next("a new home authority was made")
        url = address(program.out.next("Miburi is awake"))
        found = re.search(r"https://[\w.]+:\d+", program.out.next("On a phone"))
        assert found
        safe, token = found.group(), (tmp_path / "token").read_text().strip()
        trusting = ssl.create_default_context(cafile=authority)
        # Python's own client, as it comes: it checks the certificate and its address.
        mine = Request(safe + "/api/v1/state", headers={"Authorization": f"Bearer {token}"})
        with urlopen(mine, context=trusting) as answer:
            assert json.load(answer)["body"] == "simulated"
        with pytest.raises(URLError, match="CERTIFICATE_VERIFY_FAILED"):
            urlopen(mine)
        assert get(url + "/api/v1/state").status_code == 200
        assert get(url + "/ca.pem").content == authority.read_bytes()
        with httpx.Client(base_url=safe, verify=trusting, timeout=PATIENCE) as it:
            assert it.get("/api/v1/state").status_code == 401
            assert it.get("/ca.pem").content == authority.read_bytes()
            assert it.post("/pair", json={"token": token}).status_code == 204
            (cookie,) = it.cookies.jar
            assert (cookie.secure, cookie.has_nonstandard_attr("HttpOnly")) == (True, True)
            assert it.get("/face").status_code == 200
            assert it.post("/api/v1/stop").status_code == 204
            evil = {"Origin": "https://evil.example"}
            assert it.post("/api/v1/stop", headers=evil).status_code == 403
        with miburi.connect(safe, token, authority) as partner:
            next(state for state in partner.watch() if state.phase == "stopped")
        # Its port may be another program's at that address; then nobody is told there.
        door = f"http://{urlsplit(safe).hostname}:{urlsplit(url).port}"
        with suppress(httpx.TransportError):
            page = get(door + "/pair")
            if page.status_code == 200 and "Miburi" in page.text:
                assert safe + "/pair" in page.text
                assert get(door + "/api/v1/state").status_code == 426
                assert post(door + "/pair", json={"token": token}).status_code == 426
        code, said, errors = program.end(signal.SIGINT)
    assert (code, errors) == (0, "")
    assert "Good-bye. The body was stopped and holds its position with little force; " in said


@pytest.mark.parametrize("https", [False, True])
def test_a_port_that_is_taken_is_said(https: bool) -> None:
    with socket.create_server(("0.0.0.0", 0)) as taken, pytest.raises(OutputError, match="--port"):
        port = taken.getsockname()[1]
        with listening_twice("0.0.0.0", port - 1) if https else listening_plainly("0.0.0.0", port):
            pass


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has other locks")
def test_a_folder_that_another_partner_uses_is_said_and_nothing_there_is_touched(
    tmp_path: Path,
) -> None:
    with alone_in(tmp_path):
        done = command("run", "--headless", "--port", "0", "--folder", tmp_path)
    assert done.returncode == 1
    assert "a folder of its own with --folder" in done.stderr
    assert [file.name for file in tmp_path.iterdir()] == [".lock"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--body", "marble", "--port", "0"), "one of simulated"),
        (("--temperament", "wild", "--port", "0"), "default, calm"),
        (("--ik", "best", "--port", "0"), "default, residual, paper"),
        (("--seed", "-1", "--port", "0"), "0 or more"),
        (("--body", "card", "--port", "0"), "give it one with --serial"),
    ],
)
def test_wrong_options_are_refused_in_words(options: tuple[str, ...], words: str) -> None:
    done = command("run", "--headless", *options)
    assert done.returncode == 2
    assert words in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("host", "port", "words"),
    [("127.0.0.1", 70_000, "from 0 to 65535"), ("no.such.host.invalid", 0, "not an address"),
     ("127.0.0.1", 65_535, "from 0 to 65535")],
)  # fmt: skip
def test_no_address_is_refused_in_words(host: str, port: int, words: str) -> None:
    with pytest.raises(InputError, match=words), listening_twice(host, port):
        pass


@pytest.mark.proof("test_on_this_computer_it_answers_at_once_and_moves")
def test_the_emulated_card_lives(tmp_path: Path, firmware: Path) -> None:
    with running(tmp_path, "--body", "emulated-card", "--forget") as program:
        url = address(program.out.next())
        assert get(url + "/api/v1/state").json()["body"] == "emulated-card"
        motors = get(url + "/api/v1/motors").json()["motors"]
        assert {motor["temperature"] for motor in motors} == {35.0}
        simulated = {"name": "simulated"}
        assert post(url + "/api/v1/bodies", json=simulated).status_code == 204
        again = {"name": "emulated-card"}
        assert post(url + "/api/v1/bodies", json=again).status_code == 204


@pytest.mark.parametrize("name", ["people.json", "manners.json", "feelings.json", "events.sqlite"])
def test_what_cannot_be_read_keeps_it_from_starting_and_is_left(tmp_path: Path, name: str) -> None:
    """It began anew in its place, so it forgot what root had restored."""
    (tmp_path / name).mkdir()
    given = (iphonoid(), shipped_repertoire(), shipped_temperament())
    launch = Launch(*given, folder=tmp_path, port=70_000)  # it would not start anyway
    with pytest.raises(InputError, match=rf"{name}: cannot be read \(.*; it belongs to .* chown"):
        serve(launch)
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such limit")
@pytest.mark.parametrize("files", [64, 160])
def test_so_few_files_are_refused_or_leave_enough_for_stop(tmp_path: Path, files: int) -> None:
    few = ("sh", "-c", f'ulimit -n {files}; exec "$@"', "sh")
    with running(tmp_path, within=few) as program, ExitStack() as opened:
        assert "Raise the limit: `ulimit -n 1024`" in program.errors.next(f"only {files} files")
        if files == 64:
            assert program.end(None)[0] == 2
            return
        url = address(program.out.next("Miburi is awake"))
        stream = partial(httpx.stream, "GET", url + "/api/v1/events", timeout=PATIENCE)
        answers = [opened.enter_context(stream()) for _ in range(40)]
        assert [answer.status_code for answer in answers] == [200] * 32 + [503] * 8
        assert post(url + "/api/v1/stop").status_code == 204
        until(lambda: get(url + "/api/v1/state").json()["held"])


def test_while_the_partner_hangs_the_server_says_that_it_cannot_be_reached(there: Program) -> None:
    url, process = there.url + "/api/v1", there.process
    process.send_signal(signal.SIGSTOP)
    try:
        answer = until(lambda: get(url + "/state"), lambda answer: answer.status_code != 200)
        assert (answer.status_code, "cannot be reached" in answer.text) == (503, True)
        assert post(url + "/stop").status_code == 503
        health = get(there.url + "/health")
        assert (health.status_code, health.json()) == (503, {"alive": False})
    finally:
        process.send_signal(signal.SIGCONT)
    until(lambda: get(url + "/state"), lambda answer: answer.status_code != 503)
    # That Stop has waited for it, and is taken at its next step; the stop for its own silence,
    # which comes first, would end by itself.
    seen = [get(url + "/state").json()]
    until(lambda: seen.append(get(url + "/state").json()) or seen[-1]["held"])  # type: ignore[func-returns-value]
    # The first answer may still be of the moment before; then it stops, and stays so.
    after = itertools.dropwhile(lambda state: state["phase"] != "stopped", seen)
    assert {state["phase"] for state in after} == {"stopped"}


@pytest.mark.parametrize(("which", "name"), [(SERVER, "server"), (RECEPTION, "reception")])
def test_while_the_server_hangs_the_body_is_stopped(there: Program, which: int, name: str) -> None:
    hung = helpers_of(there.process.pid)[which]
    os.kill(hung, signal.SIGSTOP)
    try:
        there.errors.next(f"the {name} does not respond, so the body was stopped")
    finally:
        os.kill(hung, signal.SIGCONT)
    # What the server was told while it hung, it hears first: the body still moves there.
    state = until(lambda: get(there.url + "/api/v1/state").json(), lambda state: state["held"])
    assert state["phase"] == "stopped"


def test_while_the_server_hangs_stop_works_and_comes_before_an_earlier_release(
    there: Program,
) -> None:
    here = urlsplit(there.url).hostname, urlsplit(there.url).port
    with (
        httpx.Client(base_url=there.url + "/api/v1", timeout=PATIENCE) as kept,
        socket.create_connection(here, PATIENCE) as release,
    ):
        kept.get("/state")
        server = helpers_of(there.process.pid)[SERVER]
        os.kill(server, signal.SIGSTOP)
        try:
            release.sendall(b"POST /api/v1/release HTTP/1.1\r\nHost: localhost\r\n\r\n")
            answers = [kept.post("/stop"), post(there.url + "/api/v1/stop"), kept.post("/stop")]
            # Long enough for the server to take its own sleep for the partner's.
            there.errors.next("the server does not respond")
        finally:
            os.kill(server, signal.SIGCONT)
        assert [answer.status_code for answer in answers] == [204] * 3
        said = HTTPResponse(release)
        said.begin()
        # A server that hears this before it hears the partner again refuses it, too: 503. That was
        # seen once in many runs, while the reception hung as well.
        refusals = {409: "Stop was pressed after", 503: "cannot be reached"}
        assert refusals.get(said.status, "?") in said.read().decode()
        assert kept.get("/state").json()["phase"] == "stopped"
