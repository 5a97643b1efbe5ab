"""Write the page on contact safety from outcomes of trials: method, figures and tables."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from miburi.ground.templates import render
from miburi.studies.trials.charts import Point, distributions, rule_map_figure
from miburi.studies.trials.conditions import HandKind
from miburi.studies.trials.runs import as_array
from miburi.studies.trials.summary import ISO_LIMITS, LATE, MATTERS, summarise
from miburi.studies.trials.tables import iso_sentence, rows
from miburi.studies.trials.trial import Outcome

#: The speeds in the table of forces, in m/s.
CAPS = (0.1, 0.2, 0.3, 0.5, 0.8)
_PAGE = Path(__file__).with_suffix(".md")


def write_page(
    tables: Mapping[str, Mapping[str, Sequence[Outcome]]], points: Sequence[Point], folder: Path
) -> None:
    """Write ``safety.md`` and its pictures into ``folder``.

    ``tables`` has the trials for each column of the tables ``main``, ``states`` and ``parts``, of
    which the last two may be missing. The pictures show the first column of ``main``.
    """
    first = next(iter(tables["main"].values()))
    distributions(first, folder / "safety-distributions.png")
    rule_map_figure(points, folder / "safety-rules.png")
    summaries = {
        table: {name: summarise(some) for name, some in columns.items()}
        for table, columns in tables.items()
    }
    hands = {hand.value: [o for o in first if o.hand == hand] for hand in HandKind}
    by_hand = {hand: summarise(some) for hand, some in hands.items() if some}
    met = [o for o in first if o.touched and o.sustained_force >= MATTERS]
    late = [o for o in met if not o.stopped or o.latency > LATE]
    pushes = [o for o in first if o.push_after_stop >= 0]  # NaN without a stop
    rigid = hands[HandKind.RIGID.value]
    speeds, forces = as_array(rigid, "speed"), as_array(rigid, "peak_force")
    page = render(
        _PAGE,
        tables={name: (list(columns), rows(columns)) for name, columns in summaries.items()},
        hands=list(by_hand),
        by_hand=rows(by_hand),
        late=sorted(late, key=lambda o: -o.sustained_force),
        pushed=max(pushes, key=lambda o: o.push_after_stop, default=None),
        points=points,
        iso=iso_sentence(),
        caps=[(cap, forces[speeds <= cap]) for cap in CAPS],
        forces=forces,
        towards=as_array(hands[HandKind.TOWARDS.value], "peak_force"),
        fastest=speeds.max(initial=0.0),
        face=ISO_LIMITS["face"],
        median=np.median,
    )
    (folder / "safety.md").write_text(page, encoding="utf-8")
