"""A contact trial of your own: put a hand in the right arm's way, and measure the stop."""

import numpy as np

from miburi import (
    EmotionalModel,
    Expression,
    Partner,
    Simulated,
    forward,
    iphonoid,
    key_poses,
    load_gesture,
    solve,
)

robot = iphonoid()
happiness = load_gesture("happiness")
for mood in (0.5, 0.75, 1.0):
    goal = solve(robot, key_poses(robot, happiness, mood)[0].target, start=robot.neutral).angles
    on_the_way = forward(robot, robot.neutral + 0.6 * (goal - robot.neutral))[:3]  # right hand, m
    body = Simulated(robot)
    body.place_hand(on_the_way, along=np.array([1.0, 0.0, 0.0]))
    partner = Partner(body, EmotionalModel())
    partner.perform(Expression("happiness", mood))

    touch = body.touch
    while body.state.stop is None and body.state.time < 3.0:
        partner.step(0.01)
        touch = touch.then(body.touch)  # join both: the first moment, the largest force
    stop = body.state.stop
    if stop is None or touch.began is None:
        print(f"mood {mood}: not stopped by the hand; {touch.force:.1f} N")
    else:
        latency = stop.time - touch.began
        print(f"mood {mood}: stopped {1e3 * latency:.0f} ms after the touch, {touch.force:.1f} N")
