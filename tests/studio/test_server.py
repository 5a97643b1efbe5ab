"""The server as a user starts it: how it begins, whom it lets in, and how it ends."""

import json
import os
import re
import signal
import socket
import ssl
import subprocess
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from http.client import HTTPResponse
from itertools import islice
from pathlib import Path
from urllib.error import URLError
from urllib.parse import urlsplit
from urllib.request import Request, urlopen

import httpx
import numpy as np
import pytest
from tests.fixtures.live import address, own_environment, refuses_in_json, started_by_https
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

import miburi
from miburi.feelings import shipped_temperament
from miburi.interface.reach import qr_for_terminal
from miburi.live.memory import remembered
from miburi.live.recording import read

Start = Callable[..., AbstractContextManager[str]]


def run(*options: str) -> subprocess.CompletedProcess[str]:
    """Start a server that cannot start."""
    return subprocess.run(
        [sys.executable, "-m", "miburi", "run", "--headless", *options],
        capture_output=True, text=True, timeout=60, check=False, env=own_environment(),
    )  # fmt: skip


def awake(folder: Path, *options: str) -> subprocess.Popen[str]:
    """Start a server that a test ends in its own way."""
    return subprocess.Popen(
        [sys.executable, "-m", "miburi", "run", "--headless", "--port", "0", "--folder",
         str(folder), *options],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=own_environment(),
        start_new_session=True,
    )  # fmt: skip


def session(leader: int) -> dict[int, str]:
    """The living processes of a session and those that its leader started; their command lines."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            state, parent, _, session = (folder / "stat").read_text().rsplit(")", 1)[1].split()[:4]
            if str(leader) in (parent, session) and state != "Z":
                found[int(folder.name)] = (folder / "cmdline").read_text()
    return found


#: Which of the helpers is which, in the order in which they begin.
SERVER, RECEPTION = 0, 1


def helpers_of(partner: int) -> list[int]:
    """The processes that the partner's process has started: the server, and the reception."""
    return sorted(pid for pid, words in session(partner).items() if "spawn_main" in words)


def nobody_left(partner: int, helpers: list[int]) -> None:
    """Wait until all are gone; each helper has a session of its own."""
    while session(partner) or any(session(helper) for helper in helpers):
        pass


def test_on_this_computer_it_answers_at_once_and_moves(start: Start, tmp_path: Path) -> None:
    with start() as said:
        url = address(said)
        assert "Studio: " + url in said
        page = httpx.get(url)
        assert page.status_code == 200
        assert "Miburi" in page.text
        assert "Simulated, servo XL330-M288-T as identified by others." in page.text
        for source in ("http://", "https://"):
            assert source not in page.text.replace("http://www.w3.org", "")
        assert httpx.get(url + "/face").status_code == 200
        while (shown := httpx.get(url + "/api/v1/state").json()["expressed"]) is None:
            pass  # it breathes, and is about to greet
        assert shown["feeling"] == "happiness"
        assert httpx.get(url, headers={"Host": "evil.example"}).status_code == 403
        evil = {"Origin": "https://evil.example"}
        assert httpx.post(url + "/api/v1/stop", headers=evil).status_code == 403
        with pytest.raises(InvalidStatus):
            connect(url.replace("http", "ws") + "/api/v1/live", additional_headers=evil)
        socket_io = url + "/_nicegui_ws/socket.io/?EIO=4&transport=polling"
        assert httpx.get(socket_io, headers=evil).status_code == 403
    assert remembered(tmp_path / "feelings.json", shipped_temperament("playful")) is not None


