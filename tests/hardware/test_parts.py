"""Parts to print: closed, printable, named, with room for what is put into them."""

import io
import os
import re
import subprocess
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import trimesh

from miburi.errors import InputError
from miburi.hardware import engraving, exports, meetings, servo
from miburi.hardware.bill import bill, priced, slice_part, slicer, to_csv
from miburi.hardware.build import FIT, PrintedPart, bodies, link_frames, printed_mass, printed_parts
from miburi.hardware.check import check
from miburi.hardware.gauge import FITS, PITCH, TURNED, gauge
from miburi.hardware.places import mounting, mounts
from miburi.hardware.screws import drawn_screw, screws
from miburi.hardware.solids import box, hull, join, moved, rod
from miburi.robot import JOINTS, Robot, buildable, iphonoid
from miburi.robot.shape import links

ROBOT = buildable()
#: The link that each joint turns.
CARRIED = {link.joint: link.name for link in links(ROBOT)}
Parts = dict[str, PrintedPart]


def drawn(count: int) -> list[Robot]:
    """Robots with lengths 0.8 to 1.5 times those of the buildable, with two phones."""
    rng, robots = np.random.default_rng(7), []
    for number in range(count):
        lengths = {k: v * rng.uniform(0.8, 1.5) for k, v in ROBOT.lengths.model_dump().items()}
        phone = {"phone_height": 0.163, "phone_width": 0.078} if number % 2 else {}
        update = {
            "lengths": ROBOT.lengths.model_copy(update=lengths),
            "shape": ROBOT.shape.model_copy(update=phone),
        }
        robots.append(ROBOT.model_copy(update=update))
    return robots


def program() -> str:
    found = slicer()
    if found is None and os.environ.get("CI") != "true":
        pytest.skip("needs the Debian package prusa-slicer")
    assert found
    return found


def test_each_part_is_closed_for_others_too(parts: Parts) -> None:
    for part in [*parts.values(), *gauge()]:
        solid = part.on_the_bed
        mesh = trimesh.load_mesh(io.BytesIO(exports.stl(solid)), file_type="stl")
        assert mesh.is_watertight, part.name
        assert mesh.body_count == 1, part.name
        assert mesh.volume == pytest.approx(solid.volume(), rel=1e-3)


@pytest.mark.proof("test_each_part_is_closed_for_others_too")
def test_the_slicer_reads_each_part_without_repair(parts: Parts, tmp_path: Path) -> None:
    command = program()
    for part in [*parts.values(), *gauge()]:
        path = tmp_path / f"{part.name}.3mf"
        path.write_bytes(exports.encode(part.on_the_bed, part.name, "3mf"))
        said = subprocess.run(
            [command, "--info", str(path)], capture_output=True, text=True, check=True
        )
        assert "manifold = yes" in said.stdout, part.name
        assert not {"repaired", "removed", "degenerate"} & set(said.stdout.split("_")), part.name


@pytest.mark.proof("test_each_part_is_closed_for_others_too")
@pytest.mark.parametrize("name", ["left_upper_arm", "lid", "jaw"])
def test_a_mass_is_the_slicers(parts: Parts, name: str) -> None:
    """Supports are not part of the robot."""
    grams, time = slice_part(program(), parts[name], supports=False)
    assert 1000 * printed_mass(parts[name]) == pytest.approx(grams, rel=0.1)
    assert time


@pytest.mark.proof("test_two_things_in_one_place_are_named")
def test_the_same_robot_gives_the_same_bytes(parts: Parts) -> None:
    for again in printed_parts(buildable()):
        for ending in exports.FORMATS if again.name in {"left_yoke", "torso"} else ():
            one, two = (
                exports.encode(part.on_the_bed, part.name, ending)
                for part in (parts[again.name], again)
            )
            assert one == two


def test_a_step_file_is_one_closed_shell(parts: Parts) -> None:
    """Each edge is used twice, once each way: only so is a shell closed."""
    lines = exports.step(parts["idler"].on_the_bed, "idler").decode("ascii").splitlines()
    used = [line.split("*,*,")[1] for line in lines if "ORIENTED_EDGE" in line]
    assert set(Counter(word.split(",")[0] for word in used).values()) == {2}
    assert set(Counter(used).values()) == {1}
    assert sum("CLOSED_SHELL" in line for line in lines) == 1


