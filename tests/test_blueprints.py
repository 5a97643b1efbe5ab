"""The blueprints for Home Assistant ask for what they use, and use what they ask for."""

import re
from pathlib import Path
from typing import Any

import yaml

FOLDER = Path(__file__).parents[1] / "clients" / "home-assistant"


class Loader(yaml.SafeLoader):
    """Reads Home Assistant's YAML; what is to be put in is a tuple."""


Loader.add_constructor("!input", lambda loader, node: ("input", loader.construct_scalar(node)))


def inputs(part: Any) -> set[str]:
    if isinstance(part, tuple):
        return {part[1]}
    values = part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()
    return {name for value in values for name in inputs(value)}


def test_each_blueprint_is_whole() -> None:
    files = sorted(FOLDER.glob("*.yaml"))
    assert len(files) == 6
    for file in files:
        text = file.read_text(encoding="utf-8")
        content = yaml.load(text, Loader)  # a safe loader with one tag more
        about = content["blueprint"]
        assert set(content) >= {"blueprint", "trigger", "action", "mode"}, file
        assert about["domain"] == "automation", file
        assert inputs(content) == set(about["input"]), file
        named = set(re.findall(r"(?:states|state_attr)\((\w+)", text))
        assert named <= set(content.get("variables", {})), file
