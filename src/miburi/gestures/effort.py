"""Laban's effort: four numbers in a gesture's file that say how the gesture is performed."""

from typing import Annotated

from pydantic import Field

from miburi.ground.tables import Table

Share = Annotated[float, Field(ge=0, le=1)]


class Effort(Table):
    """Space, weight, time and flow (Laban; the paper's Fig. 5), each in [0, 1].

    In the paper, space and time rise with the mood, while weight and flow belong to the feeling.
    Their effects on a gesture are our choice:

    Attributes
    ----------
    space
        The share of the amplitude in the file: at 0 the body stays at neutral, at 1 it reaches the
        pose.
    weight
        Light 0, strong 1: a strong movement is short and then halts. It takes 1 − weight / 2 of the
        time that it would take otherwise.
    time
        Sustained 0, sudden 1: the tempo is 0.5 + time, so that 0.5 leaves the gesture's tempo as
        written.
    flow
        Bound 0, free 1: below 0.5 a wide movement halts half-way; the lower the number, the longer
        the halt. At 0.5 and above there is no halt. Above 0.5 a partner that has ``life`` passes
        key poses without stopping, whatever its temperament.
    """

    space: Share
    weight: Share
    time: Share
    flow: Share

    @property
    def tempo(self) -> float:
        """The speed relative to the written speed, 0.5 to 1.5."""
        return 0.5 + self.time

    @property
    def stroke(self) -> float:
        """The share of a movement's time that passes before it halts, 1 to 0.5."""
        return 1.0 - self.weight / 2

    @property
    def free(self) -> bool:
        """Whether a body passes key poses without stopping, except those with a time to stay."""
        return self.flow > 0.5

    @property
    def hesitation(self) -> float:
        """The share of a wide movement's time for which it halts half-way, 0 to 0.25."""
        return max(0.0, 0.25 - self.flow / 2)
