"""A person's Stop is ended by a person; who pressed and who released stands in the log."""

import json
import socket
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest
from fastapi import FastAPI
from tests.fixtures.live import Server, interface, run, serving
from tests.fixtures.waiting import post, until
from websockets.sync.client import connect

import miburi
from miburi.errors import BodyError
from miburi.feelings import EmotionalModel, shipped_temperament
from miburi.live.runner import Runner
from miburi.live.wishes import ChangeBody, Release
from miburi.serving.access import STOP, Gate
from miburi.serving.press import BY, Hold
from miburi.studio.face_page import RELEASE, add_face_page

V1 = "/api/v1"


@pytest.fixture
def page(live: Runner) -> Iterator[Server]:
    """The interface with the face's page."""
    app: FastAPI = interface(live)
    add_face_page(app, live)
    with serving(Gate(app)) as url:
        yield Server(url, live)


def held(page: Server) -> bool:
    """Whether the body is stopped, and stays so when it has come to rest."""
    until(lambda: page.runner.snapshot.state.held)
    then = page.runner.snapshot.state.time
    until(lambda: page.runner.snapshot.state.time >= then + 0.5)
    return page.runner.snapshot.state.phase == "stopped"


def told(runner: Runner) -> list[tuple[str, str | None]]:
    return [
        (one.kind, one.by)
        for one in runner.history.after(0)
        if one.kind in ("pressed", "release_begun")
    ]


def release_by_every_door(page: Server) -> list[str]:
    """Try to release as programs do; return why each was refused."""
    answers = [
        post(page.url + V1 + "/release"),
        post(page.url + V1 + "/release", headers={BY: "person"}),
        post(page.url + RELEASE, json={}),  # it is no page
    ]
    assert [answer.status_code for answer in answers] == [409] * 3
    why = [answer.json()["detail"] for answer in answers]
    with miburi.connect(page.url) as partner, pytest.raises(BodyError) as refused:
        partner.release()
    with connect("ws" + page.url.removeprefix("http") + V1 + "/live") as socket:
        socket.send(json.dumps({"do": "release"}))
        while "refused" not in (heard := json.loads(socket.recv(timeout=10))):
            pass
    return [*why, str(refused.value), heard["refused"]]


@pytest.mark.parametrize("by", ["person", "home", "agent", "ros", "somebody's own button"])
def test_no_program_ends_the_stop_of_anybody_else(page: Server, by: str) -> None:
    assert post(page.url + STOP, headers={BY: by}).status_code == 204
    assert held(page)
    assert all("only a person" in why for why in release_by_every_door(page))
    assert page.runner.snapshot.state.phase == "stopped"
    known = by if by in ("home", "agent", "ros") else "person"
    assert told(page.runner) == [("pressed", known)]
    shown = {"seen": page.runner.snapshot.state.serial}
    answer = post(page.url + RELEASE, json=shown, headers={"Origin": page.url})
    assert answer.status_code == 204
    assert told(page.runner) == [("pressed", known), ("release_begun", "person")]


def test_a_program_ends_its_own_stop_until_a_person_presses_too(page: Server) -> None:
    with miburi.connect(page.url) as partner:
        partner.stop()
        assert held(page)
        partner.release()
        assert partner.wait().stop is None
        partner.stop()
        post(page.url + STOP)
        partner.stop()  # whatever comes later hides no person's Stop
        assert held(page)
        with pytest.raises(BodyError, match="only a person"):
            partner.release()
    assert told(page.runner) == [
        ("pressed", "program"),
        ("release_begun", "program"),
        ("pressed", "program"),
        ("pressed", "person"),
    ]


def test_a_program_may_end_it_where_the_partner_was_started_so(runner: Runner) -> None:
    hold = Hold(programs_may_release=True)
    mild = Runner(
        runner.robot, EmotionalModel(shipped_temperament("playful")), runner.recordings, hold=hold
    )
    mild.stop()
    run(mild, 1.0)
    freed = mild.ask(Release())
    run(mild, 0.1)
    freed.result(0)


def test_a_stop_whose_connection_gave_way_is_pressed_again_once() -> None:
    heard = []

    def answer(listener: socket.socket) -> None:
        for answered in (b"", b"HTTP/1.1 204 No Content\r\n\r\n"):
            line, _ = listener.accept()
            with line:
                heard.append(line.recv(65_536))
                line.sendall(answered)

    with socket.create_server(("127.0.0.1", 0)) as listener, ThreadPoolExecutor() as pool:
        listener.settimeout(5.0)
        done = pool.submit(answer, listener)
        with miburi.connect(f"http://127.0.0.1:{listener.getsockname()[1]}") as partner:
            partner.stop()
        done.result(10)
    first, second = (words.lower() for words in heard)
    assert first == second
    assert b"\r\nmiburi-by: program\r\n" in second


def test_another_body_is_still_held_by_the_person(runner: Runner) -> None:
    runner.stop()
    run(runner, 1.0)
    runner.ask(ChangeBody("simulated"))
    run(runner, 1.0)
    refused = runner.ask(Release())
    run(runner, 0.1)
    with pytest.raises(BodyError, match="only a person"):
        refused.result(0)
    assert runner.snapshot.state.phase == "stopped"
