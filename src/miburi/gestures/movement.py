"""Read movement functions: turn a gesture file (TOML) into a checked object.

Positions of hands and head are relative to the body, so that a gesture carries over to other
robots; :mod:`miburi.gestures.coordinates` defines the coordinates in which gestures are blended.
:func:`misfits` names the key poses that a robot cannot reach.
"""

from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from miburi import feelings, ik
from miburi.errors import DescriptionError, InputError
from miburi.feelings import FEELINGS
from miburi.gestures import coordinates
from miburi.gestures.effort import Effort
from miburi.ground.tables import Table, load_table
from miburi.robot import Array, Robot
from miburi.robot.geometry import arm_reach, hand_distances

Direction = Annotated[list[Annotated[float, Field(ge=-1, le=1)]], Field(min_length=3, max_length=3)]
Phase = Annotated[float, Field(ge=0, le=1)]


class Posture(Table):
    """A key pose at full intensity; hands in the chest's frame, in multiples of L23 + L34.

    The head's direction, from its joint to its centre in the base frame, may have any length. A
    direction to the side turns the waist.
    """

    phase: Phase = Field(description="When the body arrives, as a share of the duration.")
    until: Phase | None = Field(default=None, description="When it leaves; null: at once.")
    right: Direction = Field(
        description="The right hand, relative to its shoulder: forward, out, up; 1 is the "
        "arm's full reach."
    )
    left: Direction = Field(description="The left hand, in the same way.")
    head: Direction = Field(description="The head's direction: forward, left, up.")

    @property
    def leaves(self) -> float:
        """The phase at which the body leaves the pose."""
        return self.phase if self.until is None else self.until

    @property
    def coordinates(self) -> Array:
        """The pose's eight polar coordinates; see :mod:`miburi.gestures.coordinates`."""
        return coordinates.polar(*map(np.array, (self.right, self.left, self.head)))

    @model_validator(mode="after")
    def _check_reach(self) -> Self:
        if self.until is not None and self.until < self.phase:
            raise ValueError(
                f"until must not be before phase ({self.phase}), got {self.until}; "
                "it says when the body leaves the pose"
            )
        for side in ("right", "left"):
            length = float(np.linalg.norm(getattr(self, side)))
            if length > 1:
                raise ValueError(
                    f"{side} = {getattr(self, side)} is {length:.3f} times the arm's reach from "
                    "the shoulder; at most 1 is allowed"
                )
        if np.linalg.norm(self.head[:2]) < 0.05:
            raise ValueError(
                f"head = {self.head} points straight up or nowhere; its forward and left parts "
                "must together be at least 0.05 long"
            )
        return self


class Repeat(Table):
    """Play a range of key poses more than once.

    ``first`` and ``last`` are the ends of the range, counted from 1. ``times`` says how often the
    range is played in all. ``back`` is the time from the last pose to the first, as a share of the
    gesture's duration. Each repeat makes the gesture longer.
    """

    first: Annotated[int, Field(ge=1)] = Field(description="The first pose of the range, from 1.")
    last: Annotated[int, Field(ge=1)] = Field(description="The last one.")
    times: Annotated[int, Field(ge=2, le=8)] = Field(description="How many times in all.")
    back: Annotated[float, Field(gt=0, le=1)] = Field(
        description="The way back, as a share of the duration."
    )


