"""What was said in the present conversation; it is never written to a disk."""

import re
from collections import deque
from collections.abc import Iterator, Sequence
from datetime import datetime, timedelta
from itertools import takewhile

__all__ = ["STAYS", "Remarks"]

#: How long after last speaking somebody counts as present (our choice).
STAYS = timedelta(hours=2)
#: The number of remarks that are kept; how many of the latest a pronoun can refer to, and how many
#: a name; and for how long (our choice).
_KEPT, _FEW, _SOME, _MEANT = 60, 3, 12, timedelta(minutes=5)
#: A remark of at most this many characters is repeated whole, a longer one sentence by sentence
#: (our choice).
_SHORT = 120


class Remarks:
    """What the person at the table has said: each remark, its time, and its statements."""

    def __init__(self) -> None:
        self._all: deque[tuple[datetime, str, list[str]]] = deque(maxlen=_KEPT)
        #: The statement that the next sentence may continue.
        self.about: str | None = None

    def clear(self) -> None:
        """Forget them all."""
        self._all.clear()
        self.about = None

    def note(self, now: datetime, said: str, told: Sequence[str], *, more: bool) -> None:
        """Keep a remark, and those of its sentences that are not questions.

        With ``more``, the remark continues the one before it, and is kept together with that.
        """
        about = self.about if more else None
        self.about = about or next(reversed(told), self.about)
        first = [f"{about.rstrip('.!')}. {each}" for each in told[:1]] if about else told[:1]
        self._all.append((now, said, [*first, *told[1:]]))

    def latest(self, now: datetime, most: int = _FEW) -> Iterator[str]:
        """Yield the latest few remarks that a pronoun may refer to, newest first."""
        few = [*self._all][-most:]
        return (said for when, said, _ in reversed(few) if when >= now - _MEANT)

    def latest_told(self, now: datetime) -> Iterator[str]:
        """Yield what the latest remarks state, newest first, back to an empty remark.

        Remarks that only ask something are left out.
        """
        few = takewhile(lambda one: one[1], reversed([*self._all][-_FEW:]))
        return (" ".join(told) for when, _, told in few if told and when >= now - _MEANT)

    def sentences(self, now: datetime, *, named: bool = True) -> Iterator[str]:
        """Yield the sentences that may mention the person meant, newest first.

        A name may refer to a person mentioned several remarks ago; a pronoun alone (not ``named``)
        rarely does.
        """
        for said in self.latest(now, _SOME if named else _FEW):
            yield from reversed(re.split(r"[.!?]+", said))

    def last_told(self, now: datetime) -> str | None:
        """Return the latest statement, if it is among the latest few remarks."""
        few = [*self._all][-_FEW:]
        told = (each for when, _, all_told in few if when >= now - _MEANT for each in all_told)
        return next(reversed([*told]), None)

    def told(self, now: datetime) -> list[str]:
        """Return the statements: those of a short remark as one, of a long one each by itself."""
        said = []
        for when, _, told in self._all:
            whole = " ".join(told)
            if when >= now - STAYS:
                said += [whole] if len(whole) <= _SHORT else told
        return said

    def amend(self, old: str, new: str) -> None:
        """Put a corrected sentence in the place of what it corrects."""
        for n, (when, said, told) in enumerate(self._all):
            if old in (" ".join(told), *told):
                rest = [each for each in told if each not in old]
                self._all[n] = when, said, [new, *rest]
