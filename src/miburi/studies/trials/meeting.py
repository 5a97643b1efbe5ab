"""Plan where and when a person meets the moving robot, and move the person's hand."""

from dataclasses import dataclass

import numpy as np

from miburi.robot import Array, Robot
from miburi.robot.mjcf import HAND_SIZE
from miburi.robot.shape import extremities, links
from miburi.safety.move import Move
from miburi.safety.profile import FINE, SECOND, plan_profile, to_steps
from miburi.safety.stop import Phase
from miburi.studies.trials.conditions import HandKind, Person
from miburi.studies.trials.plant import TrialPlant

#: A person is in the way only if the link still has this far to go, in m (our choice).
LEAST_REST = 0.015
#: How far, in m, before the meeting point a hand that moves towards the robot starts, and how far
#: it goes beyond that point at most.
_APPROACH = 0.10
_BEYOND = 0.05


@dataclass(frozen=True)
class Meeting:
    """Where and when the hand meets a link."""

    body: str  #: the model's body …
    local: Array  #: … and the meeting point in its frame, (3,) m
    time: float  #: s since the move began
    place: Array  #: (3,) m, the middle of the hand
    out: Array  #: (3,), the direction in which the hand lies from the link
    along: Array  #: (3,), the direction of its fingers
    speed: float  #: m/s, the commanded speed of the meeting point


def plan(plant: TrialPlant, person: Person, start: Array, move: Move) -> Meeting | None:
    """Return where ``person`` meets the link on its way; None if the link hardly moves.

    It assumes a path that is straight in the joint angles, and a robot without sag or lag.
    """
    robot = plant.robot
    body, local, axis, depth = _spot(robot, person)
    fractions = np.linspace(0.0, 1.0, 17)
    points, axes = plant.path(body, local, axis, start + fractions[:, None] * (move.angles - start))
    pieces = np.linalg.norm(np.diff(points, axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(pieces)])
    if way[-1] * (1 - person.part) < LEAST_REST:
        return None
    row = int(np.clip(np.searchsorted(way, person.part * way[-1]), 1, len(way) - 1))
    if pieces[row - 1] == 0.0:
        return None
    motion = (points[row] - points[row - 1]) / pieces[row - 1]
    across = _across(motion, person.roll)
    out = np.cos(person.tilt) * motion + np.sin(person.tilt) * across
    along = np.cross(out, axes[row])
    if np.linalg.norm(along) < 0.3:
        along = np.cross(out, across)
    along /= np.linalg.norm(along)
    # The rest of the hand lies on the side away from the robot's middle.
    outwards = along if along[:2] @ points[row, :2] >= 0 else -along
    place = points[row] + (HAND_SIZE[0] + depth) * out + (HAND_SIZE[1] - person.reach) * outwards
    time, rate = _when(robot, start, move, float(fractions[row]))
    speed = rate * float(pieces[row - 1]) / float(fractions[row] - fractions[row - 1])
    return Meeting(body, local, time, place, out, along, speed)


def _across(direction: Array, roll: float) -> Array:
    """Return a unit vector normal to a unit ``direction``, turned by ``roll`` rad."""
    first = np.cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
    first /= np.linalg.norm(first)
    across: Array = np.cos(roll) * first + np.sin(roll) * np.cross(direction, first)
    return across


def _spot(robot: Robot, person: Person) -> tuple[str, Array, Array, float]:
    """Return the link's body, meeting point and axis in the body's frame, and half its depth."""
    shape, tips = robot.shape, extremities(robot)
    if person.link == "head":
        tilt = shape.phone_level
        up = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
        side = np.copysign(0.4 * shape.phone_width, np.cos(person.roll))
        high = (person.spot - 0.5) * 0.9 * shape.phone_height
        link, centre = tips["head"]
        return link, centre + np.array([0.0, side, 0.0]) + high * up, up, shape.phone_thickness / 2
    side_name, _, segment = person.link.partition("_")
    forearm, hand = tips[side_name]
    axis = np.array([0.0, -1.0 if side_name == "right" else 1.0, 0.0])
    if segment == "upper_arm":
        parent, elbow = next((x.parent, x.position) for x in links(robot) if x.name == forearm)
        return parent, person.spot * np.array(elbow), axis, shape.arm_radius
    if segment == "forearm":
        return forearm, 0.8 * person.spot * np.array(hand), axis, shape.arm_radius
    return forearm, np.array(hand), axis, shape.hand_radius


def _when(robot: Robot, start: Array, move: Move, fraction: float) -> tuple[float, float]:
    """Return when, in s, a fraction of the move is done, and the move's rate then, in 1/s."""
    origin, goal = to_steps(robot, start), to_steps(robot, move.angles)
    profile, _ = plan_profile(robot, origin, goal, to_steps(robot, move.speeds))
    motor = int(np.argmax(profile.distance))
    every = SECOND // 500
    times = np.arange(0, int(profile.total[motor]) + 2 * every, every)
    travel = profile.position(times[:, None])[:, motor] / (profile.distance[motor] * FINE)
    row = int(np.clip(np.searchsorted(travel, fraction), 1, len(times) - 1))
    return times[row] / SECOND, float(travel[row] - travel[row - 1]) * SECOND / every


class Actor:
    """Moves the person's hand, once at each reading."""

    def __init__(self, plant: TrialPlant, person: Person, meeting: Meeting) -> None:
        self._plant, self._person, self._meeting = plant, person, meeting
        if person.kind is not HandKind.GRASPING:
            plant.offer_hand(self._place(0.0), meeting.along, np.zeros(3), person.skin)

    def act(self, phase: Phase) -> None:
        """Move the hand at this reading; ``phase`` tells the person if the robot has stopped."""
        plant, person, meeting = self._plant, self._person, self._meeting
        if phase is Phase.STOPPED:
            # After a stop, a person stops pushing; a wall stays in place.
            if person.kind is not HandKind.RIGID:
                plant.anchor = plant.hand[:3]
        elif plant.touched_at is None:
            if person.kind is HandKind.TOWARDS:
                plant.anchor = self._place(plant.time)
            elif person.kind is HandKind.GRASPING and plant.time >= meeting.time:
                plant.grasp(meeting.body, meeting.local, person.skin)

    def _place(self, time: float) -> Array:
        """Return where the person wants the hand to be, shape (3,), in m."""
        meeting, ahead = self._meeting, 0.0
        if self._person.kind is HandKind.TOWARDS:
            ahead = self._person.speed * (meeting.time - time)
        place: Array = meeting.place + np.clip(ahead, -_BEYOND, _APPROACH) * meeting.out
        return place


def carriers(part: str) -> tuple[str, ...]:
    """Return the motors that carry a part or link of the robot, from the waist outwards."""
    side, _, segment = part.partition("_")
    if side in ("right", "left"):
        motors = ("shoulder", "elbow", "fingertip")
        count = {"ball": 1, "upper": 2, "upper_arm": 2}.get(segment, 3)
        return ("waist", *(f"{side}_{motor}" for motor in motors[:count]))
    if side in ("phone", "nod", "head"):
        return ("waist", "head")
    return ("waist",) if side in ("trunk", "yoke", "neck") else ()
