"""A card with eight emulated servos, the host's body on it, and the controller's Python twin."""

import copy
import struct
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from miburi.card.card import Card, wake
from miburi.card.link import FrameKind, Reason, Report
from miburi.card.order import Order
from miburi.card.reading import PHASES
from miburi.card.settings import FULL_PWM, CardSettings, FreeMotor
from miburi.card.units import real_acceleration
from miburi.emulation.bus import Bus
from miburi.emulation.firmware import EmulatedCard
from miburi.emulation.servos import Servo
from miburi.robot import JOINTS, Robot, iphonoid
from miburi.robot.guards import Guards
from miburi.safety.contact import Sign
from miburi.safety.controller import Controller
from miburi.safety.move import Move, plan_move
from miburi.safety.profile import SECOND, to_steps
from miburi.safety.stop import Phase, StopReason

SIGNS = (None, *Sign)

#: What a card is told of one motor's load: quarters of a step at both ends, and the most duty
#: until motors have sped up, and after that.
LOAD = struct.Struct("<bbHH")
#: The payload of loads of motors that bear nothing, with all their duty.
NO_LOADS = LOAD.pack(0, 0, FULL_PWM, FULL_PWM) * len(JOINTS)


def weightless() -> Robot:
    """Return the robot as these servos see it: their shafts turn alone."""
    robot = iphonoid()
    nothing = dict.fromkeys(type(robot.masses).model_fields, 1e-12)
    return robot.model_copy(update={"masses": robot.masses.model_copy(update=nothing)})


#: The guards of such servos, in steps: what :func:`miburi.calibration.guards.granted` gave for all
#: free moves of a calibration, shaken (:meth:`Rig.shake`).
SLACK = (14, 10, 10, 8, 10, 10, 8, 11)
BEHIND = (15, 13, 11, 10, 12, 13, 10, 13)
AHEAD = (12, 12, 12, 10, 12, 12, 10, 15)


@cache
def calibrated() -> CardSettings:
    """Return settings for servos that do what they are told, 30 ms later, whatever it takes.

    The free servo is then a stiff one without friction: half of the delay is its own. The
    description's guards are the simulated body's: these servos are calibrated as a card's.
    """
    settings = CardSettings.of(weightless())
    joints = tuple(
        replace(
            joint,
            free=FreeMotor(pull=16_383, brake=49_152, friction=0, lost=0),
            guards=Guards(lag=18_000, slack=slack, least=8, behind=behind, ahead=ahead, arrival=9),
        )
        for joint, slack, behind, ahead in zip(settings.joints, SLACK, BEHIND, AHEAD, strict=True)
    )
    return CardSettings(replace(settings.general, error_per_pwm=32_000), joints)


class Line(EmulatedCard):
    """An emulated card whose cable can be pulled, and which can be mute.

    ``closings`` counts how often the host has closed it.
    """

    pulled = mute = False
    sent = b""
    closings = 0

    def read(self, until: float) -> bytes:
        if self.pulled:
            raise OSError("pulled")
        if self.mute:
            self.wait(until)
            super().read(until)
            return b""
        return super().read(until)

    def write(self, data: bytes) -> None:
        if self.pulled:
            raise OSError("pulled")
        self.sent = data
        super().write(data)

    def close(self) -> None:
        """The card stays on when the host lets go of the cable."""
        self.closings += 1


class Talking(Card):
    """The body on the card; it tells which requests the card took.

    ``hung`` says by how many steps each motor hangs from its goal, where the description does not.
    """

    hung: tuple[int, ...] | None = None

    on_answer: Callable[[FrameKind, bytes, bytes], None] = staticmethod(lambda *_: None)

    def ask(self, kind: FrameKind, payload: bytes = b"", patience: float = 0.25) -> bytes:
        if kind == FrameKind.LOADS and self.hung is not None:
            payload = b"".join(LOAD.pack(4 * sag, 4 * sag, FULL_PWM, FULL_PWM) for sag in self.hung)
        answer = super().ask(kind, payload, patience)
        self.on_answer(kind, payload, answer)
        return answer


