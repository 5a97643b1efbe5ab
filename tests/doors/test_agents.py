"""The door for agents, asked by the official client over both of its transports."""

import asyncio
import itertools
import json
import re
import sys
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import Future
from typing import Any

import httpx
import pytest
from mcp import Client, StdioServerParameters
from mcp.client.stdio import stdio_client
from mcp.client.streamable_http import streamable_http_client
from tests.fixtures.gate import TOKEN, Clock
from tests.fixtures.keys import keys
from tests.fixtures.live import (
    Server,
    block_the_right_arm,
    interface,
    own_environment,
    serving,
    stays_stopped,
)
from tests.fixtures.live import until as run_until
from tests.fixtures.waiting import PATIENCE, PAUSE, post

from miburi.client.asker import Asker
from miburi.client.remote import connect
from miburi.doors.agents import BURST, add_agents
from miburi.feelings import FEELINGS, Expression
from miburi.interface.acting import UNSAID
from miburi.live.runner import Runner
from miburi.live.wishes import Granted, Perform, Release, Wish
from miburi.serving.access import AGENTS, Gate
from miburi.serving.access import RATE as GATE_RATE

TOOLS = {"feel", "say", "gesture", "look", "think", "stop", "state", "events"}
INITIALIZE = {
    "jsonrpc": "2.0",
    "id": 1,
    "method": "initialize",
    "params": {
        "protocolVersion": "2025-11-25",
        "capabilities": {},
        "clientInfo": {"name": "test", "version": "1"},
    },
}


