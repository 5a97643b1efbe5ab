"""The loop: the paper's flow from feeling to body."""

from pathlib import Path

import numpy as np
import pytest
from tests.fixtures.partner import PaperBody, happy, of, run
from tests.partner.conftest import Moving

from miburi import gestures, ik
from miburi.errors import BodyError, InputError
from miburi.feelings import FEELINGS, EmotionalModel, Expression
from miburi.partner import (
    LAPSES,
    GestureEnded,
    GestureStarted,
    MoveSent,
    Partner,
    WishDropped,
)
from miburi.robot import Robot, forward, load_robot
from miburi.safety.move import Move
from miburi.safety.stop import Phase


@pytest.mark.parametrize(
    ("move_time", "touched", "expected"),
    [(0.2, False, [0.02, 2, 4, 6, 8]), (0.8, False, [0.02, 4, 8]), (0.2, True, [0.02, 4, 6, 8])],
    ids=["each period", "too long for a period", "after a contact"],
)
def test_gestures_begin_at_multiples_of_the_period(
    robot: Robot, move_time: float, touched: bool, expected: list[float]
) -> None:
    body = PaperBody(robot, move_time)
    partner = Partner(body, happy(), period=2.0)
    events = run(partner, 0.8)
    if touched:
        body.touch()
    events += run(partner, 8.2)
    starts = [event.time for event in of(GestureStarted, events)]
    np.testing.assert_allclose(starts, expected, atol=0.021)
    assert all(event.complete for event in of(GestureEnded, events))
    assert all(event.solution.error.max() < 1e-3 for event in of(MoveSent, events))


def test_without_a_feeling_or_a_mood_it_stays_at_neutral(robot: Robot) -> None:
    for feelings in (EmotionalModel(), happy(0.0)):
        body = PaperBody(robot)
        run(Partner(body, feelings), 5.0)
        assert body.moves == []


def test_the_strongest_emotion_picks_the_gesture_and_its_mood_the_intensity(robot: Robot) -> None:
    feelings = EmotionalModel()
    feelings.set_state(
        emotion={"happiness": 0.4, "anger": 0.6}, mood={"happiness": 0.9, "anger": 0.3}, hold=True
    )
    started = of(GestureStarted, run(Partner(PaperBody(robot), feelings), 1.0))[0]
    assert (started.expression.feeling, started.expression.mood) == ("anger", 0.3)


@pytest.mark.parametrize("feeling", FEELINGS)
def test_a_stronger_mood_takes_more_space_in_less_time(robot: Robot, feeling: str) -> None:
    def space_and_speed(mood: float) -> list[float]:
        feelings, body = EmotionalModel(), PaperBody(robot)
        feelings.set_state(emotion={feeling: 1.0}, mood={feeling: mood}, hold=True)
        run(Partner(body, feelings, period=60.0), 3.0)
        space = max(np.abs(move.angles - robot.neutral).max() for move in body.moves)
        return [space, max(move.speeds.max() for move in body.moves)]

    assert np.all(np.diff([space_and_speed(mood) for mood in (0.3, 0.9)], axis=0) > 0)


def test_the_mood_of_now_counts_at_the_next_key_pose(robot: Robot) -> None:
    body, feelings = PaperBody(robot), happy(0.9)
    partner = Partner(body, feelings, period=60.0)
    run(partner, 0.1)
    feelings.set_state(mood={"happiness": 0.0}, hold=True)
    run(partner, 3.0)
    np.testing.assert_allclose(body.moves[-1].angles, robot.neutral, atol=1e-3)
    assert len(body.moves) == 2


def test_rest_brings_the_body_home(robot: Robot, moving: Moving) -> None:
    partner, body = moving
    assert not partner.at_rest
    partner.rest()
    run(partner, 2.0)
    assert partner.at_rest
    np.testing.assert_array_equal(body.moves[-1].angles, robot.neutral)
    count = len(body.moves)
    run(partner, 4.0)
    assert len(body.moves) == count


