"""Hours of a partner alone in a room, at each level of rest: does its body ever stop itself?

    python bench/servos/hours.py [--hours 10] [--robot -1] [--robots 12] [--seed 1]

Nobody touches it. It rests. Every 3 to 10 minutes it hears a drawn feeling; every 2 to 6 minutes
it says something for 3 to 8 s with beats; every 5 to 60 s the face that it looks at has moved.
``--robot`` is one of a workshop, calibrated as its maker would; −1 is the robot as described. One
line comes after each hour, with all since the start, so that it may be interrupted.
"""

import argparse

import numpy as np
from flow import STEP, made

from miburi.feelings import FEELINGS, EmotionalModel, Stimulus, shipped_temperament
from miburi.feelings.temperament import REST_LEVELS, RestLevel
from miburi.partner import GestureStarted, MoveSent, Partner, Stopped

HOUR = 3600.0


class Day:
    """One partner's hours at a level."""

    def __init__(self, level: RestLevel, number: int, robots: int, seed: int) -> None:
        temperament = shipped_temperament().model_copy(update={"at_rest": level})
        self.feelings = EmotionalModel(temperament)
        body = made(number, robots, seed)
        self.partner = Partner(body, self.feelings, life=seed, period=0.5)
        self.rng = np.random.default_rng([seed, REST_LEVELS.index(level)])
        self.feels, self.speaks, self.looks = self.rng.uniform((180, 120, 5), (600, 360, 60))
        self.moves = self.gestures = self.stops = 0
        self.level = level

    def pass_an_hour(self) -> str:
        """Let an hour pass, and say what has come of all until now."""
        partner, rng = self.partner, self.rng
        until = partner.body.state.time + HOUR
        while (now := partner.body.state.time) < until:
            if now >= self.feels:
                felt = Stimulus(rng.choice(FEELINGS), float(rng.uniform(0.5, 1)), "speech")
                self.feelings.stimulate(felt)
                self.feels += rng.uniform(180, 600)
            if now >= self.speaks:
                partner.gesticulate(np.cumsum(rng.uniform(0.5, 1.2, rng.integers(4, 10))).tolist())
                self.speaks += rng.uniform(120, 360)
            if now >= self.looks:
                partner.company.gaze = float(rng.uniform(-0.6, 0.6))
                self.looks += rng.uniform(5, 60)
            for event in partner.step(STEP):
                self.moves += isinstance(event, MoveSent)
                self.gestures += isinstance(event, GestureStarted)
                self.stops += isinstance(event, Stopped)
        hours = round(partner.body.state.time / HOUR)
        return f"{self.level:7} {hours:5} {self.moves:6} {self.gestures:8} {self.stops:5}"


def main() -> None:
    """Let the hours pass, each level in turn."""
    options = argparse.ArgumentParser(description=__doc__)
    for name, default in (("hours", 10), ("robot", -1), ("robots", 12), ("seed", 1)):
        options.add_argument(f"--{name}", type=int, default=default)
    chosen = options.parse_args()
    print("level   hours  moves gestures stops", flush=True)
    each = (chosen.robot, chosen.robots, chosen.seed)
    days = [Day(level, *each) for level in REST_LEVELS]
    for _ in range(chosen.hours):
        for day in days:
            print(day.pass_an_hour(), flush=True)


if __name__ == "__main__":
    main()
