"""Section 2 of the paper: a safe robot partner."""

from functools import partial
from math import ceil

import numpy as np

from miburi.safety.contact import PAPER_RATIO
from miburi.safety.stop import StopReason
from miburi.studies.paper.claim import Claims, ClaimVerdict, Finding, claim, holds
from miburi.studies.paper.rule import FIRST_WINDOW, fastest, pass_map
from miburi.studies.paper.runs import Runs
from miburi.studies.trials.summary import summarise

_NOT_BUILT = "the emulated card has not been built here (`make firmware`)"
#: The speed in rad/s below which a motor counts as stopped, and the time in s within which it must
#: have stopped (our choice).
_STILL, _SOON = 0.1, 0.3
#: The claim that the body stops directly holds if all stops come within ``_LATEST`` s after the
#: first touch, and holds with a condition if 95 % come within ``_DIRECT`` s (our thresholds).
_DIRECT, _LATEST = 0.15, 0.3
#: The weight of a person's hand, in N: 0.56 % of the weight of 60 kg (de Leva 1996).
_HAND = 3.3

SAFETY: Claims = {}
_claim = partial(claim, SAFETY, "2")


@_claim(
    "“It needs to be always active and given priority before any other mode.”",
    ours="at rest the stop has a name of its own, `touched`: the body gives way, and "
    "the mood stays",
)
def _always_active(runs: Runs) -> Finding:
    blocked = {
        "in a move": runs.moving,
        "on the way back": runs.returning,
        "at rest": runs.resting,
    }
    stopped = [when for when, what in blocked.items() if what.stop is not None]
    refused = sum(what.refused for what in blocked.values())
    return holds(len(stopped) == refused == len(blocked)), (
        f"a hand in the way stops the body {', '.join(stopped) or 'never'} ({len(stopped)} of "
        f"{len(blocked)}), and the stopped body refuses a move ({refused} of {len(blocked)})"
    )


@_claim(
    "“The security feature is always directly included into the body's movements, not "
    "depending on the orders of the robot's head.”",
    ours="the processor is emulated, the body is simulated",
)
def _on_the_card(runs: Runs) -> Finding:
    """Block a move on the emulated card after its host has gone silent."""
    if (card := runs.on_card) is None:
        return ClaimVerdict.UNKNOWN, _NOT_BUILT
    return holds(card.stop is not None and card.stop.reason is StopReason.CONTACT), (
        "the firmware on the emulated card, whose host sent one move and then neither spoke nor "
        + (
            "listened, did not stop"
            if card.stop is None
            else f"listened, stops {card.silence:.1f} s after the host's last word "
            f"(reason: {card.stop.reason})"
        )
    )


@_claim(
    "“If the speed of only one motor is under the decided limit, the robot … directly stops "
    "its movement.”",
    ours="the speed is compared with that of a free servo, at every reading",
)
def _one_motor_stops_all(runs: Runs) -> Finding:
    """Look at all motors after a stop in a move, and after one on the way back."""
    waits, named = [], []
    for blocked in (runs.moving, runs.returning):
        if blocked.stop is None:
            waits.append(np.inf)
            continue
        if (name := str(blocked.stop.motor).replace("_", " ")) not in named:
            named.append(name)
        fast = np.abs(blocked.speeds) > _STILL
        late = np.flatnonzero(fast.any(axis=1))
        waits.append(float(blocked.times[late[-1]]) if len(late) else 0.0)
    return holds(max(waits) <= _SOON), (
        "one arm of two is blocked, in a move and on the way back (noticed at: "
        f"{', '.join(named) or 'none'}): all eight motors are slower than {_STILL:g} rad/s from "
        f"{1e3 * max(waits):.0f} ms after the stop on"
    )