def test_life_varies_gestures_and_a_seed_repeats_it(robot: Robot) -> None:
    def lived(life: int | None) -> list[np.ndarray]:
        body = PaperBody(robot)
        run(Partner(body, happy(), life=life), 8.0)
        return [move.angles for move in body.moves]

    plain, varied = lived(None), lived(1)
    assert any(np.allclose(plain[0], again, atol=1e-3) for again in plain[1:])
    assert not any(np.allclose(varied[0], again, atol=1e-3) for again in varied[1:])
    np.testing.assert_array_equal(varied, lived(1))
    assert not np.array_equal(varied[0], lived(2)[0])


def test_a_key_pose_is_held(robot: Robot) -> None:
    """Fright freezes: the body stays in its key pose, though its move is over."""
    feelings, body = EmotionalModel(), PaperBody(robot, move_time=0.1)
    feelings.set_state(emotion={"fright": 1.0}, mood={"fright": 0.9}, hold=True)
    held = max(pose.hold for pose in gestures.key_poses(robot, gestures.load("fright"), 0.9))
    assert held > 0.2
    sent = [event.time for event in of(MoveSent, run(Partner(body, feelings, period=60), 8.0))]
    assert max(np.diff(sent)) >= held


def test_a_pause_waits_at_neutral_and_ends(robot: Robot, moving: Moving) -> None:
    partner, body = moving
    partner.pause()
    run(partner, 5.0)
    np.testing.assert_array_equal(body.moves[-1].angles, robot.neutral)
    count = len(body.moves)
    partner.stop()
    run(partner, 20.0)
    assert body.phase is Phase.STOPPED
    partner.release()
    run(partner, 10.0)
    assert len(body.moves) == count
    partner.resume()
    assert of(GestureStarted, run(partner, 4.0))


def test_what_is_asked_for_comes_next_and_once(robot: Robot) -> None:
    body, feelings = PaperBody(robot), EmotionalModel()
    partner = Partner(body, feelings)
    run(partner, 0.1)
    partner.perform(Expression("surprise", 0.8))
    events = run(partner, 10.0)
    (started,) = of(GestureStarted, events)
    assert started.expression == Expression("surprise", 0.8)
    assert of(MoveSent, events)
    assert not partner.asked


@pytest.mark.parametrize(("stopped", "performed"), [(LAPSES - 1, True), (LAPSES + 1, False)])
def test_a_wish_lapses_where_the_body_stays_stopped(
    robot: Robot, stopped: float, performed: bool
) -> None:
    """Whoever releases the body much later does not expect the gesture any more."""
    partner = Partner(PaperBody(robot), EmotionalModel())
    run(partner, 0.1)
    partner.stop()
    partner.perform(Expression("surprise", 0.8))
    waited = run(partner, stopped)
    partner.release(by_person=True)
    released = run(partner, 10.0)
    assert bool(of(GestureStarted, released)) is performed
    lapsed = [event.expression for event in of(WishDropped, waited + released)]
    assert lapsed == ([] if performed else [Expression("surprise", 0.8)])


def test_what_waited_for_a_gesture_does_not_lapse_at_a_contact(robot: Robot) -> None:
    body = PaperBody(robot, LAPSES + 2.0)
    partner = Partner(body, happy())
    run(partner, 0.1)
    partner.perform(Expression("surprise", 0.8))
    run(partner, LAPSES + 1.0)
    body.touch()
    assert not of(WishDropped, run(partner, 1.0))


def test_a_look_turns_the_head_shows_no_feeling_and_ends_at_neutral(robot: Robot) -> None:
    body = PaperBody(robot)
    partner = Partner(body, happy())
    partner.perform(None, gestures.look(robot, "left", 3.0))
    events = run(partner, 3.0)  # it holds the look, whatever it feels
    assert of(GestureStarted, events) == []
    assert (partner.asked, partner.expression) == (True, None)
    (move,) = body.moves
    assert move.angles[0] == pytest.approx(0.7, abs=1e-3)  # the waist turns to its left
    assert forward(robot, move.angles)[7] > 0.01  # and the head with it
    run(partner, 3.0)
    np.testing.assert_allclose(body.moves[1].angles, robot.neutral, atol=1e-5)
    assert not partner.asked


