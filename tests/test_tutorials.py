"""Every page of docs/learn, followed to the letter in an empty folder."""

import os
from pathlib import Path

import pytest

from tests.fixtures.tutorial import Command, Reader, matches, steps

PAGES = sorted((Path(__file__).parents[1] / "docs" / "learn").glob("*.md"))


#: `make test` types the first page alone; `make test-lessons` types all in their own environment.
LONG = pytest.mark.proof("test_a_page_shows_what_its_reader_sees")


@pytest.mark.parametrize(
    "page",
    [PAGES[0], *(pytest.param(page, marks=LONG) for page in PAGES[1:])],
    ids=lambda page: page.stem,
)
def test_a_page_shows_what_its_reader_sees(page: Path, tmp_path: Path) -> None:
    with Reader(tmp_path) as reader:
        for step in steps(page):
            if isinstance(step, Command):
                printed = reader.type(step.line)
                shown = matches(step.output, printed) or _cannot_draw(page, printed)
                assert shown, f"$ {step.line}\n{printed}"
            else:
                reader.save(step)


def _cannot_draw(page: Path, printed: str) -> bool:
    """Whether a computer says that it cannot draw, and the page says that this may be."""
    if os.environ.get("CI") == "true":
        return False
    said = "cannot draw pictures here (no EGL)"
    return said in printed and said in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("shown", "printed", "alike"),
    [
        ("moved 3 mm\n", "moved 3 mm\n", True),
        ("moved 3 mm\n", "moved 4 mm\n", False),
        ("at …:8080\n…\n", "at 127.0.0.1:8080\nand\nmore\n", True),
        ("it …\n", "it fails.\n", True),
        ("", "Traceback\n", False),
    ],
)
def test_only_dots_stand_for_what_differs(shown: str, printed: str, alike: bool) -> None:
    assert matches(shown, printed) is alike


def test_files_and_commands_are_found_and_other_fences_are_left_alone(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "```console\n$ a | b\nc\n$ d\n```\n```python\n# e.py\nf\n```\n```shell\ng\n```\n"
    )
    first, second, file = steps(page)
    assert first == Command("a | b", "c\n")
    assert second == Command("d", "")
    assert (file.name, file.text) == ("e.py", "# e.py\nf\n")