class Agent:
    """The official client, and what it is told."""

    def __init__(self, client: Client) -> None:
        self.client = client

    async def call(self, tool: str, **arguments: Any) -> str:
        answer = await self.client.call_tool(tool, arguments)
        (content,) = answer.content
        assert content.type == "text"
        assert not answer.is_error, content.text
        return content.text

    async def refused(self, tool: str, **arguments: Any) -> str:
        answer = await self.client.call_tool(tool, arguments)
        (content,) = answer.content
        assert content.type == "text"
        assert answer.is_error, content.text
        return content.text

    async def state(self) -> dict[str, Any]:
        state = json.loads(await self.call("state"))
        assert isinstance(state, dict)
        return state

    async def until(self, wanted: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        async with asyncio.timeout(PATIENCE):
            while not wanted(state := await self.state()):
                await asyncio.sleep(PAUSE)
        return state


@pytest.fixture
def clock() -> Clock:
    """What the agents' wishes are counted by."""
    return Clock()


@pytest.fixture
def door(live: Runner, clock: Clock) -> Iterator[Server]:
    """A live partner that lets agents in; its gate's own clock is fast enough for any test."""
    app = interface(live)
    add_agents(app, clock)
    ticks = itertools.count()
    with serving(Gate(app, clock=lambda: 1000.0 * next(ticks)), lifespan=True) as url:
        yield Server(url, live)


def over_http(url: str) -> Client:
    return Client(streamable_http_client(url + "/mcp"))


def over_stdio(url: str) -> Client:
    command = ["-m", "miburi", "mcp", "--url", url]
    server = StdioServerParameters(command=sys.executable, args=command, env=own_environment())
    return Client(stdio_client(server))


def run(client: Client, work: Callable[[Agent], Awaitable[None]]) -> None:
    """Let an agent work until it has done."""

    async def working() -> None:
        async with client:
            await work(Agent(client))

    asyncio.run(working())


async def use_every_tool(agent: Agent) -> None:
    assert {tool.name for tool in (await agent.client.list_tools()).tools} == TOOLS
    assert await agent.call("feel", feeling="happiness", strength=1) == "It feels happiness."
    assert (await agent.state())["feels"]["feeling"] == "happiness"
    assert await agent.call("gesture", feeling="surprise", intensity=0.4) == (
        "It has shown surprise."
    )
    assert await agent.call("say", words="Hello, you.") == "It is saying that."
    assert (await agent.state())["said"] == "Hello, you."
    for words in ("You are worthless.", "Help! I can't breathe!"):
        assert UNSAID in await agent.refused("say", words=words)
    assert (await agent.state())["said"] == "Hello, you."
    assert await agent.call("think", on=True) == "It looks thoughtful."
    await agent.until(lambda state: state["asked"] and state["shows"] is None)
    assert await agent.call("think", on=False) == "It looks ahead."
    assert await agent.call("look", at="left") == "It looks left."
    events = await agent.call("events")
    assert "stimulus: happiness 1.00, application" in events
    assert "gesture_ended: surprise 0.40" in events
    since = events.splitlines()[-1].split()[0]
    assert "surprise 0.40" not in await agent.call("events", since=since)
    assert "Only a person" in await agent.call("stop")
    assert (await agent.until(lambda state: state["stopped"]))["body"] == "stopped"
    told = await agent.client.read_resource("miburi://gestures")
    assert {gesture["feeling"] for gesture in json.loads(told.contents[0].text)} == {*FEELINGS}  # type: ignore[union-attr]
    told = await agent.client.read_resource("miburi://state")
    assert json.loads(told.contents[0].text)["body"] == "stopped"  # type: ignore[union-attr]


def test_every_tool_does_what_it_says(door: Server) -> None:
    run(over_http(door.url), use_every_tool)


@pytest.mark.proof("test_every_tool_does_what_it_says")
def test_every_tool_does_the_same_over_standard_input_and_output(door: Server) -> None:
    run(over_stdio(door.url), use_every_tool)


def test_tools_say_what_they_take_and_what_a_client_may_expect(door: Server) -> None:
    cases: list[tuple[str, dict[str, Any], str]] = [
        ("feel", {"feeling": "boredom"}, "'happiness', 'sadness'"),
        ("feel", {"feeling": "fear", "strength": 1.5}, "less than or equal to 1"),
        ("feel", {}, "Field required"),
        ("gesture", {"feeling": "fear", "intensity": -1}, "greater than or equal to 0"),
        ("look", {"at": "aside"}, "'user', 'left', 'right', 'up' or 'down'"),
        ("think", {}, "Field required"),
        ("say", {"words": "x" * 301}, "at most 300"),
        ("events", {"since": "-1"}, "should match pattern"),
        ("feel", {"feeling": "fear", "strenght": 0.1}, "feel takes feeling, strength"),
        ("stop", {"now": True}, "stop takes no arguments"),
        ("release", {}, "release"),
    ]

    async def work(agent: Agent) -> None:
        for tool, arguments, words in cases:
            answer = await agent.client.call_tool(tool, arguments)
            assert answer.is_error, (tool, arguments)
            said = answer.content[0].text  # type: ignore[union-attr]
            assert words in said
            assert "://" not in said  # no links to the pages of a library
        tools = (await agent.client.list_tools()).tools
        assert all(tool.title for tool in tools)
        hints = {tool.name: tool.annotations for tool in tools}
        reading = {name for name, one in hints.items() if one and one.read_only_hint}
        assert reading == {"state", "events"}
        assert not any(one is None or one.destructive_hint for one in hints.values())
        answer = await agent.client.call_tool("state", {})
        assert answer.structured_content is not None
        assert answer.structured_content["body"] in ("idle", "moving")
        # An agent has little to read. A piece is at most four letters or one sign: no
        # tokenizer in use makes more of English. A model is given names, descriptions and
        # arguments; the rest is for its client.
        given = {"name", "description", "input_schema"}
        for parts, most in ((given, 1300), (None, 1800)):
            dumps = [
                tool.model_dump(exclude_none=True, by_alias=True, include=parts) for tool in tools
            ]
            assert len(re.findall(r"\w{1,4}|[^\w\s]", json.dumps(dumps))) <= most

    run(over_http(door.url), work)


def test_a_contact_ends_an_agents_gesture_and_the_agent_is_told_why(door: Server) -> None:
    async def work(agent: Agent) -> None:
        await asyncio.to_thread(block_the_right_arm, partner)
        told = await agent.call("gesture", feeling="happiness", intensity=1)
        assert re.match(r"The body is stopped: its \w+ \w+ met something with \d+\.\d N\.", told)
        assert "goes on by itself" in told
        assert "broken off" in told
        stopped = await agent.state()
        assert stopped["body"] == "stopped"
        partner.remove_hand()
        # Its next wish waits for the release, which comes by itself after a contact.
        assert await agent.call("gesture", feeling="surprise") == "It has shown surprise."
        events = await agent.call("events", since=stopped["latest_event"])
        kinds = [line.split()[4].rstrip(":") for line in events.splitlines()]
        assert kinds.index("release_begun") < kinds.index("gesture_begun")

    with connect(door.url) as partner:
        run(over_http(door.url), work)


def test_no_agent_can_release_a_body_that_somebody_stopped(door: Server) -> None:
    async def work(agent: Agent) -> None:
        await agent.call("stop")
        before = await agent.until(lambda state: state["stopped"])
        assert "Only a person can release it" in before["stopped"]
        for tool in (await agent.client.list_tools()).tools:
            possible = {"feeling": "fear", "at": "up", "on": True, "words": "Let me go!"}
            needed = {name: possible[name] for name in tool.input_schema.get("required", ())}
            answer = await agent.call(tool.name, **needed)
            if {"feeling", "at", "on"} & needed.keys():
                assert "Only a person can release it" in answer
                assert not answer.startswith("It looks")
        await asyncio.to_thread(stays_stopped, partner)
        assert (await agent.state())["body"] == "stopped"
        assert "release" not in await agent.call("events", since=before["latest_event"])
        door.runner.ask(Release(by_person=True)).result(5)
        await agent.until(lambda state: state["body"] == "idle")

    with connect(door.url) as partner:
        run(over_http(door.url), work)


def test_an_agent_is_told_of_a_pause_and_of_distress_but_not_the_words(door: Server) -> None:
    async def work(agent: Agent) -> None:
        assert (await agent.state())["distress"] is None
        partner.pause()
        assert "paused" in await agent.call("feel", feeling="fear")
        told = await agent.refused("gesture", feeling="fear")
        assert "Nothing was done: the partner is paused" in told
        assert "Only a person can" in told
        partner.say("The kitchen is on fire")
        assert (await agent.state())["distress"] == "fire"
        events = await agent.call("events")
        assert "distress: fire" in events
        assert "kitchen" not in events

    with connect(door.url) as partner:
        run(over_http(door.url), work)


def test_of_two_agents_at_once_one_gets_its_gesture_and_the_other_is_told(door: Server) -> None:
    async def work(agent: Agent) -> None:
        async with over_http(door.url) as client:
            partner.express(Expression("thrill", 0.9))  # both have to wait for its end
            await agent.until(lambda state: state["shows"] == {"feeling": "thrill", "mood": 0.9})
            told = await asyncio.gather(
                agent.call("gesture", feeling="fear"),
                Agent(client).call("gesture", feeling="surprise"),
            )
        shown, replaced = sorted(told, key=lambda words: not words.startswith("It has shown"))
        assert shown in ("It has shown fear.", "It has shown surprise.")
        assert replaced == "It did not begin: a newer wish has taken its place."

    with connect(door.url) as partner:
        run(over_http(door.url), work)


def test_a_stop_drops_a_gesture_that_waits_and_the_agent_is_told(
    runner: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    granted = runner.ask

    def stop_while_it_waits(wish: Wish[Granted]) -> Future[Granted]:
        answer = granted(wish)
        runner.tick()
        runner.stop()
        runner.tick()
        return answer

    async def work(agent: Agent) -> None:
        told = await agent.call("gesture", feeling="disgust")
        assert told.endswith("Only a person can release it. Your gesture was dropped.")
        runner.start()
        granted(Release(by_person=True)).result(60)
        await agent.until(lambda state: state["body"] == "idle")
        assert "gesture_begun: disgust" not in await agent.call("events")

    runner.ask(Perform(Expression("thrill", 0.9)))  # the agent's gesture has to wait for its end
    run_until(runner, lambda state: state.asked and state.expressed)
    monkeypatch.setattr(runner, "ask", stop_while_it_waits)
    app = interface(runner)
    add_agents(app)
    with serving(app, lifespan=True) as url:
        run(over_http(url), work)
    runner.close(patience=0.0)


def test_too_many_wishes_are_refused_in_words_and_none_waits(door: Server, clock: Clock) -> None:
    async def work(agent: Agent) -> None:
        for _ in range(int(BURST)):
            await agent.call("feel", feeling="fear")
        for _ in range(2):
            assert "Nothing was done: too many" in await agent.refused("feel", feeling="fear")
        assert "stopped" in await agent.call("stop")  # no limit holds it up
        clock.now += 1
        assert (await agent.call("feel", feeling="fear")).startswith("It feels fear.")

    run(over_http(door.url), work)


@pytest.mark.proof("test_every_tool_does_what_it_says")
def test_a_partner_that_cannot_be_reached_is_an_error_in_words() -> None:
    """The bridge starts without a partner: the assistant itself says what to start."""

    async def work(agent: Agent) -> None:
        for tool, arguments in (("feel", {"feeling": "fear"}), ("stop", {}), ("state", {})):
            answer = await agent.client.call_tool(tool, arguments)
            assert answer.is_error, tool
            assert answer.content[0].text.endswith(  # type: ignore[union-attr]
                "Nothing was done: http://127.0.0.1:9 does not answer; is `miburi run` running "
                "there?"
            )

    run(over_stdio("http://127.0.0.1:9"), work)


def test_the_gate_stands_before_agents_too(live: Runner) -> None:
    cases: list[tuple[dict[str, str], int]] = [
        ({}, 401),
        ({"Authorization": "Bearer wrong"}, 401),
        ({"Authorization": f"Bearer {TOKEN}"}, 200),
        ({"Authorization": f"Bearer {TOKEN}", "Origin": "https://evil.example"}, 403),
        ({"Authorization": f"Bearer {TOKEN}", "Sec-Fetch-Site": "cross-site"}, 403),
    ]
    app = interface(live)
    add_agents(app)
    accept = {"Accept": "application/json, text/event-stream"}
    with serving(Gate(app, keys(TOKEN)), lifespan=True) as url:
        for headers, status in cases:
            answer = post(url + AGENTS, json=INITIALIZE, headers=accept | headers)
            assert answer.status_code == status
            assert (status == 401) == ("www-authenticate" in answer.headers)
            if status == 200:
                assert answer.json()["result"]["serverInfo"]["name"] == "miburi"


def test_calls_in_a_row_over_the_bridge_wait_for_the_gate(
    live: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    burst = 20
    monkeypatch.setattr("miburi.serving.access.BURST", burst)

    async def calls() -> None:
        async with httpx.AsyncClient(base_url=url + "/api/v1", verify=False) as http:
            partner = Asker(url, http)
            for _ in range(2 * burst):
                assert (await partner.state()).stop is None

    ticks = itertools.count()  # a quarter of a request comes back with each
    with serving(Gate(interface(live), clock=lambda: next(ticks) / GATE_RATE / 4)) as url:
        asyncio.run(calls())
