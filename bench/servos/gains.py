"""What each P gain brings on gestures: sag, lag and overshoot, beside what others simulated.

    python bench/servos/gains.py [--servo NAME|FILE] [--moves 48] [--seed 1] [--timestep 0.002]

Each row drives the same gesture moves, with the trials' spread of voltage, friction, load and
delay, and no correction of goals. Sag is how far the motors hang from their goals at last, lag the
delay that fits the motion best once offset and scale are fitted too, overshoot how far beyond its
resting place a motor swings. "Theirs" are the figures of another plant of the same constants
(1 kHz, integer control, PWM slope; M6) on other moves of the same gestures.
"""

import argparse

import numpy as np

from miburi.robot import iphonoid
from miburi.safety.profile import FINE, SECOND, plan_profile, to_steps
from miburi.servos import load_servo
from miburi.studies.trials.conditions import draw
from miburi.studies.trials.plant import TrialPlant

THEIRS = {
    400: "0.015 / 0.083 / 0.130   90 (66-98)   0",
    800: "0.006 / 0.035 / 0.059   50 (38-80)   1",
    1600: "0.003 / 0.017 / 0.028   28 (18-44)   4",
    3200: "0.0017 / 0.0086 / 0.014   14 (8-26)   4",
    6400: "0.0006 / 0.0042 / 0.007   6 (4-16)   3",
}
REST = 0.4  # s
DELAYS = np.arange(0, 0.13, 0.002)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--servo", default="xl330-m288-t")
    options.add_argument("--moves", type=int, default=48)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--timestep", type=float, default=0.002)
    chosen = options.parse_args()
    servo = load_servo(chosen.servo)
    print("P      sag p50 / p95 / max rad   lag p50 (p5-p95) ms   overshoot p95 steps")
    for gain, theirs in THEIRS.items():
        drive = servo.drive.model_copy(update={"gain": float(gain), "lift": 0.0})
        sag, lag, over = measure(
            servo.model_copy(update={"drive": drive}), chosen.moves, chosen.seed, chosen.timestep
        )
        print(
            f"{gain:<6} {np.median(sag):.4f} / {np.percentile(sag, 95):.4f} / {sag.max():.3f}"
            f"   {1e3 * np.median(lag):.0f} ({1e3 * np.percentile(lag, 5):.0f}-"
            f"{1e3 * np.percentile(lag, 95):.0f})   {np.percentile(over, 95):.0f}"
        )
        print(f"theirs {theirs}")


def measure(servo, moves: int, seed: int, timestep: float):
    """Return sags, lags and overshoots of ``moves`` moves: (n,) rad, (m,) s, (m,) steps."""
    robot = iphonoid().with_servo(servo)
    plant = TrialPlant(robot)
    plant.model.opt.timestep = timestep
    per_step = round(timestep * SECOND)
    sags, lags, overs = [], [], []
    for index in range(moves):
        rng = np.random.default_rng([seed, index])
        conditions = draw(robot, rng, moves=1)
        plant.begin(conditions.start, conditions.variation, rng)
        move, _ = conditions.moves[0]
        origin, goal = to_steps(robot, conditions.start), to_steps(robot, move.angles)
        profile, direction = plan_profile(robot, origin, goal, to_steps(robot, move.speeds))
        seconds = int(profile.total.max()) / SECOND + REST
        times = np.arange(1, round(seconds / timestep) + 1, dtype=np.int64)[:, None] * per_step
        wanted = (origin + direction * profile.position(times) / FINE) * robot.servo.step
        went = []
        for row in wanted:
            plant.advance(row[None], servo.motor_torque)
            went.append(plant.angles)
        angles = np.array(went)
        sags.extend(np.abs(wanted[-1] - angles[-1]))
        for motor in np.flatnonzero(profile.distance > 50):
            far = (angles[:, motor] - angles[-1, motor]) * direction[motor]
            overs.append(max(0.0, far.max() / robot.servo.step))
            lags.append(best_delay(wanted[:, motor], angles[:, motor], timestep))
    return np.array(sags), np.array(lags), np.array(overs)


def best_delay(wanted, went, timestep: float) -> float:
    """Return the delay in s after which an affine map of ``wanted`` fits ``went`` best."""
    errors = []
    for delay in DELAYS:
        shift = round(delay / timestep)
        late = np.concatenate([np.full(shift, wanted[0]), wanted[: len(wanted) - shift]])
        centred, answer = late - late.mean(), went - went.mean()
        scale = (centred @ answer) / (centred @ centred)
        errors.append(((answer - scale * centred) ** 2).sum())
    return float(DELAYS[int(np.argmin(errors))])


if __name__ == "__main__":
    main()
