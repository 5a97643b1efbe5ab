"""Section 2 of the paper: a safe robot partner.

Each function takes the :class:`~miburi.studies.paper.runs.Runs` and returns one
:class:`~miburi.studies.paper.claim.Claim`; its name is the claim's name.
"""

from math import ceil

import numpy as np

from miburi.safety.contact import PAPER_RATIO
from miburi.safety.stop import StopReason
from miburi.studies.paper.claim import Claim, ClaimVerdict, holds
from miburi.studies.paper.rule import FIRST_WINDOW, fastest, pass_map
from miburi.studies.paper.runs import Runs
from miburi.studies.trials.summary import summarise

__all__ = [
    "always_active",
    "effort",
    "on_the_card",
    "one_motor_stops_all",
    "period_and_card",
    "period_and_limit",
    "stops_at_once",
    "upper_arms",
]

_NOT_BUILT = "the emulated card has not been built here (`make firmware`)"
#: Speed below which a motor counts as stopped, rad/s; time within which it must have stopped, s
#: (our choice).
_STILL, _SOON = 0.1, 0.3
#: Stopping is direct if all stops come within 0.3 s after the first touch, and direct with a
#: condition if 95 % come within 0.15 s (our thresholds).
_DIRECT, _LATEST = 0.15, 0.3
#: The weight of a person's hand, N: 0.56 % of 60 kg (de Leva 1996).
_HAND = 3.3


def always_active(runs: Runs) -> Claim:
    """Block a body that is moving, one that is returning to neutral, and one at rest."""
    blocked = {
        "in a move": runs.moving,
        "on the way back": runs.returning,
        "at rest": runs.resting,
    }
    stopped = [when for when, what in blocked.items() if what.stop is not None]
    refused = sum(what.refused for what in blocked.values())
    return Claim(
        "2",
        "“It needs to be always active and given priority before any other mode.”",
        holds(len(stopped) == refused == len(blocked)),
        f"a hand in the way stops the body {', '.join(stopped) or 'never'} ({len(stopped)} of "
        f"{len(blocked)}), and the stopped body refuses a move ({refused} of {len(blocked)})",
        "at rest the stop has a name of its own, `touched`: the body gives way, and the mood stays",
    )


def on_the_card(runs: Runs) -> Claim:
    """Block a move on the emulated card after its host has gone silent."""
    sentence = (
        "“The security feature is always directly included into the body's movements, not "
        "depending on the orders of the robot's head.”"
    )
    if (card := runs.on_card) is None:
        return Claim("2", sentence, ClaimVerdict.UNKNOWN, _NOT_BUILT)
    return Claim(
        "2",
        sentence,
        holds(card.stop is not None and card.stop.reason is StopReason.CONTACT),
        "the firmware on the emulated card, whose host sent one move and then neither spoke nor "
        + (
            "listened, did not stop"
            if card.stop is None
            else f"listened, stops {card.silence:.1f} s after the host's last word "
            f"(reason: {card.stop.reason})"
        ),
        "the processor is emulated, the body is simulated",
    )


def period_and_card(runs: Runs) -> Claim:
    """Count the readings of the emulated card in a period."""
    sentence = "p is “balanced by the Arduino card's computing power”."
    if (card := runs.on_card) is None:
        return Claim("2", sentence, ClaimVerdict.UNKNOWN, _NOT_BUILT)
    # The longest gap is rounded up to the next 20 ms, because it varies with the firmware's
    # compiler.
    median, longest = 1e3 * np.median(card.gaps), 20 * ceil(50 * card.gaps.max())
    return Claim(
        "2",
        sentence,
        holds(longest < 100),
        f"the card reads all eight servos every {median:.0f} ms (at most {longest} ms), so a "
        f"period of 0.1 s has {100 / longest:.0f} to {100 / median:.0f} readings",
        "ATmega2560 at 16 MHz, emulated; bus at 1 Mbit/s",
    )


