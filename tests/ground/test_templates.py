from pathlib import Path

import pytest
from jinja2 import UndefinedError

from miburi.ground.templates import render


@pytest.mark.parametrize(("name", "text"), [("a.html", "&lt;b&gt;\n"), ("a.md", "<b>\n")])
def test_html_is_escaped_and_markdown_is_not(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text("{{ value }}\n")
    assert render(tmp_path / name, value="<b>") == text


def test_a_value_that_is_missing_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "a.md").write_text("{{ vlaue }}")
    with pytest.raises(UndefinedError, match="vlaue"):
        render(tmp_path / "a.md", value=1)
