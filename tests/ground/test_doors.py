"""Files that were made to break a parser: one clear line at every door."""

from collections.abc import Callable
from pathlib import Path

import pytest

from miburi.calibration.file import read_calibration
from miburi.errors import DescriptionError
from miburi.feelings import load_temperament
from miburi.feelings.catalogue import load_catalogue
from miburi.gestures import load_for
from miburi.robot import iphonoid, load_robot
from miburi.servos import load_servo

DOORS: dict[str, Callable[[Path], object]] = {
    "robot": load_robot,
    "gesture": lambda path: load_for(iphonoid(), str(path)),
    "temperament": load_temperament,
    "servo": lambda path: load_servo(str(path)),
    "calibration": lambda path: read_calibration(iphonoid(), path),
    "feelings": load_catalogue,
}
CONTENTS = {
    "lists": "x = " + "[" * 100_000,
    "tables": "x = " + "{a = " * 50_000,
    "dotted": ".".join("a" * 5_000) + " = 1",
    "header": "[" + ".".join("a" * 5_000) + "]",
    "number": "x = " + "9" * 5000,
    "bytes": "\udcff\udcfe",
}


@pytest.mark.parametrize("content", CONTENTS)
@pytest.mark.parametrize("door", DOORS)
def test_a_file_made_to_break_a_parser_is_refused_in_one_line(
    door: str, content: str, tmp_path: Path
) -> None:
    path = tmp_path / "bad.toml"
    path.write_bytes(CONTENTS[content].encode(errors="surrogateescape"))
    with pytest.raises(DescriptionError, match="bad.toml") as refused:
        DOORS[door](path)
    assert len(str(refused.value)) < 1000
