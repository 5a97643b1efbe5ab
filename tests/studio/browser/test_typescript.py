"""The TypeScript client in a page of another origin, as its example has it."""

import runpy
import shutil
import subprocess
from pathlib import Path

import pytest
from playwright._impl._driver import compute_driver_executable
from playwright.sync_api import Page, expect
from starlette.applications import Starlette
from starlette.routing import Mount
from starlette.staticfiles import StaticFiles
from tests.fixtures.live import interface, serving
from tests.fixtures.waiting import until

from miburi.live.runner import Runner
from miburi.serving.access import Gate

ROOT = Path(__file__).parents[3]
CLIENT = ROOT / "clients" / "typescript"
#: Takes the types out, as Node itself does; the result runs in a browser.
STRIP = """
const { stripTypeScriptTypes } = require("node:module");
const { readFileSync, writeFileSync } = require("node:fs");
const [from, to] = process.argv.slice(1);
writeFileSync(to, stripTypeScriptTypes(readFileSync(from, "utf8")));
"""
#: A partner whose streams end before any event, or fall silent; the clock is the test's own.
STREAMS = r"""
import { mock } from "node:test";
const [client, way] = process.argv.slice(1), { Partner } = await import(client);
mock.timers.enable({ apis: ["setTimeout"] });
let opened = 0;
globalThis.fetch = async (url, { signal }) => {
  if (url.endsWith("/state")) return Response.json({ boot: "5f2c9a10", latest: 42 });
  opened += 1;
  const event = { id: "5f2c9a10:43", kind: "stop" };
  const text = opened === 3 ? `data: ${JSON.stringify(event)}\n` : ": here\n\n";
  return new Response(new ReadableStream({ start(line) {
    line.enqueue(new TextEncoder().encode(text));
    if (way === "ends" && opened < 3) line.close();
    signal?.addEventListener("abort", () => { try { line.error(signal.reason); } catch {} });
  } }));
};
const event = new Partner("http://here").events().next();
let waits = true;
event.finally(() => (waits = false));
for (let seconds = 0; waits && seconds < (way === "ends" ? 5 : 70); seconds += 1) {
  for (let turn = 0; turn < 20; turn += 1) await new Promise(setImmediate);
  mock.timers.tick(1000);
}
console.log(waits ? "waits" : (await event).value.id, opened);
process.exit();
"""


def run_node(script: str, *given: object, module: bool = False) -> str:
    """Run a script by the Node that comes with the browsers' driver; return what it prints."""
    node, _ = compute_driver_executable()
    kind = ["--input-type=module"] if module else []
    command = [node, *kind, "-e", script, *map(str, given)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


@pytest.mark.parametrize("way", ["ends", "is silent"])
def test_a_stream_that_ends_before_an_event_or_is_silent_is_opened_again(
    way: str, tmp_path: Path
) -> None:
    client = tmp_path / "miburi.mjs"
    run_node(STRIP, CLIENT / "miburi.ts", client)
    assert run_node(STREAMS, client, way, module=True).split() == ["5f2c9a10:43", "3"]


def test_a_page_of_another_origin_praises_and_stops_it_and_hears_what_happens(
    page: Page, live: Runner, tmp_path: Path, trouble: list[str]
) -> None:
    run_node(STRIP, CLIENT / "miburi.ts", tmp_path / "miburi.js")
    shutil.copy(CLIENT / "page.html", tmp_path)
    site_of = Starlette(routes=[Mount("/", StaticFiles(directory=tmp_path))])
    with serving(site_of) as site:
        with serving(Gate(interface(live))) as address:
            page.goto(f"{site}/page.html?at={address}")
            expect(page.get_by_role("status")).to_contain_text("no answer from")
        with serving(Gate(interface(live), origins=frozenset({site}))) as address:
            page.goto(f"{site}/page.html?at={address}")
            happened = page.get_by_role("list", name="What happened")
            expect(page.get_by_role("status")).to_contain_text("It ")
            page.get_by_role("button", name="Praise it").click()
            expect(happened).to_contain_text("stimulus · happiness")
            page.get_by_role("button", name="Stop").click()
            expect(happened).to_contain_text("stop")
            until(lambda: live.held)
            page.goto("about:blank")
    trouble.clear()  # the browser, too, says that it was refused


def test_the_types_are_those_of_the_interface(live: Runner) -> None:
    digest = runpy.run_path(str(ROOT / "tools" / "typescript_client.py"))["digest"]
    first, *_ = (CLIENT / "api.ts").read_text(encoding="utf-8").split("\n")
    made = interface(live).openapi()
    assert first == f"// {digest(made)}", "run tools/typescript_client.py"
