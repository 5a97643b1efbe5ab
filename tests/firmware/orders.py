"""What a servo is told when it lies, and how far that is from where it is."""

import numpy as np
from tests.firmware.rig import Rig

from miburi.emulation.servos import Servo
from miburi.robot import JOINTS
from miburi.safety.move import Move
from miburi.safety.stop import Phase

#: Steps from its shaft to which a stop may send a servo: a lie that could be true by the time that
#: has passed (``places.h``: 204 in 40 ms), sag and way back (``controller.h``: 16 and 48).
NEAR = 320


class Orders:
    """Remembers what every servo is told, and how far from its shaft that is."""

    def __init__(self, rig: Rig) -> None:
        self.rig, self.wrong = rig, list[str]()
        for motor, servo in enumerate(rig.servos):
            self._watch(motor, servo)

    def _watch(self, motor: int, servo: Servo) -> None:
        write, joint = servo.write, self.rig.settings.joints[motor]
        general = self.rig.settings.general
        fastest, softly = general.max_speed, general.hold_pwm

        def written(address: int, data: bytes, time: float) -> int:
            error = write(address, data, time)
            if error == 0 and address <= 116 < address + len(data) and servo.segment is not None:
                goal, speed = servo.get("goal_position"), servo.segment.speed
                angle = (goal - joint.zero) * joint.direction
                if not joint.min <= angle <= joint.max:
                    self.wrong.append(f"{JOINTS[motor]}: {angle} is outside its limits")
                if not 0 < speed <= fastest + 8:
                    self.wrong.append(f"{JOINTS[motor]}: goes at {speed} steps/s")
                far = abs(goal - servo.shaft.place) > NEAR
                if far and servo.get("goal_pwm") == softly:
                    self.wrong.append(
                        f"{JOINTS[motor]}: a stop sends it from {servo.shaft.place:.0f} to {goal}"
                    )
            return error

        servo.write = written  # type: ignore[method-assign]


def begin(rig: Rig, phase: Phase, motor: int) -> None:
    """Bring the body into a phase, with the motor in motion where others are."""
    angles = rig.robot.neutral.copy()
    angles[[0, 1, 2, 3, 4, 5, 6, 7]] += [0.6, 0.8, 0.5, 0.3, 0.8, -0.5, -0.3, 0.2]
    angles = np.clip(angles, rig.robot.lower, rig.robot.upper)
    if phase is Phase.IDLE:
        return
    rig.body.move(Move(angles, np.full(8, 1.0)))
    rig.run(0.3)
    if phase is not Phase.MOVING:
        rig.body.stop()
        rig.run(0.1)
    if phase is Phase.RETURNING:
        rig.body.release()
        rig.run(0.1)
