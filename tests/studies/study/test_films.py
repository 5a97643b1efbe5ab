"""Missing films are drawn, whole and once; a film of one's own must be there."""

from pathlib import Path

import pytest
from tests.fixtures.study import TWO_FILMS, Lab

from miburi.errors import InputError
from miburi.gestures import Repertoire, shipped_repertoire
from miburi.robot import Robot
from miburi.studies.study.films import FILMS, draw_missing, find_films
from miburi.studies.study.plan import FILE, load_study


@pytest.mark.proof("test_a_film_of_ones_own_must_be_there")
def test_only_what_is_missing_is_drawn(robot: Robot, tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    there = find_films(lab.study, tmp_path)
    there["fright-0.9"].unlink()
    steps: list[tuple[int, int]] = []
    functions = shipped_repertoire().functions
    short = Repertoire(tuple(one.model_copy(update={"duration": 0.3}) for one in functions))
    films = draw_missing(lab.study, tmp_path, robot, short, lambda *step: steps.append(step))
    assert steps == [(0, 1), (1, 1)]
    assert films["fear-0.9"].read_text() == "fear-0.9"  # as it was
    assert films["fright-0.9"].stat().st_size > 5_000
    assert sorted(file.name for file in (tmp_path / FILMS).iterdir()) == sorted(
        file.name for file in films.values()
    )


def test_a_film_of_ones_own_must_be_there(robot: Robot, tmp_path: Path) -> None:
    own = 'moods = [0.9]\nfile = "mine.mp4"'
    text = TWO_FILMS.replace('["fear", "fright"]', '["fear"]').replace("moods = [0.9]", own)
    (tmp_path / FILE).write_text(text, encoding="utf-8")
    study = load_study(tmp_path)
    with pytest.raises(InputError, match=r"films has no mine\.mp4"):
        draw_missing(study, tmp_path, robot, shipped_repertoire(), lambda *_: None)
    (tmp_path / FILMS).mkdir()
    (tmp_path / FILMS / "mine.mp4").write_bytes(b"film")
    assert find_films(study, tmp_path) == {"mine": tmp_path / FILMS / "mine.mp4"}
