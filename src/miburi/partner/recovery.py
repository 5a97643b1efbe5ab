"""Recovering from a stop: when the body may go back to neutral by itself.

After a contact it may after a pause, which doubles with each encounter until a gesture has gone
through. After anything else a person decides; and while a person holds the body, nobody else does.
"""

from miburi.safety.stop import Stop

__all__ = ["FIRST_PAUSE", "LONGEST_PAUSE", "Recovery"]

#: Seconds from a contact stop to the release, doubled at each encounter in a row (ours).
FIRST_PAUSE = 1.0
LONGEST_PAUSE = 16.0


class Recovery:
    """What is known of the present stop, and of the encounters before it; times in s."""

    def __init__(self) -> None:
        #: Whether a person has stopped the body.
        self.held = False
        self._encounters = 0
        self._release_at: float | None = None
        self._known: Stop | None = None

    def is_new(self, stop: Stop) -> bool:
        """Take a stop in; whether it was not known before."""
        new, self._known = stop != self._known, stop
        return new

    def after_contact(self, time: float) -> None:
        """Release the body after a pause."""
        pause = min(FIRST_PAUSE * 2**self._encounters, LONGEST_PAUSE)
        self._release_at = time + pause
        self._encounters += 1

    def wait_for_a_person(self) -> None:
        """Do not release the body: somebody asked for the stop, or something failed."""
        self._release_at = None

    def hurry(self, time: float) -> None:
        """Release the body after its pause, or at once where there is none, whoever held it."""
        self._release_at, self.held = self._release_at or time, False

    def is_due(self, time: float) -> bool:
        """Whether the body is to be released."""
        return self._release_at is not None and time >= self._release_at and not self.held

    def retry(self, time: float) -> None:
        """Try again later: the body was not ready."""
        self._release_at = time + FIRST_PAUSE

    def released(self) -> None:
        """Forget when to release the body: it was."""
        self._release_at, self.held = None, False

    def at_rest(self) -> None:
        """Forget the stop: it is over."""
        self._known = None

    def unhindered(self) -> None:
        """Forget the encounters: a gesture has gone through."""
        self._encounters = 0
