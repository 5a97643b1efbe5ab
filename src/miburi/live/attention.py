"""The partner's part in a conversation: it listens, thinks or speaks."""

from typing import Literal

from miburi.partner.rest import Attention

#: Turns that pages report: a person is about to speak, or waits for an answer.
Turn = Literal["listening", "thinking"]
#: A turn ends after this time, in s, unless it is reported again (our choice).
FADES: dict[Turn, float] = {"listening": 10.0, "thinking": 30.0}
#: How long the partner listens for an answer after its own words, in s (our choice).
TURN = 6.0


class Attending:
    """The turn in a conversation; none at first."""

    def __init__(self) -> None:
        self._turn: Turn | None = None
        self._left = 0.0  # s
        self._sentence: int | None = None

    def begin(self, turn: Turn) -> None:
        """Begin a turn.

        Listening does not interrupt thinking: a page's report of it may arrive late.
        """
        if turn == "thinking" or self._turn != "thinking" or self._left <= 0:
            self._turn, self._left = turn, FADES[turn]

    def step(self, dt: float, sentence: int | None) -> Attention | None:
        """Advance by ``dt`` s; return what the partner does now, if anything.

        ``sentence`` is the number of the sentence that it is saying, if any. Thinking that begins
        during a sentence lasts until the next sentence begins, or until it times out.
        """
        begins, self._sentence = sentence != self._sentence, sentence
        if sentence is not None and (begins or self._turn != "thinking"):
            self._turn, self._left = "listening", TURN
            return "speaking"
        self._left -= dt
        return self._turn if self._left > 0 else None