@_claim(
    "The robot “directly stops”: how late after the first touch?",
    ours=(
        "the condition is a contact that is neither soft nor near a joint's axis "
        "([contact safety](safety.md)); the stop reaches the servos about 15 ms later"
    ),
)
def _stops_at_once(runs: Runs) -> Finding:
    found = summarise(runs.outcomes)
    p95, latest = found.latency_p95 or np.inf, found.latency_max or np.inf
    return holds(latest <= _LATEST, p95 <= _DIRECT), (
        f"{found.blocked} trials: mean {1e3 * (found.latency_mean or np.inf):.0f} ms, 95 % within "
        f"{1e3 * p95:.0f} ms, the latest {1e3 * latest:.0f} ms; {found.late} later than 250 ms"
    )


@_claim(
    "p = 0.1 s and v = 0.9372 · v_sent are “the best operation” (Eqs. 1 and 2).",
    ours="the paper does not describe its servos' ramps, and no sweep of p and v is made here",
)
def _period_and_limit(runs: Runs) -> Finding:
    """Apply the rule as printed to free moves, with and without a lag."""
    moves = fastest(runs.robot, runs.moves)
    ideal, lagging = (
        float(pass_map(moves, np.array([lag]), np.array([ramp]))[0, 0])
        for lag, ramp in ((0.0, 1e9), (0.02, 40.0))
    )
    return holds(PAPER_RATIO == 9372 and ideal == lagging == 1.0), (
        f"as printed, a free move passes its first window only if lag + v / 2a ≤ "
        f"{1e3 * FIRST_WINDOW:.2f} ms: of {len(moves)} free moves {ideal:.0%} pass with a servo "
        f"that follows at once, {lagging:.0%} at a lag of 20 ms and a ramp of 40 rad/s²"
    )


@_claim(
    "p is “balanced by the Arduino card's computing power”.",
    ours="ATmega2560 at 16 MHz, emulated; bus at 1 Mbit/s",
)
def _period_and_card(runs: Runs) -> Finding:
    if (card := runs.on_card) is None:
        return ClaimVerdict.UNKNOWN, _NOT_BUILT
    # The longest gap varies with the firmware's compiler, so it is rounded up to the next 20 ms.
    median, longest = 1e3 * np.median(card.gaps), 20 * ceil(50 * card.gaps.max())
    return holds(longest < 100), (
        f"the card reads all eight servos every {median:.0f} ms (at most {longest} ms), so a "
        f"period of 0.1 s has {100 / longest:.0f} to {100 / median:.0f} readings"
    )


@_claim(
    "“It is very unlikely for it to be blocked somewhere else than at the upper arms.”",
    ours=(
        "lengths and movement functions; an arm is taken as 2 cm thick to either side, and its "
        "upper arm as the link at the shoulder"
    ),
)
def _upper_arms(runs: Runs) -> Finding:
    """Put obstacles near the moves' paths, and count which link hits them first."""
    met = runs.met()
    share = met["upper_arm"] / met.total()
    return holds(share > 0.9), (
        f"of {met.total()} random obstacles within 5 cm of the gestures' paths {share:.0%} meet an "
        f"upper arm first, {met['forearm'] / met.total():.0%} a forearm or hand, "
        f"{met['phone'] / met.total():.0%} the phone"
    )


@_claim(
    "“The effort needed to stop the robot's movement by applying a force on the top of its "
    "arms is very low: putting our hand on the robot's way without caring is sufficient.”",
    ours=(
        "we take “very low” as less than a hand weighs, 3.3 N (0.56 % of 60 kg, de Leva 1996); the "
        "condition is a mean over 0.1 s, without the first touch's peak"
    ),
)
def _effort(runs: Runs) -> Finding:
    found = summarise(runs.outcomes)
    pressed, peak = found.sustained_force_p95 or np.inf, found.peak_force_median or np.inf
    return holds(max(pressed, peak) < _HAND, pressed < _HAND), (
        f"{found.blocked} trials, anywhere on the arms: 95 % press on the person with "
        f"{pressed:.1f} N or less over 0.1 s; the peak of the first touch is {peak:.1f} N in the "
        f"median, {found.peak_force_p99:.0f} N or less in 99 %"
    )
