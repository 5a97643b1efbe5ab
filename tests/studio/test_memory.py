from pathlib import Path

import pytest

from miburi.feelings import EmotionalModel, shipped_temperament
from miburi.studio import memory


def test_feelings_are_kept_and_age(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    feelings = EmotionalModel()
    feelings.set_state(mood={"happiness": 0.8})
    monkeypatch.setattr(memory.time, "time", lambda: 1000.0)
    memory.remember(tmp_path / "deep" / "feelings.json", feelings)
    monkeypatch.setattr(memory.time, "time", lambda: 4600.0)
    kept = memory.remembered(tmp_path / "deep" / "feelings.json", shipped_temperament())
    assert kept is not None
    assert kept.mood[0] == pytest.approx(0.8 * 0.3679, rel=1e-3)


@pytest.mark.parametrize("text", ["", "{torn", "{}", '{"when": 1, "feelings": {}}', "[]", "\x00"])
def test_what_cannot_be_read_is_forgotten(tmp_path: Path, text: str) -> None:
    (tmp_path / "feelings.json").write_text(text)
    assert memory.remembered(tmp_path / "feelings.json", shipped_temperament()) is None


def test_where_nothing_can_be_kept_it_forgets(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    memory.remember(tmp_path / "file" / "feelings.json", EmotionalModel())
