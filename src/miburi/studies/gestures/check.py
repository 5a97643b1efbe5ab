"""Check that a gesture meets its requirements at every mood, on the simulated body.

The paper requires that a greater mood makes the movement larger and faster (Section 4). For safety,
parts of the robot must not collide, and the contact rule must not stop a free gesture.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass

import numpy as np

from miburi.bma.settings import Settings
from miburi.bodies.rehearsal import PERIOD, rehearse
from miburi.gestures import MovementFunction, key_poses, misfits
from miburi.robot import Robot, forward
from miburi.studies.gestures.measures import Measures, measure

#: The largest allowed error of the inverse kinematics in a key pose, m.
MOST_ERROR = 1e-3


@dataclass(frozen=True)
class Measured:
    """The measurements of a gesture at one mood, on the simulated body.

    ``ik_error`` is the largest position error of all key poses and extremities, in m.
    ``self_collisions`` counts the records (one every 0.02 s) in which two parts of the robot
    collide; ``met`` names the first pair. ``contact_stops`` is 0 or 1; ``stopped_by`` names the
    motor.
    """

    feeling: str
    mood: float
    measures: Measures
    ik_error: float
    self_collisions: int
    contact_stops: int
    met: str | None = None
    stopped_by: str | None = None

    def as_json(self) -> dict[str, float | int | str]:
        """Return the output of ``miburi gesture measures --json``."""
        return {
            "feeling": self.feeling,
            "mood": self.mood,
            **{name: round(value, 9) for name, value in asdict(self.measures).items()},
            "ik_error_m": round(self.ik_error, 9),
            "self_collisions": self.self_collisions,
            "contact_stops": self.contact_stops,
        }


def moods(step: float) -> list[float]:
    """Return the moods 0, ``step``, … 1."""
    count = round(1 / step)
    return [round(index / count, 6) for index in range(count + 1)]


def perform(
    robot: Robot, function: MovementFunction, mood: float, settings: Settings | None = None
) -> Measured:
    """Perform a gesture at one mood on the simulated body, and measure it."""
    rehearsal = rehearse(robot, key_poses(robot, function, mood), settings)
    stop = rehearsal.stop
    return Measured(
        feeling=function.feeling,
        mood=mood,
        measures=measure(rehearsal.positions, PERIOD),
        ik_error=rehearsal.ik_error,
        self_collisions=rehearsal.self_collisions,
        contact_stops=int(stop is not None),
        met=" and ".join(rehearsal.met) if rehearsal.met else None,
        stopped_by=f"{stop.motor} ({stop.sign}) at {stop.time:.2f} s" if stop else None,
    )


def check(
    robot: Robot, function: MovementFunction, *, step: float, settings: Settings | None = None
) -> Iterator[str]:
    """Yield each fault of a gesture in words.

    Every pose must be in reach and inside the limits. Mood 0 must be exactly neutral. At every mood
    the kinematics must be within 1 mm, no parts may collide, and the contact rule may not stop the
    body. The rules about collisions and contact stops also apply to a partner with ``life``, which
    does not pause at the key poses of a gesture with free flow. Space and speed must strictly rise
    with the mood.
    """
    yield from misfits(robot, function)
    rest = forward(robot, robot.neutral)
    if any(not np.array_equal(pose.target, rest) for pose in key_poses(robot, function, 0.0)):
        yield "at mood 0 it is not exactly neutral"
    before: Measured | None = None
    for mood in moods(step):
        now = perform(robot, function, mood, settings)
        if now.ik_error > MOST_ERROR:
            yield f"at mood {mood} a key pose is missed by {1e3 * now.ik_error:.2f} mm"
        if now.met:
            yield f"at mood {mood} the robot's {now.met} meet"
        if now.stopped_by:
            yield f"at mood {mood} the contact rule stops it: {now.stopped_by}"
        if function.effort.free:
            flowing = rehearse(robot, key_poses(robot, function, mood), settings, flows=True)
            if flowing.met and not now.met:
                yield (
                    f"at mood {mood}, without pauses, the robot's {' and '.join(flowing.met)} meet"
                )
            if flowing.stop and not now.stopped_by:
                yield f"at mood {mood}, without pauses, the contact rule stops {flowing.stop.motor}"
        if before is not None and not now.contact_stops:
            if now.measures.volume <= before.measures.volume:
                yield f"from mood {before.mood} to {mood} it does not use more space"
            if now.measures.mean_speed <= before.measures.mean_speed:
                yield f"from mood {before.mood} to {mood} it does not become faster"
        before = now
