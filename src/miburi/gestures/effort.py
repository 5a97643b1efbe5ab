"""Laban's effort: four numbers, written in a gesture's file, that say how it is moved."""

from typing import Annotated

from pydantic import Field

from miburi.ground.tables import Table

__all__ = ["Effort"]

Share = Annotated[float, Field(ge=0, le=1)]


class Effort(Table):
    """Space, weight, time and flow (Laban; the paper's Fig. 5), each in [0, 1].

    The paper lets space and time rise with the mood; weight and flow belong to the feeling.
    What the numbers do to a gesture is ours:

    Attributes
    ----------
    space
        Share of the written reach that is used: 0 stays at neutral, 1 goes all the way.
    weight
        Light 0, strong 1: a strong movement is short and then halts; it takes the share
        1 − weight / 2 of its time.
    time
        Sustained 0, sudden 1: the tempo is 0.5 + time, so 0.5 is as written.
    flow
        Bound 0, free 1: below 0.5 a wide movement halts half-way, the longer the more bound;
        from 0.5 on it sweeps through.
    """

    space: Share
    weight: Share
    time: Share
    flow: Share

    @property
    def tempo(self) -> float:
        """How much faster than written, 0.5 to 1.5."""
        return 0.5 + self.time

    @property
    def stroke(self) -> float:
        """Share of its time that a movement takes before it halts, 1 to 0.5."""
        return 1.0 - self.weight / 2

    @property
    def hesitation(self) -> float:
        """Share of its time that a wide movement halts half-way, 0 to 0.25."""
        return max(0.0, 0.25 - self.flow / 2)
