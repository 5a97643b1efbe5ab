"""Observe a partner for its viewers: states, and explanations of stops."""

from collections import deque
from typing import Any

import numpy as np

from miburi.bodies import Touch, Touchable
from miburi.feelings import FEELINGS, Expression, FeelingModel
from miburi.live.state import Expressed, Hand, MotorOut, MotorsOut, RuleOut, State, StopOut
from miburi.partner import Event, MoveSent, Partner, Released, Stopped
from miburi.robot import JOINTS, Array, forward
from miburi.robot.guards import by_motor
from miburi.safety.contact import Sign
from miburi.safety.profile import FINE, SECOND
from miburi.safety.stop import Phase, StopReason

#: At each step, the peak force of a touch without a stop fades by this factor; below ``_GONE``, in
#: N, the touch is forgotten.
_FADING, _GONE = 0.9, 0.005
#: The angle that the eyes reach without the head, rad (our choice).
_ASIDE = 0.35
#: The hands' speed is averaged over this many steps, as a card's reports do not come in step with
#: the loop.
_SPEED_STEPS = 5


class Observer:
    """Observes a body of kind ``name`` and its partner, step by step."""

    def __init__(
        self, name: str, port: str | None, partner: Partner, feelings: FeelingModel
    ) -> None:
        self.name, self.port = name, port
        self._partner, self._feelings = partner, feelings
        self._robot = partner.body.robot
        self._home = forward(self._robot, self._robot.neutral)[:6].reshape(2, 3)
        self._computed = (self._robot.neutral.copy(), self._home)
        self._human = (np.full(7, np.nan), Hand(position=[0.0] * 3, quaternion=[0.0] * 4))
        self._hands: deque[tuple[float, Array]] = deque(maxlen=_SPEED_STEPS + 1)
        self._stop: StopOut | None = None
        self._peak = 0.0
        self._part: str | None = None
        self._sent: Array | None = None  # speeds of the latest move, rad/s

    def take(self, events: list[Event]) -> StopOut | None:
        """Take in the events of a step; return a description of its stop, if any."""
        self._follow_touch(self._partner.body.state.phase)
        stopped = None
        for event in events:
            if isinstance(event, MoveSent | Released):
                self._sent = event.move.speeds if isinstance(event, MoveSent) else None
            elif isinstance(event, Stopped):
                stopped = self._stop = self._explain(event)
        return stopped

    def state(self, serial: int, **more: Any) -> State:
        """Return the present state; ``more`` has the fields that the caller fills in."""
        body, feelings = self._partner.body, self._feelings
        state = body.state
        touch = self._touch
        hands = self._hands_at(state.angles)
        self._hands.append((state.time, hands))
        before, then = self._hands[0]
        way = float(np.linalg.norm(hands - then, axis=1).mean())
        speed = way / (state.time - before) if state.time > before else 0.0
        felt, shown = feelings.express(), self._partner.expression
        return State(
            serial=serial,
            time=round(state.time, 3),
            body=self.name,
            phase=state.phase.value,
            temperament=feelings.temperament.name,
            rest=feelings.temperament.at_rest,
            angles=state.angles.round(4).tolist(),
            velocities=state.velocities.round(3).tolist(),
            emotion=feelings.emotion.round(4).tolist(),
            feeling=feelings.feeling.round(4).tolist(),
            mood=feelings.mood.round(5).tolist(),
            felt=_expressed(felt),
            expressed=_expressed(self._current(shown)),
            asked=self._partner.asked,
            attention=self._partner.company.attends,
            eyes=self._eyes(),
            hand_speed=round(speed, 4),
            extent=round(float(np.linalg.norm(hands - self._home, axis=1).max()), 4),
            ratios=self._ratios(),
            stop=self._stop,
            held=self._partner.held,
            force=None if touch is None else round(touch.force, 2),
            hand=self._hand(body.touchable),
            face=self._face(felt, shown),
            **more,
        )

    def _hands_at(self, angles: Array) -> Array:
        """Return both hands' positions, shape (2, 3), in m; computed only if the body has moved."""
        if not np.array_equal(angles, self._computed[0]):
            self._computed = (angles.copy(), forward(self._robot, angles)[:6].reshape(2, 3))
        return self._computed[1]

    def _hand(self, body: Touchable | None) -> Hand | None:
        """Return the simulated hand's state, computed only if it has moved."""
        if body is None:
            return None
        pose = body.configuration[1]
        if not np.array_equal(pose, self._human[0]):
            rounded = pose.round(4).tolist()
            self._human = (pose.copy(), Hand(position=rounded[:3], quaternion=rounded[3:]))
        return self._human[1]

    def _eyes(self) -> tuple[float, float]:
        """Return where the eyes look: they move before the head, and return as the head follows."""
        turn, rise = self._partner.ahead
        return round(_share(turn), 2), round(-_share(rise), 2)

    def motors(self) -> MotorsOut:
        """Return the motors' health and calibration; call it once a second."""
        from miburi.safety.free import FreeRule  # it loads Numba

        motors, robot = self._partner.body.motors(), self._robot
        guards, step = by_motor(motors.rule.guards), robot.servo.step
        each = [
            MotorOut(
                joint=joint,
                servo=motor.servo,
                answers=motor.answers,
                temperature=motor.temperature,
                voltage=motor.voltage,
                guards=guards[i].map(lambda guard, n: round(n * guard.unit.size(step), 5)),
            )
            for i, (joint, motor) in enumerate(zip(JOINTS, motors.each, strict=True))
        ]
        return MotorsOut(
            body=self.name,
            port=self.port,
            calibrated=guards != by_motor(FreeRule.of(robot).guards),
            settings=motors.settings,
            hottest=motors.hottest,
            lowest=motors.lowest,
            rule=RuleOut(period=motors.rule.period / SECOND, ratio=motors.rule.ratio / 10_000),
            motors=each,
        )

    def _explain(self, event: Stopped) -> StopOut:
        """Describe a stop: the travel is from the contact rule, and the force from the physics."""
        stop, body = event.stop, self._partner.body
        moved = due = measured = expected = None
        if stop.reason is StopReason.CONTACT and stop.motor is not None:
            motor, step = JOINTS.index(stop.motor), self._robot.servo.step / FINE
            if body.window is not None:
                moved = float(body.window.measured[motor]) * step
                due = float(body.window.expected[motor]) * step
                if stop.sign == Sign.SPEED:
                    seconds = float(body.window.length[motor]) / SECOND
                    measured, expected = moved / seconds, due / seconds
            if stop.sign == Sign.TRACKING and self._sent is not None:
                measured = abs(float(body.state.velocities[motor]))
                expected = float(self._sent[motor])
        contact = stop.reason is StopReason.CONTACT
        by_hand = self._part is not None and (contact or stop.reason is StopReason.TOUCHED)
        return StopOut(
            time=stop.time,
            reason=stop.reason,
            motor=stop.motor,
            sign=stop.sign,
            ratio=_rounded(stop.ratio),
            moved=_rounded(moved),
            due=_rounded(due),
            measured=_rounded(measured),
            expected=_rounded(expected),
            force=round(self._peak, 2) if by_hand else None,
            part=self._part if by_hand else None,
            mood_before=event.mood_before if contact else None,
            mood_after=event.mood_after if contact else None,
        )

    @property
    def _touch(self) -> Touch | None:
        touchable = self._partner.body.touchable
        return None if touchable is None else touchable.touch

    def _follow_touch(self, phase: Phase) -> None:
        """Keep the largest force of a touch for a stop that may follow."""
        touch = self._touch
        if touch is not None:
            if touch.force > 0:
                self._peak, self._part = max(self._peak, touch.force), touch.part
            elif phase is not Phase.STOPPED:
                self._peak *= _FADING
                self._part = self._part if self._peak > _GONE else None
        if phase is not Phase.STOPPED:
            self._stop = None
        elif self._stop is not None and (force := self._stop.force) is not None:
            self._stop = self._stop.model_copy(update={"force": max(force, round(self._peak, 2))})

    def _current(self, shown: Expression | None) -> Expression | None:
        """Return the expression shown, with its requested mood or else with the present mood."""
        if shown is None or self._partner.asked:
            return shown
        return Expression(shown.feeling, float(self._feelings.mood[FEELINGS.index(shown.feeling)]))

    def _face(self, felt: Expression | None, shown: Expression | None) -> list[float]:
        """Return how much of each feeling the face shows, 0 to 1.

        A requested gesture shows its own feeling alone. Otherwise each feeling shows at its mood
        times (its emotion / the strongest emotion)².
        """
        weights = np.zeros(len(FEELINGS))
        if shown is not None and self._partner.asked:
            weights[FEELINGS.index(shown.feeling)] = shown.mood
        elif felt is not None and not self._partner.company.calm:
            emotion = self._feelings.emotion
            weights = self._feelings.mood * (emotion / emotion.max()) ** 2
        return [float(weight) for weight in weights.round(3)]

    def _ratios(self) -> list[float | None]:
        """Return each motor's latest contact ratio, at most 1; None if the motor was not judged.

        The ratio includes the contact rule's slack, so it crosses the limit when the rule's speed
        test stops the body.
        """
        window = self._partner.body.window
        if window is None:
            return [None] * len(JOINTS)
        return [
            min(round(float(granted) / float(should), 4), 1.0) if judged and should else None
            for granted, should, judged in zip(
                window.granted, window.expected, window.judged, strict=True
            )
        ]


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 4)


def _expressed(expression: Expression | None) -> Expressed | None:
    if expression is None:
        return None
    return Expressed.model_validate(
        {"feeling": expression.feeling, "mood": round(expression.mood, 5)}
    )


def _share(angle: float) -> float:
    return max(-1.0, min(1.0, angle / _ASIDE))