def one_motor_stops_all(runs: Runs) -> Claim:
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
    return Claim(
        "2",
        "“If the speed of only one motor is under the decided limit, the robot … directly stops "
        "its movement.”",
        holds(max(waits) <= _SOON),
        "one arm of two is blocked, in a move and on the way back (noticed at: "
        f"{', '.join(named) or 'none'}): all eight motors are slower than {_STILL:g} rad/s from "
        f"{1e3 * max(waits):.0f} ms after the stop on",
        "the speed is compared with that of a free servo, at every reading",
    )


def stops_at_once(runs: Runs) -> Claim:
    """Measure from the first touch to the stop, over the contact trials."""
    found = summarise(runs.outcomes)
    p95, latest = found.latency_p95 or np.inf, found.latency_max or np.inf
    return Claim(
        "2",
        "The robot “directly stops”: how late after the first touch?",
        holds(
            latest <= _LATEST,
            ClaimVerdict.HOLDS_IF if p95 <= _DIRECT else ClaimVerdict.DIFFERS,
        ),
        f"{found.blocked} trials: mean {1e3 * (found.latency_mean or np.inf):.0f} ms, 95 % within "
        f"{1e3 * p95:.0f} ms, the latest {1e3 * latest:.0f} ms; {found.late} later than 250 ms",
        "the condition is a contact that is neither soft nor near a joint's axis "
        "([contact safety](safety.md)); the stop reaches the servos about 15 ms later",
    )


def period_and_limit(runs: Runs) -> Claim:
    """Apply the rule as printed to free moves, with and without a lag."""
    moves = fastest(runs.robot, runs.moves)
    ideal, lagging = (
        float(pass_map(moves, np.array([lag]), np.array([ramp]))[0, 0])
        for lag, ramp in ((0.0, 1e9), (0.02, 40.0))
    )
    return Claim(
        "2",
        "p = 0.1 s and v = 0.9372 · v_sent are “the best operation” (Eqs. 1 and 2).",
        holds(PAPER_RATIO == 9372 and ideal == lagging == 1.0),
        f"as printed, a free move passes its first window only if lag + v / 2a ≤ "
        f"{1e3 * FIRST_WINDOW:.2f} ms: of {len(moves)} free moves {ideal:.0%} pass with a servo "
        f"that follows at once, {lagging:.0%} at a lag of 20 ms and a ramp of 40 rad/s²",
        "the paper does not describe its servos' ramps, and no sweep of p and v is made here",
    )


def effort(runs: Runs) -> Claim:
    """Compare the force that stops the robot with the weight of a hand."""
    found = summarise(runs.outcomes)
    pressed, peak = found.sustained_force_p95 or np.inf, found.peak_force_median or np.inf
    return Claim(
        "2",
        "“The effort needed to stop the robot's movement by applying a force on the top of its "
        "arms is very low: putting our hand on the robot's way without caring is sufficient.”",
        holds(
            max(pressed, peak) < _HAND,
            ClaimVerdict.HOLDS_IF if pressed < _HAND else ClaimVerdict.DIFFERS,
        ),
        f"{found.blocked} trials, anywhere on the arms: 95 % press on the person with "
        f"{pressed:.1f} N or less over 0.1 s; the peak of the first touch is {peak:.1f} N in the "
        f"median, {found.peak_force_p99:.0f} N or less in 99 %",
        "we take “very low” as less than a hand weighs, 3.3 N (0.56 % of 60 kg, de Leva 1996); the "
        "condition is a mean over 0.1 s, without the first touch's peak",
    )


def upper_arms(runs: Runs) -> Claim:
    """Put obstacles near the moves' paths, and count which link hits them first."""
    met = runs.met()
    share = met.upper_arm / sum(met)
    return Claim(
        "2",
        "“It is very unlikely for it to be blocked somewhere else than at the upper arms.”",
        holds(share > 0.9),
        f"of {sum(met)} random obstacles within 5 cm of the gestures' paths {share:.0%} meet an "
        f"upper arm first, {met.forearm / sum(met):.0%} a forearm or hand, "
        f"{met.phone / sum(met):.0%} the phone",
        "lengths and movement functions; an arm is taken as 2 cm thick to either side, and its "
        "upper arm as the link at the shoulder",
    )
