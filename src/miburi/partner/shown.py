"""How a partner with ``life`` shows an emotion: at once, with a few gestures, and then no more.

Without this limit, a gesture is repeated as long as its emotion lasts: fourteen times for one
remark. The paper's experiment does so.
"""

from miburi.feelings import FEELINGS, Expression, FeelingModel
from miburi.robot import Array

#: The largest number of gestures for one emotion (our choice).
_MOST = 3
#: An emotion that rises by more than this above its earlier level is a new one (our choice).
_RISES = 0.05
#: The newest feeling is shown if it has at least this share of the strongest emotion's strength
#: (our choice).
_NEAR = 0.9


class ShownEmotion:
    """An emotion, tracked from its onset; the emotional model is only read.

    Attributes
    ----------
    shown
        How many gestures have shown it.
    """

    def __init__(self, feelings: FeelingModel) -> None:
        self._feelings = feelings
        self.shown, self._rose = 0, False
        self._before: Array | None = None
        self._feeling: str | None = None
        self._lowest = 0.0
        self._rose_last: int | None = None

    def left(self, felt: Expression | None) -> Expression | None:
        """Return the feeling that is still to be shown, if any.

        Of emotions that are nearly equal, the newest is shown first. For example, a fright also
        raises an older fear, to slightly above the fright itself. The fright is shown, because it
        is newer.
        """
        emotion = self._feelings.emotion
        before, self._before = self._before, emotion.copy()
        felt = self._newest(felt, emotion, before)
        if felt is None:
            self._feeling = None
            return None
        index = FEELINGS.index(felt.feeling)
        level = float(emotion[index])
        rises = level > self._lowest + _RISES
        if felt.feeling != self._feeling:
            rises = before is None or level > before[index] + _RISES / 5
        self._rose = rises or (self._rose and felt.feeling == self._feeling)
        if felt.feeling != self._feeling or level > self._lowest + _RISES:
            self.shown, self._feeling, self._lowest = 0, felt.feeling, level
        self._lowest = min(self._lowest, level)
        return felt if self.shown < _MOST else None

    def _newest(
        self, felt: Expression | None, emotion: Array, before: Array | None
    ) -> Expression | None:
        """Return the feeling that rose last if nearly as strong as ``felt``; otherwise ``felt``."""
        if before is not None and (emotion - before).max() > _RISES:
            self._rose_last = int((emotion - before).argmax())
        newest = self._rose_last
        if felt is None or newest is None or felt.feeling == FEELINGS[newest]:
            return felt
        if emotion[newest] < _NEAR * emotion.max():
            return felt
        return Expression(FEELINGS[newest], float(self._feelings.mood[newest]))

    @property
    def rises(self) -> bool:
        """Whether no gesture has shown this emotion, and it became the strongest by rising."""
        return self._rose and self.shown == 0
