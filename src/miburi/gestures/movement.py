"""Movement functions: one TOML file each, checked when it is read."""

from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from miburi import feelings
from miburi.errors import DescriptionError, InputError
from miburi.feelings import FEELINGS
from miburi.gestures.effort import Effort
from miburi.ground.tables import Table, load_table
from miburi.robot import Array, Robot, forward, inverse, inverse_within_limits
from miburi.robot.geometry import arm_reach, head_joint, shoulders

__all__ = [
    "Direction",
    "MovementFunction",
    "Phase",
    "Posture",
    "Repeat",
    "angles",
    "load",
    "load_for",
    "misfits",
    "shipped_feelings",
]

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


def load(source: str | Path) -> MovementFunction:
    """Read the gesture of a feeling, or any gesture file.

    Parameters
    ----------
    source
        A feeling's name, for the gesture that ships with Miburi, or the path of a TOML file.

    Raises
    ------
    InputError
        No gesture ships for that name.
    DescriptionError
        The file cannot be read, or a key is wrong.
    """
    if isinstance(source, str) and not source.endswith(".toml"):
        if source not in (known := shipped_feelings()):
            raise InputError(
                f"There is no gesture for {source!r}; there is one for {', '.join(known)}. "
                "A path of a gesture file ends in .toml."
            )
        with resources.as_file(resources.files(__package__) / f"{source}.toml") as path:
            return load(path)
    return load_table(MovementFunction, source)


def load_for(robot: Robot, path: Path | str) -> MovementFunction:
    """Read a gesture file that a user wrote for ``robot``.

    Raises
    ------
    DescriptionError
        The file cannot be read, a key is wrong, or the robot cannot do a key pose; the message
        names the file and every such pose, and says what is allowed.
    """
    function = load(Path(path))
    problems = list(misfits(robot, function))
    if problems:
        raise DescriptionError(f"{path}: {'; '.join(problems)}.")
    return function


def shipped_feelings() -> tuple[str, ...]:
    """Name the feelings for which a gesture ships with Miburi, in the order of ``FEELINGS``."""
    folder = resources.files(__package__)
    return tuple(feeling for feeling in FEELINGS if (folder / f"{feeling}.toml").is_file())


def misfits(robot: Robot, function: MovementFunction) -> Iterator[str]:
    """Say in words which key poses the robot's limits do not allow, and what they allow."""
    size = robot.lengths
    for number, pose in enumerate(function.pose, start=1):
        target = _target(robot, pose)
        reached = forward(robot, inverse_within_limits(robot, target))
        right, left, head = np.linalg.norm((reached - target).reshape(3, 3), axis=1) > _TOLERANCE
        if head:
            turned = np.arctan2(pose.head[1], pose.head[0])
            raised = np.arcsin(pose.head[2] / np.linalg.norm(pose.head))
            yield (
                f"pose {number}: head = {pose.head} turns the waist by {turned:.3f} and raises the "
                f"head by {raised:.3f} rad; allowed are {robot.lower[0]} to {robot.upper[0]} and "
                f"{robot.lower[-1]} to {robot.upper[-1]}"
            )
            continue  # the waist carries the arms: they cannot be judged without it
        for misses, name, hand, bend in (
            (right, "right", pose.right, robot.upper[3]),
            (left, "left", pose.left, robot.lower[6]),
        ):
            if misses:
                folded = np.hypot(size.L23 + size.L34 * np.cos(bend), size.L34 * np.sin(bend))
                yield (
                    f"pose {number}: {name} = {hand}, {np.linalg.norm(hand):.3f} arm's reaches "
                    "from the shoulder, is out of reach; allowed is what the joint limits let the "
                    f"arm do, at a distance of {folded / (size.L23 + size.L34):.2f} to 1"
                )


#: m, the largest distance of an extremity from where a key pose wants it.
_TOLERANCE = 1e-6


def angles(robot: Robot, pose: Posture) -> Array:
    """Return the joint angles, (8,) rad, that put hands and head where ``pose`` says.

    A pose that the limits do not allow is bent until they do; see :func:`misfits`.
    """
    target = _target(robot, pose)
    exact = inverse(robot, target, _TOLERANCE)
    if not len(exact):
        return inverse_within_limits(robot, target)
    # Where an elbow may bend either way, it bends as it does at neutral.
    best: Array = exact[np.argmax(exact[:, 3] - exact[:, 6])]
    return best


def _target(robot: Robot, pose: Posture) -> Array:
    """Return where ``pose`` wants the extremities, (9,) m in the base frame."""
    right, left, head = np.array(pose.right), np.array(pose.left), np.array(pose.head)
    reach = arm_reach(robot)
    look = head / np.linalg.norm(head)
    waist = np.arctan2(look[1], look[0])
    cos, sin = np.cos(waist), np.sin(waist)
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    right_shoulder, left_shoulder = shoulders(robot)
    return np.concatenate(
        [
            turn @ (right_shoulder + reach * right * [1, -1, 1]),
            turn @ (left_shoulder + reach * left),
            head_joint(robot) + robot.lengths.LH2 * look,
        ]
    )
