"""Decide when a stopped body may go back to neutral.

A :class:`Recovery` takes stops and gestures, and answers whether the body is to be released.

- The body is never released before it has come to rest. Otherwise the contact rule would mistake
  the end of the old motion, and the swinging of the motors' loads, for a new contact.
- After a contact, or a stop because the loop was late, the body is released automatically after a
  pause. The pause doubles with each encounter until a gesture is completed without one.
- After a hand has moved it, the body is released automatically once it has been still for a while.
- After any other stop, and while a person holds the body, only a person can release it.
"""

from dataclasses import replace

import numpy as np

from miburi.bodies import BodyState
from miburi.errors import BodyError
from miburi.robot import Array
from miburi.safety.stop import Stop, StopReason

#: The first and the longest pause between a contact stop and the release, in s (our choice).
FIRST_PAUSE, LONGEST_PAUSE = 1.0, 16.0
#: A body is at rest once no motor has been faster than this speed (rad/s) for this time (s); our
#: choice. The speed is two encoder steps in the window over which velocities are measured. The time
#: is longer than the delay after which a stopped motor yields.
REST_SPEED, REST_TIME = 0.1, 0.25
#: A body that a hand leads slowly counts as moving whenever a motor is further than this, in rad,
#: from where it was when the body last counted as moving (our choice). This is more than one
#: encoder step.
_MOVED_ON = 0.004
#: A hand that moved the body has let go once the body has been still for this time, in s (our
#: choice).
LET_GO = 2.0


class UnsettledError(BodyError):
    """The stopped body has not come to rest yet; it can be released a moment later."""


class Recovery:
    """Remembers the present stop and counts the encounters before it; times are in s."""

    def __init__(self) -> None:
        #: Whether a person has stopped the body.
        self.held = False
        #: Whether the partner itself has stopped the body, and has not yet processed the stop.
        self.halted = False
        self._encounters = 0
        self._release_at: float | None = None
        self._inherits = False  # whether the next stop is the rest of another body's pause
        self._pause_ends = self._moved_at = self._seen_at = 0.0
        self._silent = False
        self._stillness = REST_TIME
        self._place: Array | None = None  # where it was when it last moved
        self._stop: Stop | None = None

    def notice(self, stop: Stop) -> bool:
        """Remember a stop; return whether it is a new one."""
        new, self._stop = stop != self._stop, stop
        if new:
            self._moved_at = stop.time
        return new

    def take_in(self, stop: Stop, time: float) -> Stop:
        """Plan the release after a new stop, and return the stop.

        If the partner stopped the body because the loop was late, the stop gets that reason.
        """
        late = self.halted and stop.reason is StopReason.ASKED
        self.halted = False
        inherits, self._inherits = self._inherits and stop.reason is StopReason.ASKED, False
        if late or stop.reason is StopReason.CONTACT:
            pause = min(FIRST_PAUSE * 2**self._encounters, LONGEST_PAUSE)
            self._release_at = self._pause_ends = time + pause
            self._stillness = REST_TIME
            self._encounters += 1
        elif stop.reason is StopReason.TOUCHED:  # until the hand that moves it has let go
            self._release_at, self._stillness = time, LET_GO
            self._moved_at, self._place = time, None
        else:  # somebody asked for it, or something failed: only a person ends it
            self._release_at = self._pause_ends if inherits else None
            self._stillness = REST_TIME
        return replace(stop, reason=StopReason.LOOP_LATE) if late else stop

    def look(self, state: BodyState) -> None:
        """See whether the stopped body moves."""
        self._silent, self._seen_at = state.time == self._seen_at, state.time
        if self._place is None:
            self._place = state.angles
        led_on = np.abs(state.angles - self._place).max() > _MOVED_ON
        if np.abs(state.velocities).max() > REST_SPEED or (led_on and self._stillness == LET_GO):
            self._moved_at, self._place = state.time, state.angles

    def check(self, state: BodyState, *, by_person: bool) -> None:
        """Refuse a release that comes too early.

        Raises
        ------
        UnsettledError
            The body has not come to rest.
        BodyError
            The pause after a contact is not over; a person may cut it short.
        """
        left = self._pause_ends - state.time
        if left > 0 and not by_person:
            raise BodyError(f"the body pauses after a stop; it can be released in {left:.1f} s.")
        if self._silent:
            return  # a lost card's clock stands still: let the card itself refuse
        stillness = REST_TIME if by_person else self._stillness
        if state.stop != self._stop or not self._is_still(state.time, stillness):
            raise UnsettledError(
                "the stopped body has not come to rest yet; release it in a moment."
            )

    def _is_still(self, time: float, seconds: float) -> bool:
        return time - self._moved_at >= seconds - 1e-9

    def succeed(self, other: "Recovery", then: float, now: float) -> bool:
        """Take over the stop, the pause and the encounters of another body.

        ``then`` is the present moment on the other body's clock, ``now`` on this one's. Returns
        whether this body must be stopped because the other was not free to move.
        """
        left = max(0.0, other._pause_ends - then)
        self._pause_ends, self._encounters = now + left, other._encounters
        self.held, self._inherits = other.held, left > 0
        return self.held or self._inherits

    def is_due(self, time: float) -> bool:
        """Whether to release the body now."""
        planned = self._release_at is not None and time >= self._release_at
        return planned and not self.held and self._is_still(time, self._stillness)

    def retry(self, time: float) -> None:
        """Plan another release, because the body was not ready."""
        self._release_at = time + FIRST_PAUSE

    def forget_release(self) -> None:
        """Cancel the planned release, because the body has been released."""
        self._release_at, self._pause_ends, self.held = None, 0.0, False

    def forget_stop(self) -> None:
        """Forget the stop, because it is over."""
        self._stop = None

    def forget_encounters(self) -> None:
        """Reset the count of encounters, because a gesture was completed."""
        self._encounters = 0
