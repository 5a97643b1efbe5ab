"""``miburi export``: the robot as a model for MuJoCo or ROS."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from miburi.cli.options import RobotFile, robot_of
from miburi.cli.places import a_folder
from miburi.errors import InputError, need

if TYPE_CHECKING:
    from miburi.robot import Robot

__all__ = ["export"]


def export(
    form: Annotated[str, typer.Argument(help="mjcf or urdf.")],
    robot: RobotFile = None,
    meshes: Annotated[
        Path | None,
        typer.Option(
            help="Folder for the files of the printed parts; the model then shows the parts.",
            show_default=False,
            callback=a_folder,
        ),
    ] = None,
) -> None:
    """Print the robot as MJCF (MuJoCo) or URDF, made from its description."""
    from miburi.robot.mjcf import to_mjcf
    from miburi.robot.urdf import to_urdf

    forms = {"mjcf": to_mjcf, "urdf": to_urdf}
    if form not in forms:
        raise InputError(f"the form must be one of {', '.join(forms)}, got {form!r}.")
    body = robot_of(robot)
    print(forms[form](body, None if meshes is None else _write_meshes(body, meshes)), end="")


def _write_meshes(robot: "Robot", folder: Path) -> dict[tuple[str, str], str]:
    """Write the real shapes of each link, and return the files by link and colour."""
    need("manifold3d", "hardware")
    from miburi.ground.files import whole_files
    from miburi.hardware.exports import stl
    from miburi.hardware.shapes import shapes

    files = {}
    with whole_files(folder) as draft:
        for (link, colour), solid in shapes(robot).items():
            name = f"{link}-{colour}.stl"
            (draft / name).write_bytes(stl(solid))
            files[link, colour] = str((folder / name).absolute())
    return files
