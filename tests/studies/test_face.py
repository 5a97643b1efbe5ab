"""The face for films: one for each feeling, stronger with the mood, drawn from today's page."""

from itertools import combinations

import numpy as np
import pytest
from PIL import Image

from miburi.feelings import FEELINGS, Expression
from miburi.robot import Robot
from miburi.studies.face import MOODS, SHEET, SIZE, SOURCE, face, source_digest
from miburi.studies.film import Scene, camera


def test_every_feeling_has_a_face_of_its_own() -> None:
    faces = [face(Expression(name, 0.9)) for name in FEELINGS] + [face(None)]
    assert {one.shape for one in faces} == {(SIZE, SIZE, 3)}
    for one, other in combinations(faces, 2):
        assert np.abs(one.astype(int) - other).mean() > 5


def test_the_mood_shows() -> None:
    sad = [face(Expression("sadness", mood)) for mood in MOODS]
    assert not any(np.array_equal(one, other) for one, other in combinations(sad, 2))
    np.testing.assert_array_equal(face(Expression("sadness", 0.62)), sad[2])
    np.testing.assert_array_equal(face(Expression("sadness", 0.05)), face(None))


def test_it_is_drawn_on_the_screen_upright(robot: Robot) -> None:
    """Left half red, upper half green: they arrive where someone in front sees them."""
    picture = np.zeros((SIZE, SIZE, 3), dtype=np.uint8)
    picture[:, : SIZE // 2, 0] = 255
    picture[: SIZE // 2, :, 1] = 255
    with camera(robot, 320, 240) as opened:
        blank = opened.picture(Scene(robot.neutral)).astype(int)
        drawn = opened.picture(Scene(robot.neutral, face=picture)).astype(int)
        again = opened.picture(Scene(robot.neutral)).astype(int)
    np.testing.assert_array_equal(blank, again)
    rows, columns = np.nonzero(np.abs(drawn - blank).sum(axis=2) > 60)
    top, left = np.quantile(rows, 0.3), np.quantile(columns, 0.3)
    bottom, right = np.quantile(rows, 0.6), np.quantile(columns, 0.7)

    def colour(row: float, column: float) -> tuple[bool, bool]:
        red, green, _ = drawn[int(row), int(column)]
        return bool(red > 100), bool(green > 100)

    assert colour(top, left) == (True, True)
    assert colour(top, right) == (False, True)
    assert colour(bottom, left) == (True, False)
    assert colour(bottom, right) == (False, False)


@pytest.mark.skipif(not SOURCE.exists(), reason="the face's page is not part of this build")
def test_the_sheet_is_drawn_from_todays_page() -> None:
    with Image.open(SHEET) as sheet:
        assert sheet.info["Source"] == source_digest(), "run tools/draw-faces"
