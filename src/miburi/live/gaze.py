"""Where the face is that the eyes see: in go places in pictures, out comes where to turn to.

A page says where in its pictures a face is; the picture stays there. On a real robot the camera
rides on the head, so a place counts from where the waist is turned. A simulated robot has nobody's
camera on its head: there it counts from straight ahead.
"""

from math import atan, radians, tan

from miburi.bodies import BodyState
from miburi.robot import JOINTS

__all__ = ["FORGOTTEN", "Gaze"]

#: s after which a face that nobody tells of any more has gone (ours); pages tell every 2 s.
FORGOTTEN = 5.0
#: Half of what a phone's camera sees across, rad (a common one; ours).
_HALF = radians(32)


class Gaze:
    """Keeps where the latest face is.

    Parameters
    ----------
    rides
        Whether the camera rides on the head.
    """

    def __init__(self, *, rides: bool) -> None:
        self._rides = rides
        self._seen: tuple[float, float] | None = None  # rad to the left, and when

    def see(self, x: float | None, body: BodyState) -> None:
        """Take in where a face is.

        Parameters
        ----------
        x
            Its middle, of the picture's width from the left, 0 to 1; None: nobody is there.
        body
            Now: its time, and how far its waist is turned.
        """
        # The camera is not mirrored: its left is the partner's left.
        self._seen = None
        if x is not None:
            bearing = atan((1 - 2 * x) * tan(_HALF))
            waist = float(body.angles[JOINTS.index("waist")])
            self._seen = (bearing + waist if self._rides else bearing, body.time)

    def turn(self, time: float) -> float:
        """Return where somebody is, rad to the left of straight ahead; 0 if nobody is there."""
        if self._seen is None or time > self._seen[1] + FORGOTTEN:
            return 0.0
        return self._seen[0]