#: What a refusal names.
NAMED = re.compile(
    r"(lengths\.L\w\w|shape\.pedestal_height) is [\d.]+ mm and must be [\d.]+"
    r"|take [\d.]+ mm off lengths\.L01"
)


@pytest.mark.proof("test_a_missing_stop_is_named")
def test_of_drawn_robots_each_is_built_or_told_which_length() -> None:
    made, refused = [], []
    for robot in drawn(20):
        try:
            made.append((robot, printed_parts(robot)))
        except InputError as error:
            refused.append(str(error))
    assert [words for words in refused if not NAMED.search(words)] == []
    assert len(made) >= 2
    for robot, parts in made:
        table = meetings.by_link(bodies(robot, parts))
        assert all(len(part.solid.decompose()) == 1 for part in parts)
        assert list(meetings.in_one_link(table)) == []
    assert list(meetings.over_the_range(robot, table)) == []


def test_the_papers_body_cannot_be_built_and_its_lengths_are_named() -> None:
    with pytest.raises(InputError, match=r"lengths\.LH1 is 50\.0 mm and must be 57\.4") as caught:
        printed_parts(iphonoid())
    assert "shape.pedestal_radius" in str(caught.value)


@pytest.mark.parametrize("fit", [-0.1, 0.7, float("nan")])
def test_a_fit_out_of_range_is_refused(fit: float) -> None:
    for door in (printed_parts, lambda robot, fit: next(check(robot, {}, 0.02, fit))):
        with pytest.raises(InputError, match="fit must be from 0 to 0.6 mm"):
            door(ROBOT, fit)


def test_the_megas_posts_are_under_its_holes(parts: Parts) -> None:
    """Along from its USB end, across from the edge beside the USB socket: the left one."""
    holes = {(13.97, 50.8), (15.24, 2.54), (66.04, 45.72), (90.17, 2.54)}
    foot = parts["foot"].solid
    floor = -1000 * ROBOT.shape.pedestal_height + 2.4
    for along, across in holes:
        x, y = along - 101.6 / 2, 53.3 / 2 - across
        ring = rod((x, y, floor + 1), (x, y, floor + 3), 2.9) - rod((x, y, floor), (x, y, 0), 1.4)
        assert (ring ^ foot).volume() == pytest.approx(ring.volume(), rel=0.02)
    # The USB socket, 12 wide, 9.3 to 21.3 from that edge, looks out at the back.
    y = 53.3 / 2 - 15.3
    way = box((-80, -52), (y - 6, y + 6), (floor + 5.8, floor + 16))
    assert (way ^ foot).volume() < 1


def test_the_waist_never_shears_the_feeds_wires(parts: Parts) -> None:
    """A bundle of 5 mm that hangs from the torso passes the column wherever the torso looks."""
    bundle = rod((14.9, 0, -8), (14.9, 0, 12), 2.5)
    assert (bundle ^ parts["column"].solid).volume() < 0.1
    for degrees in range(-100, 101, 20):
        turned = parts["torso"].solid.rotate((0, 0, degrees))
        assert (bundle ^ turned).volume() < 0.1, degrees


def test_no_screw_meets_a_servo_that_it_does_not_hold(parts: Parts) -> None:
    servos = [thing for thing in bodies(ROBOT, parts.values()) if thing.name.endswith("servo")]
    frames = link_frames(ROBOT, np.zeros(len(JOINTS)))
    groups = screws(ROBOT)
    for name in ("card", "column", "lid", "neck", "chest", "jaw"):
        for screw in groups[name]:
            solid = moved(drawn_screw(screw, 0.0), frames[screw.link])
            for thing in servos:
                met = (solid ^ moved(thing.solid, frames[thing.link])).volume()
                assert met < 0.01, (name, thing.name)


def test_the_axles_screw_is_reached_through_the_fork(parts: Parts) -> None:
    """The fork is pushed over first; the idler's screw goes in through its rear cheek."""
    for mount in mounts(ROBOT):
        if mount.idler:
            frames = link_frames(ROBOT, np.zeros(len(JOINTS)))
            way = moved(rod((0, -60, 0), (0, -22.6, 0), 2.7), mount.frame)
            way = moved(way, frames[mount.link])
            for part in parts.values():
                if part.link == CARRIED[mount.joint]:
                    there = moved(part.solid, frames[part.link])
                    assert (way ^ there).volume() < 0.05, part.name