def test_nothing_is_no_wish(robot: Robot) -> None:
    with pytest.raises(InputError, match="give a feeling, or key poses"):
        Partner(PaperBody(robot), EmotionalModel()).perform(None)


def test_a_robot_that_cannot_do_the_shipped_gestures_moves_all_the_same(
    tall_file: Path, tmp_path: Path
) -> None:
    file = tmp_path / "narrow.toml"
    file.write_text(tall_file.read_text(encoding="utf-8").replace("max = 2.0", "max = 1.0"))
    narrow = load_robot(file)
    for feeling in FEELINGS:
        body, feelings = PaperBody(narrow), EmotionalModel()
        feelings.set_state(emotion={feeling: 1.0}, mood={feeling: 0.9}, hold=True)
        ended = of(GestureEnded, run(Partner(body, feelings), 4.0))
        assert ended
        assert all(event.complete for event in ended)
        for move in body.moves:
            assert (move.angles >= narrow.lower).all()
            assert (move.angles <= narrow.upper).all()


def test_a_seed_chooses_among_several_gestures_of_a_feeling(
    robot: Robot, own_gestures: Path, tmp_path: Path
) -> None:
    for name in ("cheer", "wave"):
        text = (own_gestures / "cheer.toml").read_text().replace("cheer", name)
        (tmp_path / f"{name}.toml").write_text(text)
    repertoire = gestures.read_repertoire(tmp_path, robot)

    def performed(life: int | None) -> list[str | None]:
        partner = Partner(PaperBody(robot), happy(), repertoire=repertoire, life=life)
        return [event.gesture for event in of(GestureStarted, run(partner, 14.0))]

    one = performed(1)
    assert set(performed(None)) == set(one) == {"cheer", "wave"}
    assert performed(1) == one != performed(2)


class Reluctant(PaperBody):
    """A body that takes no move while another runs, as a card may do."""

    refused = 0

    def move(self, move: Move) -> None:
        if self.phase is Phase.MOVING:
            self.refused += 1
            raise BodyError("not now")
        super().move(move)


def test_a_key_pose_that_is_refused_on_the_way_is_performed_after_it(robot: Robot) -> None:
    def shown(body: PaperBody) -> list[int]:
        partner = Partner(body, EmotionalModel(), life=1)
        partner.perform(Expression("happiness", 0.9))
        events = run(partner, 6.0)
        assert [event.complete for event in of(GestureEnded, events)] == [True]
        return [event.key_pose for event in of(MoveSent, events)]

    body = Reluctant(robot, move_time=0.5)
    assert shown(body) == shown(PaperBody(robot, move_time=0.5))
    assert 0 < body.refused < 10, "it does not ask again at every step"


FOUND = ik.Solution(np.zeros(8), 0.0, np.zeros(3), 1, 0, ik.CONVERGED)


@pytest.mark.parametrize(
    "given",
    [
        None,
        np.zeros(8),
        FOUND._replace(angles=[0.0] * 8),
        FOUND._replace(angles=np.zeros(7)),
        FOUND._replace(angles=np.full(8, np.nan)),
        FOUND._replace(error=0.0),
    ],
    ids=["None", "array", "list", "seven", "nan", "no error"],
)
def test_kinematics_that_find_no_solution_are_told_what_to_return(
    robot: Robot, given: object
) -> None:
    def solve(*_: object) -> ik.Solution:
        return given  # type: ignore[return-value]

    partner = Partner(PaperBody(robot), happy(), period=2.0, solve=solve)
    with pytest.raises(InputError, match=r"^solve= must return a miburi.ik.Solution .*, got .*$"):
        run(partner, 0.1)