class Twin:
    """Judges every report as the Python controller would, and remembers what it never allows."""

    def __init__(self, robot: Robot, settings: CardSettings) -> None:
        servo = robot.servo
        ramp = real_acceleration(settings.general.acceleration) * servo.step
        as_real = servo.model_copy(update={"acceleration": ramp})
        self.robot = robot.model_copy(update={"servo": as_real})
        self.settings = settings
        self.controller: Controller | None = None
        self.last: Report | None = None
        self.whole: list[Report] = []  # the two latest in which all were heard
        self.loads = NO_LOADS
        self.looks = 0
        #: From when on every look at the motors would see the contact, µs.
        self.detectable: int | None = None
        self.wants_detectable = False

    def start(self, order: Order, began: int) -> None:
        assert self.last is not None
        here = np.array(self.last.positions)
        if self.controller is None:
            neutral = to_steps(self.robot, self.robot.neutral)
            self.controller = Controller(self.robot, self.settings.rule, neutral)
            for report in self.whole:
                self.controller.note(np.array(report.positions), report.time)
        c, speeds = self.controller, None
        before, since = (c.watch, began - c.began) if c.phase is Phase.MOVING else (None, 0)
        if before is not None:
            speeds = c.speed(began)
        c.start(Phase.MOVING, order.goals, order.speeds, here, began)
        was = 1 if before is None else before.direction
        profile, direction = order.profile(self.settings, c.origin, speeds, was)
        loading = order.loading(self.settings, here, c.origin, direction)
        if before is None:
            velocity, gone = c.drift(here, direction, began)
            loading = replace(loading, velocity=velocity, gone=gone)
        c.watch = self.settings.rule.watch(profile, here, direction, loading)
        if before is not None:
            c.watch.go_on(before, self.last.time - (began - since), since)
        self.detectable = None

    def hear(self, kind: FrameKind, payload: bytes, answer: bytes) -> None:
        if kind == FrameKind.LOADS:
            self.loads = payload
        elif kind == FrameKind.MOVE:
            self.start(Order.unpack(payload, self.loads), struct.unpack("<q", answer)[0])
        elif kind in (FrameKind.RELEASE, FrameKind.STOP):
            # The return starts from a reading that is not reported: it is not judged here.
            self.controller = None

    def see(self, report: Report) -> None:
        self.last = report
        if report.heard == 0xFF:
            self.whole = [*self.whole[-1:], report]
        c = self.controller
        if c is None or report.heard != 0xFF:
            return
        if self.wants_detectable and c.phase is Phase.MOVING:
            # From here on, a look at any moment would see it.
            seen = copy.deepcopy(c.watch).look(np.array(report.positions), report.time - c.began)
            if seen is None:
                self.detectable = None
            elif self.detectable is None:
                self.detectable = report.time
        if c.phase is Phase.STOPPED:
            c.update(np.array(report.positions), report.time)
        elif c.phase in (Phase.MOVING, Phase.IDLE):
            self.looks += c.phase is Phase.MOVING
            c.update(np.array(report.positions), report.time)
            assert PHASES[report.phase] is c.phase, (report, c.phase, c.latched)
            if c.phase is Phase.STOPPED:
                stop = c.latched
                assert stop is not None
                assert stop.time == report.stop_time / SECOND
                assert stop.motor == JOINTS[report.motor]
                if stop.reason is StopReason.TOUCHED:
                    assert report.reason == Reason.TOUCHED
                    return
                assert stop.sign == SIGNS[report.sign].value
                assert stop.ratio == report.measured / max(report.expected, 1)
                assert c.window is not None
                assert c.window.length[report.motor] == report.length


class Rig:
    """All of it, switched on; `wake` brings the body to neutral."""

    def __init__(
        self,
        firmware: Path,
        seed: int = 0,
        *,
        awake: bool = True,
        twin: bool = True,
        settings: CardSettings | None = None,
    ) -> None:
        self.robot = weightless()
        self.settings = settings or calibrated()
        self.rng = np.random.default_rng(seed)
        self.servos = [
            Servo.new(j.servo, j.zero + j.direction * (j.neutral - 30))
            for j in self.settings.joints
        ]
        self.bus = Bus(self.servos)
        self.line = Line(self.bus, elf=firmware / "miburi.elf", library=firmware / "libmega.so")
        self.body = Talking(lambda: self.line, self.robot, self.settings)
        self.twin = Twin(self.robot, self.settings)
        if twin:
            self._join_twin()
        if awake:
            self.body.step(0.04)
            wake(self.body)

    def _join_twin(self) -> None:
        self.body.ask(FrameKind.STATUS, struct.pack("<H", 1))  # a report after every reading
        self.body.on_report = self.twin.see
        self.body.on_answer = self.twin.hear
        self.twin.last = self.body.report

    @property
    def cause(self) -> tuple[StopReason, str | None] | None:
        """The reason for the body's stop, and the motor that the stop names."""
        stop = self.body.state.stop
        return None if stop is None else (stop.reason, stop.motor)

    def run(self, seconds: float) -> None:
        """Let time pass from now on: a step alone counts what requests before it took."""
        until = self.line.now() + seconds - 0.001
        while self.line.now() < until:
            self.body.step(0.02)

    def turn(self, motors: list[int], by: float, speed: float) -> None:
        """Send motors ``by`` rad away from neutral, the others to neutral, at ``speed`` rad/s."""
        angles = self.robot.neutral.copy()
        angles[motors] += by
        self.body.move(Move(angles, np.full(8, speed)))

    def settle(self, limit: float = 20.0) -> Phase:
        """Wait for the end of a motion."""
        for _ in range(round(limit / 0.02)):
            state = self.body.step(0.02)
            if state.phase in (Phase.IDLE, Phase.STOPPED):
                break
        return state.phase

    def random_move(self) -> Move:
        """Anywhere inside the limits, in step or each motor at its own speed."""
        robot, here = self.robot, self.body.state.angles
        angles = self.rng.uniform(robot.lower, robot.upper)
        stay = self.rng.random(8) < 0.3
        angles = np.clip(np.where(stay, here, angles), robot.lower, robot.upper)
        if self.rng.random() < 0.7:
            return plan_move(robot, here, angles, float(self.rng.uniform(0.3, 2.0)))
        speeds = np.exp(self.rng.uniform(np.log(0.5), np.log(robot.servo.max_speed), 8))
        return Move(angles, speeds)

    def shake(self) -> None:
        """Other loads, lags and noise for the next move, within what was calibrated."""
        for servo in self.servos:
            servo.shaft.load = float(self.rng.uniform(-3, 3))
            servo.shaft.lag = float(self.rng.uniform(28_000, 32_000))
            servo.shaft.noise = lambda: float(self.rng.uniform(-0.6, 0.6))
        self.run(0.1)  # the load is there before the move begins

    def at_rest(self) -> bool:
        """Whether no servo's trajectory is under way, now or in half a second."""
        now = self.line.mega.time
        places = [servo.setpoint(now) for servo in self.servos]
        self.line.run(now + 500_000)
        still = places == [servo.setpoint(self.line.mega.time) for servo in self.servos]
        self.body.step(0.5)
        return still

    def close(self) -> None:
        self.line.mega.close()
