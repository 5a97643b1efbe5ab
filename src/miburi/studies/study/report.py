"""The report on a study: a page with figures, findings as JSON, answers as CSV and Parquet."""

import csv
import hashlib
import json
from collections.abc import Collection, Mapping
from dataclasses import asdict
from pathlib import Path

import numpy as np

from miburi.errors import InputError, need
from miburi.feelings.catalogue import CATALOGUE
from miburi.ground.files import whole_files
from miburi.ground.templates import render
from miburi.studies.figures import PRINT, figure_file
from miburi.studies.study.films import find_films
from miburi.studies.study.findings import find
from miburi.studies.study.found import ChoiceFindings, RatingFindings
from miburi.studies.study.kept import AnswerPace, Shown, StudyAnswer
from miburi.studies.study.plan import Study
from miburi.studies.study.store import ANSWERS, REHEARSED, open_store
from miburi.version import __version__

_PAGE = Path(__file__).with_suffix(".html")


#: The columns of answers.csv and answers.parquet; a participant is only a number.
_COLUMNS = {
    "participant": "int32",
    "language": "string",
    "step": "int32",
    "film": "string",
    "feeling": "string",
    "mood": "float64",
    "face": "bool",
    "whole": "int32",  # how often a live gesture was shown to its end in that trial;
    "broken": "int32",  # how often it was interrupted;
    "others": "int32",  # how often another came before the answer. All are None for a film
    "question": "string",
    "item": "string",
    "value": "string",
    "practice": "bool",
    "seconds": "float64",  # how long the page took, or None
    "plays": "int32",  # how often its film was started, or None
    "left_out": "bool",  # whether the findings leave the participant out
}
Row = tuple[object, ...]


def write_report(study: Study, folder: Path, out: Path, *, rehearsal: bool = False) -> Path:
    """Write the report on a study's answers, or on those of its rehearsal (a trial run).

    Return the page, ``index.html``; ``findings.json``, ``answers.csv``, ``answers.parquet`` and
    figures are beside it. The same answers give the same page, JSON and CSV, byte for byte.

    Raises InputError if there are no answers yet; OutputError if the answers belong to another
    study, or the folder cannot be written to; MiburiError if PyArrow or SciPy is not installed.
    """
    for library in ("pyarrow", "scipy"):
        need(library, "studies")
    kept = folder / (REHEARSED if rehearsal else ANSWERS)
    if not kept.is_file():
        tried = not rehearsal and (folder / REHEARSED).is_file()
        hint = " For the answers of its rehearsal, add --rehearsal." if tried else ""
        raise InputError(f"{folder} has no {kept.name}: nobody has answered yet.{hint}")
    store = open_store(kept, study, reading=True)
    answers, showings, paces = store.answers(), store.showings(), store.paces()
    counts = store.counts(len(study.steps))
    findings = find(study, answers, counts, showings, paces, store.wordings())
    gone = {one.participant for one in findings.left_out}
    made_with = {
        "miburi": __version__,
        "films": {
            name: hashlib.sha256(path.read_bytes()).hexdigest()
            for name, path in sorted(find_films(study, folder).items())
        },
        "partners": store.partners(),
    }
    with whole_files(out) as draft:
        _write_rows([_row(answer, study, showings, paces, gone) for answer in answers], draft)
        for choice in findings.choices:
            _confusion_figure(choice, draft / f"{choice.question}.png")
        for rating in findings.ratings:
            if rating.means:
                _mood_figure(rating, draft / f"{rating.question}.png")
        numbers = json.dumps(
            asdict(findings) | {"made_with": made_with}, indent=2, ensure_ascii=False
        )
        (draft / "findings.json").write_text(numbers + "\n", encoding="utf-8")
        page = render(
            _PAGE,
            study=study,
            language=study.languages[0],
            rehearsal=rehearsal,
            findings=findings,
            made_with=made_with,
        )
        (draft / "index.html").write_text(page, encoding="utf-8")
    return out / "index.html"


