"""``miburi to-ros``: parse, convert, print."""

from pathlib import Path
from typing import Annotated

import typer

from miburi.cli.options import RobotFile, robot_of
from miburi.cli.places import a_file
from miburi.errors import InputError, need

__all__ = ["to_ros"]


def to_ros(
    recording: Annotated[Path, typer.Argument(help="A recording (MCAP).")],
    out: Annotated[
        Path, typer.Argument(help="The file to write (MCAP, ROS 2's messages).", callback=a_file)
    ],
    robot: RobotFile = None,
) -> None:
    """Write a recording as ROS 2 messages, for ROS 2's tools."""
    if recording.resolve() == out.resolve():
        raise InputError(f"{out} is the file to read; choose another file to write.")
    need("cyclonedds", "ros")
    from miburi.doors.ros_recording import convert_recording

    print(f"{convert_recording(recording, robot_of(robot), out)} messages in {out}.")
