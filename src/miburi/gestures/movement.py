"""Movement functions: one TOML file each, checked when it is read."""

from importlib import resources
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from miburi import feelings
from miburi.errors import DescriptionError, InputError
from miburi.gestures.effort import Effort
from miburi.robot import Array, Robot, inverse, iphonoid
from miburi.robot.geometry import arm_reach, hand_distances, head_joint, shoulders
from miburi.tables import Table, load_table

#: The feelings that have a gesture: the files beside this one.
FEELINGS = tuple(
    sorted(
        file.name.removesuffix(".toml")
        for file in resources.files(__package__).iterdir()
        if file.name.endswith(".toml")
    )
)

Direction = Annotated[list[Annotated[float, Field(ge=-1, le=1)]], Field(min_length=3, max_length=3)]
Phase = Annotated[float, Field(ge=0, le=1)]


class Posture(Table):
    """A key pose at full intensity.

    Attributes
    ----------
    phase, until
        When the body arrives and when it leaves, in parts of the gesture's duration.
    right, left
        Hand as seen from its own shoulder, [forward, out, up] of the chest, in arm's reaches
        (L23 + L34).
    head
        Direction from the head's joint to its centre, [forward, left, up] of the base; any
        length. What points to the side turns the waist.
    """

    phase: Phase
    until: Phase | None = None
    right: Direction
    left: Direction
    head: Direction

    @property
    def leaves(self) -> float:
        """Phase at which the body leaves the pose."""
        return self.phase if self.until is None else self.until

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.until is not None and self.until < self.phase:
            raise ValueError(
                f"until must not be before phase ({self.phase}), got {self.until}; "
                "it says when the body leaves the pose"
            )
        for side in ("right", "left"):
            length = float(np.linalg.norm(getattr(self, side)))
            if length > 1:
                raise ValueError(
                    f"{side} = {getattr(self, side)} is {length:.3f} arm's reaches from the "
                    "shoulder; at most 1 is allowed"
                )
        if np.linalg.norm(self.head[:2]) < 0.05:
            raise ValueError(
                f"head = {self.head} points straight up or nowhere; its forward and left parts "
                "must say where it looks"
            )
        return self


class Repeat(Table):
    """Key poses ``first`` to ``last``, counted from 1, are played ``times`` times in all.

    The way ``back`` from the last to the first takes that part of the gesture's duration, which
    each repeat makes longer.
    """

    first: Annotated[int, Field(ge=1)]
    last: Annotated[int, Field(ge=1)]
    times: Annotated[int, Field(ge=2, le=8)]
    back: Annotated[float, Field(gt=0, le=1)]


class MovementFunction(Table):
    """The paper's movement function (Section 4): what one feeling does to hands and head.

    Attributes
    ----------
    name, feeling
        Its own name, and the feeling that it shows.
    duration
        s, from neutral to neutral at tempo 1, repeats not counted.
    hedge
        How the mood μ weighs: ``plainly`` μ, ``very`` μ², ``more or less`` √μ.
    effort
        Laban's effort at full intensity.
    pose
        The key poses in the order of their phases; neutral comes before and after by itself.
    repeat
        A stretch of key poses that is played more than once.
    """

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
    feeling: str
    duration: Annotated[float, Field(ge=0.2, le=20)]
    hedge: Literal["plainly", "very", "more or less"] = "plainly"
    effort: Effort
    pose: Annotated[tuple[Posture, ...], Field(min_length=1, max_length=32, strict=False)]
    repeat: Repeat | None = None

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.feeling not in feelings.FEELINGS:
            raise ValueError(
                f"feeling = {self.feeling!r} is not known; allowed are "
                f"{', '.join(feelings.FEELINGS)}"
            )
        left = 0.0
        for number, pose in enumerate(self.pose, start=1):
            if pose.phase <= left:
                raise ValueError(
                    f"pose {number} has the phase {pose.phase}; it must come after {left}, "
                    "when the pose before it is left"
                )
            left = pose.leaves
        if left >= 1:
            raise ValueError(
                f"the last pose is left at {left}; it must be left before 1, "
                "so that there is time to go back to neutral"
            )
        if self.repeat and not self.repeat.first < self.repeat.last <= len(self.pose):
            raise ValueError(
                f"repeat goes from pose {self.repeat.first} to {self.repeat.last}; allowed is "
                f"from one pose to a later one, of {len(self.pose)}"
            )
        return self


