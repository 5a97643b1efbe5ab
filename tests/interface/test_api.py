import json
import re
from collections.abc import Iterator

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
from tests.fixtures.live import Server
from tests.fixtures.waiting import PATIENCE, post, until

from miburi.errors import BodyError
from miburi.feelings import FEELINGS
from miburi.live.runner import Runner
from miburi.live.state import State
from miburi.robot.guards import by_motor
from miburi.safety.free import FreeRule
from miburi.serving.access import EVENTS, STOP
from miburi.serving.press import BY

V1 = "/api/v1"


@pytest.fixture
def client(server: Server) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=server.url, verify=False, timeout=PATIENCE) as client:
        yield client


def state_of(client: httpx.Client) -> State:
    return State.model_validate(client.get(V1 + "/state").json())


def unlike(
    client: httpx.Client, wishes: list[tuple[str, object, set[int], str]]
) -> list[tuple[str, object, int, str]]:
    """Return what is answered otherwise than with these codes and words."""
    answers = [(one, client.post(V1 + one[0], json=one[1])) for one in wishes]
    return [
        (path, content, answer.status_code, answer.text)
        for (path, content, codes, words), answer in answers
        if answer.status_code not in codes or words not in answer.json()["detail"]
    ]


def test_one_request_makes_it_feel(client: httpx.Client, live: Runner) -> None:
    answer = client.post(V1 + "/stimulus", json={"feeling": "happiness", "strength": 0.8})
    assert answer.status_code == 200
    live.stop().result(PATIENCE)  # the step after this command knows the stimulus
    state = state_of(client)
    assert state.emotion[FEELINGS.index("happiness")] > 0.5
    (told,) = [one for one in client.get(V1 + "/log").json() if one["id"] == answer.json()["id"]]
    assert (told["kind"], told["by"]) == ("stimulus", "person")


def test_wrong_values_are_refused_in_words(client: httpx.Client) -> None:
    wrong = [
        ("/stimulus", {"feeling": "boredom"}, "happiness"),
        ("/stimulus", {"feeling": "fear", "strength": 1.01}, "less than or equal to 1"),
        ("/stimulus", {"feeling": "fear", "strength": "1"}, "valid number"),
        ("/stimulus", {"feeling": "fear", "loudness": 1}, "Extra inputs"),
        ("/express", {"feeling": "fear", "effort": {"space": 1}}, "weight"),
        ("/hand", {"position": [0, 0]}, "at least 3"),
        ("/hand", {"position": [0, 0, 9.0]}, "less than or equal to 2"),
        ("/bodies", {"name": "../card"}, "pattern"),
        ("/pause", {"paused": 1}, "boolean"),
        ("/look", {"at": "back"}, "'user', 'left'"),
        ("/look", {"at": "up", "seconds": 31}, "less than or equal to 30"),
    ]
    assert unlike(client, [(path, content, {422}, words) for path, content, words in wrong]) == []


def test_what_cannot_be_done_is_said_in_words(client: httpx.Client) -> None:
    refused: list[tuple[str, object, set[int], str]] = [
        ("/release", None, {409}, "only a stopped body"),
        ("/bodies", {"name": "card"}, {400, 409}, ""),
        ("/bodies", {"name": "marble"}, {400}, "one of simulated"),
        ("/bodies", {"name": "two-words"}, {400}, "one of simulated"),
        ("/temperament", {"name": "wild"}, {400}, "default, calm"),
        (
            "/express",
            {"feeling": "fear", "blend": {"fear": 0.5}},
            {400},
            "already the main feeling",
        ),
        ("/hand", {"position": [0.1, 0.2, 0.1], "along": [0, 0, 0]}, {400}, "zero vector"),
    ]
    assert unlike(client, refused) == []


def test_a_misspelt_parameter_is_named_and_a_stop_is_obeyed_whatever_comes_with_it(
    client: httpx.Client,
) -> None:
    refused = client.get(V1 + "/events?afer=0&limit=1")
    assert refused.status_code == 400
    assert refused.json()["detail"].startswith("afer")
    assert "after" in refused.json()["detail"]
    assert client.get(V1 + "/state?rate=30").status_code == 400
    assert client.post(STOP + "?softly=1").status_code == 204
    until(lambda: state_of(client).phase == "stopped")


def test_the_refusal_that_any_request_may_meet_is_described(client: httpx.Client) -> None:
    described = client.get("/api/openapi.json").json()["paths"]
    for path, methods in described.items():
        for method, operation in methods.items():
            assert ("429" in operation["responses"]) == (path != STOP), (method, path)


def test_a_body_made_to_break_a_parser_is_refused(client: httpx.Client) -> None:
    headers = {"Content-Type": "application/json"}
    number = b'{"strength":' + b"9" * 6000 + b"}"
    for content in (b"[" * 60_000, b'{"a":' * 12_000, number, b"\xff\xfe"):
        for path in ("/stimulus", "/say", "/express", "/bodies"):
            answer = client.post(V1 + path, content=content, headers=headers)
            assert answer.status_code in (400, 422), (path, content[:20])
            assert answer.json()["detail"]


def test_nan_is_no_number(client: httpx.Client) -> None:
    body = '{"feeling": "fear", "strength": NaN}'
    answer = client.post(
        V1 + "/stimulus", content=body, headers={"Content-Type": "application/json"}
    )
    assert answer.status_code == 422


