"""What the physical body leaves out of a servo's model, for speed, and how much that is.

    python bench/servos/left_out.py [--moves 60]

One servo alone, with an arm's or the waist's inertia and load, makes ramped moves: with the
control's whole encoder steps and the PWM's slope, and without. Differences in encoder steps.
"""

import argparse

import numpy as np

from miburi.safety.profile import FINE, SECOND, Profile
from miburi.servos import Axis, Servo, load_servo


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--moves", type=int, default=60)
    count = options.parse_args().moves
    servo = load_servo("xl330-m288-t")
    fine = 1 << 16
    ratio = fine / servo.encoder.steps_per_turn
    finer = servo.model_copy(
        update={
            "encoder": servo.encoder.model_copy(update={"steps_per_turn": fine}),
            "drive": servo.drive.model_copy(update={"gain": servo.drive.gain / ratio}),
        }
    )
    sudden = servo.model_copy(update={"gains": servo.gains.model_copy(update={"pwm_slope": 1e6})})
    faster = servo.model_copy(update={"loop": servo.loop.model_copy(update={"rate": 1e4})})
    for name, other in (
        ("whole steps", finer), ("the PWM's slope", sudden), ("a control at 1 kHz", faster)
    ):  # fmt: skip
        moving, resting = [], []
        rng = np.random.default_rng(1)
        for _ in range(count):
            arguments = rng.uniform(100, 1500), rng.uniform(300, 3900), rng.uniform(1e-4, 2e-3)
            load = rng.uniform(-0.06, 0.06)
            ways = [drive(one, *arguments, load) for one in (servo, other)]
            apart = np.abs(np.subtract(*ways)) / servo.step
            moving.append(apart.max())
            resting.append(apart[-1])
        print(
            f"{name}: median {np.median(moving):.2f}, most {max(moving):.2f} on the way; "
            f"median {np.median(resting):.2f}, most {max(resting):.2f} at rest"
        )


def drive(servo: Servo, distance: float, speed: float, inertia: float, load: float):
    """Return the angles of a ramped move, one each 10 ms, rad."""
    one = np.array([1])
    profile = Profile.plan(one * round(distance), one * FINE * round(speed), one * 13038)
    axis = Axis(servo, inertia, load)
    axis.advance(0.0, 0.3)
    step = load_servo("xl330-m288-t").step
    angles = []
    for tick in range(int(profile.total[0]) // 1000 + 300):
        axis.advance(float(profile.position(tick * SECOND // 1000)[0]) / FINE * step, 0.001)
        if tick % 10 == 0:
            angles.append(axis.angle)
    return np.array(angles)


if __name__ == "__main__":
    main()
