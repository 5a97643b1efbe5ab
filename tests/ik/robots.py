"""Robots of the iphonoid's kind, drawn at random: other lengths, other limits."""

import numpy as np

from miburi.robot import JOINTS, iphonoid


def random_robots(count, seed):
    """Draw robots: each length 0.5 to 2 times the iphonoid's, each joint with limits of its own.

    A joint's range is 0.6 rad wide at least, anywhere from -π to π, and one in five is all of
    that, so that limits are asymmetric, left and right differ, and the head may nod over.
    """
    generator, robot = np.random.default_rng(seed), iphonoid()
    return [_random_robot(generator, robot, number) for number in range(count)]


def _random_robot(generator, robot, number):
    data = robot.model_dump()
    data["name"] = f"drawn_{number}"
    for name in data["lengths"]:
        data["lengths"][name] *= generator.uniform(0.5, 2.0)
    for name in JOINTS:
        low, high = -np.pi, np.pi
        if generator.uniform() > 0.2:
            width = generator.uniform(0.6, 2 * np.pi)
            low = generator.uniform(-np.pi, np.pi - width)
            high = min(low + width, np.pi)
        data["joints"][name] |= {"min": low, "max": high, "neutral": (low + high) / 2}
    return type(robot).model_validate(data)


def scaled(robot, factor):
    """Return the robot with all its lengths multiplied."""
    size = robot.lengths
    lengths = {name: getattr(size, name) * factor for name in type(size).model_fields}
    return robot.model_copy(update={"lengths": size.model_copy(update=lengths)})


def drawn_targets(robot, count, seed):
    """Return poses drawn uniformly inside the limits; their hands and head are in reach."""
    return np.random.default_rng(seed).uniform(robot.lower, robot.upper, (count, 8))
