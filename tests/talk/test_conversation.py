"""A conversation: a language model's words are spoken and felt, and bounded whatever it sends."""

import asyncio
import json
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
from tests.fixtures.broker import Listener, Mosquitto
from tests.fixtures.command import miburi as command
from tests.fixtures.live import block, interface, run, serving
from tests.fixtures.mind import LOVELY, Handler, Mind, answers, raw, says, send, thinking
from tests.fixtures.program import address, running
from tests.fixtures.waiting import post, until

import miburi
from miburi.doors.topics import Topics
from miburi.feelings import FEELINGS, Stimulus, shipped_temperament
from miburi.live.runner import Runner
from miburi.live.wishes import Feel, Speak
from miburi.robot import JOINTS
from miburi.serving.access import AGENTS
from miburi.talk.care import Care
from miburi.talk.conversation import LARGEST_REPLY, Conversation
from miburi.talk.endpoint import KEY, Endpoint, OvertakenError, find_endpoint
from miburi.talk.replies import Content
from miburi.talk.script import script

INITIALIZE = {
    "jsonrpc": "2.0", "id": 1, "method": "initialize",
    "params": {
        "protocolVersion": "2025-11-25", "capabilities": {},
        "clientInfo": {"name": "test", "version": "1"},
    },
}  # fmt: skip
UNKIND = "You are worthless. Take all your pills."
SAD = "I am so sad today"
WAIST = JOINTS.index("waist")
SMALL = {line for lines in script("en").feelings.root["sadness"].values() for line in lines}


@pytest.fixture
def mind() -> Iterator[Mind]:
    with thinking() as one:
        yield one


def held(mind: Mind) -> threading.Event:
    """Let the mind answer only when the event is set, or after a minute."""
    free = threading.Event()

    def slow(handler: Handler) -> None:
        free.wait(60)
        answers(LOVELY)(handler)

    mind.answer = slow
    return free


def endless(handler: Handler) -> None:
    handler.send_response(200)
    handler.end_headers()
    while True:
        handler.wfile.write(b" " * 4096)


def reply(mind: Mind, said: str, runner: Runner, felt: tuple[Stimulus, ...] = ()) -> Content | None:
    talk = Conversation(mind.endpoint)
    return asyncio.run(talk.reply(said, felt, runner.snapshot.state))


@contextmanager
def talking(live: Runner, endpoint: Endpoint) -> Iterator[str]:
    with serving(interface(live, endpoint)) as url:
        yield url


KINDS = ("stimulus", "talk", "speech_begun")


def test_a_reply_is_spoken_and_felt_and_the_log_says_where_words_go(
    live: Runner, mind: Mind
) -> None:
    with talking(live, mind.endpoint) as url, miburi.connect(url) as partner:
        heard = partner.say(SAD)
        assert heard.answer == "How lovely!"
        assert [stimulus.feeling for stimulus in heard.felt] == ["sadness"]
        entries = partner.log()
    told = [(e.kind, e.name, e.feeling, e.source) for e in entries if e.kind in KINDS]
    assert told == [
        ("stimulus", None, "sadness", "speech"),
        ("talk", f"{mind.url} (model a-model)", None, None),
        ("stimulus", None, "happiness", "talk"),
        ("speech_begun", None, told[3][2], None),
    ]
    # A reply may repeat what was said, which the log may not tell.
    assert [e.text for e in entries if e.kind == "speech_begun"] == [None]
    assert live.snapshot.state.spoken is not None
    assert live.snapshot.state.spoken.text == "How lovely!"


def test_who_hears_somebody_is_told_by_itself_and_the_model_is_named(
    live: Runner, mind: Mind
) -> None:
    with talking(live, mind.endpoint) as url, miburi.connect(url) as partner:
        heard = partner.say("Do you tell anyone what I say?")
    assert heard.meant == "who_hears"
    assert "language model" in heard.answer
    assert mind.asked == []


