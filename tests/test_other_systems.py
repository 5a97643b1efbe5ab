"""Other systems, imitated here: what Windows does differently."""

import errno
import fcntl
import os
import socket
import subprocess
import sys
import tomllib
from pathlib import Path

import mujoco
import pytest
from packaging.requirements import Requirement

from miburi.cli.card import emulate
from miburi.errors import BodyError, OutputError
from miburi.ground.files import whole_files
from miburi.robot import iphonoid
from miburi.serving.addresses import listening
from miburi.serving.keys import kept_token
from miburi.studies.film import DrawingError, camera


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
    monkeypatch.setattr("miburi.serving.keys.os.name", "nt")
    assert kept_token(tmp_path / "token") == token


def test_a_port_that_is_taken_is_noticed_where_a_reused_one_is_shared(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """SO_REUSEADDR on Windows is SO_REUSEPORT here: a socket that asks for it shares."""
    plain = socket.socket.setsockopt

    def as_on_windows(self: socket.socket, level: int, name: int, value: int) -> None:
        plain(self, level, socket.SO_REUSEPORT if name == socket.SO_REUSEADDR else name, value)

    monkeypatch.setattr(socket.socket, "setsockopt", as_on_windows)
    monkeypatch.setattr(sys, "platform", "win32")
    with listening("127.0.0.1", 0) as first:
        port = first.getsockname()[1]
        with pytest.raises(OutputError, match="another port"), listening("127.0.0.1", port):
            pass


def test_where_there_are_no_pseudo_terminals_an_emulated_card_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("pty", "tty", "termios"):
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.delitem(sys.modules, "miburi.emulation.terminal", raising=False)
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(BodyError, match="Windows has none"):
        emulate()


def test_what_windows_draws_with_is_installed_there() -> None:
    """MuJoCo draws by GLFW there, which it does not bring along: films were always left out."""
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))
    wanted = [Requirement(line) for line in project["project"]["dependencies"]]
    for platform, there in (("win32", True), ("linux", False), ("darwin", False)):
        needed = {
            one.name for one in wanted
            if one.marker is None or one.marker.evaluate({"sys_platform": platform})
        }  # fmt: skip
        assert ("glfw" in needed) is there, platform


def test_elsewhere_no_debian_package_is_advised(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(*_: object) -> None:
        raise ImportError("no OpenGL")

    monkeypatch.setattr(mujoco, "Renderer", nothing)
    monkeypatch.setattr(sys, "platform", "win32")
    with (
        pytest.raises(DrawingError, match="no OpenGL.*graphics driver") as refused,
        camera(iphonoid()),
    ):
        pass
    assert "apt" not in str(refused.value)