class MovementFunction(Table):
    """The paper's movement function (Section 4): how one feeling moves hands and head.

    Attributes
    ----------
    name, feeling
        The name of the gesture, and the feeling that it shows.
    duration
        How long the gesture takes from neutral back to neutral at tempo 1, without repeats, in s.
    hedge
        The linguistic hedge on the membership μ: ``plainly`` μ, ``very`` μ², ``more or less`` √μ.
    effort
        Laban's effort at full intensity.
    pose
        The key poses in the order of their phases; the gesture starts and ends at neutral.
    repeat
        A range of key poses to play more than once.
    """

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
    feeling: str
    duration: Annotated[float, Field(ge=0.2, le=20)]
    hedge: Literal["plainly", "very", "more or less"] = "plainly"
    effort: Effort
    pose: Annotated[tuple[Posture, ...], Field(min_length=1, max_length=32, strict=False)]
    repeat: Repeat | None = None

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if self.feeling not in feelings.FEELINGS:
            raise ValueError(
                f"feeling = {self.feeling!r} is not known; the known ones are "
                f"{', '.join(feelings.FEELINGS)} (`miburi --feelings FILE` adds yours)"
            )
        left = 0.0
        for number, pose in enumerate(self.pose, start=1):
            if pose.phase <= left:
                raise ValueError(
                    f"pose {number} has the phase {pose.phase}; it must come after {left}, "
                    "when the body leaves the pose before it"
                )
            left = pose.leaves
        if left >= 1:
            raise ValueError(
                f"the body leaves the last pose at {left}; it must leave before 1, "
                "so that there is time to go back to neutral"
            )
        if self.repeat and not self.repeat.first < self.repeat.last <= len(self.pose):
            raise ValueError(
                f"repeat goes from pose {self.repeat.first} to {self.repeat.last}; it must go "
                f"from one pose to a later one, of {len(self.pose)}"
            )
        return self


def load(source: str | Path) -> MovementFunction:
    """Read the gesture of a feeling, or any gesture file.

    ``source`` is a feeling's name, for the gesture that ships with Miburi, or the path of a TOML
    file.

    Raises
    ------
    InputError
        No gesture ships for that name.
    DescriptionError
        The file cannot be read, or a key is wrong.
    """
    if isinstance(source, str) and not source.endswith(".toml"):
        if source not in (available := shipped_feelings()):
            raise InputError(
                f"There is no gesture for {source!r}; there is one for {', '.join(available)}. "
                "The path of a gesture file must end in .toml."
            )
        with resources.as_file(resources.files(__package__) / f"{source}.toml") as path:
            return load(path)
    return load_table(MovementFunction, source)


def load_for(robot: Robot, path: Path | str) -> MovementFunction:
    """Read a gesture file that a user wrote for ``robot``.

    Raises
    ------
    DescriptionError
        The file cannot be read, a key is wrong, or the robot cannot reach a key pose. The message
        names every such pose, and says what is allowed.
    """
    function = load(Path(path))
    problems = list(misfits(robot, function))
    if problems:
        raise DescriptionError(f"{path}: {'; '.join(problems)}.")
    return function


def shipped_feelings() -> tuple[str, ...]:
    """Return the feelings for which a gesture ships with Miburi, in the order of ``FEELINGS``."""
    folder = resources.files(__package__)
    return tuple(feeling for feeling in FEELINGS if (folder / f"{feeling}.toml").is_file())


def misfits(robot: Robot, function: MovementFunction) -> Iterator[str]:
    """Yield a message for each key pose outside the robot's limits, with the limits."""
    for number, pose in enumerate(function.pose, start=1):
        wanted = pose.coordinates
        turned, raised = wanted[6:]
        inside = robot.lower[[0, -1]] - _TOLERANCE, robot.upper[[0, -1]] + _TOLERANCE
        if not np.all((inside[0] <= wanted[6:]) & (wanted[6:] <= inside[1])):
            yield (
                f"pose {number}: head = {pose.head} turns the waist by {turned:.3f} and raises the "
                f"head by {raised:.3f} rad; the waist may turn by {robot.lower[0]} to "
                f"{robot.upper[0]}, and the head by {robot.lower[-1]} to {robot.upper[-1]}"
            )
            continue  # the waist carries the arms, so if it is out of reach, they cannot be checked
        closest = hand_distances(robot)[:, 0] / arm_reach(robot)
        for side, name in enumerate(("right", "left")):
            alone = coordinates.neutral(robot)
            alone[6:] = wanted[6:]
            alone[3 * side : 3 * side + 3] = wanted[3 * side : 3 * side + 3]
            reached = ik.solve(robot, coordinates.targets(robot, alone), start=robot.neutral)
            if reached.error.max() > _TOLERANCE:
                yield (
                    f"pose {number}: {name} = {getattr(pose, name)}, {alone[3 * side]:.3f} arm's "
                    "reaches from the shoulder, is out of reach; allowed is what the joint limits "
                    f"let the arm do, at a distance of {closest[side]:.2f} to 1"
                )


#: The largest error of an extremity's position, in m, and the largest angle outside a limit, in
#: rad, that still count as reached.
_TOLERANCE = 1e-4