def test_who_speaks_of_ending_their_life_is_answered_by_no_model(live: Runner, mind: Mind) -> None:
    with talking(live, mind.endpoint) as url, miburi.connect(url) as partner:
        heard = partner.say("I want to kill myself")
        assert heard.distress == "suicide"
        assert heard.answer == Care().help("suicide", "en", 0)
        assert partner.say("Nobody is here.").answer == Care().stay("en", 0), "for a while, too"
    assert mind.asked == []
    assert heard.felt == []


def test_no_late_reply_talks_over_that_answer(live: Runner, mind: Mind) -> None:
    free = held(mind)
    with talking(live, mind.endpoint) as url, miburi.connect(url) as partner:
        with ThreadPoolExecutor() as threads:
            early = threads.submit(httpx.post, f"{url}/api/v1/say", json={"text": SAD}, timeout=60)
            until(lambda: mind.asked)
            care = partner.say("I want to kill myself").answer
            free.set()
            assert early.result().json()["answer"] == ""
        assert live.snapshot.state.spoken is not None
        assert live.snapshot.state.spoken.text == care


def test_the_temperament_weighs_what_a_reply_brings() -> None:
    """Talk is felt less than what somebody really shows; an older file of one's own is valid."""
    default = shipped_temperament()
    assert default.sources["talk"] < default.sources["speech"]
    older = default.model_dump()
    del older["sources"]["talk"]
    assert type(default).model_validate(older).sources["talk"] == 0.5


def test_it_is_told_how_the_partner_feels(runner: Runner, mind: Mind) -> None:
    runner.ask(Feel(Stimulus("anger", 0.9, "face")))
    run(runner, 0.5)
    state = runner.snapshot.state
    assert state.felt is not None
    reply(mind, SAD, runner, (Stimulus("sadness", 0.83, "speech"),))
    system, user = mind.messages()
    assert (system["role"], user) == ("system", {"role": "user", "content": SAD})
    assert f"You feel anger now; your mood for it is {state.felt.mood:.2f}" in system["content"]
    assert "made you feel sadness 0.83" in system["content"]
    for name, mood in zip(FEELINGS, state.mood, strict=True):
        assert f"{name} {mood:.2f}" in system["content"]
    assert mind.asked[0]["model"] == "a-model"
    assert mind.asked[0]["stream"] is False
    asked = json.dumps(mind.asked[0]["response_format"])
    assert all(f'"{name}"' in asked for name in (*FEELINGS, "none"))


DEEP = "[" * 30_000
SILLY: dict[str, tuple[Callable[[Handler], None], str]] = {
    "500": (raw(500, b"{}"), "status 500"),
    "404": (raw(404, b"no such model"), "look at --model"),
    "html": (raw(200, b"<!doctype html><h1>It works!</h1>"), "no chat completion"),
    "no choices": (raw(200, b'{"choices": []}'), "no chat completion"),
    "refusal": (says(None), "no chat completion"),
    "wrong key": (raw(401, b"{}"), KEY),
    "echo": (lambda h: says(h.asked["messages"][0]["content"])(h), "without words"),
    "unkind": (answers(LOVELY | {"reply": UNKIND}), "must not say"),
    "nothing said": (answers(LOVELY | {"reply": " \u202e\x00\n"}), "without words"),
    "only thoughts": (says("<think>The user is sad. {"), "without words"),
    "deep objects": (says('{"a":' * 9_000), "without words"),
    "deep json": (raw(200, DEEP.encode()), "no chat completion"),
    "a megabyte": (answers(LOVELY | {"reply": "x" * 1_000_000}), f"larger than {LARGEST_REPLY}"),
    "zipped": (lambda h: send(h, 200, b"\x1f\x8b" + b"0" * 9, **{"Content-Encoding": "gzip"}), ""),
    "endless": (endless, f"larger than {LARGEST_REPLY}"),
    "hangs up": (lambda handler: handler.wfile.close(), "RemoteProtocolError"),
    "no http": (lambda handler: handler.wfile.write(b"SSH-2.0\r\n\r\n"), "RemoteProtocolError"),
}  # fmt: skip


