"""Move the robot's right hand forward and up, centimetre by centimetre."""

import numpy as np

from miburi import forward, iphonoid, solve

robot = iphonoid()
angles = robot.neutral
start = forward(robot, angles)  # right hand, left hand and head: nine coordinates in m
for centimetres in range(9):
    target = start + 0.01 * centimetres * np.array([1, 0, 1, 0, 0, 0, 0, 0, 0])
    solution = solve(robot, target, start=angles)  # start here, for a smooth path
    angles = solution.angles
    print(f"{centimetres} cm  error {1e3 * solution.error.max():6.3f} mm  {solution.status}")
    print("      rad ", " ".join(f"{angle:+.3f}" for angle in angles))
