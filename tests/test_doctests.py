"""The examples in the docstrings of all modules give what they say."""

import doctest
from importlib import import_module
from pathlib import Path

import pytest

import miburi

ROOT = Path(miburi.__file__).parent
MODULES = sorted(
    ".".join(["miburi", *path.relative_to(ROOT).with_suffix("").parts]).removesuffix(".__init__")
    for path in ROOT.rglob("*.py")
    if ">>>" in path.read_text(encoding="utf-8")
)


@pytest.mark.parametrize("name", MODULES)
def test_the_examples_of(name: str) -> None:
    result = doctest.testmod(import_module(name))
    assert result.attempted > 0
    assert result.failed == 0
