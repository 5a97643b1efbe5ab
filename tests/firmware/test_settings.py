"""The guards in C++ are those of their table: names, order, widths, and ranges to the last one."""

import re
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from tests.firmware.toolchain import NATIVE, SKETCH, need, run

from miburi.card.settings import ALLOWED, CardSettings, FreeMotor, JointSettings
from miburi.robot import iphonoid
from miburi.robot.guards import GUARDS

JOINT = CardSettings.of(iphonoid()).joints[0]
#: For each joint: its values by name, the index of the first out of range, and its bytes again.
PROGRAM = """
#include <cstdio>
#include <initializer_list>
#include "settings.h"
using namespace miburi;

int main() {
  uint8_t bytes[JOINT_SIZE];
  while (std::fread(bytes, sizeof bytes, 1, stdin) == 1) {
    Reader in(bytes, sizeof bytes);
    const Joint joint = read_joint(in);
    for (const long value : {VALUES, static_cast<long>(out_of_range(joint))}) {
      std::printf("%ld ", value);
    }
    Writer out(bytes, sizeof bytes);
    write_joint(joint, out);
    for (const uint8_t byte : bytes) {
      std::printf("%02x", byte);
    }
    std::printf("\\n");
  }
}
"""


def cases() -> Iterator[tuple[JointSettings, int]]:
    """Yield joints with a guard at an end of its range, and what the card must refuse of them."""
    for name, guard in GUARDS.items():
        for value in (guard.low - 1, guard.low, guard.high, guard.high + 1):
            joint = replace(JOINT, guards=replace(JOINT.guards, **{name: value}))
            good = guard.low <= value <= guard.high
            yield joint, 255 if good else list(joint.values).index(name)
    for name, most in zip(FreeMotor._fields, (65_535, 65_535, 65_535, 255), strict=True):
        low, high, _ = ALLOWED[name]
        for value in {max(low - 1, 0), low, high, min(high + 1, most)}:
            joint = replace(JOINT, free=JOINT.free._replace(**{name: value}))
            yield joint, 255 if low <= value <= high else list(joint.values).index(name)
    low, high, _ = ALLOWED["sag"]
    for value in (low, high, high + 1):
        joint = replace(JOINT, sag=value)
        yield joint, 255 if value <= high else list(joint.values).index("sag")


def disagreements(headers: Path, folder: Path) -> list[str]:
    """Return what these headers make of the cases otherwise than Python does."""
    rooms = dict.fromkeys(GUARDS, "guards.") | dict.fromkeys(FreeMotor._fields, "servo.")
    values = [rooms.get(name, "") + {"servo": "id"}.get(name, name) for name in JOINT.values]
    source, program = folder / "settings.cpp", folder / "settings"
    source.write_text(PROGRAM.replace("VALUES", ", ".join(f"long{{joint.{v}}}" for v in values)))
    flags = [flag for flag in NATIVE if flag != f"-I{SKETCH}"]
    run(*flags, f"-I{headers}", source, "-o", program)
    said = run(program, data=b"".join(joint.pack() for joint, _ in cases())).decode().splitlines()
    wanted = [
        " ".join(map(str, (*joint.values.values(), bad, joint.pack().hex())))
        for joint, bad in cases()
    ]
    return [one for one, other in zip(said, wanted, strict=True) if one != other]


def mutants() -> Iterator[tuple[str, str]]:
    """Yield what is changed in ``settings.h``, and its text with the change."""
    text = (SKETCH / "settings.h").read_text()
    for name in GUARDS:
        (row,) = re.finditer(rf"within\(j\.guards\.{name}, (\d+), (\d+)\)", text)
        for end in (1, 2):
            other = str(int(row[end]) + 1)
            yield f"{name} to {other}", text[: row.start(end)] + other + text[row.end(end) :]
    for one, other in (
        ("guards.behind = in", "guards.ahead = in"),
        ("j.guards.behind,", "j.guards.ahead,"),
        ("(j.guards.behind)", "(j.guards.ahead)"),
    ):
        yield one, text.replace(one, "\0").replace(other, one).replace("\0", other)
    for name, end in (("pull", "16383"), ("friction", "32767")):
        row = f"within(j.servo.{name}, {'1' if name == 'pull' else '0'}, "
        yield f"{name} further", text.replace(f"{row}{end}", f"{row}{int(end) + 1}")
    yield "sag further", text.replace("within(j.sag, 0, 768)", "within(j.sag, 0, 769)")
    one, other = "servo.brake = in", "servo.friction = in"
    yield one, text.replace(one, "\0").replace(other, one).replace("\0", other)
    yield "another width", text.replace("guards.slack = in.i16()", "guards.slack = in.u8()")


def test_the_cards_guards_are_those_of_the_table(tmp_path: Path) -> None:
    need("g++", "g++")
    assert disagreements(SKETCH, tmp_path) == []


@pytest.mark.proof("test_the_cards_guards_are_those_of_the_table")
def test_no_other_guards_pass_for_those_of_the_table(tmp_path: Path) -> None:
    need("g++", "g++")
    headers = tmp_path / "headers"
    shutil.copytree(SKETCH, headers)
    for what, text in mutants():
        assert text != (SKETCH / "settings.h").read_text(), what
        (headers / "settings.h").write_text(text)
        assert disagreements(headers, tmp_path), what
