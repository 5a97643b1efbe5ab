"""The TypeScript client in a page of another origin, as its example has it."""

import runpy
import shutil
import subprocess
from pathlib import Path

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


def test_a_page_of_another_origin_praises_and_stops_it_and_hears_what_happens(
    page: Page, live: Runner, tmp_path: Path, trouble: list[str]
) -> None:
    node, _ = compute_driver_executable()
    script = [node, "-e", STRIP, CLIENT / "miburi.ts", tmp_path / "miburi.js"]
    subprocess.run(script, check=True, capture_output=True)
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
