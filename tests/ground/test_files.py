"""Files are complete under their final names, or not there at all."""

import sys
from pathlib import Path

import pytest

from miburi.errors import OutputError
from miburi.ground.files import alone_in, whole_files


def test_complete_files_replace_older_ones(tmp_path: Path) -> None:
    out = tmp_path / "a" / "b"
    for text in ("first", "second"):
        with whole_files(out) as draft:
            (draft / "x.txt").write_text(text)
            assert text == "first" or (out / "x.txt").read_text() == "first"
    assert (out / "x.txt").read_text() == "second"
    assert [path.name for path in out.iterdir()] == ["x.txt"]  # hidden drafts would show


@pytest.mark.parametrize("kind", [ValueError, KeyboardInterrupt, SystemExit])
def test_a_failed_run_leaves_no_files(tmp_path: Path, kind: type[BaseException]) -> None:
    with pytest.raises(kind), whole_files(tmp_path) as draft:
        (draft / "x.txt").write_text("half")
        raise kind
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_place_of_the_folder_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("")
    with pytest.raises(OutputError, match="cannot write there"), whole_files(tmp_path / "taken"):
        pass


def test_a_read_only_folder_is_an_error() -> None:
    with (
        pytest.raises(OutputError, match="/proc/miburi: cannot write"),
        whole_files("/proc/miburi"),
    ):
        pass


def test_a_full_disk_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="No space left.*make room"), whole_files(tmp_path):
        Path("/dev/full").write_text("x" * 100_000, encoding="utf-8")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has other locks")
def test_a_folder_is_for_one_at_a_time(tmp_path: Path) -> None:
    for _ in range(2):
        with (
            alone_in(tmp_path / "new"),
            pytest.raises(OutputError, match="--folder"),
            alone_in(tmp_path / "new"),
        ):
            pass


def test_a_read_only_folder_keeps_nobody_out() -> None:
    with alone_in(Path("/proc/miburi")), alone_in(Path("/proc/miburi")):
        pass
