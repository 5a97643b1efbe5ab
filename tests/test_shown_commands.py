"""Every command that README and docs show is one that there is, and prints what they show.

The lessons (docs/learn) are followed whole by test_tutorials. Here are the blocks of the other
pages: each command of `miburi` is parsed, and all are carried out but those that ELSEWHERE names.
"""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.fixtures.command import miburi
from tests.fixtures.tutorial import Reader, matches

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(ROOT.glob("docs/*.md"))]
#: What a line of a block begins with that is a command.
_BEGINS = re.compile(
    r"(\$ )?(miburi|make|python|pip|curl|sudo|npm|arecord|echo|printf|export|mosquitto_\w+|ros2) "
)
#: Commands that are not carried out here, and where they are.
ELSEWHERE = {
    r"make ": "continuous integration runs make",
    r"(pip|sudo|npm) ": "it installs something; tests/test_extras.py has the extras",
    r"(arecord|mosquitto_\w+|ros2) ": "another program: tests/senses, tests/interface",
    r"curl -N": "it never ends: tests/interface/test_events.py",
    r"(curl|miburi say) ": "test_what_is_sent_to_a_partner_is_taken, below",
    r"miburi (--feelings \S+ )?run": "it never ends; tests/cli/test_run.py wakes partners",
    r"miburi (card|devices|fleet|feel|gesture record|study (run|report|close))":
        "it needs a partner, a card or answers: tests/cli, tests/interface, tests/studies",
    r"miburi hardware|miburi export \w+ .*--meshes": "tests/test_docs.py, tests/hardware",
    r"miburi --feelings|export |python$": "tests/feelings/test_ninth.py follows that section",
    r"miburi (gallery|paper|gesture measures)": "it takes minutes: tests/studies",
    r"miburi experiment --(seed|body)": "the README's is in tests/test_docs.py",
    r"miburi gesture preview": "tests/test_without_egl.py draws one",
    r"python (bench|tools)/": "it takes minutes; what it printed is kept beside it",
    r"python examples/": "tests/test_docs.py makes its picture",
    r"miburi template robot iphonoid": "tests/test_docs.py",
}  # fmt: skip


@dataclass(frozen=True)
class Shown:
    """A command, and what the page says that it prints; None where it says nothing."""

    page: str
    line: str
    output: str | None


def shown(page: Path) -> list[Shown]:
    """Return the commands of a page's indented blocks, in order."""
    found: list[Shown] = []
    text = page.read_text(encoding="utf-8")
    for block in re.findall(r"(?:^    \S.*\n(?:    .*\n|\n(?=    ))*)", text, re.MULTILINE):
        lines = [line[4:] for line in block.splitlines()]
        if not _BEGINS.match(f"{lines[0]} "):
            continue
        dollars = lines[0].startswith("$ ")
        while lines:
            line = lines.pop(0)
            if not (line.startswith("$ ") if dollars else _BEGINS.match(f"{line} ")):
                continue
            while lines and not _is_whole(line):
                line += "\n" + lines.pop(0)
            output = []
            while lines and not (lines[0].startswith("$ ") or _BEGINS.match(f"{lines[0]} ")):
                output.append(lines.pop(0))
            printed = "\n".join(output).strip("\n")
            found.append(Shown(page.name, line.removeprefix("$ "), printed or None))
    return found


def _is_whole(line: str) -> bool:
    """Whether no quotation is open, and no line follows."""
    try:
        shlex.split(line, comments=True)
    except ValueError:
        return False
    return not line.endswith("\\")


COMMANDS = [command for page in PAGES for command in shown(page)]


def test_the_pages_show_commands() -> None:
    assert len(COMMANDS) > 70
    unused = [why for why in ELSEWHERE if not any(re.match(why, one.line) for one in COMMANDS)]
    assert unused == []


def test_every_command_of_miburi_is_one_that_there_is() -> None:
    """Its options, too: a wrong one is told before the help that is asked for here."""
    wrong = []
    for command in COMMANDS:
        words = shlex.split(re.sub(r"\\\n", " ", command.line), comments=True)
        if "[--" in command.line:  # the list of options
            words = [word.strip("[]") for word in words]
        if "miburi" not in words:
            continue
        words = words[words.index("miburi") + 1 :]
        ends = [words.index(end) for end in ("|", ">", "&&") if end in words]
        done = miburi(*words[: min(ends, default=len(words))], "--help")
        if done.returncode:
            wrong.append(f"{command.page}: {command.line}: {done.stderr}")
    assert wrong == []


def _is_elsewhere(command: Shown) -> bool:
    return any(re.match(pattern, command.line) for pattern in ELSEWHERE)


@pytest.mark.parametrize("page", sorted({one.page for one in COMMANDS if not _is_elsewhere(one)}))
def test_a_command_prints_what_the_page_shows(page: str, tmp_path: Path) -> None:
    text = (ROOT / ("docs" if page != "README.md" else ".") / page).read_text(encoding="utf-8")
    if saved := re.search(r"Save it as `([\w.]+)`", text):
        file = re.findall(r"^```toml\n(.*?)^```$", text[: saved.start()], re.M | re.DOTALL)[-1]
        (tmp_path / saved[1]).write_text(file, encoding="utf-8")
    (tmp_path / "docs").mkdir()
    with Reader(tmp_path) as reader:
        for command in COMMANDS:
            if command.page == page and not _is_elsewhere(command):
                printed = reader.type(re.sub(r" +# .*", "", command.line))
                assert "Traceback" not in printed
                assert not printed.startswith("miburi: "), printed
                if command.output is not None:
                    assert matches(command.output, printed), f"$ {command.line}\n{printed}"


def test_what_is_sent_to_a_partner_is_taken(tmp_path: Path) -> None:
    posts = [one for one in COMMANDS if one.line.startswith("curl -X POST")]
    assert len(posts) == 2
    with Reader(tmp_path) as reader:
        address = re.search(r"http://\S+", reader.type("miburi run"))
        assert address
        for post in posts:
            line = post.line.replace("curl", "curl --silent --show-error --fail")
            assert '"id"' in reader.type(line)
        [said] = [one for one in COMMANDS if one.line.startswith("miburi say")]
        assert said.output
        # What it answers is drawn.
        shown = re.sub("it says: .*", "it says: …", said.output)
        assert matches(shown, reader.type(said.line.split(" #")[0].rstrip()))
