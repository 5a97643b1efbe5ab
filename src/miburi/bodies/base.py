"""The interface of every body, whether physics simulates it or an Arduino card drives its motors.

A body takes moves, stops and releases, and returns states. A simulated body also offers what is in
:class:`Touchable`.
"""

from dataclasses import dataclass
from typing import Protocol

from miburi.robot import Array, Robot
from miburi.safety.contact import Rule, Window
from miburi.safety.move import Course, Move
from miburi.safety.stop import Phase, Stop


@dataclass(frozen=True)
class BodyState:
    """The state of a body, as its motors measure it.

    Attributes
    ----------
    time
        The time in s on the body's clock.
    angles, velocities
        Angles, (8,) in rad, and velocities, (8,) in rad/s, as the encoders measure them. Because
        encoders count in steps, velocities are means over the last 50 or 60 ms; so they lag the
        angles by half of this time.
    phase
        Idle, moving, stopped or returning.
    stop
        The stop in force, or None.
    """

    time: float
    angles: Array
    velocities: Array
    phase: Phase
    stop: Stop | None


@dataclass(frozen=True)
class Motor:
    """The condition of one motor; None where the body cannot know it.

    Attributes
    ----------
    servo
        The id of its servo on the bus.
    answers
        Whether it answered the latest request for a reading.
    temperature, voltage
        The temperature in °C and the voltage in V, both measured at the servo.
    """

    servo: int | None = None
    answers: bool | None = None
    temperature: float | None = None
    voltage: float | None = None


@dataclass(frozen=True)
class Motors:
    """The condition of the motors, and the rule that watches them.

    Attributes
    ----------
    each
        The eight motors, in the order of ``JOINTS``.
    rule
        The contact rule in force, with its guards.
    settings
        The checksum of the card's settings, as four hexadecimal digits; None if there is no card.
    hottest, lowest
        The card stops the body above this temperature (°C), and below this voltage (V); None if
        there is no card.
    """

    each: tuple[Motor, ...]
    rule: Rule
    settings: str | None = None
    hottest: float | None = None
    lowest: float | None = None


@dataclass(frozen=True)
class Touch:
    """What touched the body during the latest step; only a simulation knows it.

    Attributes
    ----------
    force
        The largest force between the human hand and the robot, in N.
    began
        When the first contact in this step began, in s on the body's clock; None if there was none.
    part
        The part of the robot that was touched last; None if none was.
    itself
        Two parts of the robot that touched each other, or None.
    """

    force: float = 0.0
    began: float | None = None
    part: str | None = None
    itself: tuple[str, str] | None = None

    def then(self, later: "Touch") -> "Touch":
        """Return this touch and the touch of a later step as one."""
        return Touch(
            max(self.force, later.force),
            later.began if self.began is None else self.began,
            later.part or self.part,
            self.itself or later.itself,
        )


class Touchable(Protocol):
    """What only a simulated body offers: a human hand to put in its way, and its true pose."""

    @property
    def touch(self) -> Touch:
        """What touched the body during the latest step."""

    @property
    def configuration(self) -> tuple[Array, Array]:
        """True joint angles, (8,) rad, and the hand's pose, (7,): position in m, and quaternion."""

    def place_hand(self, position: Array, along: Array) -> None:
        """Put the human hand somewhere. Move the hand in small steps, or through free space.

        ``position`` is the middle of the hand, (3,) m; ``along`` is the direction of the fingers,
        (3,), of any length except zero.

        Raises
        ------
        InputError
            A value is not finite, or ``along`` has no length.
        """

    def remove_hand(self) -> None:
        """Take the human hand away."""


class Body(Protocol):
    """The partner's body, physical or simulated.

    The contact rule is part of the body; nothing in this interface can switch it off.
    """

    @property
    def robot(self) -> Robot:
        """The robot's description."""

    @property
    def state(self) -> BodyState:
        """The latest state; a body at rest is idle."""

    @property
    def window(self) -> Window | None:
        """The figures that the contact rule compared at its latest reading; None if unknown.

        A card reports them only for the present contact, and only for the motor that met something.
        """

    @property
    def touchable(self) -> Touchable | None:
        """The human hand, and how it touches the body; None for a body that is not simulated."""

    def motors(self) -> Motors:
        """Return the condition of the motors; a card updates it twice a second."""

    def move(self, move: Move) -> None:
        """Start a move to final positions, from rest or from within another move.

        Raises
        ------
        BodyError
            The body is stopped or returning, or the move goes outside the limits.
        """

    def course(self) -> Course:
        """Return where the motors' profiles are now, which is where a new move would start."""

    def stop(self) -> None:
        """Stop all motors and hold softly until released."""

    def halt(self) -> None:
        """Stop motors that would keep moving even when no more steps are taken.

        Any thread may call this method while another uses the body; it does not wait for an answer.
        """

    def release(self) -> None:
        """End a stop: go back to neutral, slowly; the contact rule stays on.

        Raises
        ------
        BodyError
            The body is not stopped.
        """

    def step(self, dt: float) -> BodyState:
        """Advance by ``dt`` seconds and return the resulting state."""

    def close(self) -> None:
        """Stop, and free the body's resources; it cannot be moved any more."""
