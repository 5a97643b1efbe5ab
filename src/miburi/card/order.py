"""The loads that are sent with each move, and the move that is under way.

This module takes the robot's description and the move. For each motor, it gives the position error
that the load causes at the start and the end of the move, and how much duty the motor may use. The
card refuses a duty that cannot hold the load. The firmware's ``controller.h`` is the other side.
"""

import struct
from typing import NamedTuple

import numpy as np

from miburi.card.settings import FULL_PWM, CardSettings
from miburi.card.units import next_speed, real_acceleration, real_speed
from miburi.robot import JOINTS, Array, Robot
from miburi.safety.contact import Loading
from miburi.safety.controller import return_speed
from miburi.safety.drive import aim, demand
from miburi.safety.free import granted_share
from miburi.safety.move import Move
from miburi.safety.profile import FINE, Motion, Profile, Steps, plan_towards, to_steps, whole

#: The unit in which errors are sent to the card, in 1/256 steps, and the largest number of units.
_QUARTER, _MOST = FINE // 4, 127
_LOAD = struct.Struct("<bbHH")


class Order(NamedTuple):
    """A move as it is sent to the card; all fields are (8,).

    Attributes
    ----------
    goals, speeds
        The goals in steps, and the speeds in steps/s.
    begin, end
        The errors that the loads cause, in quarters of a step of the joint's angle.
    pwm, cruise
        The limit of the duty, out of ``FULL_PWM``, and its limit once the motors have sped up.
    """

    goals: Steps
    speeds: Steps
    begin: Steps
    end: Steps
    pwm: Steps
    cruise: Steps

    @classmethod
    def of(
        cls,
        robot: Robot,
        settings: CardSettings,
        positions: Steps,
        origin: Steps,
        move: Move,
        velocity: Steps | None = None,
    ) -> "Order":
        """Return the order for motors at ``positions`` with profiles from ``origin``, in steps.

        ``velocity`` is the velocity on the profiles, (8,) 1/256 steps/s; None if the motors stand
        still.
        """
        robot = settings.identified(robot)
        lower, upper = to_steps(robot, robot.lower), to_steps(robot, robot.upper)
        goals = np.clip(to_steps(robot, aim(robot, move.angles)), lower, upper)
        # A slow motor whose speed was rounded down would arrive long after the others.
        asked = to_steps(robot, move.speeds).tolist()
        speeds = np.minimum([next_speed(speed) for speed in asked], settings.general.max_speed)
        return cls._loaded(robot, settings, positions, origin, goals, speeds, velocity)

    @classmethod
    def home(cls, robot: Robot, settings: CardSettings, positions: Steps, *, led: bool) -> "Order":
        """Return the order for the slow return to neutral, with the speeds that the card chooses.

        ``led`` says whether a hand led the body to where it is now.
        """
        robot = settings.identified(robot)
        neutral = np.array([joint.neutral for joint in settings.joints])
        way = np.abs(neutral - positions)
        fastest = return_speed(settings.general.return_speed, led=led)
        speeds = way * fastest // max(int(way.max()), 1)
        return cls._loaded(robot, settings, positions, positions, neutral, speeds)

    @classmethod
    def _loaded(
        cls,
        robot: Robot,
        settings: CardSettings,
        positions: Steps,
        origin: Steps,
        goals: Steps,
        speeds: Steps,
        velocity: Steps | None = None,
    ) -> "Order":
        unknown = np.zeros_like(goals)
        order = cls(goals, speeds, unknown, unknown, unknown, unknown)
        profile, direction = order.profile(settings, origin, velocity)
        needs = demand(robot, positions, origin, profile, direction)

        def duty(torque: Array) -> Steps:
            share = torque / robot.servo.model.motor_torque
            return np.clip(np.ceil(share * FULL_PWM), 1, FULL_PWM).astype(np.int64)

        def quarters(error: Steps, duty: Steps) -> Steps:
            most = np.minimum(duty * settings.general.error_per_pwm // 256 // _QUARTER, _MOST)
            rounded = (error * direction + _QUARTER // 2) // _QUARTER
            clipped: Steps = np.clip(rounded, -most, most)
            return clipped

        pwm, cruise = duty(needs.ceiling), duty(needs.cruise)
        begin, end = quarters(needs.loading.begin, pwm), quarters(needs.loading.end, cruise)
        return cls(goals, speeds, begin, end, pwm, cruise)

    def profile(
        self,
        settings: CardSettings,
        origin: Steps,
        velocity: Steps | None = None,
        before: Steps | int = 1,
    ) -> tuple[Profile, Steps]:
        """Return the motion that the servos perform for an order, and each motor's direction."""
        return plan_towards(
            origin,
            self.goals,
            np.array([real_speed(speed) for speed in self.speeds.tolist()]),
            np.full(len(JOINTS), real_acceleration(settings.general.acceleration)),
            velocity,
            before,
        )

    def loading(
        self, settings: CardSettings, positions: Steps, origin: Steps, direction: Steps
    ) -> Loading:
        """Return the loads that the card's rule expects on the motors."""
        return Loading(
            offset=(origin - positions) * direction * FINE,
            begin=self.begin * _QUARTER * direction,
            end=self.end * _QUARTER * direction,
            most=self.pwm * settings.general.error_per_pwm >> 8,
        )

    def pack(self) -> bytes:
        """Return the payload of a move."""
        return struct.pack("<8h8H", *self.goals, *self.speeds)

    def pack_loads(self) -> bytes:
        """Return the payload of the loads, which are sent before a move or a release."""
        return b"".join(map(_LOAD.pack, self.begin, self.end, self.pwm, self.cruise))

    @classmethod
    def unpack(cls, move: bytes, loads: bytes) -> "Order":
        """Read the payloads of a move and of its loads."""
        motion = np.array(struct.unpack("<8h8H", move), dtype=np.int64)
        of_motor = np.array(list(_LOAD.iter_unpack(loads)), dtype=np.int64).T
        return cls(*motion.reshape(2, len(JOINTS)), *of_motor)


class Underway(NamedTuple):
    """An order that the card carries out.

    Attributes
    ----------
    order
        The move, or the way home.
    began
        When it started, in µs on the card's clock; 0 until the card has accepted it.
    share
        The share of its guards that each motor is granted, (8,) 1/256; see
        :func:`miburi.safety.free.granted_share`.
    motion
        The motion that the servos carry out for it.
    """

    order: Order
    began: int
    share: Steps
    motion: Motion

    @classmethod
    def of(cls, order: Order, settings: CardSettings, place: Steps, velocity: Steps) -> "Underway":
        """Return an order that starts at the profiles' present positions and speeds.

        ``place`` is in 1/256 steps, ``velocity`` in 1/256 steps/s.
        """
        profile, direction = order.profile(settings, whole(place), velocity)
        motion = Motion(profile, direction, whole(place))
        return cls(order, 0, granted_share(profile), motion)