def load(source: str | Path, robot: Robot | None = None) -> MovementFunction:
    """Read the gesture of a feeling, or any gesture file.

    Parameters
    ----------
    source
        A feeling's name, or the path of a TOML file.
    robot
        Whose limits the key poses must keep; the iphonoid where none is given.

    Raises
    ------
    InputError
        There is no such feeling.
    DescriptionError
        The file cannot be read, a key is wrong, or a key pose is out of the robot's reach.
    """
    if isinstance(source, str) and not source.endswith(".toml"):
        if source not in FEELINGS:
            raise InputError(
                f"There is no gesture for {source!r}; there is one for {', '.join(FEELINGS)}. "
                "A path of a gesture file ends in .toml."
            )
        with resources.as_file(resources.files(__package__) / f"{source}.toml") as path:
            return load(path, robot)
    function = load_table(MovementFunction, source)
    for number, pose in enumerate(function.pose, start=1):
        try:
            angles(robot or iphonoid(), pose)
        except InputError as error:
            raise DescriptionError(f"{source}: pose {number}: {error}") from error
    return function


def angles(robot: Robot, pose: Posture) -> Array:
    """Return the joint angles, (8,) rad, that put hands and head where ``pose`` says.

    Raises
    ------
    InputError
        The pose is out of reach, or outside the joint limits.
    """
    nod = robot.neutral[-1]
    level = [float(np.cos(nod)), 0.0, float(np.sin(nod))]
    right, left, head = np.array(pose.right), np.array(pose.left), np.array(pose.head)
    found = _solutions(robot, right, left, head)
    if len(found):
        # Where an elbow may bend either way, it bends as it does at neutral.
        best: Array = found[np.argmax(found[:, 3] - found[:, 6])]
        return best
    hanging = _HANGING
    if not len(_solutions(robot, hanging, hanging, head)):
        turned, raised = np.arctan2(head[1], head[0]), np.arcsin(head[2] / np.linalg.norm(head))
        raise InputError(
            f"head = {pose.head} turns the waist by {turned:.3f} and raises the head by "
            f"{raised:.3f} rad; allowed are {robot.lower[0]} to {robot.upper[0]} and "
            f"{robot.lower[-1]} to {robot.upper[-1]}."
        )
    right_fits = len(_solutions(robot, right, hanging, np.array(level)))
    name, hand = ("left", pose.left) if right_fits else ("right", pose.right)
    nearest, farthest = hand_distances(robot)[int(right_fits)] / arm_reach(robot)
    raise InputError(
        f"{name} = {hand}, {np.linalg.norm(hand):.3f} arm's reaches from the shoulder, is out of "
        f"reach; allowed is what the joint limits let the arm do, at a distance of "
        f"{nearest:.2f} to {farthest:.2f}."
    )


#: A hand that every arm can put there: hanging, a little outwards.
_HANGING = np.array([0.0, 0.3, -0.94])


def _solutions(robot: Robot, right: Array, left: Array, head: Array) -> Array:
    """Return all joint angles, (k, 8), for hands and head given as in :class:`Posture`."""
    reach = arm_reach(robot)
    look = head / np.linalg.norm(head)
    waist = np.arctan2(look[1], look[0])
    cos, sin = np.cos(waist), np.sin(waist)
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    right_shoulder, left_shoulder = shoulders(robot)
    return inverse(
        robot,
        np.concatenate(
            [
                turn @ (right_shoulder + reach * right * [1, -1, 1]),
                turn @ (left_shoulder + reach * left),
                head_joint(robot) + robot.lengths.LH2 * look,
            ]
        ),
    )
