"""The token in its file: made once, for its owner alone, and anew where it is none."""

import stat
from pathlib import Path

import pytest

from miburi.interface.access import kept_token


def test_the_token_is_made_once_and_for_its_owner_alone(tmp_path: Path) -> None:
    path = tmp_path / "miburi" / "token"
    token = kept_token(path)
    assert len(token) >= 32
    assert kept_token(path) == token
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


@pytest.mark.parametrize("content", [b"short", b"\xff\x00" * 40, b"x" * 40 + b"\n" + b"y" * 40])
def test_a_token_that_is_none_is_made_anew(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "token"
    path.write_bytes(content)
    path.chmod(0o600)
    token = kept_token(path)
    assert token.encode() not in content
    assert kept_token(path) == token


def test_a_token_that_others_could_read_is_made_anew(tmp_path: Path) -> None:
    path = tmp_path / "token"
    token = kept_token(path)
    path.chmod(0o644)
    assert kept_token(path) != token
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