def test_stop_and_release(client: httpx.Client) -> None:
    assert client.post(V1 + "/stop", headers={BY: "program"}).status_code == 204
    state = until(lambda: state_of(client), lambda state: state.stop)
    assert state.phase == "stopped"
    assert state.stop is not None
    assert state.stop.reason == "asked"
    assert client.post(V1 + "/release").status_code == 204
    until(lambda: state_of(client).phase != "stopped")
    kinds = [entry["kind"] for entry in client.get(V1 + "/log").json()]
    assert kinds.index("stop") < kinds.index("release_begun")


def test_a_blend_with_its_own_effort_is_performed(client: httpx.Client) -> None:
    effort = {"space": 0.5, "weight": 0.2, "time": 0.4, "flow": 0.9}
    wish = {"feeling": "happiness", "mood": 0.8, "blend": {"surprise": 0.4}, "effort": effort}
    assert client.post(V1 + "/express", json=wish).status_code == 200
    shown = until(lambda: state_of(client), lambda state: state.asked).expressed
    assert shown is not None
    assert (shown.feeling, shown.mood) == ("happiness", 0.8)


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


def test_a_full_folder_is_said(client: httpx.Client, live: Runner) -> None:
    live.recordings.limit = 0
    answer = client.post(V1 + "/recordings", json={"on": True})
    assert answer.status_code == 507
    assert "delete old ones" in answer.json()["detail"]


def test_what_can_be_looked_at(client: httpx.Client, live: Runner) -> None:
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


def test_nothing_that_comes_in_can_name_the_contact_rule(client: httpx.Client) -> None:
    """No request has a place for the rule's period, ratio or guards, or for bare moves."""
    schema = client.get("/api/openapi.json").json()
    taken = json.dumps(
        [schema["components"]["schemas"][name] for name in schema["components"]["schemas"]
         if name.endswith("In")]
    ).lower()  # fmt: skip
    for word in ("ratio", "threshold", "guard", "slack", "lag", "torque", "speed", "rule",
                 "period", "angles", "limit", "stiffness"):  # fmt: skip
        assert not re.search(rf"(?<!du){word}", taken), word
    for name, part in schema["components"]["schemas"].items():
        if name.endswith("In"):
            assert part["additionalProperties"] is False, name


def test_the_rule_is_the_same_after_every_request(client: httpx.Client, live: Runner) -> None:
    schema = client.get("/api/openapi.json").json()
    for path, operations in schema["paths"].items():
        if "post" in operations:
            for content in (None, {"ratio": 0, "period": 10**9}, {"rule": None}, []):
                client.post(path, json=content)
    rule = live.body.motors().rule
    fresh = FreeRule.of(live.robot)
    assert (rule.period, rule.ratio) == (fresh.period, fresh.ratio)
    assert by_motor(rule.guards) == by_motor(fresh.guards)


#: uvicorn's own answer to a header that HTTP does not allow; it never reaches the interface.
NO_HTTP = b"Invalid HTTP request received."


@pytest.mark.proof("test_wrong_values_are_refused_in_words")
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


def test_everything_is_described_with_an_example_for_each_request(client: httpx.Client) -> None:
    schema = client.get("/api/openapi.json").json()
    models = schema["components"]["schemas"]
    bare = [
        f"{name}.{field}"
        for name, model in models.items()
        for field, content in model.get("properties", {}).items()
        if not content.get("description")
    ]
    assert bare == []
    requests = [operation for path in schema["paths"].values() for operation in path.values()]
    assert len({one["operationId"] for one in requests}) == len(requests)
    tags = {one["name"] for one in schema["tags"]}
    for one in requests:
        assert set(one["tags"]) <= tags
        assert one["description"], one["operationId"]
        assert all(given.get("description") for given in one.get("parameters", []))
        if "requestBody" in one:
            content = one["requestBody"]["content"]["application/json"]["schema"]
            assert models[content["$ref"].rsplit("/", 1)[1]]["examples"], one["operationId"]
    assert schema["servers"]
    assert schema["components"]["securitySchemes"]


def test_each_example_is_taken(client: httpx.Client) -> None:
    schema = client.get("/api/openapi.json").json()
    for path, methods in schema["paths"].items():
        if "requestBody" in methods.get("post", {}):
            content = methods["post"]["requestBody"]["content"]["application/json"]["schema"]
            name = content["$ref"].rsplit("/", 1)[1]
            for example in schema["components"]["schemas"][name]["examples"]:
                answer = client.post(path.format(name="Anna", number=1), json=example)
                unknown = (400,) if "{" in path else ()
                assert answer.status_code in (200, 204, 409, *unknown), (path, answer.text)


@pytest.mark.parametrize(
    ("sent", "kind", "words"),
    [
        (b'{"feeling": "fear"}', "text/plain", "Content-Type: application/json"),
        (b"{feeling: 1}", "application/json", r"not JSON: .* \(character 1\)"),
    ],
)
def test_a_request_that_is_not_json_is_told_so(
    server: Server, sent: bytes, kind: str, words: str
) -> None:
    url = server.url + "/api/v1/stimulus"
    answer = post(url, content=sent, headers={"Content-Type": kind})
    assert answer.status_code == 422
    assert re.search(words, answer.json()["detail"])
