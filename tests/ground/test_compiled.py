"""Where compiled code is kept, and when it is compiled anew."""

import re
import shutil
from pathlib import Path

import pytest

import miburi
from miburi.ground import compiled

ROOT = Path(miburi.__file__).parent


def compiled_modules() -> list[str]:
    """Every module with a compiled function, from the package's root."""
    return [
        path.relative_to(ROOT).as_posix()
        for path in ROOT.rglob("*.py")
        if re.search(r"^@compiled\b", path.read_text(encoding="utf-8"), re.MULTILINE)
    ]


def test_a_change_in_any_compiled_module_compiles_all_of_them_anew(tmp_path: Path) -> None:
    copy = tmp_path / "miburi"
    shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns("__pycache__", "static"))
    states = [compiled.state_of_sources(copy)]
    assert states == [compiled.state_of_sources(ROOT)]
    modules = compiled_modules()
    assert len(modules) >= 3
    for module in modules:
        with (copy / module).open("a", encoding="utf-8") as file:
            file.write("# changed\n")
        states.append(compiled.state_of_sources(copy))
    (copy / compiled.FOLDERS[0] / "new.py").touch()
    states.append(compiled.state_of_sources(copy))
    assert len(set(states)) == len(states)


def test_without_a_home_nothing_is_written_where_one_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nobody() -> Path:
        raise RuntimeError("no home")

    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", nobody)
    closed = tmp_path / "closed"
    closed.touch()
    monkeypatch.setattr(compiled, "_ROOT", closed)
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    assert compiled._writable_folder() is None
    assert list(here.iterdir()) == []
