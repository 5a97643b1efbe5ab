"""What a card is told beside a move: speeds that its servos can do."""

import numpy as np

from miburi.card.order import Order
from miburi.card.settings import CardSettings
from miburi.robot import Robot
from miburi.safety.drive import aim
from miburi.safety.move import plan_move
from miburi.safety.profile import SECOND, to_steps


def test_a_motor_with_little_to_go_arrives_with_the_others(robot: Robot) -> None:
    """Servos count speeds in 15.6 steps/s: rounded down, 23 took 0.96 s where others took 0.65."""
    settings, rng = CardSettings.of(robot), np.random.default_rng(3)
    origin = to_steps(robot, aim(robot, robot.neutral))
    for _ in range(30):
        little = rng.uniform(-0.03, 0.03, 8)
        there = np.clip(robot.neutral + little, robot.lower, robot.upper)
        move = plan_move(robot, robot.neutral, there, 0.6)
        order = Order.of(robot, settings, origin, origin, move)
        assert order.profile(settings, origin)[0].total.max() <= 0.62 * SECOND
