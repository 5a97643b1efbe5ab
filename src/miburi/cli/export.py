"""``miburi export``, ``to-ros`` and ``template``: files for other programs, and for a user."""

from collections.abc import Callable
from functools import partial
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from miburi.cli.options import RobotFile, must_be_one_of, robot_of
from miburi.cli.places import a_file, a_folder, must_not_replace
from miburi.errors import need

if TYPE_CHECKING:
    from miburi.robot import Robot


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

    forms: dict[str, Callable[..., str]] = {"mjcf": partial(to_mjcf, alone=True), "urdf": to_urdf}
    must_be_one_of(forms, form, "the form")
    body = robot_of(robot)
    print(forms[form](body, None if meshes is None else _write_meshes(body, meshes)), end="")


def _write_meshes(robot: "Robot", folder: Path) -> dict[tuple[str, str], str]:
    need("manifold3d", "hardware")
    from miburi.ground.files import whole_files
    from miburi.hardware.exports import stl
    from miburi.hardware.shapes import shapes

    files = {}
    with whole_files(folder) as draft:
        for (link, colour), solid in shapes(robot).items():
            name = f"{link}-{colour}.stl"
            (draft / name).write_bytes(stl(solid))
            files[link, colour] = (folder / name).as_posix()
    return files


def to_ros(
    recording: Annotated[Path, typer.Argument(help="A recording (MCAP).")],
    out: Annotated[
        Path, typer.Argument(help="The file to write (MCAP, ROS 2's messages).", callback=a_file)
    ],
    robot: Annotated[
        Path | None,
        typer.Option(help="The robot's description, for an old recording that lacks it."),
    ] = None,
) -> None:
    """Write a recording as ROS 2 messages, for ROS 2's tools."""
    must_not_replace(out, recording, robot)
    need("cyclonedds", "ros")
    from miburi.doors.ros_recording import convert_recording

    described = None if robot is None else robot_of(robot)
    print(f"{convert_recording(recording, out, described)} messages in {out}.")


#: The package and folder of the files of each kind.
_FOLDERS = {
    "feelings": ("miburi.feelings", "."),
    "gesture": ("miburi.gestures", "."),
    "language": ("miburi.languages", "en"),
    "robot": ("miburi.robot", "."),
    "servo": ("miburi.servos", "."),
    "temperament": ("miburi.feelings", "temperaments"),
}


def template(
    kind: Annotated[str, typer.Argument(help=", ".join(_FOLDERS) + ".")],
    name: Annotated[
        str | None, typer.Argument(help="Default: list the names, if there are several.")
    ] = None,
) -> None:
    """Print a file that ships with Miburi, to start your own from."""
    must_be_one_of(_FOLDERS, kind, "the kind")
    files = _files(kind)
    if name is None and len(files) == 1:
        name = next(iter(files))
    if name is None:
        print("\n".join(files))
        return
    must_be_one_of(files, name, f"the {kind}")
    print(files[name].read_text(encoding="utf-8"), end="")


def _files(kind: str) -> dict[str, Traversable]:
    package, folder = _FOLDERS[kind]
    found = (resources.files(package) / folder).iterdir()
    return {
        file.name.removesuffix(".toml"): file
        for file in sorted(found, key=lambda file: file.name)
        if file.name.endswith(".toml")
    }
