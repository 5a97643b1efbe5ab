"""What a reader follows in the documents leads somewhere; what a reader copies works."""

import dataclasses
import importlib
import inspect
import os
import re
import runpy
import subprocess
import sys
import textwrap
import tomllib
from itertools import chain
from pathlib import Path
from typing import get_args

import pytest
from typer.testing import CliRunner

from miburi.card.bench_report import BenchFindings, BenchReport, write_report
from miburi.cli.commands import app
from miburi.live.events.event import EventKind, LiveEvent
from tests.fixtures.command import miburi

ROOT = Path(__file__).parents[1]
#: What only the site has.
MADE = "reference/"
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("bench/**/*.md")]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_and_pictures_are_there(page: Path) -> None:
    links = re.findall(r"\]\(([^)#]*)(?:#([^)]*))?\)", page.read_text(encoding="utf-8"))
    inside = [each for each in links if "://" not in each[0] and not each[0].startswith(MADE)]
    assert [link for link, _ in inside if not (page.parent / link).exists()] == []
    parts = [(page.parent / link if link else page, part) for link, part in inside if part]
    assert [part for where, part in parts if part not in headings(where)] == []


def headings(page: Path) -> set[str]:
    """The anchors of a page: its own, and those of its headings, on GitHub as on the site."""
    text = page.read_text(encoding="utf-8")
    titles = re.findall(r"^#+ (.*)", text, re.M)
    plain = (re.sub(r"[^\w\s-]", "", title.lower()) for title in titles)
    made = (re.sub(r"\s+", "-", title.strip()) for title in plain)
    return {*made, *re.findall(r"<a id=\"([^\"]+)\"", text)}