def test_each_parts_letters_differ_from_every_other_parts(parts: Parts) -> None:
    """Its letters are cut into it, and left differs from right by more than a mirror."""
    texts = engraving.texts(ROBOT, FIT)
    assert set(parts) - set(texts) == {"chest", "jaw", "idler"}
    for name, words in texts.items():
        for letters in words:
            assert (letters ^ parts[name].solid).volume() < 0.01, name
            # The plastic between the letters is there.
            assert (hull(letters) ^ parts[name].solid).volume() > 0.5, name
    for name in ("yoke", "upper_arm", "forearm"):
        left, right = (parts[f"{side}_{name}"].solid for side in ("left", "right"))
        apart = left.mirror((0, 1, 0)) - right
        assert apart.volume() > 0.3, name


def test_a_horns_notch_is_seen_where_its_servo_counts_2048(parts: Parts) -> None:
    """A servo that is put in a quarter turn off hides its notch: nobody can mistake it."""
    for number, mount in enumerate(mounts(ROBOT)):
        pose = np.zeros(len(JOINTS))
        pose[number] = mount.centred
        frames = link_frames(ROBOT, pose)
        things = [part for part in parts.values() if part.link == CARRIED[mount.joint]]
        carried = join(moved(part.solid, frames[part.link]) for part in things)
        for quarter, seen in ((0, True), (1, False), (2, False), (3, False)):
            x, z = 8.3 * np.sin(np.pi / 2 * quarter), -8.3 * np.cos(np.pi / 2 * quarter)
            sight = moved(rod((x, 6.6, z), (x, 9.5, z), 0.4), mount.frame)
            free = (moved(sight, frames[mount.link]) ^ carried).volume() < 0.05
            assert free == seen, (mount.joint, quarter)


def test_no_servo_of_a_built_robot_counts_past_its_zero() -> None:
    """The card refuses a joint whose range comes near the step from 4095 to 0."""
    built = mounting(ROBOT)
    for low, high, direction, zero in zip(
        ROBOT.lower, ROBOT.upper, built.direction, built.zero, strict=True
    ):
        counts = [zero + direction * angle / ROBOT.servo.step for angle in (low, high)]
        assert 100 < min(counts) < max(counts) < 4095 - 100
    # Positive is the robot's left, forwards and up; the left shoulder and the head look across.
    assert built.direction == [1, 1, 1, 1, -1, 1, 1, -1]


def test_the_gauges_pockets_are_those_of_the_parts() -> None:
    """A case that is larger by a pocket's fit goes in there, and not into the one before."""
    pockets, holes = (part.solid for part in gauge())
    assert len(holes.decompose()) == 1
    for place, fit in enumerate(FITS):
        for case_fit in FITS:
            case = moved(servo.case(case_fit - 0.01), TURNED).translate((place * PITCH, 0, 0))
            goes_in = (case ^ pockets).volume() < 0.05
            assert goes_in == (case_fit <= fit), (fit, case_fit)


def test_the_bill_counts_the_parts_and_gives_no_price_without_a_source(parts: Parts) -> None:
    rows = list(bill(ROBOT, list(parts.values())))
    counts = {row.name: row.count for row in rows}
    assert counts["servo DYNAMIXEL XL330-M288-T"] == 8
    # Eight horns and five idlers of four screws each; three cases of four, five of two, the chest.
    assert counts["screw M2x6 self-tapping, pan head"] == 4 * (8 + 5)
    assert counts["screw M2x8 self-tapping, pan head"] == 3 * 4 + 5 * 2 + 4
    assert counts["screw M2.6x8"] == 4
    assert [row.name for row in rows if (row.price is None) == bool(row.source)] == []
    assert [row.name for row in rows if (row.price is None) == bool(row.currency)] == []
    assert {f"printed: {name}" for name in parts} <= set(counts)
    (filament,) = [row for row in rows if row.name == "filament PETG"]
    printed = [row.grams or 0 for row in rows if row.name.startswith("printed: ")]
    # The filament is that of the parts: a sum of grams counts it once.
    assert filament.grams is None
    assert int(filament.remark.split(" g ")[0]) == pytest.approx(sum(printed), abs=len(printed))
    without = sum(row.price is None for row in rows) - len(printed)
    assert priced(rows) == f"The lines with a price come to 251.77 USD; {without} others have none."
    lines = to_csv(rows).splitlines()
    assert len(lines) == len(rows) + 1
    assert lines[0].startswith("name,count,number,price,currency,source")
