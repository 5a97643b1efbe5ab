"""Every check passes on the buildable robot, and fails on one that breaks it."""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from miburi.bodies.rehearsal import PERIOD, rehearse
from miburi.gestures import key_poses, load
from miburi.hardware import meetings
from miburi.hardware.balance import weights
from miburi.hardware.build import PrintedPart, Solid, bodies, link_frames, printed_parts
from miburi.hardware.check import Finding, check
from miburi.hardware.dimensions import dimensions
from miburi.hardware.wiring import buffer_board, card, hub_board
from miburi.robot import JOINTS, Robot, buildable
from miburi.robot.loads import GRAVITY, loads
from miburi.robot.shape import BASE, links
from miburi.servos import load_servo

ROBOT = buildable()


@cache
def motion(feeling: str) -> np.ndarray:
    return rehearse(ROBOT, key_poses(ROBOT, load(feeling), 1.0)).angles[::4]


def still(robot: Robot) -> np.ndarray:
    return np.tile(robot.neutral, (6, 1))


def finding(name: str, robot: Robot, poses: np.ndarray) -> Finding:
    """The finding of one check; those after it are not carried out."""
    found = check(robot, {"a motion": poses}, 4 * PERIOD)
    return next(one for one in found if one.check == name)


def changed(table: str, **values: float) -> Robot:
    return ROBOT.model_copy(update={table: getattr(ROBOT, table).model_copy(update=values)})


def with_range(joint: str, **limits: float) -> Robot:
    joints = ROBOT.joints
    one = getattr(joints, joint).model_copy(update=limits)
    return ROBOT.model_copy(update={"joints": joints.model_copy(update={joint: one})})


@pytest.mark.proof("test_two_things_in_one_place_are_named")
def test_the_buildable_robot_passes_every_check() -> None:
    motions = {feeling: motion(feeling) for feeling in ("happiness", "anger")}
    found = list(check(ROBOT, motions, 4 * PERIOD))
    assert [one for one in found if not one.ok] == []
    assert len(found) == len({one.check for one in found}) == 16


def test_a_robot_with_another_servo_has_no_parts_to_print() -> None:
    (found,) = check(ROBOT.with_servo(load_servo("imagined")), {}, PERIOD)
    assert not found.ok
    assert "parts exist for the XL330 only, and this robot has imagined" in found.words


def test_gestures_that_the_contact_rule_stopped_at_once_are_named() -> None:
    found = check(ROBOT, {"anger": still(ROBOT)[:1]}, PERIOD, stopped=["anger"])
    ends = {one.check: one for one in itertools.takewhile(lambda one: one.check != "push", found)}
    assert not ends["contact rule"].ok
    assert ends["contact rule"].words.endswith("help: anger")
    assert "tipping" in ends


def folded() -> np.ndarray:
    """A hanging arm whose forearm is bent into the trunk."""
    pose = np.array(ROBOT.neutral)
    pose[JOINTS.index("right_elbow")], pose[JOINTS.index("right_fingertip")] = 1.6, 1.2
    return np.tile(pose, (6, 1))


def thrown() -> np.ndarray:
    """Arms and head that are thrown forwards faster than any servo could."""
    down = np.array([0.0, -0.5, 1.57, 0.0, -0.5, -1.57, 0.0, 0.8])
    poses = np.tile(down, (6, 1))
    poses[::2, [1, 4, 7]] = 1.57, 1.57, 0.2
    return poses


@pytest.mark.proof("test_a_missing_stop_is_named")
@pytest.mark.parametrize(
    ("robot", "poses", "name", "words"),
    [
        (changed("lengths", L12=0.05), None, "parts", "L12 is 50.0 mm and must be 54.6 mm"),
        (changed("masses", torso=0.30), None, "masses", "torso = 0.19"),
        (changed("masses", phone=0.40), None, "torque standing", "greatest torque, at the head"),
        (changed("servo", acceleration=90.0), None, "torque moving", "greatest torque, at the"),
        (changed("lengths", LH1=0.10), None, "cables", "the longest route, to the head"),
        (ROBOT, thrown(), "tipping", "zero-moment"),
        (with_range("head", min=-0.6), None, "joints", "head at"),
        (with_range("right_shoulder", min=-3.1, max=3.1), None, "stops", "right_shoulder at"),
        (ROBOT, folded(), "gestures", "right_forearm"),
    ],
    ids=lambda value: value.replace(" ", "-") if isinstance(value, str) else "",
)
def test_a_check_fails_on_what_breaks_it(
    robot: Robot, poses: np.ndarray | None, name: str, words: str
) -> None:
    found = finding(name, robot, still(robot) if poses is None else poses)
    assert not found.ok, found.words
    assert words in found.words