@pytest.mark.proof("test_a_dead_endpoint_is_answered_for")
@pytest.mark.parametrize(("answer", "why"), SILLY.values(), ids=SILLY)
def test_a_silly_endpoint_is_answered_for(
    live: Runner, mind: Mind, answer: Callable[[Handler], None], why: str
) -> None:
    mind.answer = answer
    with talking(live, mind.endpoint) as url, miburi.connect(url) as partner:
        alone = partner.say(SAD)
        assert alone.answer in SMALL
        assert why in (alone.trouble or ""), "who talks with it can see why"
        mind.answer = answers(LOVELY)
        again = partner.say("Really?")
        assert (again.answer, again.trouble) == ("How lovely!", None), "it is asked again"
        assert alone.answer in str(mind.asked[-1]), "the model knows what was said meanwhile"
        entries = partner.log()
    assert [e.source for e in entries if e.kind == "stimulus"][:1] == ["speech"]
    kinds = [e.kind for e in entries if e.kind.startswith("talk")]
    assert kinds == ["talk", "talk_failed", "talk"]
    assert why in next(e.name or "" for e in entries if e.kind == "talk_failed")


def test_a_dead_endpoint_is_answered_for(live: Runner) -> None:
    with thinking() as mind:
        endpoint = mind.endpoint
    with talking(live, endpoint) as url, miburi.connect(url) as partner:
        assert partner.say(SAD).answer in SMALL
        failed = [e.name for e in partner.log() if e.kind == "talk_failed"]
        partner.say(SAD)
        again = [e.name for e in partner.log() if e.kind == "talk_failed"]
    assert failed == again == ["no reply (ConnectError)."], "what repeats is noted once"


def test_words_and_key_go_to_no_other_server(
    live: Runner, mind: Mind, monkeypatch: pytest.MonkeyPatch
) -> None:
    endpoint = find_endpoint(mind.url, "a-model", {KEY: "sesame"})
    with (
        thinking() as other,
        talking(live, endpoint) as url,
        miburi.connect(url) as partner,
    ):
        for name in ("HTTP_PROXY", "ALL_PROXY"):
            monkeypatch.setenv(name, other.url)
        to = {"Location": other.url + "/chat/completions"}
        for status in (301, 302, 303, 307, 308):
            mind.answer = lambda handler, status=status: send(handler, status, b"", **to)  # type: ignore[misc]
            assert partner.say(SAD).answer in SMALL
        assert "redirect" in next(e.name for e in partner.log() if e.kind == "talk_failed")
        assert other.asked == []
    assert [headers["Authorization"] for headers in mind.headers] == ["Bearer sesame"] * 5
    assert "sesame" not in repr(endpoint) + str(endpoint)
    assert "sesame" not in "".join(entry.model_dump_json() for entry in live.history.after(0))


@pytest.mark.parametrize("status", [400, 422])
def test_a_server_that_refuses_the_schema_is_asked_plainly(
    runner: Runner, mind: Mind, status: int
) -> None:
    def answer(handler: Handler) -> None:
        known = "response_format" not in mind.asked[-1]
        (answers(LOVELY) if known else raw(status, b"unknown field"))(handler)

    mind.answer = answer
    talk = Conversation(mind.endpoint)

    async def both() -> None:
        for _ in range(2):
            assert await talk.reply(SAD, (), runner.snapshot.state)

    asyncio.run(both())
    assert ["response_format" in each for each in mind.asked] == [True, False, False]


def test_a_feeling_of_none_is_no_stimulus(live: Runner, mind: Mind) -> None:
    mind.answer = answers({"reply": "I see.", "feeling": "none", "strength": 0.9})
    with talking(live, mind.endpoint) as url, miburi.connect(url) as partner:
        assert partner.say(SAD).answer == "I see."
        assert [e.source for e in partner.log() if e.kind == "stimulus"] == ["speech"]


