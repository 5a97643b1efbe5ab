"""What every body takes and tells, whatever moves it: physics, or motors on a card."""

from dataclasses import dataclass
from typing import Protocol

from miburi.robot import Array, Robot
from miburi.safety.contact import Rule, Window
from miburi.safety.move import Move
from miburi.safety.stop import Phase, Stop

__all__ = ["Body", "BodyState", "Motor", "Motors", "Touch", "Touchable"]


@dataclass(frozen=True)
class BodyState:
    """What the motors say.

    Attributes
    ----------
    time
        s, on the body's clock.
    angles, velocities
        (8,) rad and rad/s, as the encoders measure them.
    phase
        Idle, moving, stopped or returning.
    stop
        The stop that holds now, or None.
    """

    time: float
    angles: Array
    velocities: Array
    phase: Phase
    stop: Stop | None


@dataclass(frozen=True)
class Motor:
    """How one motor is; None is what the body cannot know.

    Attributes
    ----------
    servo
        Its servo's id on the bus.
    answers
        Whether it answered the latest reading.
    temperature, voltage
        °C, and V at the servo.
    """

    servo: int | None = None
    answers: bool | None = None
    temperature: float | None = None
    voltage: float | None = None


@dataclass(frozen=True)
class Motors:
    """How the motors are, and the rule that watches them.

    Attributes
    ----------
    each
        The eight, in the order of ``JOINTS``.
    rule
        The contact rule that runs, with its guards.
    settings
        The check sum of what a card knows of the body, four hexadecimal digits; None without one.
    hottest, lowest
        °C at which, and V below which, a card stops the body; None without one.
    """

    each: tuple[Motor, ...]
    rule: Rule
    settings: str | None = None
    hottest: float | None = None
    lowest: float | None = None


@dataclass(frozen=True)
class Touch:
    """What happened to the body during the latest step; known to a simulation alone.

    Attributes
    ----------
    force
        Largest force between human hand and robot, N.
    began
        First moment of that contact in the step, s; None without one.
    part
        The robot's part that was touched last; None without a contact.
    itself
        Two parts of the robot that met, or None.
    """

    force: float = 0.0
    began: float | None = None
    part: str | None = None
    itself: tuple[str, str] | None = None

    def then(self, later: "Touch") -> "Touch":
        """Return this and a later step's touch as one."""
        return Touch(
            max(self.force, later.force),
            later.began if self.began is None else self.began,
            later.part or self.part,
            self.itself or later.itself,
        )


class Touchable(Protocol):
    """What only a simulated body has: a human hand to put in its way, and the truth about it."""

    @property
    def touch(self) -> Touch:
        """What happened to the body during the latest step."""

    @property
    def configuration(self) -> tuple[Array, Array]:
        """True joint angles (8,) rad, and the human hand's pose (7,): m and quaternion."""

    def place_hand(self, position: Array, along: Array) -> None:
        """Put the human hand somewhere; move it there in small steps or through free space.

        Parameters
        ----------
        position
            (3,) m, its middle.
        along
            (3,), the direction of the fingers; any length but zero.

        Raises
        ------
        InputError
            A value is not finite, or ``along`` has no length.
        """

    def remove_hand(self) -> None:
        """Take the human hand away."""


class Body(Protocol):
    """The one interface that the partner moves.

    The contact rule is part of the body and cannot be switched off through it.
    """

    @property
    def robot(self) -> Robot:
        """The description that the body was built from."""

    @property
    def state(self) -> BodyState:
        """The latest state; a body at rest is idle."""

    @property
    def window(self) -> Window | None:
        """What the contact rule compared at its latest look; None where the body does not know.

        A card tells it of the contact that holds now, and judges in it the motor that met
        something alone.
        """

    @property
    def touchable(self) -> Touchable | None:
        """The human hand, and what it does to the body; None for a body that is no simulation."""

    def motors(self) -> Motors:
        """Return how the motors are; the card asks its servos for it twice a second."""

    def move(self, move: Move) -> None:
        """Start a move to final positions; only an idle body takes one.

        Raises
        ------
        BodyError
            The body is not idle, or the move leaves the limits.
        """

    def stop(self) -> None:
        """Stop all motors and hold softly until released."""

    def release(self) -> None:
        """End a stop: go back to neutral, slowly; the contact rule stays on.

        Raises
        ------
        BodyError
            The body is not stopped.
        """

    def step(self, dt: float) -> BodyState:
        """Let ``dt`` seconds pass and return the state after them."""

    def close(self) -> None:
        """Stop, and let go of what the body holds; it cannot be moved any more."""
