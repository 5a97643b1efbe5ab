"""Where compiled code is kept, and when it is compiled again."""

import errno
import re
import shutil
import tempfile
from pathlib import Path

import pytest

import miburi
from miburi.ground import compiled

ROOT = Path(miburi.__file__).parent


def compiled_modules() -> list[str]:
    """Return every module with a compiled function, relative to the package's root."""
    return [
        path.relative_to(ROOT).as_posix()
        for path in ROOT.rglob("*.py")
        if re.search(r"^@compiled\b", path.read_text(encoding="utf-8"), re.MULTILINE)
    ]


def test_a_change_in_any_compiled_module_compiles_all_of_them_again(tmp_path: Path) -> None:
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


def test_without_a_home_folder_nothing_is_written_to_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nobody() -> Path:
        raise RuntimeError("no home")

    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", nobody)
    closed = tmp_path / "closed"
    closed.touch()
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    assert compiled.cache_folder(closed) is None
    assert list(here.iterdir()) == []


@pytest.fixture
def image(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Sources with a full cache beside them, in a place that cannot be written, even by root."""
    root = tmp_path / "image"
    (root / "ik").mkdir(parents=True)
    folder = root / "__pycache__" / f"compiled-{compiled.state_of_sources(root)}" / "ik"
    folder.mkdir(parents=True)
    (folder / "solver.nbi").write_bytes(b"an index")
    really = tempfile.TemporaryFile

    def read_only(*, dir: Path) -> object:  # noqa: A002  (as it is named there)
        if dir.is_relative_to(root):
            raise OSError(errno.EROFS, "read-only")
        return really(dir=dir)

    monkeypatch.setattr(tempfile, "TemporaryFile", read_only)
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    return root


def test_a_full_cache_that_cannot_be_written_is_not_compiled_again(
    image: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    folder = compiled.cache_folder(image)
    assert folder is not None
    assert folder.is_relative_to(tmp_path / "home")
    assert (folder / "ik" / "solver.nbi").read_bytes() == b"an index"
    (folder / "ik" / "solver.nbi").write_bytes(b"newer")
    assert compiled.cache_folder(image) == folder
    assert (folder / "ik" / "solver.nbi").read_bytes() == b"newer"


def test_without_any_place_to_write_a_full_cache_serves_all_the_same(
    image: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    closed = tmp_path / "closed"
    closed.touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(closed))
    folder = compiled.cache_folder(image)
    assert folder is not None
    assert not folder.is_relative_to(image)
    assert (folder / "ik" / "solver.nbi").read_bytes() == b"an index"
