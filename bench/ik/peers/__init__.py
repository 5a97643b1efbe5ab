"""Other people's solvers behind one face: each is called the quickest way that its library allows.

A maker takes whether the targets are in reach, and returns (target (9,) m, start (8,) rad) → pose
(8,) rad. In reach a solver may stop at a residual of 1e-4 m. What it calls at each evaluation is
compiled. The adapters were written by an advocate of these libraries, who did not know Miburi's
solver. A peer that is not installed is left out.
"""

from peers.arms import make_eaik, make_ikgeo, make_ikpy, make_rtb
from peers.body import ROBOT
from peers.optimisers import (
    make_cma,
    make_de,
    make_lbfgsb,
    make_leastsq,
    make_pymoo,
    make_slsqp,
    make_trf,
)
from peers.trees import make_mink, make_pin, make_pink, make_placo

__all__ = ["MISSING", "PEERS", "ROBOT"]

#: name in the table → (its maker, distribution, starts allowed, targets a round in reach and
#: out of reach; 0 where it has no answer)
PEERS = {
    "EAIK (arms apart)": (make_eaik, "eaik", 1, 500, 0),
    "IK-Geo (arms apart)": (make_ikgeo, "ik-geo", 1, 500, 0),
    "placo": (make_placo, "placo", 20, 200, 20),
    "pinocchio, own LM": (make_pin, "pin", 20, 200, 20),
    "mink (daqp)": (make_mink, "mink", 20, 60, 10),
    "pink (daqp)": (make_pink, "pin-pink", 20, 60, 10),
    "robotics toolbox ik_LM (arms apart)": (make_rtb, "roboticstoolbox-python", 1, 300, 0),
    "ikpy (arms apart)": (make_ikpy, "ikpy", 20, 10, 0),
    "scipy trf": (make_trf, "scipy", 20, 20, 5),
    "scipy leastsq, angles as sines": (make_leastsq, "scipy", 20, 100, 10),
    "scipy L-BFGS-B": (make_lbfgsb, "scipy", 20, 20, 5),
    "scipy SLSQP": (make_slsqp, "scipy", 20, 20, 5),
    "cma": (make_cma, "cma", 20, 5, 0),
    "scipy differential evolution": (make_de, "scipy", 20, 10, 0),
    "pymoo DE": (make_pymoo, "pymoo", 20, 5, 0),
}

#: Peers one would expect, and why they are not here.
MISSING = {
    "optik": "is not in the package index that we used",
    "ssik": (
        "is missing because it works like EAIK and IK-Geo, and only for arms of six or seven joints"
    ),
}
