"""Whether somebody talks with the partner, and whose turn it is."""

from typing import Literal

from miburi.partner.rest import Attention

__all__ = ["FADES", "TURN", "Attending", "Turn"]

#: Whose turn somebody may say it is: they are about to speak, or wait for an answer.
Turn = Literal["listening", "thinking"]
#: s after which a turn is over that nobody tells of again (ours).
FADES: dict[Turn, float] = {"listening": 10.0, "thinking": 30.0}
#: s after its own words in which it listens for an answer (ours).
TURN = 6.0


class Attending:
    """Keeps what the partner does for somebody who talks with it, none at first."""

    def __init__(self) -> None:
        self._turn: Turn | None = None
        self._left = 0.0  # s
        self._sentence: int | None = None

    def begin(self, turn: Turn) -> None:
        """Take in that somebody is about to speak, or that they have spoken.

        What comes late, or before it has answered, does not end its thinking.
        """
        if turn == "thinking" or self._turn != "thinking" or self._left <= 0:
            self._turn, self._left = turn, FADES[turn]

    def step(self, dt: float, sentence: int | None) -> Attention | None:
        """Let ``dt`` s pass; return what it does now.

        Parameters
        ----------
        dt
            s
        sentence
            The number of the sentence that it is saying, if any. Who interrupts it is answered
            by the next one.
        """
        if sentence is not None and sentence != self._sentence:
            self._turn, self._left = "listening", TURN
        self._sentence = sentence
        if sentence is not None and self._turn != "thinking":
            self._turn, self._left = "listening", TURN
            return "speaking"
        self._left -= dt
        return self._turn if self._left > 0 else None
