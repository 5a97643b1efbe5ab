"""Laban's effort: the four qualities that shape a gesture, each from 0 to 1."""

from typing import Annotated

from pydantic import Field

from miburi.tables import Table

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
        Light 0, strong 1: a strong gesture strikes, with a halt after each move.
    time
        Sustained 0, sudden 1: the tempo is 0.5 + time, so 0.5 is as written.
    flow
        Bound 0, free 1: bound movement halts half-way, free movement sweeps through.
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
    def strike(self) -> float:
        """Share of the time between two key poses that the move may take, 1 to 0.5."""
        return 1.0 - self.weight / 2
