"""Who presses Stop, and who may end it.

A Stop counts as a person's unless it says that a program pressed it, so a home-made button can send
a bare Stop. A release counts as a program's unless it comes from a page or another place where a
person acts.
"""

from datetime import datetime
from typing import Literal, NamedTuple, get_args

from miburi.errors import BodyError

#: The header that tells who presses.
BY = "miburi-by"
#: The header with the id of a press that a page sends twice, so that the copy is recognised.
PRESS = "miburi-press"
#: The length of the random id (our choice).
_DRAWN = range(16, 65)
#: Who presses: a person at a page or a terminal; a smart home; an agent (MCP); ROS; a program that
#: uses :mod:`miburi.client.remote`; or the partner itself, when nobody can reach it.
By = Literal["person", "home", "agent", "ros", "program", "partner"]
#: Programs may release a Stop that one of these pressed. They may not release a Stop that an agent
#: or ROS pressed: after such a Stop, people expect somebody to look at the body.
_PROGRAMS_MAY_END = ("program", "partner")
_NAMES = {
    "person": "a person", "home": "the smart home", "agent": "an assistant", "ros": "ROS",
}  # fmt: skip
_HELD = (
    "{name} pressed Stop, so only a person can release the body: in the studio or on the face's "
    "page. Wait until somebody does, or start the partner with --programs-may-release."
)


def who(claim: str) -> By:
    """Return who presses Stop, as a request claims; an unknown claim counts as a person's."""
    for known in get_args(By):
        if claim == known != "partner":
            return known  # type: ignore[no-any-return]
    return "person"


class Press(NamedTuple):
    """One press of Stop, or several that are handled as one.

    A page sends each press by two routes, because one may be blocked. If a person releases the body
    in between, the second copy of the press must not stop it again.
    """

    by: By = "person"
    #: The ids of the presses; None if one of them has no id.
    names: frozenset[str] | None = None

    @staticmethod
    def both(before: "Press | None", later: "Press") -> "Press":
        """Return two presses in a row as one."""
        if before is None:
            return later
        by = outlasting(before.by, later.by)
        if before.names is None or later.names is None:
            return Press(by)
        return Press(by, before.names | later.names)


#: A press without details.
PRESSED = Press()


def press(by: str = "person", name: str = "") -> Press:
    """Return the press that a request describes."""
    return Press(who(by), frozenset({name}) if len(name) in _DRAWN else None)


def outlasting(before: By | None, by: By) -> By:
    """Return which of two presses in a row counts: a program's never hides a person's."""
    return by if before is None or before in _PROGRAMS_MAY_END else before


class Hold:
    """Remembers who stopped the body.

    Parameters
    ----------
    programs_may_release
        Whether programs may end a person's Stop, too.
    """

    #: A Stop from before this start that only a person may end: who pressed it, and when, if known.
    before: tuple[By, datetime | None] | None = None

    def __init__(self, *, programs_may_release: bool = False) -> None:
        self._programs_may_release = programs_may_release
        self._by: By | None = None  # None without a press

    @property
    def by(self) -> By | None:
        """Who pressed a Stop that only a person may end; None if nobody did."""
        return None if self._by in _PROGRAMS_MAY_END else self._by

    def press(self, by: By) -> bool:
        """Record a press; return whether it changes who holds the body."""
        before, self._by = self._by, outlasting(self._by, by)
        return self._by != before

    def end(self, *, by_person: bool) -> By:
        """Forget the Stop after a release; return who released it."""
        self._by = self.before = None
        return "person" if by_person else "program"

    def close(self) -> None:
        """Remember nothing more."""

    def check(self, *, by_person: bool) -> None:
        """Refuse a program's release of a Stop that only a person may end.

        Raises
        ------
        BodyError
            A program asks for the release, but only a person may release the body.
        """
        if self.by is not None and not (by_person or self._programs_may_release):
            raise BodyError(_HELD.format(name=_NAMES[self.by]))
