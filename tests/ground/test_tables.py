"""What a description works out for itself never gets in the way of comparing or copying it."""

import copy
import pickle

import numpy as np
import pytest

from miburi.feelings.temperament import Temperament, shipped_temperament
from miburi.ground.tables import Table
from miburi.robot import Robot, iphonoid


def used(table: Table) -> Table:
    """Return a table that has worked out all its arrays."""
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


def test_a_changed_copy_works_everything_out_anew(robot: Robot) -> None:
    used(robot)
    waist = robot.joints.waist.model_copy(update={"max": 1.0})
    changed = robot.model_copy(update={"joints": robot.joints.model_copy(update={"waist": waist})})
    assert changed.upper[0] == 1.0
    assert robot.upper[0] == 1.744


def test_what_a_copy_works_out_cannot_be_changed(robot: Robot) -> None:
    used(robot)
    for twin in (copy.deepcopy(robot), pickle.loads(pickle.dumps(robot))):
        np.testing.assert_array_equal(twin.lower, robot.lower)
        with pytest.raises(ValueError, match="read-only"):
            twin.lower[0] = -9
