"""A servo's units: steps of its encoder, and its units of speed and acceleration."""

from miburi.errors import BodyError
from miburi.robot import Robot

#: Encoder steps in a turn of the XL330 servos that a card drives; as in ``settings.h``.
STEPS_PER_TURN = 4096


def check_encoder(robot: Robot) -> None:
    """Refuse a robot whose encoder steps are not those of the servos that a card drives.

    Raises
    ------
    BodyError
        The encoders differ, so that the card would misread every angle and guard.
    """
    steps = robot.servo.model.encoder.steps_per_turn
    if steps != STEPS_PER_TURN:
        raise BodyError(
            f"the {robot.name}'s encoders count {steps} steps a turn; a card drives servos that "
            f"count {STEPS_PER_TURN} (XL330). If the robot has XL330 servos, name them in its "
            "description; otherwise use it in simulation."
        )


def real_speed(speed: int) -> int:
    """Return a speed as an XL330 rounds it, in units of 1/256 step/s; ``speed`` is in steps/s.

    The servo counts in units of 0.229 turns/min.
    """
    return (max((speed * 1000 + 7816) // 15_633, 1) * 400_207 + 50) // 100


def next_speed(speed: int) -> int:
    """Round ``speed``, in steps/s, up to the next speed that an XL330 supports."""
    return (-(-speed * 1000 // 15_633) * 15_633 + 500) // 1000


def real_acceleration(acceleration: int) -> int:
    """Round an acceleration (steps/s²) to what an XL330 can do: units of 214.577 turns/min²."""
    return (max((acceleration * 1000 + 122_070) // 244_141, 1) * 244_141 + 500) // 1000
