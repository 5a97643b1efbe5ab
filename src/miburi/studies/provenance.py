"""Say what results come from: checksums of what was used, and the software that ran."""

import platform
from importlib.metadata import version
from pathlib import Path

from miburi.calibration.file import CalibrationFile
from miburi.feelings import Temperament
from miburi.feelings.catalogue import CATALOGUE
from miburi.gestures import Repertoire
from miburi.ground.tables import Table, load_table
from miburi.robot import Robot
from miburi.robot.fit import checksum, checksums

#: The packages whose numbers enter the results, by their distributions.
_PACKAGES = {"mujoco": "mujoco-core", "numpy": "numpy", "numba": "numba"}


def provenance(
    *,
    robot: Robot | None = None,
    temperament: Temperament | None = None,
    repertoire: Repertoire | None = None,
    calibration: Path | None = None,
) -> dict[str, str]:
    """Return a checksum of each description that was used, and the versions of what ran.

    ``robot`` is the robot as described, before a calibration. The checksums are those of
    :mod:`miburi.robot.fit`: they are of the values, so comments, and a description's own name and
    sources, do not change them. ``robot_checksum`` covers the whole robot with its servo;
    ``servo_checksum`` is the one that a calibration has in ``[fits]``; ``gestures_checksum`` covers
    all gestures, the shipped ones too. On one machine, the same use gives the same words.

    Raises DescriptionError if the calibration file cannot be read.
    """
    used: dict[str, Table | None] = {
        "robot": robot,
        "temperament": temperament,
        "feelings": CATALOGUE,
        "calibration": load_table(CalibrationFile, calibration) if calibration else None,
    }
    values = {name: table.model_dump(mode="json") for name, table in used.items() if table}
    if repertoire is not None:
        values["gestures"] = {f.name: f.model_dump(mode="json") for f in repertoire.functions}
    sums = {f"{name}_checksum": checksum(value) for name, value in values.items()}
    if robot is not None:
        sums["servo_checksum"] = checksums(robot)["servo"]
    system = (platform.system(), platform.machine(), "".join(platform.libc_ver()))
    return {
        **sums,
        "python": platform.python_version(),
        **{name: version(package) for name, package in _PACKAGES.items()},
        "platform": " ".join(filter(None, system)),
    }
