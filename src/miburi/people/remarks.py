"""The remarks of the present conversation; they are never written to a disk."""

import re
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime, timedelta
from itertools import takewhile

#: How long after last speaking somebody counts as present (our choice).
STAYS = timedelta(hours=2)
#: How many remarks are kept. How many of the latest remarks a pronoun can refer to, and how many if
#: the words also give a name. The age up to which a pronoun can refer to a remark. (All are our
#: choice.)
_KEPT, _FEW, _SOME, _MEANT = 60, 3, 12, timedelta(minutes=5)
#: A remark of at most this many characters is repeated whole, a longer one sentence by sentence
#: (our choice).
_SHORT = 120


class Remarks:
    """What the person at the table has said: each remark, its time, and its statements."""

    def __init__(self, clock: Callable[[], datetime]) -> None:
        self._clock = clock
        self._all: deque[tuple[datetime, str, list[str]]] = deque(maxlen=_KEPT)
        #: The statement that the next sentence may continue.
        self.about: str | None = None

    def clear(self) -> None:
        """Forget them all."""
        self._all = deque(maxlen=_KEPT)  # another thread may be reading the old ones
        self.about = None

    def note(self, said: str, told: Sequence[str], *, more: bool) -> None:
        """Keep a remark, and those of its sentences that are not questions (``told``).

        With ``more``, the first of these sentences continues the previous statement, and is joined
        to it.
        """
        about = self.about if more else None
        self.about = about or next(reversed(told), self.about)
        first = [f"{about.rstrip('.!')}. {each}" for each in told[:1]] if about else told[:1]
        self._all.append((self._clock(), said, [*first, *told[1:]]))

    def _latest(self, most: int = _FEW) -> list[tuple[str, list[str]]]:
        """Return the latest few remarks and their statements, newest first."""
        since = self._clock() - _MEANT
        few = reversed([*self._all][-most:])
        return [(said, told) for when, said, told in few if when >= since]

    def latest_told(self) -> str | None:
        """Return the latest statements; search a few remarks, and none before an empty remark."""
        few = takewhile(lambda one: one[0], self._latest())
        return next((" ".join(told) for _, told in few if told), None)

    def sentences(self, *, named: bool = True) -> Iterator[str]:
        """Yield the sentences that may mention the person meant by a pronoun, newest first.

        If the words also give a name (``named``), the person may have been mentioned longer ago.
        """
        for said, _ in self._latest(_SOME if named else _FEW):
            yield from reversed(re.split(r"[.!?]+", said))

    def last_told(self) -> str | None:
        """Return the latest statement, if it is among the latest few remarks."""
        return next((told[-1] for _, told in self._latest() if told), None)

    def told(self) -> list[str]:
        """Return the statements; those of a short remark are joined into one."""
        said, since = [], self._clock() - STAYS
        for when, _, told in [*self._all]:
            whole = " ".join(told)
            if when >= since:
                said += [whole] if len(whole) <= _SHORT else told
        return said

    def amend(self, old: str, new: str) -> None:
        """Replace the statements that make up ``old`` by the corrected statement ``new``."""
        for n, (when, said, told) in enumerate([*self._all]):
            if old in (" ".join(told), *told):
                rest = [each for each in told if each not in old]
                self._all[n] = when, said, [new, *rest]
