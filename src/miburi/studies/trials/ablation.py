"""Switch off a part of the contact stop, or test it with servos in another state."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from miburi.robot import Robot
from miburi.robot.guards import Guards
from miburi.safety.contact import Rule
from miburi.safety.free import FreeRule
from miburi.safety.printed import PrintedRule
from miburi.studies.trials.plan import Subject
from miburi.studies.trials.replay import DeafRule
from miburi.studies.trials.workshop import calibrate_servos

_SLACK = np.array([20, 16, 16, 16, 16, 16, 16, 16])
#: The narrowest guards, in µs and in encoder steps, with which the rule that compares a motor with
#: its delayed profile hardly ever stops free moves of the simulated XL330 (our choice).
PROFILE_GUARDS = Guards(
    lag=np.full(8, 14_000),
    slack=_SLACK,
    least=np.full(8, 8),
    behind=_SLACK + 6,
    ahead=_SLACK + 6,
    arrival=np.full(8, 16),
)

#: The shipped rule, and rules to compare with it, by name.
RULES: dict[str, Callable[[FreeRule], Rule]] = {
    "miburi": lambda rule: rule,
    "weightless": lambda rule: replace(rule, sag=np.zeros_like(rule.sag)),
    "profile": lambda _: Rule(PROFILE_GUARDS),
    "printed": lambda rule: PrintedRule(rule.guards),
    "off": lambda rule: DeafRule(rule.guards),
}


#: Parts of the servos' drive that can be switched off: the lift, which raises goals against
#: sagging, and the ceiling, which limits the motors' torque.
WITHOUT = {"lift": {"lift": 0.0}, "ceiling": {"headroom": 1000.0}}


@dataclass(frozen=True)
class ServoState:
    """A state of all servos: factors on friction and resistance, and the supply voltage in V.

    ``voltage`` is None if each trial draws its own. ``before`` says that the robot was calibrated
    before it came into this state.
    """

    friction: float = 1.0
    resistance: float = 1.0
    voltage: float | None = None
    before: bool = False


#: States for trials: a hot motor has a fifth more resistance, worn gears 1.8 times the friction
#: (both our choice). No state adds play; `--play` adds it to servos with workshop tolerances.
STATES = {
    "hot": ServoState(resistance=1.2),
    "warmed-up": ServoState(resistance=1.2, before=True),
    "worn": ServoState(friction=1.8),
    "4.75V": ServoState(voltage=4.75, before=True),
    "5.25V": ServoState(voltage=5.25, before=True),
}


def in_state(
    robot: Robot, name: str, seed: int, judged: Callable[[FreeRule], Rule] = RULES["miburi"]
) -> Subject:
    """Return a calibrated robot with servos in one of ``STATES``, and the rule that watches it.

    ``judged`` makes this rule from the calibrated rule.

    Raises BodyError if the robot cannot be calibrated; see
    :func:`miburi.studies.trials.workshop.calibrate_servos`.
    """
    state, servo = STATES[name], robot.servo.model
    motor = servo.motor.model_copy(update={"resistance": servo.motor.resistance * state.resistance})
    changed = servo.varied(friction=state.friction).model_copy(update={"motor": motor})
    true = robot.with_servo(changed)
    done = calibrate_servos(robot, seed, robot if state.before else true)
    driven = true.servo.model.model_copy(update={"drive": done.robot.servo.model.drive})
    return Subject(done.robot, judged(done.rule), true.with_servo(driven), state.voltage)
