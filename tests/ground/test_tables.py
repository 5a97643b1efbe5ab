"""Values that a table derives from its keys do not affect comparing or copying it."""

import copy
import pickle
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from miburi.feelings.temperament import Temperament, shipped_temperament
from miburi.ground.tables import Table
from miburi.robot import Robot, iphonoid, load_robot


def used(table: Table) -> Table:
    """Return the table after it has derived all its arrays."""
    match table:
        case Robot():
            assert table.lower.shape == table.upper.shape == table.neutral.shape == (8,)
        case Temperament():
            assert table.fading.size + table.shares.size + table.weights.size + table.matrix.size
    return table


def tables() -> list[Table]:
    return [iphonoid(), shipped_temperament()]


@pytest.mark.parametrize("table", tables(), ids=lambda table: type(table).__name__)
def test_a_used_table_equals_its_copies_and_has_their_hash(table: Table) -> None:
    same = type(table).model_validate(table.model_dump())
    for twin in (same, table.model_copy(), copy.deepcopy(table), pickle.loads(pickle.dumps(table))):
        assert used(twin) == used(table)
        assert hash(twin) == hash(table)
    other = table.model_copy(update={"name": "other"})
    assert used(other) != table
    assert table != "no table"


def test_the_order_of_a_mapping_changes_neither_equality_nor_hash() -> None:
    table = shipped_temperament()
    turned = table.model_copy(update={"lasting": dict(reversed(table.lasting.items()))})
    assert (turned == table, hash(turned)) == (True, hash(table))


def test_a_changed_copy_derives_its_values_again(robot: Robot) -> None:
    used(robot)
    waist = robot.joints.waist.model_copy(update={"max": 1.0})
    changed = robot.model_copy(update={"joints": robot.joints.model_copy(update={"waist": waist})})
    assert changed.upper[0] == 1.0
    assert robot.upper[0] == 1.744


def test_the_derived_arrays_of_a_copy_are_read_only(robot: Robot) -> None:
    used(robot)
    for twin in (copy.deepcopy(robot), pickle.loads(pickle.dumps(robot))):
        np.testing.assert_array_equal(twin.lower, robot.lower)
        with pytest.raises(ValueError, match="read-only"):
            twin.lower[0] = -9


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_file_as_windows_writes_it_is_read(tmp_path: Path, encoding: str) -> None:
    """Notepad begins a file with a mark, and `>` in PowerShell 5 writes UTF-16."""
    text = (resources.files("miburi.robot") / "iphonoid.toml").read_text(encoding="utf-8")
    file = tmp_path / "mine.toml"
    file.write_bytes(text.replace("\n", "\r\n").encode(encoding))
    assert load_robot(file) == iphonoid()