@pytest.fixture
def with_sizes(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., None]]:
    """Lets a size of ``dimensions.toml`` be another one: no robot's file changes those."""
    shipped = dimensions()

    def change(table: str, **values: float) -> None:
        other = shipped.model_copy(
            update={table: getattr(shipped, table).model_copy(update=values)}
        )
        monkeypatch.setattr("miburi.hardware.dimensions.load_table", lambda *_: other)
        dimensions.cache_clear()

    yield change
    dimensions.cache_clear()


@pytest.mark.proof("test_a_missing_stop_is_named")
@pytest.mark.parametrize(
    ("table", "size", "value", "name", "words"),
    [
        ("wall", "shell", 1.0, "walls", "thinnest 0."),
        ("wall", "cheek", 14.0, "fit", "cradle and jaw"),
        ("wall", "web", 21.0, "finger gaps", "elbows and fingertips 5.5 mm"),
        ("wall", "plate", 4.5, "screws", "horn (M2x6) 1.5 mm"),
        ("servo", "horn_circle", 14.5, "drivers", "left_shoulder (left_yoke)"),
    ],
)
def test_a_check_fails_on_a_size_that_breaks_it(
    with_sizes: Callable[..., None], table: str, size: str, value: float, name: str, words: str
) -> None:
    with_sizes(table, **{size: value})
    found = finding(name, ROBOT, still(ROBOT))
    assert not found.ok, found.words
    assert words in found.words


@pytest.mark.proof("test_two_things_in_one_place_are_named")
def test_a_robot_that_a_push_tips_is_to_be_screwed_to_the_table() -> None:
    """It can be built all the same."""
    narrow = finding("push", changed("shape", pedestal_radius=0.063), still(ROBOT))
    wide = finding("push", changed("shape", pedestal_radius=0.08), still(ROBOT))
    assert narrow.ok
    assert narrow.words.endswith("tape or clamp the foot to the table")
    assert wide.words.endswith("95 % of contacts push with at most 2.6 N")


@pytest.mark.proof("test_two_things_in_one_place_are_named")
@pytest.mark.parametrize("robot", [ROBOT, changed("shape", torso_radius=0.045)])
def test_the_boards_share_no_room_with_parts_and_servos(robot: Robot) -> None:
    table = meetings.by_link(
        [
            *bodies(robot, printed_parts(robot)),
            Solid("card", BASE, card(robot)),
            Solid("buffer", BASE, buffer_board(robot)),
            Solid("hub", "torso", hub_board(robot)),
        ]
    )
    assert list(meetings.in_one_link(table)) == []


def test_the_descriptions_solids_load_the_motors_as_the_parts_do(
    parts: dict[str, PrintedPart],
) -> None:
    """Physics, trials and card know the description alone; 0.01 N·m are a step of the encoder."""
    things = weights(ROBOT, list(parts.values()))
    carriers = {link.name: link for link in links(ROBOT)}
    rng = np.random.default_rng(0)
    for pose in rng.uniform(ROBOT.lower, ROBOT.upper, (20, len(JOINTS))):
        frames, torques = link_frames(ROBOT, pose), np.zeros(len(JOINTS))
        for thing in things:
            centre = frames[thing.link] @ [*thing.centre, 1.0]
            carrier = thing.link
            while link := carriers.get(carrier):
                axis, joint = frames[carrier][:, :3] @ link.axis, frames[carrier][:, 3]
                arm = np.cross(axis, centre - joint)[2] / 1000
                torques[JOINTS.index(link.joint)] += GRAVITY * thing.mass * arm
                carrier = link.parent
        assert np.abs(torques - loads(ROBOT, pose).gravity).max() < 0.01


@pytest.mark.proof("test_two_things_in_one_place_are_named")
def test_each_arm_has_the_stops_of_its_own_range() -> None:
    robot = with_range("right_elbow", max=1.2, neutral=1.1)
    found = {one.check: one for one in check(robot, {"a motion": still(robot)}, 4 * PERIOD)}
    assert found["stops"].ok, found["stops"].words
    assert found["joints"].ok, found["joints"].words


def test_two_things_in_one_place_are_named(parts: dict[str, PrintedPart]) -> None:
    column = parts["column"]
    pushed = replace(column, solid=column.solid.translate((0, 0, -3.0)))
    things = bodies(ROBOT, [*(parts | {"column": pushed}).values()])
    met = meetings.in_one_link(meetings.by_link(things))
    assert {"column", "waist servo"} in [set(pair) for pair in met]


def test_a_missing_stop_is_named(parts: dict[str, PrintedPart]) -> None:
    """Without the pin on the column nothing ends the waist's turn."""
    things = bodies(ROBOT, [part for part in parts.values() if part.name != "column"])
    loose = list(meetings.stops_hold(ROBOT, meetings.by_link(things)))
    assert {joint for joint, _ in loose} == {"waist"}
    assert len(loose) == 2