def test_the_wheels_description_leads_nowhere_that_a_wheel_does_not_have() -> None:
    """And names only extras that there are."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    text = (ROOT / project["readme"]).read_text("utf-8")
    targets = re.findall(r"\]\(([^)]*)\)|(?:src|href)=\"([^\"]*)", text)
    assert [target for pair in targets for target in pair if target and "://" not in target] == []
    named = set(re.findall(r"`\[(\w+)\]`", text))
    assert named
    assert named <= set(project["optional-dependencies"])


@pytest.mark.parametrize("page", ["README.md", "docs/experiment.md"])
def test_the_first_example_shows_a_happy_gesture(
    page: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (example, *_) = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.DOTALL)
    exec(example, {})
    shown = capsys.readouterr().out
    assert "GestureStarted(time=0.02, expression=Expression(feeling='happiness'" in shown
    assert "Stopped(" not in shown


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


def test_the_readmes_experiment_is_what_the_command_prints(tmp_path: Path) -> None:
    recipe = re.search(r"miburi (experiment .*)--out", (ROOT / "Makefile").read_text())
    shown = re.search(r"^(    XL330-.*\n(?:    .*\n)+)", (ROOT / "README.md").read_text(), re.M)
    assert recipe
    assert shown
    arguments = [*recipe.group(1).split(), "--no-film", "--out", str(tmp_path)]
    printed = CliRunner().invoke(app, arguments).stdout.splitlines()
    written = textwrap.dedent(shown.group()).splitlines()
    timed = re.compile(r"median .* ms; \d+ × faster")
    assert [timed.sub("", line) for line in printed[: len(written)]] == [
        timed.sub("", line) for line in written
    ]


@pytest.mark.parametrize(
    "command",
    [
        "parts",
        "gauge",
        pytest.param(
            "check",
            marks=pytest.mark.proof("test_two_things_in_one_place_are_named"),
        ),
    ],
)
def test_a_command_of_the_building_page_prints_what_stands_there(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = (ROOT / "docs" / "build.md").read_text()
    monkeypatch.chdir(tmp_path)
    Path("paper.toml").write_text(
        CliRunner().invoke(app, ["template", "robot", "iphonoid"]).stdout, encoding="utf-8"
    )
    shown = re.findall(
        rf"^    \$ miburi (hardware {command}.*)\n((?:    .*\n)+)", page, re.MULTILINE
    )
    assert shown
    for arguments, output in shown:
        done = miburi(*arguments.split())
        printed = "".join((done.stdout, done.stderr))
        assert printed.splitlines() == textwrap.dedent(output).splitlines()


def test_make_help_lists_every_target() -> None:
    makefile = (ROOT / "Makefile").read_text()
    targets = re.findall(r"^([a-z][a-z-]*):(?!=)", makefile, re.MULTILINE)
    printed = subprocess.run(
        ["make", "--no-print-directory", "help"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    assert re.findall(r"^make ([a-z-]+) +\S", printed, re.MULTILINE) == targets


@pytest.mark.proof("test_links_and_pictures_are_there")
def test_pictures_are_those_that_their_commands_make() -> None:
    """Those that are quickly made; `tools/renew-images --check` looks at all."""
    done = subprocess.run(
        [sys.executable, "tools/renew-images", "--check", "day.png", "happy-talk.png"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (0, ""), done.stderr


def test_nothing_in_the_reference_is_without_words() -> None:
    """Every class, function and field of it says what it is; fields in `Attributes`, say."""
    site = runpy.run_path(str(ROOT / "docs" / "site.py"))
    rooms = [importlib.import_module(f"miburi.{room}") for room in site["ROOMS"]]
    modules = [module for room in rooms for module in site["modules_of"](room)]
    entries = [getattr(module, name) for module in modules for name in site["public_names"](module)]
    silent = [one.__qualname__ for one in entries if inspect.isroutine(one) and not one.__doc__]
    for one in filter(inspect.isclass, entries):
        own = [(name, member) for name, member in vars(one).items() if name[0] != "_"]
        silent += [
            f"{one.__qualname__}.{name}"
            for name, member in own
            if (inspect.isfunction(member) or isinstance(member, property))
            and not any(getattr(vars(base).get(name), "__doc__", None) for base in one.__mro__)
        ]
        if dataclasses.is_dataclass(one):
            told = re.search(r"^(Attributes|Parameters)\n--", inspect.getdoc(one) or "", re.M)
            own_words = re.findall(r"^    (\w+): .*\n    \"\"\"", inspect.getsource(one), re.M)
            described = {
                name for name, hint in one.__annotations__.items() if "Annotated" in str(hint)
            }
            rest = set(one.__annotations__) - {*own_words, *described}
            silent += [f"{one.__qualname__}: {rest}"] * bool(rest and not told)
    assert silent == []


@pytest.mark.proof("test_links_and_pictures_are_there")
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


def builders(folder: Path, page: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, ROOT / "tools" / "builders", folder, page]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_the_page_of_measured_robots_has_every_report(tmp_path: Path) -> None:
    page = tmp_path / "builders.md"
    page.write_bytes((ROOT / "docs" / "builders.md").read_bytes())
    assert builders(ROOT / "docs" / "builders", page).returncode == 0
    assert page.read_bytes() == (ROOT / "docs" / "builders.md").read_bytes()


@pytest.mark.proof("test_the_page_of_measured_robots_has_every_report")
def test_a_builders_report_stands_beside_the_simulation(tmp_path: Path) -> None:
    page = tmp_path / "builders.md"
    page.write_bytes((ROOT / "docs" / "builders.md").read_bytes())
    report = BenchReport(robot="iphonoid", servo="XL330-M288-T").after(
        "false_stops",
        BenchFindings({"moves": 260.0, "stops": ["waist"]}, {"divisor": {"p_divisor": 250.0}}),
    )
    write_report(report, tmp_path / "anna.toml")
    assert builders(tmp_path, page).returncode == 0
    text = page.read_text(encoding="utf-8")
    assert "|  | simulation | anna |" in text
    assert "| `divisor.p_divisor` | 256 | 250 |" in text
    assert "| false_stops: stops |  | waist |" in text
    (tmp_path / "bert.toml").write_text('robot = "iphonoid"\nservo = 3\n', encoding="utf-8")
    refused = builders(tmp_path, page)
    assert refused.returncode == 1
    assert "bert.toml" in refused.stderr
    write_report(BenchReport(robot="iphonoid", servo="XL999"), tmp_path / "bert.toml")
    (tmp_path / "anna.toml").unlink()
    refused = builders(tmp_path, page)
    assert "XL999".lower() in refused.stderr.lower()
    assert "Traceback" not in refused.stderr
    assert page.read_text(encoding="utf-8") == text


def test_the_page_of_the_senses_has_the_figures_of_its_bench() -> None:
    """It showed three rows of another table for weeks."""
    page = (ROOT / "docs" / "senses.md").read_text("utf-8")
    bench = (ROOT / "bench" / "words.txt").read_text("utf-8")
    comments = re.findall(
        r"^  (\w+) +n +(\d+)  precision (\S+)  recall (\S+)  F1 (\S+)", bench, re.M
    )
    rows = [f"| {name} | {' | '.join(figures)} |" for name, *figures in comments[:7]]
    everyday = re.findall(r"^# Everyday.*?(?=^# )", bench, re.M | re.S)
    counts = [
        re.findall(r"^(?:feelings|neutral|denied|all).*: (\d+/\d+)", one, re.M) for one in everyday
    ]
    assert (len(rows), len(everyday)) == (7, 8)
    assert [what for what in [*rows, *chain(*counts)] if what not in page] == []


def test_the_page_of_the_senses_has_what_its_benches_measured() -> None:
    page = (ROOT / "docs" / "senses.md").read_text("utf-8")
    bench = (ROOT / "bench" / "distress.txt").read_text("utf-8")
    rows = re.findall(r"^\| (?:\w+: .*|[a-z]+ \| \d.*) \|$", bench, re.M)
    assert len(rows) > 25
    rows += (ROOT / "bench" / "facts.txt").read_text("utf-8").splitlines()
    assert [row for row in rows if row not in page] == []


def test_the_page_of_events_names_every_kind_with_fields_that_events_have() -> None:
    page = (ROOT / "docs" / "events.md").read_text("utf-8")
    rows = re.findall(r"^\| (`\w+`(?:, `\w+`)*) \| [^|`]+ \| (.*)\|$", page, re.M)
    kinds = [kind for named, _ in rows for kind in re.findall(r"`(\w+)`", named)]
    assert sorted(kinds) == sorted(get_args(EventKind))
    fields = {field for _, named in rows for field in _outside_brackets(named)}
    assert fields - {*LiveEvent.model_fields} == set()


def _outside_brackets(text: str) -> list[str]:
    named = re.findall(r"`(\w+)`", re.sub(r"\([^)]*\)", "", text))
    return [name for name in named if name not in get_args(EventKind)]
