"""What a reader follows in the documents leads somewhere; what a reader copies works."""

import os
import re
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from typer.testing import CliRunner

from miburi.cli.commands import app

ROOT = Path(__file__).parents[1]
#: What only the site has.
MADE = "reference/"
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("bench/**/*.md")]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_and_pictures_are_there(page: Path) -> None:
    links = re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8"))
    inside = [link for link in links if "://" not in link and not link.startswith(MADE)]
    assert [link for link in inside if not (page.parent / link).exists()] == []


def test_there_are_pages() -> None:
    assert {"README.md", "card.md", "safety.md"} <= {page.name for page in PAGES}


def test_the_first_example_shows_a_happy_gesture(capsys: pytest.CaptureFixture[str]) -> None:
    (example, *_) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    exec(example, {})
    assert "GestureStarted(time=0.02, expression=Expression(feeling='happiness'" in (
        capsys.readouterr().out
    )


@pytest.mark.parametrize("command", ["forward", "ik"])
def test_a_command_of_the_readme_prints_what_stands_there(command: str) -> None:
    shown = re.search(
        rf"^    \$ miburi ({command} .*)\n((?:    .*\n)+)",
        (ROOT / "README.md").read_text(),
        re.MULTILINE,
    )
    assert shown
    arguments, output = shown.groups()
    printed = CliRunner().invoke(app, arguments.split()).stdout
    assert printed.splitlines() == textwrap.dedent(output).splitlines()


def test_make_help_lists_every_target() -> None:
    makefile = (ROOT / "Makefile").read_text()
    targets = re.findall(r"^([a-z][a-z-]*):(?!=)", makefile, re.MULTILINE)
    printed = subprocess.run(
        ["make", "--no-print-directory", "help"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    assert re.findall(r"^make ([a-z-]+) +\S", printed, re.MULTILINE) == targets


def test_pictures_are_those_that_their_commands_make() -> None:
    """Those that are quickly made; `tools/renew-images --check` looks at all."""
    done = subprocess.run(
        [sys.executable, "tools/renew-images", "--check", "day.png", "happy-talk.png"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (0, ""), done.stderr


def test_the_site_is_whole_and_asks_for_nothing_from_elsewhere(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", tmp_path],
        cwd=ROOT, capture_output=True, text=True, check=False,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    pages = [page.read_text(encoding="utf-8") for page in tmp_path.rglob("*.html")]
    assert len(pages) > 30
    loaded = [
        re.findall(r"<(?:img|link|script)[^>]*(?:src|href)=\"?(https?:[^\" >]*)", page)
        for page in pages
    ]
    assert [address for page in loaded for address in page] == []