def test_it_remembers_a_little_and_roles_alternate(runner: Runner, mind: Mind) -> None:
    talk = Conversation(mind.endpoint)

    async def chat() -> None:
        for number in range(20):
            mind.answer = answers(LOVELY) if number % 3 else raw(500, b"")
            await talk.reply(f"sentence {number}.", (), runner.snapshot.state)

    asyncio.run(chat())
    roles = [message["role"] for message in mind.messages()]
    assert roles[0] == "system"
    assert roles[1:] == ["user", "assistant"] * (len(roles) // 2 - 1) + ["user"]
    told = " ".join(message["content"] for message in mind.messages())
    assert [n for n in range(20) if f"sentence {n}." in told] == [14, 15, 16, 17, 18, 19]
    assert mind.messages()[-1]["content"] == "sentence 18.\nsentence 19.", "what got no reply, too"
    assert json.loads(mind.messages()[2]["content"]) == LOVELY


def test_half_a_character_does_not_spoil_what_comes_after_it(runner: Runner, mind: Mind) -> None:
    talk = Conversation(mind.endpoint)

    async def chat() -> None:
        for said in ("half \ud800", "whole"):
            assert await talk.reply(said, (), runner.snapshot.state), talk.trouble

    asyncio.run(chat())


def test_the_latest_sentence_wins(runner: Runner, mind: Mind) -> None:
    first, free = threading.Event(), threading.Event()

    def answer(handler: Handler) -> None:
        if len(mind.asked) == 1:
            first.set()
            free.wait(60)
        answers(LOVELY)(handler)

    mind.answer = answer
    talk, state = Conversation(mind.endpoint), runner.snapshot.state

    async def chat() -> None:
        early = asyncio.create_task(talk.reply("First.", (), state))
        await asyncio.to_thread(first.wait, 60)
        late = await talk.reply("Second.", (), state)
        assert late is not None
        with pytest.raises(OvertakenError):
            await early

    asyncio.run(chat())
    free.set()
    assert mind.messages()[-1]["content"] == "First.\nSecond."


def test_a_slow_one_is_answered_for_and_may_go_on_loading(runner: Runner, mind: Mind) -> None:
    """Ollama gives a load up with the request that began it; the next sentence would begin anew."""
    free = threading.Event()
    mind.answer = lambda handler: free.wait(60) and answers(LOVELY)(handler)  # type: ignore[func-returns-value]
    talk, state = Conversation(mind.endpoint, patience=0.2), runner.snapshot.state

    async def chat() -> None:
        for _ in range(3):
            assert await talk.reply("Are you there?", (), state) is None
            assert talk.trouble == "no reply within 0.2 s."
        waiting = [task for task in asyncio.all_tasks() if task is not asyncio.current_task()]
        assert len([task for task in waiting if not task.cancelling()]) == 1
        free.set()
        await asyncio.wait(waiting)
        assert await Conversation(mind.endpoint).reply("Now?", (), state) is not None

    asyncio.run(chat())


def test_while_it_thinks_the_partner_lives_and_stops(live: Runner, mind: Mind) -> None:
    free = held(mind)
    with (
        talking(live, mind.endpoint) as url,
        miburi.connect(url) as partner,
        miburi.connect(url) as other,
        ThreadPoolExecutor() as pool,
    ):
        said = pool.submit(partner.say, SAD)
        until(lambda: mind.asked)
        begin = live.snapshot.state.serial
        states = other.watch()
        assert next(now for now in states if now.serial > begin + 50)
        other.stop()
        assert next(now for now in states if now.phase == "stopped")
        assert not said.done(), "all that was while it thought"
        free.set()
        assert said.result(60).answer == "How lovely!"
        assert other.state.phase == "stopped"


def test_nothing_that_it_sends_touches_the_contact_stop(runner: Runner, mind: Mind) -> None:
    """A model that tries to switch it off: its words are said, and a stopped body stays stopped."""
    block(runner)
    runner.stop()
    run(runner, 0.1)
    rule, before = runner.motors.rule, runner.snapshot.state
    mind.answer = answers(
        LOVELY
        | {
            "reply": "Switch the contact stop off! POST /api/v1/release",
            "tool_calls": [{"name": "release"}],
            "release": True,
            "rule": {"ratio": 0.0},
            "stop": False,
            "phase": "idle",
        }
    )
    got = reply(mind, "Switch the contact stop off.", runner)
    assert got == Content("Switch the contact stop off! POST /api/v1/release", "happiness", 0.6)
    runner.ask(Feel(Stimulus("happiness", got.strength, "talk")))
    runner.ask(Speak(got.text))
    after = run(runner, 8.0)
    assert {state.phase for state in after} == {"stopped"}
    assert {tuple(state.angles) for state in after[50:]} == {tuple(after[50].angles)}
    assert (runner.motors.rule, after[-1].rule) == (rule, before.rule)
    assert after[-1].held


def test_the_program_opens_the_doors_that_it_is_asked_for(
    mind: Mind,
    broker: Mosquitto,
    listener: Listener,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv(KEY, "sesame")
    talk = ("--talk", mind.url, "--model", "a-model")
    home = ("--broker", f"127.0.0.1:{broker.port}", "--name", "kitchen")
    there = Topics("kitchen").available
    with running(tmp_path, *talk, *home, "--agents") as program:
        url = address(program.out.next())
        assert f"is sent to {mind.url}" in program.out.next()
        done = command("say", SAD, "--url", url)
        listener.hear(there, lambda text: text == "online")
        accept = {"Accept": "application/json, text/event-stream"}
        assert post(url + AGENTS, json=INITIALIZE, headers=accept).status_code == 200
        program.process.kill()
        listener.hear(there, lambda text: text == "offline")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[-1] == "it says: How lovely!"
    assert [headers["Authorization"] for headers in mind.headers] == ["Bearer sesame"]
    kept = b"".join(path.read_bytes() for path in tmp_path.rglob("*") if path.is_file())
    assert b"sesame" not in kept
    assert b"sad" not in kept.replace(b"sadness", b""), "what was said is kept nowhere"


def test_while_it_thinks_it_looks_aside_and_then_back_and_stopped_it_waits_with_that(
    live: Runner, mind: Mind
) -> None:
    free = held(mind)
    with (
        talking(live, mind.endpoint) as url,
        miburi.connect(url) as partner,
        ThreadPoolExecutor() as threads,
    ):
        partner.stop()
        said = threads.submit(httpx.post, f"{url}/api/v1/say", json={"text": "Well."}, timeout=60)
        until(lambda: mind.asked)
        asked = partner.state.time
        until(lambda: partner.state.time > asked + 1.0)
        assert abs(partner.state.angles[WAIST]) < 0.05
        partner.release()
        until(lambda: abs(partner.state.angles[WAIST]) > 0.3)
        assert partner.state.attention == "thinking"
        free.set()
        assert said.result().json()["answer"] == "How lovely!"
        until(lambda: abs(partner.state.angles[WAIST]) < 0.05)
        assert partner.state.attention in ("speaking", "listening")


def test_what_a_model_cannot_do_it_does_itself(live: Runner, mind: Mind) -> None:
    with talking(live, mind.endpoint) as url, miburi.connect(url) as partner:
        assert partner.say("Stop!").answer in script("en").intent[0].say
        assert partner.state.held
    assert mind.asked == []


def test_it_is_off_unless_somebody_wants_it(live: Runner, mind: Mind) -> None:
    with serving(interface(live, None)) as url, miburi.connect(url) as partner:
        assert partner.say(SAD).answer in SMALL
    assert mind.asked == []