def test_elsewhere_nothing_but_the_pairing_page_answers_without_the_token(
    start: Start, tmp_path: Path
) -> None:
    with start("--host", "0.0.0.0", "--forget") as said, httpx.Client() as stranger:
        url = address(said)
        token = (tmp_path / "token").read_text().strip()
        described = httpx.get(
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
        assert httpx.get(url + "/pair").status_code == 200
        assert httpx.post(url + "/pair", json={"token": "wrong"}).status_code == 401
        with httpx.Client(base_url=url) as phone:
            assert phone.post("/pair", json={"token": token}).status_code == 204
            cookie = next(iter(phone.cookies.jar))
            assert cookie.has_nonstandard_attr("HttpOnly")
            assert phone.get("/face").status_code == 200
            assert phone.post("/api/v1/stop").status_code == 204


def test_the_code_in_the_terminal_leads_to_an_address_that_a_phone_can_reach(
    tmp_path: Path,
) -> None:
    process = awake(tmp_path, "--host", "0.0.0.0")
    assert process.stdout is not None
    process.stdout.readline()
    process.stdout.readline()
    said = process.stdout.readline()
    code = "".join(process.stdout.readline() for _ in range(8))
    process.terminate()
    process.communicate(timeout=30)
    found = re.search(r"http://([\w.-]+):\d+/pair#[\w-]+/$", said)
    assert found, said
    assert found[1] not in ("127.0.0.1", "localhost", "0.0.0.0")
    assert qr_for_terminal(found[0]).startswith(code)


def test_by_https_a_phone_comes_in_and_by_http_only_this_computer(tmp_path: Path) -> None:
    with started_by_https(tmp_path) as (url, safe):
        authority, token = tmp_path / "https" / "ca.pem", (tmp_path / "token").read_text().strip()
        # Python's own client, as it comes: it checks the certificate and its address.
        mine = Request(safe + "/api/v1/state", headers={"Authorization": f"Bearer {token}"})
        with urlopen(mine, context=ssl.create_default_context(cafile=authority)) as answer:
            assert json.load(answer)["body"] == "simulated"
        with pytest.raises(URLError, match="CERTIFICATE_VERIFY_FAILED"):
            urlopen(mine)
        assert httpx.get(url + "/api/v1/state").status_code == 200
        assert httpx.get(url + "/ca.pem").content == authority.read_bytes()
        with httpx.Client(base_url=safe, verify=ssl.create_default_context(cafile=authority)) as it:
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
            assert any(state.phase == "stopped" for state in islice(partner.watch(), 100))
        door = f"http://{urlsplit(safe).hostname}:{urlsplit(url).port}"
        if httpx.get(door + "/pair").status_code == 200:
            assert safe + "/pair" in httpx.get(door + "/pair").text
            assert httpx.get(door + "/api/v1/state").status_code == 426
            assert httpx.post(door + "/pair", json={"token": token}).status_code == 426
        before = {path.name: path.read_bytes() for path in authority.parent.iterdir()}
    with started_by_https(tmp_path):
        assert {path.name: path.read_bytes() for path in authority.parent.iterdir()} == before


def test_a_broken_authority_is_made_anew_and_said_in_a_line(tmp_path: Path) -> None:
    (tmp_path / "https").mkdir()
    (tmp_path / "https" / "authority.pem").write_text("nonsense")
    process = awake(tmp_path, "--https")
    assert process.stdout is not None
    assert "Miburi is awake" in process.stdout.readline()
    process.send_signal(signal.SIGINT)
    said, errors = process.communicate(timeout=30)
    assert process.returncode == 0
    assert "Good-bye. The body rests at neutral" in said
    assert errors.count("\n") == 1
    assert "a new home authority was made" in errors


def test_a_port_for_https_that_is_taken_is_said() -> None:
    with socket.socket() as taken:
        taken.bind(("0.0.0.0", 0))
        taken.listen()
        done = run("--https", "--port", str(taken.getsockname()[1] - 1))
    assert done.returncode == 1
    assert "another port with --port" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_port_that_is_taken_is_said() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        done = run("--port", str(taken.getsockname()[1]))
    assert done.returncode == 1
    assert "another port with --port" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--port", "70000"), "from 0 to 65535"),
        (("--host", "no.such.host.invalid"), "not an address"),
        (("--body", "marble", "--port", "0"), "one of simulated"),
        (("--temperament", "wild", "--port", "0"), "default, calm"),
        (("--ik", "best", "--port", "0"), "default, residual, paper"),
        (("--seed", "-1", "--port", "0"), "0 or more"),
        (("--body", "card", "--port", "0"), "give it one with --serial"),
        (("--https", "--port", "65535"), "from 0 to 65535"),
    ],
)
def test_wrong_options_are_refused_in_words(options: tuple[str, ...], words: str) -> None:
    done = run(*options)
    assert done.returncode == 2
    assert words in done.stderr
    assert "Traceback" not in done.stderr


def test_a_card_that_is_not_there_is_said() -> None:
    done = run("--body", "card", "--serial", "/dev/no-such-port", "--port", "0", "--forget")
    assert done.returncode == 1
    assert "The card cannot be reached" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_card_that_is_not_built_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MIBURI_FIRMWARE", str(tmp_path))
    done = run("--body", "emulated-card", "--port", "0", "--forget")
    assert done.returncode == 1
    assert "make firmware" in done.stderr
    assert "Traceback" not in done.stderr


def test_the_emulated_card_lives(start: Start, firmware: Path) -> None:
    with start("--body", "emulated-card", "--forget") as said:
        url = address(said)
        assert httpx.get(url + "/api/v1/state").json()["body"] == "emulated-card"
        motors = httpx.get(url + "/api/v1/motors").json()["motors"]
        assert {motor["temperature"] for motor in motors} == {35.0}
        simulated = {"name": "simulated"}
        assert httpx.post(url + "/api/v1/bodies", json=simulated).status_code == 204
        again = {"name": "emulated-card"}
        assert httpx.post(url + "/api/v1/bodies", json=again, timeout=30).status_code == 204


