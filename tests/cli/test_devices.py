"""What `miburi devices` shows and forgets."""

from pathlib import Path

from typer.testing import CliRunner

from miburi.cli.commands import app
from miburi.errors import InputError
from miburi.serving.keys import Keys, kept_token


def devices(folder: Path, *words: str) -> str:
    done = CliRunner().invoke(app, ["devices", *words, "--folder", str(folder)])
    if isinstance(done.exception, InputError):
        return f"error: {done.exception}"
    assert done.exit_code == 0, done.output
    return done.output


def test_a_lost_phone_is_found_and_forgotten(tmp_path: Path) -> None:
    assert "No device is paired" in devices(tmp_path)
    kept_token(tmp_path / "token")
    keys = Keys(tmp_path)
    lost = keys.pair("Mozilla/5.0 (Linux; Android 15) Chrome/130 Mobile Safari/537.36")
    name = lost.partition(".")[0]
    (row,) = [line for line in devices(tmp_path).splitlines() if name in line]
    assert "Android, Chrome" in row
    said = devices(tmp_path, "forget", name)
    assert f"Forgotten: {name}." in said
    assert keys.token in said
    assert not keys.fits(lost)
    assert "No device is paired" in devices(tmp_path)


def test_it_forgets_nothing_that_was_not_named(tmp_path: Path) -> None:
    kept_token(tmp_path / "token")
    key = Keys(tmp_path).pair("")
    assert "--folder" in devices(tmp_path / "elsewhere", "forget", "--all")
    for words in (("forget",), ("forget", "12345678"), ("forget", key[:8], "--all")):
        assert devices(tmp_path, *words).startswith("error: ")
        assert Keys(tmp_path).fits(key)
