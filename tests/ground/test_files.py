"""Results are whole under their final names, or not there at all."""

import os
from pathlib import Path

import pytest

from miburi.errors import OutputError
from miburi.ground.files import whole_files


def test_files_arrive_whole_and_replace_older_ones(tmp_path: Path) -> None:
    out = tmp_path / "a" / "b"
    for text in ("first", "second"):
        with whole_files(out) as draft:
            (draft / "x.txt").write_text(text)
            assert text == "first" or (out / "x.txt").read_text() == "first"
    assert (out / "x.txt").read_text() == "second"
    assert os.listdir(out) == ["x.txt"]  # noqa: PTH208  # hidden drafts would show


@pytest.mark.parametrize("kind", [ValueError, KeyboardInterrupt, SystemExit])
def test_a_broken_run_leaves_nothing(tmp_path: Path, kind: type[BaseException]) -> None:
    with pytest.raises(kind), whole_files(tmp_path) as draft:
        (draft / "x.txt").write_text("half")
        raise kind
    assert list(tmp_path.iterdir()) == []


def test_a_place_that_is_a_file(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("")
    with pytest.raises(OutputError, match="cannot write there"), whole_files(tmp_path / "taken"):
        pass


def test_a_read_only_place() -> None:
    with (
        pytest.raises(OutputError, match="/proc/miburi: cannot write"),
        whole_files("/proc/miburi"),
    ):
        pass


def test_a_full_disk(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="No space left.*--out"), whole_files(tmp_path):
        Path("/dev/full").write_text("x" * 100_000)
    assert list(tmp_path.iterdir()) == []
