"""Try dampings for the peers that solve a quadratic programme; ``peers.py`` uses the best.

``python bench/ik/damping.py`` prints median and mean time on 40 reachable targets, in µs, and how
many are solved. 1e-12 is the default of mink and pink, 1e-3 what mink's examples take.
"""

import numpy as np
from compare import GOOD, MIDDLE, SOLVED, measure
from peers import mink_solver, pink_solver, placo_solver
from targets import reachable

DAMPINGS = (1e-12, 1e-8, 1e-6, 1e-4)
ROUNDS = 5  # the dampings in turns


def main():
    targets = reachable(40)[1]
    for name, make in (("mink", mink_solver), ("pink", pink_solver), ("placo", placo_solver)):
        solvers = [make(damping) for damping in DAMPINGS]
        for solve in solvers:
            measure(solve, targets[:2], 1, 0.0, 1, [MIDDLE] * 2)
        found = np.array(
            [
                [measure(solve, part, 20, GOOD, 20, [MIDDLE] * len(part)) for solve in solvers]
                for part in np.split(targets, ROUNDS)
            ]
        )
        for k, damping in enumerate(DAMPINGS):
            spent, best = found[:, k, 0].ravel() * 1e6, found[:, k, 1].ravel()
            times = f"median {np.median(spent):8,.0f}  mean {spent.mean():8,.0f}"
            print(f"{name:6} {damping:6.0e}  {times}  solved {np.mean(best <= SOLVED):.0%}")


if __name__ == "__main__":
    main()
