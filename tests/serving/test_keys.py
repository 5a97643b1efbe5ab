"""The token and the devices' keys: for their owner alone, and of no use once forgotten."""

import asyncio
import errno
import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.fixtures.gate import scope_of

from miburi.errors import InputError
from miburi.serving.access import Gate
from miburi.serving.keys import LIFE, MOST, Keys, kept_token

PHONE = "Mozilla/5.0 (iPhone; CPU iPhone OS 18_1 like Mac OS X) Version/18.1 Safari/604.1"
NOW = 1_800_000_000.0


@pytest.fixture
def keys(tmp_path: Path) -> Keys:
    kept_token(tmp_path / "token")
    return Keys(tmp_path)


def test_the_token_is_made_once_and_for_its_owner_alone(tmp_path: Path) -> None:
    path = tmp_path / "miburi" / "token"
    token = kept_token(path)
    assert len(token) >= 32
    assert kept_token(path) == token
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    path.chmod(0o644)
    assert kept_token(path) != token, "others could read it"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


@pytest.mark.parametrize("content", [b"short", b"\xff\x00" * 40, b"x" * 40 + b"\n" + b"y" * 40])
def test_a_token_that_is_none_is_made_anew(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "token"
    path.write_bytes(content)
    path.chmod(0o600)
    token = kept_token(path)
    assert token.encode() not in content
    assert kept_token(path) == token
    assert {each.name for each in tmp_path.iterdir()} == {"token"}


def test_a_device_has_a_key_of_its_own_that_no_file_holds(keys: Keys, tmp_path: Path) -> None:
    one, other = keys.pair(PHONE), keys.pair("curl/8 <script>")
    assert keys.fits(one)
    assert keys.fits(other)
    assert keys.fits(keys.token)
    assert not keys.is_token(one)
    assert not keys.fits(one.partition(".")[0] + "." + other.partition(".")[2])
    assert {device.kind for device in keys.devices()} == {"iPhone, Safari", "a device"}
    for file in tmp_path.rglob("*.json"):
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
        assert one.partition(".")[2] not in file.read_text()


def test_who_forgets_one_locks_it_out_with_the_token_it_has_seen(keys: Keys) -> None:
    lost, mine, token = keys.pair(PHONE), keys.pair(PHONE), keys.token
    keys.forget(lost.partition(".")[0])
    assert not keys.fits(lost)
    assert not keys.fits(token)
    assert keys.fits(mine)
    assert keys.fits(keys.token)
    keys.forget()
    assert not keys.fits(mine)
    assert keys.devices() == []
    with pytest.raises(InputError, match=r"'../token'.*miburi devices"):
        keys.forget("../token")


def test_a_folder_that_no_partner_knows_forgets_nobody(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--folder"):
        Keys(tmp_path / "elsewhere").forget()
    assert not (tmp_path / "elsewhere").exists()


def test_who_pairs_while_all_are_forgotten_is_forgotten_too(
    keys: Keys, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The new token comes first, so the old one pairs nobody once the devices are listed."""
    token, glob, late = keys.token, Path.glob, []

    def pair_now(folder: Path, pattern: str) -> Iterator[Path]:
        found = [*glob(folder, pattern)]
        if keys.is_token(token):
            late.append(keys.pair(PHONE))
        return iter(found)

    keys.pair(PHONE)
    monkeypatch.setattr(Path, "glob", pair_now)
    assert keys.forget() == 1
    assert late == []


def test_a_key_ends_after_its_life_and_another_takes_the_place_of_the_oldest(keys: Keys) -> None:
    old = keys.pair(PHONE, now=NOW)
    assert keys.fits(old, NOW + LIFE - 1)
    assert not keys.fits(old, NOW + LIFE)
    made = [keys.pair(PHONE, now=NOW + LIFE + number) for number in range(MOST + 1)]
    assert len(keys.devices(NOW + LIFE + MOST)) == MOST
    assert [keys.fits(one, NOW + LIFE + MOST) for one in made].count(True) == MOST


def test_a_device_that_pairs_again_stays_one_and_its_visits_are_noted(keys: Keys) -> None:
    first = keys.pair(PHONE, now=NOW)
    second = keys.pair(PHONE, first, NOW)
    assert not keys.fits(first, NOW)
    (device,) = keys.devices(NOW)
    assert keys.fits(second, device.seen + 3600.0)
    assert keys.devices(NOW)[0].seen == device.seen + 3600.0


def test_a_disk_that_takes_nothing_locks_nobody_out(
    keys: Keys, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    key, stranger, token = keys.pair(PHONE, now=NOW), "0123abcd." + "x" * 43, keys.token
    monkeypatch.setattr(os, "utime", fail)
    assert keys.fits(key, NOW + 3600)
    monkeypatch.setattr(Path, "read_text", fail)  # no files are left, say
    assert keys.fits(key, NOW + 3600)
    assert keys.fits(token)
    assert not keys.fits(stranger)
    keys.devices(NOW)
    monkeypatch.undo()
    assert [device.name for device in keys.devices(NOW)] == [key.partition(".")[0]]


def test_a_clock_that_jumps_ends_no_key_for_good(keys: Keys) -> None:
    key = keys.pair(PHONE, now=NOW)
    assert keys.devices(NOW + 2 * LIFE) == []
    assert keys.fits(key, NOW + 1)
    assert keys.fits(key, NOW - 3600)
    assert not keys.fits(key, NOW - LIFE), "or a clock that was ahead would make it good for ever"


@pytest.mark.parametrize(
    "content",
    [
        "",
        "{",
        "[]",
        '{"paired": "soon", "hash": 1}',
        "{}",
        "[" * 10_000,
        f'{{"kind": "", "paired": {NOW}, "hash": 1}}',
        f'{{"kind": "", "paired": 1{"0" * 400}, "hash": ""}}',
    ],
)
def test_a_broken_file_lets_nobody_in(keys: Keys, tmp_path: Path, content: str) -> None:
    key = keys.pair(PHONE)
    (file,) = (tmp_path / "devices").iterdir()
    file.write_text(content)
    assert not keys.fits(key, NOW)
    assert keys.devices(NOW) == []


@pytest.mark.parametrize("given", ["", " ", "ffffffff." + "x" * 43, "../token." + "x" * 43, "é"])
def test_what_is_no_key_fits_nothing(keys: Keys, tmp_path: Path, given: str) -> None:
    assert not keys.fits(given)
    (tmp_path / "token").unlink()
    assert not keys.fits(given)


def test_a_forgotten_device_that_reads_nothing_is_heard_no_more(keys: Keys) -> None:
    """Its socket takes no farewell, and yet the application behind it ends."""
    ended: list[bool] = []

    async def behind(scope: Any, receive: Any, send: Any) -> None:
        try:
            await asyncio.Event().wait()
        finally:
            ended.append(True)

    async def deaf(message: Any) -> None:
        await asyncio.Event().wait()

    async def visit() -> None:
        scope = scope_of(kind="websocket", authorization=f"Bearer {keys.token}")
        visiting = asyncio.create_task(Gate(behind, keys)(scope, deaf, deaf))
        await asyncio.sleep(0)
        keys.forget()
        await asyncio.wait_for(visiting, 30)

    asyncio.run(visit())
    assert ended == [True]
