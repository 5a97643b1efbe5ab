"""What viewers are shown of a partner: its state at one moment, and why it stopped."""

from collections import deque
from typing import Any

import numpy as np

from miburi.bodies import Phase, StopReason
from miburi.bodies.card import Card
from miburi.bodies.link import Report
from miburi.contact import Rule
from miburi.feelings import FEELINGS, Expression, FeelingModel
from miburi.motion import FINE, SECOND
from miburi.partner import Event, MoveSent, Partner, Released, Stopped
from miburi.robot import JOINTS, Array, forward
from miburi.robot.guards import by_motor
from miburi.studio.wire import Expressed, Hand, MotorOut, MotorsOut, State, StopOut

#: A touch that no stop followed is forgotten within a second: its force fades by this a step.
_FADING = 0.9
#: The hands' speed is taken over so many steps: a card's reports do not come in step with ours.
_SPEED_STEPS = 5


class Observer:
    """Looks at one body and its partner, step by step.

    Parameters
    ----------
    name, port
        The kind of body, and its serial port.
    partner
        Who moves it.
    feelings
        What it feels.
    rule
        The simulated body's contact rule; by default the robot's own.
    """

    def __init__(
        self,
        name: str,
        port: str | None,
        partner: Partner,
        feelings: FeelingModel,
        rule: Rule | None = None,
    ) -> None:
        self.name, self.port = name, port
        self._partner = partner
        self._feelings = feelings
        self._robot = partner.body.robot
        self._rule = rule or Rule.of(self._robot)
        self._home = forward(self._robot, self._robot.neutral)[:6].reshape(2, 3)
        self._hands: deque[tuple[float, Array]] = deque(maxlen=_SPEED_STEPS + 1)
        self._stop: StopOut | None = None
        self._peak = 0.0
        self._part: str | None = None
        self._report: Report | None = None
        self._sent: Array | None = None  # speeds of the latest move, rad/s

    def take(self, events: list[Event]) -> StopOut | None:
        """Take in what happened in a step; return what is known about a stop, if it stopped."""
        self._follow_touch(self._partner.body.state.phase)
        stopped = None
        for event in events:
            if isinstance(event, MoveSent | Released):
                self._sent = event.move.speeds if isinstance(event, MoveSent) else None
            elif isinstance(event, Stopped):
                stopped = self._stop = self._explain(event)
        return stopped

    def state(self, serial: int, **more: Any) -> State:
        """Return the state of now; ``more`` is what others know."""
        body, feelings = self._partner.body, self._feelings
        state = body.state
        touch = getattr(body, "touch", None)
        hands = forward(self._robot, state.angles)[:6].reshape(2, 3)
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
            angles=state.angles.round(4).tolist(),
            velocities=state.velocities.round(3).tolist(),
            emotion=feelings.emotion.round(4).tolist(),
            feeling=feelings.feeling.round(4).tolist(),
            mood=feelings.mood.round(5).tolist(),
            felt=_expressed(felt),
            expressed=_expressed(self._current(shown)),
            asked=self._partner.asked,
            hand_speed=round(speed, 4),
            extent=round(float(np.linalg.norm(hands - self._home, axis=1).max()), 4),
            ratios=self._ratios(),
            stop=self._stop,
            held=self._partner.held,
            force=None if touch is None else round(touch.force, 2),
            hand=_hand(body),
            face=self._face(felt, shown),
            **more,
        )

    def motors(self) -> MotorsOut:
        """Return how the motors are, and what they were calibrated to; look once a second."""
        body, robot = self._partner.body, self._robot
        card = body if isinstance(body, Card) else None
        settings = card.settings if card else None
        # A report that has not changed since the look before is that of a card which is gone.
        report = card.report if card and card.report is not self._report else None
        self._report = card.report if card else None
        rule = settings.rule if settings else self._rule
        guards, step = by_motor(rule.guards), robot.servo.step
        motors = [
            MotorOut(
                joint=joint,
                servo=settings.joints[i].servo if settings else None,
                answers=report is not None and bool(report.heard >> i & 1) if card else None,
                temperature=report.temperatures[i] if report else None,
                voltage=report.voltages[i] / 10 if report else None,
                guards=guards[i].map(lambda guard, n: round(n * guard.unit.size(step), 5)),
            )
            for i, joint in enumerate(JOINTS)
        ]
        return MotorsOut(
            body=self.name,
            port=self.port,
            calibrated=guards != by_motor(Rule.of(robot).guards),
            settings=f"{settings.crc:04x}" if settings else None,
            hottest=settings.general.hottest if settings else None,
            lowest=settings.general.lowest / 10 if settings else None,
            motors=motors,
        )

    def _explain(self, event: Stopped) -> StopOut:
        """Say what is known about a stop: speeds from the rule's window, force from the physics."""
        stop = event.stop
        moved, due, seconds = self._window_of(event)
        measured = moved / seconds if moved is not None and seconds else None
        expected = due / seconds if due is not None and seconds else None
        if stop.sign == "tracking" and stop.motor is not None and self._sent is not None:
            # No window stopped it: how fast it is now, and the speed that was sent to it.
            motor = JOINTS.index(stop.motor)
            measured = abs(float(self._partner.body.state.velocities[motor]))
            expected = float(self._sent[motor])
        touched = hasattr(self._partner.body, "touch")
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
            force=round(self._peak, 2) if touched else None,
            part=self._part,
            mood_before=event.mood_before,
            mood_after=event.mood_after,
        )

    def _window_of(self, event: Stopped) -> tuple[float | None, float | None, float | None]:
        """Return what the rule's window measured and should have, rad, and its length, s.

        A card does not tell the length: the rule judges a slow motor over several periods.
        """
        stop, body = event.stop, self._partner.body
        if stop.reason is not StopReason.CONTACT or stop.motor is None:
            return None, None, None
        motor, step = JOINTS.index(stop.motor), self._robot.servo.step / FINE
        if isinstance(body, Card):
            return body.report.measured * step, body.report.expected * step, None
        window = self._rule_window()
        if window is None or stop.sign != "speed":
            return None, None, None
        measured, expected = float(window.measured[motor]), float(window.expected[motor])
        seconds = int(window.length[motor]) / SECOND
        return measured * step, expected * step, seconds

    def _follow_touch(self, phase: Phase) -> None:
        """Keep the largest force of a touch for the stop that follows it."""
        touch = getattr(self._partner.body, "touch", None)
        if touch is not None:
            if touch.force > 0:
                self._peak, self._part = max(self._peak, touch.force), touch.part
            elif phase is not Phase.STOPPED:
                self._peak *= _FADING
        if phase is not Phase.STOPPED:
            self._stop = None
        elif self._stop is not None and touch is not None and self._peak > (self._stop.force or 0):
            self._stop = self._stop.model_copy(update={"force": round(self._peak, 2)})

    def _current(self, shown: Expression | None) -> Expression | None:
        """Return what is shown; unless it was asked for, it is as strong as the mood of now."""
        if shown is None or self._partner.asked:
            return shown
        return Expression(shown.feeling, float(self._feelings.mood[FEELINGS.index(shown.feeling)]))

    def _face(self, felt: Expression | None, shown: Expression | None) -> list[float]:
        """Return how much of each feeling the face shows.

        What was asked for, alone; else the strongest emotion as strong as its mood, and each
        other emotion's mood in the measure in which it is as strong as that one.
        """
        weights = np.zeros(len(FEELINGS))
        if shown is not None and self._partner.asked:
            weights[FEELINGS.index(shown.feeling)] = shown.mood
        elif felt is not None:
            emotion = self._feelings.emotion
            weights = self._feelings.mood * (emotion / emotion.max()) ** 2
        return [float(weight) for weight in weights.round(3)]

    def _rule_window(self) -> Any:
        return getattr(self._partner.body, "window", None)

    def _ratios(self) -> list[float | None]:
        """Return what each motor's latest window held against the limit, up to 1.

        The slack is in it, so that it crosses the limit where the rule stops the body. A card
        tells the ratio of the motor that stopped it.
        """
        window = self._rule_window()
        if window is None:
            stop = self._stop
            return [stop.ratio if stop and stop.motor == joint else None for joint in JOINTS]
        return [
            min(round(float(granted) / float(should), 4), 1.0) if judged else None
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


def _hand(body: Any) -> Hand | None:
    if not hasattr(body, "place_hand"):
        return None
    pose = body.configuration[1].round(4).tolist()
    return Hand(position=pose[:3], quaternion=pose[3:])