def _row(
    answer: StudyAnswer,
    study: Study,
    showings: Mapping[tuple[int, int], Shown],
    paces: Mapping[tuple[int, int], AnswerPace],
    gone: Collection[int],
) -> Row:
    pace = paces.get((answer.participant, answer.step), AnswerPace())
    film = next((film for film in study.films if film.name == answer.film), None)
    trial = study.steps[answer.step].trial
    live = film is not None and film.live and trial is not None
    shown = showings.get((answer.participant, trial or 0), Shown()) if live else None
    return (
        answer.participant,
        answer.language,
        answer.step,
        answer.film,
        film.feeling if film else None,
        film.mood if film else None,
        film.face if film and not film.live else None,
        shown.whole if shown else None,
        shown.broken if shown else None,
        shown.others if shown else None,
        answer.question,
        answer.item,
        answer.value,
        study.steps[answer.step].practice,
        pace.seconds,
        pace.plays,
        answer.participant in gone,
    )


def _write_rows(rows: list[Row], folder: Path) -> None:
    import pyarrow
    import pyarrow.parquet

    with (folder / "answers.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(_COLUMNS)
        writer.writerows(map(_safe, rows))
    columns = zip(*rows, strict=True) if rows else [()] * len(_COLUMNS)
    table = pyarrow.table(
        {
            name: pyarrow.array(column, pyarrow.type_for_alias(kind))
            for (name, kind), column in zip(_COLUMNS.items(), columns, strict=True)
        }
    )
    pyarrow.parquet.write_table(table, folder / "answers.parquet", compression="zstd")


def _safe(cells: Row) -> list[object]:
    """Return cells that a spreadsheet does not read as formulas."""
    return [
        f"'{cell}" if isinstance(cell, str) and cell[:1] in ("=", "+", "-", "@") else cell
        for cell in cells
    ]


def _confusion_figure(choice: ChoiceFindings, path: Path) -> None:
    rows = [k for k, label in enumerate(choice.labels) if label in choice.by_feeling]
    table = np.array(choice.confusion, dtype=np.float64)[rows]
    shares = table / np.maximum(table.sum(axis=1, keepdims=True), 1)
    side = 1.8 + 0.62 * len(choice.labels)
    with figure_file(path, (side, 1.5 + 0.5 * len(rows)), {"font.size": 9}) as figure:
        ax = figure.subplots()
        ax.imshow(shares, vmin=0, vmax=1, cmap="Oranges", aspect="auto")
        for (row, column), count in np.ndenumerate(table.astype(int)):
            if count:
                dark = shares[row, column] > 0.6
                ax.text(column, row, str(count), ha="center", va="center",
                        color="white" if dark else "black")  # fmt: skip
        ax.set_xticks(range(len(choice.labels)), choice.labels, rotation=45, ha="right")
        ax.set_yticks(range(len(rows)), [choice.labels[k] for k in rows])
        ax.set(xlabel="chosen", ylabel="intended")


def _mood_figure(rating: RatingFindings, path: Path) -> None:
    colours = {feeling.name: feeling.colour.paper for feeling in CATALOGUE.feeling}
    with figure_file(path, (6.4, 3.4), PRINT) as figure:
        ax = figure.subplots()
        for place, (feeling, row) in enumerate(rating.means.items()):
            aside = 0.006 * (place - (len(rating.means) - 1) / 2)  # or equal means overlap
            places = [float(mood) + aside for mood in row]
            means = [one.mean or np.nan for one in row.values()]
            ends = [(one.low or np.nan, one.high or np.nan) for one in row.values()]
            ax.vlines(places, *zip(*ends, strict=True), color=colours[feeling], lw=0.7, alpha=0.6)
            ax.plot(places, means, "o-", color=colours[feeling], label=feeling)
        ax.set(xlabel="mood μ", ylabel=f"mean rating, {rating.question}", ylim=(1, rating.points))
        figure.legend(loc="outside right upper", frameon=False)
