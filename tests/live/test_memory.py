from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest

from miburi.errors import InputError, OutputError
from miburi.feelings import EmotionalModel, shipped_temperament
from miburi.live import memory
from miburi.live.memory import keep, remember, remembered


def happy() -> EmotionalModel:
    feelings = EmotionalModel()
    feelings.set_state(mood={"happiness": 0.8})
    return feelings


def test_feelings_are_kept_and_age(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory.time, "time", lambda: 1000.0)
    remember(tmp_path / "deep" / "feelings.json", happy().save())
    monkeypatch.setattr(memory.time, "time", lambda: 4600.0)
    kept = remembered(tmp_path / "deep" / "feelings.json", shipped_temperament())
    assert kept is not None
    assert kept.mood[0] == pytest.approx(0.5 + 0.3 * 0.3679, rel=1e-3)


@pytest.mark.parametrize(
    "content",
    [
        b"", b"{torn", b"{}", b"[]", b"\x00", b"\xff\xfe\x80binary", b"null",
        b'{"when": 1, "feelings": {}}', b'{"when": 1, "feelings": 7}',
        b'{"when": -1, "feelings": {}}', b'{"when": "1", "feelings": {}}',
        b"[" * 100_000, b'{"when": ' + b"[" * 100_000,
        b'{"when": ' + b"9" * 400 + b', "feelings": {}}',
        b'{"when": ' + b"9" * 5000 + b', "feelings": {}}',
        b'{"when": 1e999, "feelings": {}}',
        b'{"when": 1, "feelings": {"version": 1, "model": "cascade", "time": ' + b"9" * 400 + b"}}",
        b'{"when": 1, "feelings": {"version": 1, "model": "cascade", "time": 1, "levels": [[1'
        + b"0" * 400 + b"]]}}",
        b'{"when": 1, "feelings": {"version": "' + b"x" * 100_000 + b'"}}',
    ],
    ids=lambda content: repr(content[:30]),
)  # fmt: skip
def test_a_bad_file_is_said_and_kept_aside(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "feelings.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"feelings\.json\.bad") as refused:
        remembered(path, shipped_temperament())
    assert len(str(refused.value).splitlines()) == 1
    assert len(str(refused.value)) < 600 + len(str(path))
    assert not path.exists()
    assert path.with_name("feelings.json.bad").read_bytes() == content
    assert remembered(path, shipped_temperament()) is None
    path.write_bytes(b"again")
    with pytest.raises(InputError, match=r"feelings\.json\.bad-2\."):
        remembered(path, shipped_temperament())
    assert path.with_name("feelings.json.bad").read_bytes() == content


def test_a_place_that_takes_no_file_is_reported(tmp_path: Path) -> None:
    (tmp_path / "feelings.json").mkdir()
    with pytest.raises(InputError, match="cannot be read"):
        remembered(tmp_path / "feelings.json", shipped_temperament())
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be kept"):
        remember(tmp_path / "file" / "feelings.json", happy().save())


def test_a_write_that_fails_leaves_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "feelings.json"
    remember(path, happy().save())
    before = path.read_bytes()
    with monkeypatch.context() as patch:

        def full(_: int) -> None:
            raise OSError(28, "No space left on device")

        patch.setattr("os.fsync", full)
        with pytest.raises(OutputError, match="No space left"):
            remember(path, EmotionalModel().save())
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["feelings.json"]


def test_feelings_are_kept_every_minute_whatever_happens_in_one(tmp_path: Path) -> None:
    """Each minute stands for itself: the disk may be full, or the loop busy, in another."""
    path, feelings = tmp_path / "folder" / "feelings.json", happy()
    seen: list[bool] = []
    waits: list[float] = []

    def save() -> Future[dict[str, Any]]:
        answer: Future[dict[str, Any]] = Future()
        if len(waits) == 2:
            answer.set_exception(TimeoutError())
        else:
            answer.set_result(feelings.save())
        return answer

    def wait(seconds: float) -> bool:
        waits.append(seconds)
        seen.append(path.exists())
        if len(waits) == 2:
            (tmp_path / "folder" / "feelings.json").unlink()
        return len(waits) == 4

    keep(path, save, wait)
    assert waits == [60.0] * 4
    assert seen == [False, True, False, True]
