"""Decide when a stopped body may go back to neutral by itself.

A :class:`Recovery` is told of stops and gestures, and answers whether the body is to be released.

- After a contact: after a pause. The pause doubles with each encounter until a gesture goes
  through without one.
- After any other stop, and while a person holds the body: only when a person releases it.
"""

from miburi.safety.stop import Stop

__all__ = ["FIRST_PAUSE", "LONGEST_PAUSE", "Recovery"]

#: Seconds from a contact stop to the release: the first pause, and the longest (ours).
FIRST_PAUSE, LONGEST_PAUSE = 1.0, 16.0


class Recovery:
    """Remember the present stop and count the encounters before it; times in s."""

    def __init__(self) -> None:
        #: Whether a person has stopped the body.
        self.held = False
        self._encounters = 0
        self._release_at: float | None = None
        self._stop: Stop | None = None

    def notice(self, stop: Stop) -> bool:
        """Remember a stop; return whether it is a new one."""
        new, self._stop = stop != self._stop, stop
        return new

    def after_contact(self, time: float) -> None:
        """Plan to release the body after a pause."""
        pause = min(FIRST_PAUSE * 2**self._encounters, LONGEST_PAUSE)
        self._release_at = time + pause
        self._encounters += 1

    def wait_for_a_person(self) -> None:
        """Plan no release: somebody asked for the stop, or something failed."""
        self._release_at = None

    def is_due(self, time: float) -> bool:
        """Whether to release the body now."""
        return self._release_at is not None and time >= self._release_at and not self.held

    def retry(self, time: float) -> None:
        """Plan another release, because the body was not ready."""
        self._release_at = time + FIRST_PAUSE

    def forget_release(self) -> None:
        """Plan no release any more, because the body has been released."""
        self._release_at, self.held = None, False

    def forget_stop(self) -> None:
        """Forget the stop, because it is over."""
        self._stop = None

    def forget_encounters(self) -> None:
        """Forget the encounters, because a gesture has gone through."""
        self._encounters = 0
