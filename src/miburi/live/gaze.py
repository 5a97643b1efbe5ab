"""Convert the position of a face in a camera's pictures into a direction for the robot.

A page reports the position; the pictures stay on the page. On a real robot the phone's camera turns
with the waist, so the face's bearing is relative to the waist. A simulated robot has no camera on
its body, so the bearing is relative to straight ahead.
"""

from math import atan, radians, tan

from miburi.bodies import BodyState
from miburi.robot import JOINTS

#: A face counts as gone after this time without reports, in s (our choice). Pages report every 2 s.
FORGOTTEN = 5.0
#: Half the horizontal field of view of a common phone camera, rad (our choice).
_HALF = radians(32)


class Gaze:
    """Keeps the direction of the latest face; ``rides`` if the camera turns with the body."""

    def __init__(self, *, rides: bool) -> None:
        self._rides = rides
        self._seen: tuple[float, float] | None = None  # bearing (rad to the left), time (s)

    def see(self, x: float | None, body: BodyState) -> None:
        """Note a face at ``x`` and the state of the body at that moment.

        ``x`` is the face's centre, from 0 at the picture's left to 1 at its right; None means that
        there is no face.
        """
        # The camera is not mirrored: its left is the partner's left.
        self._seen = None
        if x is not None:
            bearing = atan((1 - 2 * x) * tan(_HALF))
            waist = float(body.angles[JOINTS.index("waist")])
            self._seen = (bearing + waist if self._rides else bearing, body.time)

    def turn(self, time: float) -> float:
        """Return how far left of straight ahead the face is, in rad; 0 if there is no face."""
        if self._seen is None or time > self._seen[1] + FORGOTTEN:
            return 0.0
        return self._seen[0]
