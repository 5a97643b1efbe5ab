"""How long after a reading the order to stop is at the servos, with the real firmware.

    python bench/servos/order.py

A hand stands in the right arm's way, again and again, elsewhere each time. The bus between the
card and the emulated servos is listened to: when the places were asked for, and when the first goal
came after the reading that told of the contact. Needs `make firmware`.
"""

from typing import Any

import numpy as np

from miburi.card.card import wake
from miburi.emulation.body import EmulatedBody
from miburi.emulation.packets import SYNC_READ, SYNC_WRITE
from miburi.robot import forward, iphonoid
from miburi.safety.move import plan_move
from miburi.safety.stop import Phase

#: The register of the goal, and that of the present place or what is read with it.
GOAL, READ_FROM = 116, range(120, 136)


def main() -> None:
    for moving, others in (("one joint", 0.0), ("all joints", 0.3)):
        delays, gaps = measure(others)
        print(f"{moving} moving:")
        for what, values in (("reading to order", delays), ("reading to reading", gaps)):
            least, middle, most, longest = np.percentile(np.array(values) / 1000, (0, 50, 95, 100))
            print(
                f"  {what:20} median {middle:.1f} ms, 95th percentile {most:.1f}, "
                f"{least:.1f} to {longest:.1f}"
            )


def measure(others: float) -> tuple[list[float], list[float]]:
    """Return 60 delays, and the gaps between readings, in µs; other joints go ``others`` rad."""
    robot, rng = iphonoid(), np.random.default_rng(1)
    body = EmulatedBody(robot)
    bus: Any = body.emulation.bus
    heard: list[tuple[float, str]] = []
    obey = bus._obey

    def listen(servo: int, instruction: int, parameters: bytes, time: float) -> Any:
        register = int.from_bytes(parameters[:2], "little")
        if instruction == SYNC_READ and register in READ_FROM:
            heard.append((time, "read"))
        elif instruction == SYNC_WRITE and register <= GOAL < register + 32:
            heard.append((time, "goal"))
        return obey(servo, instruction, parameters, time)

    bus._obey = listen
    delays: list[float] = []
    gaps: list[float] = []
    while len(delays) < 60:
        goal = robot.neutral + others
        goal[1] = robot.neutral[1] + 1.4
        between = robot.neutral + rng.uniform(0.4, 0.7) * (goal - robot.neutral)
        body.place_hand(
            forward(robot, between)[:3] + np.array([0.012, 0, 0]), np.array([0.0, 1.0, 0.0])
        )
        heard.clear()
        body.move(plan_move(robot, robot.neutral, goal, float(rng.uniform(0.4, 1.2))))
        while body.step(0.02).phase is Phase.MOVING:
            pass
        body.remove_hand()
        if body.state.phase is Phase.IDLE:  # it passed by
            body.move(plan_move(robot, goal, robot.neutral, 1.0))
            body.step(2.0)
            continue
        # The card's clock starts 2 ms after the emulator's, so its own time of the stop is no use.
        seen = body.report.stop_time
        told = min(time for time, what in heard if what == "goal" and time > seen)
        reads = [time for time, what in heard if what == "read" and time < told]
        delays.append(told - reads[-1])
        gaps += np.diff(reads).tolist()
        body.step(1.0)
        wake(body)
    body.close()
    return delays, gaps


if __name__ == "__main__":
    main()
