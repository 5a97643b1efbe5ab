"""A game: the partner shows a feeling, and you say which. Start one with `make run`.

python examples/guessing_game.py http://127.0.0.1:8080
"""

import sys

import numpy as np

from miburi import Expression, Stimulus, connect

ROUNDS = 3

with connect(sys.argv[1]) as partner:
    choices, right = np.random.default_rng(1), 0
    for number in range(1, ROUNDS + 1):
        shown = str(choices.choice(partner.robot.feelings))
        wish = partner.express(Expression(shown, 0.9))
        for event in partner.events(after=wish):
            if event.wish == wish and event.kind in ("gesture_ended", "gesture_broken_off"):
                break
        guess = input(f"{number}. What did it show? ").strip().lower()
        right += guess == shown
        feeling = "happiness" if guess == shown else "sadness"
        partner.soon(partner.stimulate, Stimulus(feeling, 0.5))  # the game does not wait for it
        print("Right!" if guess == shown else f"It was {shown}.", flush=True)
    print(f"{right} of {ROUNDS}.", flush=True)
