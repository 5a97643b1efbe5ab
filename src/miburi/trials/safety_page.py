"""The page on contact safety: method, figures and tables, made from files of trials."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from miburi.trials.conditions import HandKind
from miburi.trials.figures import Point, distributions, rule_map_figure
from miburi.trials.report import iso_sentence, table
from miburi.trials.runs import as_array
from miburi.trials.summary import ISO_LIMITS, summarise
from miburi.trials.trial import Outcome

#: m/s: the caps of the table of speeds.
CAPS = (0.1, 0.2, 0.3, 0.5, 0.8)

_METHOD = """\
# Contact safety in numbers

The paper found its period p = 0.1 s and its limit 0.9372 "by real-situation tests". This page
shows the same rule, and the same rule with the guards that a ramped servo needs, in simulated
trials. `make docs-safety` makes the page; `miburi trials` makes the trials. The servo's constants
are generic and were not identified on hardware: the figures compare rules, they certify nothing.

## How a trial goes

A trial depends on its run's seed and its own number alone. The robot rests in a key pose of a
random gesture (any feeling, mood 0.1 to 1, varied as the partner varies it) and goes on from there:
two moves in a row where nobody is near, one move where somebody is. Drawn for each trial (ours):

| what | from | to |
|---|---|---|
| battery | 4.75 V | 5.25 V (torque and stiffness in proportion) |
| dry friction | × 0.75 | × 1.25 |
| load in each hand | 0 | 10 g |
| encoder noise | 0 | 0.3 steps (standard deviation) |
| setpoint heard late | 0 | 4 ms |
| what is met | upper arm, forearm, hand of either side, phone | at 30 to 100 % of its length |
| where on its way | 10 % | 90 %, with 15 mm still to go |
| friction of the skin | 0.3 | 1.0 |

The person's hand weighs 0.6 kg and hangs on springs: *rigid* (75 N/mm) stands as on a table;
*compliant* (0.5 to 5 N/mm) gives way; *towards* comes at 0.1 to 0.5 m/s and halts where it feels
the robot; *grasping* takes hold of the moving link. Who is not rigid stops pushing when the robot
has stopped.

What counts:

- A **false stop** is a stop before anybody was touched.
- A person is **in the way** if a robot that does not stop presses on them with 1 N or more over
  0.1 s. Who is only brushed past is counted as a brush, and somebody else is drawn; who is stopped
  for is kept, however lightly the touch. A **missed** contact is a person in the way whom no stop
  follows.
- **Latency** counts from the first touch, however light; beside it stand the latency from the
  moment at which the force reached 1 N, and that of the contacts which came to 2 N over 0.1 s.
- **Push after the stop** is the largest force from 0.3 s to 0.5 s after it.

Intervals are Wilson's, 95 %.

What is ours beside the guards: the rule looks at every reading of the encoders (10 ms), over the
travel since the last period's end. After a contact the body goes back along its path by a few
degrees at most, so that it does not go on pressing; its motors go on carrying their loads, so that
they do not sink onto whom they touch; and a motor that somebody still keeps from its place 0.15 s
later stays where it is, so that it does not push back.

A varied servo has half to twice the stiffness, another lag, ramp and friction, and 4096 or 1229
steps; each is calibrated from free motion of its own before its trials.
"""


def write_page(
    outcomes: Mapping[str, Sequence[Outcome]], points: Sequence[Point], folder: Path
) -> None:
    """Write ``safety.md`` and its pictures into ``folder``.

    ``outcomes`` are the trials of each column of the table; the first is shown in the pictures.
    """
    first = next(iter(outcomes.values()))
    distributions(first, folder / "safety-distributions.png")
    rule_map_figure(points, folder / "safety-rules.png")
    columns = {name: summarise(some) for name, some in outcomes.items()}
    parts = [
        _METHOD,
        "## Results\n",
        table(columns) + "\n",
        "The paper's rule as printed compares with the nominal speed: it stops nearly every move "
        "in its first window, before anybody can be met, so that its latencies and misses come "
        "from the few moves that it let begin. The late stops of our rule are at slow or soft "
        "contacts, or near a joint's axis, where the motor is hardly held back: a force of 1 N at "
        "20 mm from the axis turns the default servo by 3 steps of its encoder, and free motion is "
        "off by as much. What counts against them is the force.\n",
        "\n![How late, and how hard](safety-distributions.png)\n",
        "### By what the hand does\n",
        _by_hand(first),
        "\n## What p and the ratio bring and cost\n",
        "Recorded runs, judged again by each rule; the guards are made for the paper's point.\n",
        "![False stops against missed contacts](safety-rules.png)\n",
        _map_table(points),
        "\n## Forces beside ISO/TS 15066\n",
        iso_sentence() + "\n",
        _caps(first),
        "",
    ]
    (folder / "safety.md").write_text("\n".join(parts))


def _by_hand(outcomes: Sequence[Outcome]) -> str:
    hands = {hand.value: [o for o in outcomes if o.hand == hand] for hand in HandKind}
    return table({hand: summarise(some) for hand, some in hands.items() if some})


def _map_table(points: Sequence[Point]) -> str:
    lines = [
        "| rule | p (s) | ratio | false stops | missed | mean time to the stop (ms) |",
        "|---|---|---|---|---|---|",
    ]
    for p in points:
        does = p.verdict
        lines.append(
            f"| {'as printed' if p.printed else 'with guards'} | {p.period / 1e6:g} "
            f"| {p.ratio / 1e4:g} | {does.false_stops:.1%} | {does.missed:.1%} "
            f"| {1e3 * does.delay:.0f} |"
        )
    return "\n".join(lines)


def _caps(outcomes: Sequence[Outcome]) -> str:
    rigid = [o for o in outcomes if o.hand == HandKind.RIGID]
    speeds, forces = as_array(rigid, "speed"), as_array(rigid, "peak_force")
    face = ISO_LIMITS["face"]
    lines = [
        "What a rigid hand feels where the robot may go so fast, and not faster:\n",
        "| speed of what is met, up to (m/s) | contacts | median peak (N) | largest peak (N) "
        "| below the face's quasi-static 65 N |",
        "|---|---|---|---|---|",
    ]
    for cap in CAPS:
        some = forces[speeds <= cap]
        if len(some):
            share = f"{(some < face).sum()} of {len(some)}"
            lines.append(
                f"| {cap:g} | {len(some)} | {np.median(some):.1f} | {some.max():.1f} | {share} |"
            )
    if rigid and forces.max() < face:
        lines.append(
            f"\nEvery contact with a rigid hand stayed below {face} N, up to the fastest "
            f"({speeds.max():.2f} m/s). On face and head no transient contact is allowed at all: "
            "there these figures permit nothing."
        )
    return "\n".join(lines)
