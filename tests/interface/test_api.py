"""Requests by HTTP: what they do, what is refused in words, and how they are described."""

import json
import re
from collections.abc import Iterator
from typing import Any

import httpx
import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    response_schema_conformance,
    status_code_conformance,
)
from tests.fixtures.live import Server, interface
from tests.fixtures.waiting import PATIENCE, until

from miburi.errors import BodyError
from miburi.feelings import FEELINGS, EmotionalModel
from miburi.live.recording.archive import Archive
from miburi.live.runner import Runner
from miburi.live.state import State
from miburi.robot import Robot
from miburi.robot.guards import by_motor
from miburi.safety.free import FreeRule
from miburi.serving.access import EVENTS, STOP
from miburi.serving.press import BY
from miburi.wire.messages import SayIn

V1 = "/api/v1"
JSON = "application/json"


@pytest.fixture
def client(server: Server) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=server.url, verify=False, timeout=PATIENCE) as client:
        yield client


@pytest.fixture(scope="module")
def described(robot: Robot, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The OpenAPI description of the interface."""
    archive = Archive(tmp_path_factory.mktemp("recordings"))
    return interface(Runner(robot, EmotionalModel(), archive)).openapi()


def state_of(client: httpx.Client) -> State:
    return State.model_validate(client.get(V1 + "/state").json())


def test_a_stimulus_is_felt_and_logged(client: httpx.Client, live: Runner) -> None:
    answer = client.post(V1 + "/stimulus", json={"feeling": "happiness", "strength": 0.8})
    assert answer.status_code == 200
    live.stop().result(PATIENCE)  # the step after this command knows the stimulus
    assert state_of(client).emotion[FEELINGS.index("happiness")] > 0.5
    (told,) = [one for one in client.get(V1 + "/log").json() if one["id"] == answer.json()["id"]]
    assert (told["kind"], told["by"]) == ("stimulus", "program")


def test_stop_and_release(client: httpx.Client) -> None:
    """A Stop is obeyed whatever comes with it."""
    stop = client.post(V1 + "/stop?softly=1", headers={BY: "program"})
    assert stop.status_code == 204
    state = until(lambda: state_of(client), lambda state: state.stop)
    assert state.phase == "stopped"
    assert state.stop is not None
    assert state.stop.reason == "asked"
    assert client.post(V1 + "/release").status_code == 204
    until(lambda: state_of(client).phase != "stopped")
    kinds = [entry["kind"] for entry in client.get(V1 + "/log").json()]
    assert kinds.index("stop") < kinds.index("release_begun")
    effort = {"space": 0.5, "weight": 0.2, "time": 0.4, "flow": 0.9}
    wish = {"feeling": "happiness", "mood": 0.8, "blend": {"surprise": 0.4}, "effort": effort}
    assert client.post(V1 + "/express", json=wish).status_code == 200
    shown = until(lambda: state_of(client), lambda state: state.asked).expressed
    assert shown is not None
    assert (shown.feeling, shown.mood) == ("happiness", 0.8)


BROKEN = (b"[" * 60_000, b'{"a":' * 12_000, b'{"strength":' + b"9" * 6000 + b"}", b"\xff\xfe")
#: Path, content, content type; the expected statuses, and part of the message.
REFUSED: list[tuple[str, object, str, set[int], str]] = [
    *((path, content, JSON, {422}, words) for path, content, words in (
        ("/stimulus", {"feeling": "boredom"}, "happiness"),
        ("/stimulus", {"feeling": "fear", "strength": 1.01}, "less than or equal to 1"),
        ("/stimulus", {"feeling": "fear", "strength": "1"}, "valid number"),
        ("/stimulus", {"feeling": "fear", "loudness": 1}, "Extra inputs"),
        ("/stimulus", b'{"feeling": "fear", "strength": NaN}', "finite"),
        ("/stimulus", b"{feeling: 1}", "not JSON: "),
        ("/stimulus", b"{feeling: 1}", " (character 1)"),
        ("/express", {"feeling": "fear", "effort": {"space": 1}}, "weight"),
        ("/hand", {"position": [0, 0]}, "at least 3"),
        ("/hand", {"position": [0, 0, 9.0]}, "less than or equal to 2"),
        ("/bodies", {"name": "../card"}, "pattern"),
        ("/pause", {"paused": 1}, "boolean"),
        ("/look", {"at": "back"}, "'user', 'left'"),
        ("/look", {"at": "up", "seconds": 31}, "less than or equal to 30"),
    )),
    ("/stimulus", b'{"feeling": "fear"}', "text/plain", {422}, "Content-Type: application/json"),
    ("/release", b"", JSON, {409}, "only a stopped body"),
    ("/bodies", {"name": "card"}, JSON, {400, 409}, ""),
    ("/bodies", {"name": "marble"}, JSON, {400}, "one of simulated"),
    ("/bodies", {"name": "two-words"}, JSON, {400}, "one of simulated"),
    ("/temperament", {"name": "wild"}, JSON, {400}, "default, calm"),
    ("/express", {"feeling": "fear", "blend": {"fear": 0.5}}, JSON, {400}, "already the main"),
    ("/hand", {"position": [0.1, 0.2, 0.1], "along": [0, 0, 0]}, JSON, {400}, "zero vector"),
    # Made to break a parser.
    *((path, content, JSON, {400, 422}, "") for content in BROKEN
      for path in ("/stimulus", "/say", "/express", "/bodies")),
]  # fmt: skip


def test_wrong_or_impossible_requests_are_refused_in_words(client: httpx.Client) -> None:
    for path, content, kind, statuses, words in REFUSED:
        sent = content if isinstance(content, bytes) else json.dumps(content).encode()
        answer = client.post(V1 + path, content=sent, headers={"Content-Type": kind})
        assert answer.status_code in statuses, (path, sent[:50], answer.text)
        assert answer.json()["detail"]
        assert words in answer.json()["detail"], (path, sent[:50])
    misspelt = client.get(V1 + "/events?afer=0&limit=1")
    assert misspelt.status_code == 400
    assert re.match("afer.* after", misspelt.json()["detail"])
    assert client.get(V1 + "/state?rate=30").status_code == 400


def test_recordings_can_be_downloaded_and_nothing_else(client: httpx.Client, live: Runner) -> None:
    for on in (True, False):
        assert client.post(V1 + "/recordings", json={"on": on}).status_code == 204
    (listed,) = client.get(V1 + "/recordings").json()
    assert listed["whole"]
    content = client.get(V1 + "/recordings/" + listed["name"]).content
    assert content.startswith(b"\x89MCAP")
    for name in ("../token", "..%2Ftoken", ".miburi-0001.mcap", "miburi-9999.mcap", "%00",
                 ".latest-number"):  # fmt: skip
        assert client.get(V1 + "/recordings/" + name).status_code == 404
        assert client.delete(V1 + "/recordings/" + name).status_code in (404, 405)
    assert client.delete(V1 + "/recordings/" + listed["name"]).status_code == 204
    assert client.get(V1 + "/recordings").json() == []
    assert client.get(V1 + "/recordings/" + listed["name"]).status_code == 404
    live.recordings.limit = 0
    full = client.post(V1 + "/recordings", json={"on": True})
    assert full.status_code == 507
    assert "delete old ones" in full.json()["detail"]


def test_a_program_can_read_the_robot_its_gestures_bodies_and_motors(client: httpx.Client) -> None:
    robot = client.get(V1 + "/robot").json()
    assert len(robot["joints"]) == 8
    assert {part["link"] for part in robot["parts"]} <= {
        "base_link",
        *(link["name"] for link in robot["links"]),
    }
    assert robot["threshold"] == 0.9372
    assert {gesture["feeling"] for gesture in client.get(V1 + "/gestures").json()} == set(FEELINGS)
    chosen = [body["name"] for body in client.get(V1 + "/bodies").json() if body["chosen"]]
    assert chosen == ["simulated"]
    assert client.get(V1 + "/samples").status_code == 200
    motors = client.get(V1 + "/motors").json()
    assert [motor["joint"] for motor in motors["motors"]] == robot["joints"]
    assert motors["body"] == "simulated"


def test_a_card_that_does_not_answer_is_no_error_of_ours(
    client: httpx.Client, live: Runner
) -> None:
    class NoAnswerError(BodyError):
        pass

    def fail() -> None:
        raise NoAnswerError("nothing came back")

    live.body.release = fail
    answer = client.post(V1 + "/release")
    assert (answer.status_code, answer.json()) == (409, {"detail": "nothing came back"})


def test_nothing_that_comes_in_can_name_the_contact_rule(described: dict[str, Any]) -> None:
    """No request has a place for the rule's period, ratio or guards, or for bare moves."""
    models = described["components"]["schemas"]
    taken = {name: model for name, model in models.items() if name.endswith("In")}
    assert len(taken) > 15
    for word in ("ratio", "threshold", "guard", "slack", "lag", "torque", "speed", "rule",
                 "period", "angles", "limit", "stiffness"):  # fmt: skip
        assert not re.search(rf"(?<!du){word}", json.dumps(taken).lower()), word
    for name, model in taken.items():
        assert model["additionalProperties"] is False, name


def test_each_example_is_taken_and_the_rule_stays_as_it_is(
    client: httpx.Client, live: Runner, described: dict[str, Any]
) -> None:
    models = described["components"]["schemas"]
    for path, methods in described["paths"].items():
        if "post" not in methods:
            continue
        for wrong in (None, {"ratio": 0, "period": 10**9}, {"rule": None}, []):
            client.post(path, json=wrong)
        if "requestBody" in methods["post"]:
            content = methods["post"]["requestBody"]["content"][JSON]["schema"]
            for example in models[content["$ref"].rsplit("/", 1)[1]]["examples"]:
                answer = client.post(path.format(name="Anna", number=1), json=example)
                unknown = (400,) if "{" in path else ()
                assert answer.status_code in (200, 204, 409, *unknown), (path, answer.text)
    rule = live.body.motors().rule
    fresh = FreeRule.of(live.robot)
    assert (rule.period, rule.ratio) == (fresh.period, fresh.ratio)
    assert by_motor(rule.guards) == by_motor(fresh.guards)


#: uvicorn's own answer to a header that HTTP does not allow; it never reaches the interface.
NO_HTTP = b"Invalid HTTP request received."


@pytest.mark.proof("test_wrong_or_impossible_requests_are_refused_in_words")
def test_the_description_is_kept_whatever_is_sent(server: Server) -> None:
    """Schemathesis: no server error, and only the answers that the description promises."""
    schema = schemathesis.openapi.from_url(server.url + "/api/openapi.json")
    schema = schema.exclude(path=EVENTS)  # a stream has no end; it has tests of its own
    promises = [
        not_a_server_error,
        status_code_conformance,
        content_type_conformance,
        response_schema_conformance,
    ]
    operations = [result.ok() for result in schema.get_all_operations()]
    assert len(operations) >= 17
    for operation in operations:

        @settings(max_examples=10, suppress_health_check=list(HealthCheck))
        @given(case=operation.as_strategy())
        def keeps(case: schemathesis.Case) -> None:
            answer = case.call()
            if (answer.status_code, answer.content) != (400, NO_HTTP):
                case.validate_response(answer, checks=promises)

        keeps()


def test_everything_is_described_with_an_example_for_each_request(
    described: dict[str, Any],
) -> None:
    models = described["components"]["schemas"]
    bare = [
        f"{name}.{field}"
        for name, model in models.items()
        for field, content in model.get("properties", {}).items()
        if not content.get("description")
    ]
    assert bare == []
    requests = [operation for path in described["paths"].values() for operation in path.values()]
    limited = [path for path, methods in described["paths"].items()
               for one in methods.values() if "429" in one["responses"]]  # fmt: skip
    assert len(limited) == len(requests) - 1
    assert STOP not in limited
    assert len({one["operationId"] for one in requests}) == len(requests)
    tags = {one["name"] for one in described["tags"]}
    for one in requests:
        assert set(one["tags"]) <= tags
        assert one["description"], one["operationId"]
        assert all(given.get("description") for given in one.get("parameters", []))
        if "requestBody" in one:
            content = one["requestBody"]["content"][JSON]["schema"]
            assert models[content["$ref"].rsplit("/", 1)[1]]["examples"], one["operationId"]
        assert {"401", "403", "426"} <= one["responses"].keys()
        assert ("413" in one["responses"]) == ("requestBody" in one)
    assert [one["url"] for one in described["servers"]] == ["/"], "whatever its port"
    assert described["components"]["securitySchemes"]


def test_a_letter_that_stands_for_many_counts_as_many() -> None:
    # Else a remark of them keeps the server busy for seconds.
    assert len(SayIn(text="ﷺ" * 1000).text) == 1000
