"""Perform a gesture of your own, own_gesture.toml beside this file, on the simulated robot."""

from pathlib import Path

from miburi import (
    EmotionalModel,
    Expression,
    Partner,
    Simulated,
    forward,
    iphonoid,
    key_poses,
    load_gesture,
)

MOOD = 0.9  # from 0 to 1: how large and how fast

robot = iphonoid()
gesture = load_gesture(Path(__file__).with_name("own_gesture.toml"))
body = Simulated(robot)
partner = Partner(body, EmotionalModel())
partner.perform(Expression(gesture.feeling, MOOD), key_poses(robot, gesture, MOOD))
partner.step(0.2)
while partner.expression is not None:
    hand = 1000 * forward(robot, body.state.angles)[:3]
    print(f"{body.state.time:4.1f} s  right hand at {hand.round()} mm")
    partner.step(0.2)
