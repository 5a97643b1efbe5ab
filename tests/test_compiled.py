"""Where compiled code is kept."""

from pathlib import Path

import pytest

from miburi import compiled


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
    monkeypatch.setattr(compiled, "_HERE", closed)
    monkeypatch.setattr(compiled, "_SOURCES", ())
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    assert compiled._writable_folder() is None
    assert list(here.iterdir()) == []
