"""A person's Stop is ended by a person; who pressed and who released stands in the log."""

import json
import socket
from concurrent.futures import ThreadPoolExecutor

import pytest
from fastapi import FastAPI
from tests.fixtures.live import interface, run, serving
from tests.fixtures.waiting import post, until
from websockets.sync.client import connect

import miburi
from miburi.errors import BodyError
from miburi.live.runner import Runner
from miburi.live.wishes import ChangeBody, Release
from miburi.serving.access import STOP, Gate
from miburi.serving.press import BY, By, Hold, who
from miburi.studio.face_page import RELEASE, add_face_page

V1 = "/api/v1"


@pytest.mark.parametrize(
    ("by", "name"),
    [
        ("person", "a person"),
        ("home", "the smart home"),
        ("agent", "an assistant"),
        ("ros", "ROS"),
        ("partner", "a person"),
        ("my own button", "a person"),
    ],
)
def test_no_program_ends_the_stop_of_anybody_else(by: str, name: str) -> None:
    hold = Hold()
    hold.press(who(by))
    hold.press("program")  # a later Stop does not hide a person's
    with pytest.raises(BodyError, match=f"^{name} pressed Stop, so only a person"):
        hold.check(by_person=False)
    hold.check(by_person=True)
    assert hold.end(by_person=True) == "person"
    hold.check(by_person=False)


@pytest.mark.parametrize(("by", "programs_may"), [("program", False), ("person", True)])
def test_a_program_ends_its_own_stop_or_any_stop_if_it_may(by: By, programs_may: bool) -> None:
    hold = Hold(programs_may_release=programs_may)
    hold.press(by)
    hold.check(by_person=False)
    assert hold.end(by_person=False) == "program"


def test_a_persons_stop_is_held_at_every_door_until_a_page_releases_it(live: Runner) -> None:
    app: FastAPI = interface(live)
    add_face_page(app, live)
    with serving(Gate(app)) as url, miburi.connect(url) as partner:
        partner.stop()
        until(lambda: partner.state.held)
        partner.release()
        assert partner.wait().stop is None
        partner.stop()
        assert post(url + STOP, headers={BY: "somebody's own button"}).status_code == 204
        then = until(lambda: partner.state, lambda state: state.held).time
        until(lambda: partner.state.time >= then + 0.5)  # it has come to rest
        refused = [
            post(url + V1 + "/release"),
            post(url + V1 + "/release", headers={BY: "person"}),
            post(url + RELEASE, json={}),  # it is no page
        ]
        assert [answer.status_code for answer in refused] == [409] * 3
        assert all("only a person" in answer.json()["detail"] for answer in refused)
        with pytest.raises(BodyError, match="only a person"):
            partner.release()
        with connect("ws" + url.removeprefix("http") + V1 + "/live") as line:
            line.send(json.dumps({"do": "release"}))
            heard = (json.loads(line.recv(timeout=10)) for _ in range(300))
            refusal = next(one["refused"] for one in heard if "refused" in one)
        assert "only a person" in refusal
        assert partner.state.phase == "stopped"
        shown = {"seen": partner.state.serial}
        assert post(url + RELEASE, json=shown, headers={"Origin": url}).status_code == 204
    kinds = ("pressed", "release_begun")
    assert [(one.kind, one.by) for one in live.history.after(0) if one.kind in kinds] == [
        ("pressed", "program"),
        ("release_begun", "program"),
        ("pressed", "program"),
        ("pressed", "person"),
        ("release_begun", "person"),
    ]


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