def test_where_no_browser_can_be_opened_it_is_said(tmp_path: Path) -> None:
    environment = own_environment()
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        environment.pop(name, None)
    process = subprocess.Popen(
        [sys.executable, "-m", "miburi", "run", "--port", "0", "--folder", str(tmp_path)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
    )  # fmt: skip
    assert process.stdout is not None
    assert "Miburi is awake" in process.stdout.readline()
    assert "No browser could be opened here" in process.stdout.readline()
    process.terminate()
    _, errors = process.communicate(timeout=30)
    assert (process.returncode, errors) == (0, "")


def test_what_the_interface_has_not_is_said_in_json(start: Start) -> None:
    with start("--forget") as said:
        refuses_in_json(address(said))


def test_an_address_without_a_page_shows_the_ways_back_and_tells_the_terminal_nothing(
    tmp_path: Path,
) -> None:
    process = awake(tmp_path)
    assert process.stdout is not None
    url = address(process.stdout.readline())
    for language, words in (("en", "nothing at this address"), ("ja", "何もありません")):
        page = httpx.get(url + "/mistyped", headers={"Accept-Language": language})
        assert (page.status_code, words in page.text) == (404, True)
        assert 'href="/"' in page.text
    process.terminate()
    said, errors = process.communicate(timeout=30)
    assert ("mistyped" in said, errors) == (False, "")


def test_ctrl_c_is_a_good_end(tmp_path: Path) -> None:
    process = awake(tmp_path)
    assert process.stdout is not None
    url = address(process.stdout.readline())
    assert httpx.post(url + "/api/v1/recordings", json={"on": True}).status_code == 204
    process.send_signal(signal.SIGINT)
    said, errors = process.communicate(timeout=30)
    assert process.returncode == 0
    assert errors == ""
    assert said == f"Good-bye. The body rests at neutral; what it feels is kept in {tmp_path}.\n"
    assert (tmp_path / "recordings" / "miburi-0001.mcap").read_bytes().endswith(b"\x89MCAP0\r\n")


def test_ctrl_c_leaves_a_stopped_body_where_it_is(tmp_path: Path) -> None:
    process = awake(tmp_path)
    assert process.stdout is not None
    assert httpx.post(address(process.stdout.readline()) + "/api/v1/stop").status_code == 204
    process.send_signal(signal.SIGINT)
    said, errors = process.communicate(timeout=30)
    assert (process.returncode, errors) == (0, "")
    assert said.startswith("Good-bye. The body was stopped and stays where it is, softly held; ")


def test_ctrl_c_in_a_terminal_is_a_good_end_of_all_processes(tmp_path: Path) -> None:
    process = awake(tmp_path)
    assert process.stdout is not None
    process.stdout.readline()
    helpers = helpers_of(process.pid)
    os.killpg(process.pid, signal.SIGINT)
    said, errors = process.communicate(timeout=30)
    assert (process.returncode, errors) == (0, "")
    assert said.startswith("Good-bye. The body rests at neutral")
    nobody_left(process.pid, helpers)


def test_who_asks_it_twice_to_end_leaves_nobody_behind(tmp_path: Path) -> None:
    """The second time falls into the moment in which it ends its helpers, or soon after."""
    process = awake(tmp_path)
    assert process.stdout is not None
    url = address(process.stdout.readline())
    helpers = helpers_of(process.pid)
    process.terminate()
    with suppress(httpx.TransportError):
        while True:
            httpx.get(url + "/api/v1/state")
    process.terminate()
    said, errors = process.communicate(timeout=30)
    assert said.startswith("Good-bye. ") or "interrupted" in errors
    assert "Traceback" not in errors
    nobody_left(process.pid, helpers)


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
@pytest.mark.parametrize("which", [SERVER, RECEPTION])
def test_if_the_server_ends_the_body_is_stopped_and_the_program_ends_with_a_word(
    tmp_path: Path, how: signal.Signals, which: int
) -> None:
    process = awake(tmp_path)
    assert process.stdout is not None
    process.stdout.readline()
    helpers = helpers_of(process.pid)
    os.kill(helpers[which], how)
    said, errors = process.communicate(timeout=30)
    assert (process.returncode, said) == (1, "")
    assert "the server has ended" in errors
    assert "stopped where it was" in errors
    assert "Traceback" not in errors
    assert remembered(tmp_path / "feelings.json", shipped_temperament("playful")) is not None
    nobody_left(process.pid, helpers)


def test_if_the_partner_is_killed_the_server_ends_too(tmp_path: Path) -> None:
    process = awake(tmp_path)
    assert process.stdout is not None
    url = address(process.stdout.readline())
    helpers = helpers_of(process.pid)
    with connect(url.replace("http", "ws") + "/api/v1/live") as socket:
        socket.recv()
        process.kill()
        with pytest.raises(ConnectionClosed):
            while True:
                socket.recv(10)
    _, errors = process.communicate(timeout=30)
    assert "Traceback" not in errors
    nobody_left(process.pid, helpers)


def test_while_the_partner_hangs_the_server_says_that_it_cannot_be_reached(tmp_path: Path) -> None:
    process = awake(tmp_path)
    assert process.stdout is not None
    url = address(process.stdout.readline()) + "/api/v1"
    process.send_signal(signal.SIGSTOP)
    try:
        while (answer := httpx.get(url + "/state")).status_code == 200:
            pass
        assert (answer.status_code, "cannot be reached" in answer.text) == (503, True)
        assert httpx.post(url + "/stop").status_code == 503
    finally:
        process.send_signal(signal.SIGCONT)
    while (answer := httpx.get(url + "/state")).status_code == 503:
        pass
    # That Stop has waited for it, and is taken at its next step; the stop for its own silence,
    # which comes first, would end by itself.
    while not (state := httpx.get(url + "/state").json())["held"]:
        assert state["phase"] == "stopped"
    assert state["phase"] == "stopped"
    process.terminate()
    _, errors = process.communicate(timeout=30)
    assert (process.returncode, errors) == (0, "")


@pytest.mark.parametrize(("which", "name"), [(SERVER, "server"), (RECEPTION, "reception")])
def test_while_the_server_hangs_the_body_is_stopped(tmp_path: Path, which: int, name: str) -> None:
    process = awake(tmp_path)
    assert process.stdout is not None
    assert process.stderr is not None
    url = address(process.stdout.readline()) + "/api/v1"
    hung = helpers_of(process.pid)[which]
    os.kill(hung, signal.SIGSTOP)
    try:
        assert f"the {name} hangs, so the body was stopped" in process.stderr.readline()
    finally:
        os.kill(hung, signal.SIGCONT)
    # What the server was told while it hung, it hears first: the body still moves there.
    while not (state := httpx.get(url + "/state").json())["held"]:
        assert state["phase"] in ("idle", "moving")
    assert state["phase"] == "stopped"
    process.terminate()
    process.communicate(timeout=30)
    assert process.returncode == 0


def test_while_the_server_hangs_stop_works_and_comes_before_an_earlier_release(
    tmp_path: Path,
) -> None:
    process = awake(tmp_path)
    assert process.stdout is not None
    url = address(process.stdout.readline())
    here = urlsplit(url).hostname, urlsplit(url).port
    with httpx.Client(base_url=url + "/api/v1") as kept, socket.create_connection(here) as release:
        kept.get("/state")
        server = helpers_of(process.pid)[SERVER]
        os.kill(server, signal.SIGSTOP)
        try:
            release.sendall(b"POST /api/v1/release HTTP/1.1\r\nHost: localhost\r\n\r\n")
            answers = [kept.post("/stop"), httpx.post(url + "/api/v1/stop"), kept.post("/stop")]
        finally:
            os.kill(server, signal.SIGCONT)
        assert [answer.status_code for answer in answers] == [204] * 3
        said = HTTPResponse(release)
        said.begin()
        assert (said.status, b"Stop has been pressed since" in said.read()) == (409, True)
        assert kept.get("/state").json()["phase"] == "stopped"
    process.terminate()
    process.communicate(timeout=30)
    assert process.returncode == 0


def test_a_recording_of_a_killed_program_is_read_up_to_its_last_second(tmp_path: Path) -> None:
    process = awake(tmp_path)
    assert process.stdout is not None
    with miburi.connect(address(process.stdout.readline())) as partner:
        partner.record()
        began = partner.state.time
        for state in partner.watch(50):
            if state.time > began + 3.5:
                break
        process.kill()
    process.communicate(timeout=30)
    (path,) = (tmp_path / "recordings").glob("*.mcap")
    times = [message.time for message in read(path, ["/joint_states"])]
    assert times[0] <= began + 0.1
    assert times[-1] > state.time - 1.1
    assert np.diff(times) == pytest.approx(0.02)


@pytest.mark.parametrize("content", [b"[" * 100_000, b"\xff\x00", b'{"when": ' + b"9" * 400 + b"}"])
def test_bad_feelings_are_said_and_kept_aside(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "feelings.json"
    path.write_bytes(content)
    process = awake(tmp_path)
    assert process.stdout is not None
    assert "Miburi is awake" in process.stdout.readline()
    process.terminate()
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 0
    assert errors.count("\n") == 1
    assert "the partner starts afresh" in errors
    assert path.with_name("feelings.json.bad").read_bytes() == content
    assert remembered(path, shipped_temperament("playful")) is not None
