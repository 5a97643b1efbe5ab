"""Other systems, imitated here: what Windows does differently."""

import errno
import fcntl
import os
import subprocess
import sys
from pathlib import Path

import pytest

from miburi.ground.files import whole_files
from miburi.interface.access import kept_token


def test_a_file_is_flushed_where_only_writers_may(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flush = os.fsync

    def as_on_windows(fd: int) -> None:
        if fcntl.fcntl(fd, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY:
            raise OSError(errno.EBADF, "Bad file descriptor")
        flush(fd)

    monkeypatch.setattr(os, "fsync", as_on_windows)
    with whole_files(tmp_path) as draft:
        (draft / "a.txt").write_text("whole")
    assert (tmp_path / "a.txt").read_text() == "whole"


def test_a_pipe_that_knows_few_signs_gets_others() -> None:
    done = subprocess.run(
        [sys.executable, "-c",
         "import sys; sys.stdout.reconfigure(encoding='cp1252'); "
         "from miburi.cli import main; main()", "words"],
        input="うれしい\n".encode(), capture_output=True, check=False,
        env={**os.environ, "PYTHONIOENCODING": "utf-8"},
    )  # fmt: skip
    assert done.stdout.decode("cp1252").startswith("'???': happiness"), done.stderr.decode()


def test_a_token_is_kept_where_files_have_no_bits_for_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else each start would lock paired devices out."""
    token = kept_token(tmp_path / "token")
    (tmp_path / "token").chmod(0o666)  # what os.stat says of every file there
    monkeypatch.setattr("miburi.interface.access.os.name", "nt")
    assert kept_token(tmp_path / "token") == token
