"""``miburi study …``: parse the arguments, call, print."""

import io
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from miburi.cli.live import partner_at
from miburi.cli.options import (
    GesturesFolder,
    RobotFile,
    must_be_one_of,
    repertoire_of,
    robot_of,
)
from miburi.cli.trials import show_progress
from miburi.errors import InputError

if TYPE_CHECKING:
    from miburi.studies.study.plan import Study
    from miburi.studies.study.store import Store


study_app = typer.Typer(
    help="Ask people which feelings they recognise in the gestures.", no_args_is_help=True
)

Folder = Annotated[Path, typer.Argument(help="The study's folder.")]


@study_app.command()
def new(folder: Folder) -> None:
    """Begin a study: write study.toml, about the eight feelings, into a folder."""
    from miburi.ground.files import whole_files
    from miburi.studies.study.plan import FILE, TEMPLATE

    if (folder / FILE).exists():
        raise InputError(f"{folder / FILE} already exists; choose another folder.")
    with whole_files(folder) as draft:
        (draft / FILE).write_text(TEMPLATE.read_text(encoding="utf-8"), encoding="utf-8")
    print(
        f"{folder / FILE}: fill in the parts in brackets, and change what you like. Then: "
        f"miburi study run {folder}"
    )


@study_app.command()
def run(
    folder: Folder,
    host: Annotated[
        str, typer.Option(help="The address to listen on; 0.0.0.0 lets every device in.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="The port to listen on; 0 takes a free one.")] = 8090,
    partner: Annotated[
        str, typer.Option(help="Address of the robot that makes a study's live gestures.")
    ] = "http://127.0.0.1:8080",
    robot: RobotFile = None,
    gestures: GesturesFolder = None,
    rehearsal: Annotated[
        bool, typer.Option("--rehearsal", help="Try it out: answers are kept apart.")
    ] = False,
) -> None:
    """Make the films that are missing, and serve the study's pages until Ctrl-C."""
    from miburi.studies.study.plan import FILE, load_study

    study = load_study(folder)
    if study.unfilled and not rehearsal:
        raise InputError(
            f"{folder / FILE}: {len(study.unfilled)} places are not filled in, such as "
            f"{study.unfilled[0]}. Fill in what people must know, or try the pages out with "
            "--rehearsal."
        )
    # These load slowly, so the checks above come first.
    from miburi.studies.study.films import draw_missing, find_films
    from miburi.studies.study.live import facts_of
    from miburi.studies.study.server import serve_study
    from miburi.studies.study.store import ANSWERS, REHEARSED, open_store

    answers = folder / (REHEARSED if rehearsal else ANSWERS)
    store = open_store(answers, study)
    if store.closed:
        raise InputError(f"{folder}: this study is closed; begin a new one in another folder.")
    films = find_films(study, folder)
    if len(films) < sum(not film.live for film in study.films):
        body = robot_of(robot)
        with show_progress("films") as progress:
            films = draw_missing(study, folder, body, repertoire_of(body, gestures), progress)

    def say(chosen: int) -> None:
        for name in _names(host):
            print(f"http://{name}:{chosen}/study/{study.name}", flush=True)
        print("(end with Ctrl-C)", flush=True)

    with ExitStack() as stack:
        living = None
        if any(film.live for film in study.films):
            living = stack.enter_context(partner_at(partner))
            store.note_partner(facts_of(living))
            print(f"{partner} makes the gestures, with its {living.state.body} body.", flush=True)
        serve_study(study, store, films, host, port, say, living)
    onward = f" Next: miburi study report {folder}" + (" --rehearsal" if rehearsal else "")
    print(f"The answers are in {answers}.{onward}")


@study_app.command()
def report(
    folder: Folder,
    out: Annotated[Path | None, typer.Option(help="Default: report in the study's folder.")] = None,
    rehearsal: Annotated[
        bool, typer.Option("--rehearsal", help="Sum up the answers of a rehearsal.")
    ] = False,
) -> None:
    """Sum up the answers: a page with figures, JSON, CSV and Parquet."""
    from miburi.studies.study.plan import load_study
    from miburi.studies.study.report import write_report

    out = out or folder / ("rehearsal-report" if rehearsal else "report")
    print(write_report(load_study(folder), folder, out, rehearsal=rehearsal))


@study_app.command()
def text(
    folder: Folder,
    language: Annotated[
        str | None, typer.Option(help="One of the study's languages; default: all of them.")
    ] = None,
) -> None:
    """Print what a participant reads, e.g. for an ethics board; small notices are left out."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(encoding="utf-8")  # also for a file on Windows
    from miburi.studies.study.plan import load_study
    from miburi.studies.study.texts import participant_text

    study = load_study(folder)
    if language is not None:
        must_be_one_of(study.languages, language, "--language")
    chosen = study.languages if language is None else [language]
    print("\n".join(participant_text(study, each) for each in chosen), end="")


@study_app.command()
def withdraw(
    folder: Folder,
    code: Annotated[str, typer.Argument(help="The code that a participant sent to you.")],
    rehearsal: Annotated[
        bool, typer.Option("--rehearsal", help="Delete from the answers of a rehearsal.")
    ] = False,
) -> None:
    """Delete the answers of a participant who asks for it, as the withdrawal page does."""
    from miburi.studies.study.plan import load_study
    from miburi.studies.study.posted import read_code

    answers = _answers(folder, load_study(folder), rehearsal=rehearsal)
    if not answers.withdraw(read_code(code)):
        raise InputError(
            f"no answers in {answers.path} have code {code!r}, so nothing was deleted; codes look "
            "like K7QM-2XHD."
        )
    print(
        f"Deleted. Earlier copies and reports still have these answers: delete those, "
        f"and make a new report with miburi study report {folder}"
        + (" --rehearsal" if rehearsal else "")
    )


@study_app.command()
def close(
    folder: Folder,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask whether you are sure.")] = False,
) -> None:
    """End a study: erase the participants' codes, so that no answer can be traced to anybody."""
    from miburi.studies.study.plan import load_study

    answers = _answers(folder, load_study(folder))
    if not yes:
        print("This ends the study for good. No answer can be withdrawn after that.")
        typer.confirm("Erase the participants' codes?", abort=True)
    erased = answers.close()
    print(
        f"{folder} is closed. Codes erased: {erased}. Nobody can answer or withdraw any more. "
        "Delete older copies of the answers: they still have the codes."
    )


def _answers(folder: Path, study: "Study", *, rehearsal: bool = False) -> "Store":
    """Open a study's answers; raise InputError if nobody has answered yet."""
    from miburi.studies.study.store import ANSWERS, REHEARSED, open_store

    path = folder / (REHEARSED if rehearsal else ANSWERS)
    if not path.is_file():
        raise InputError(f"{folder} has no {path.name}: nobody has answered yet.")
    return open_store(path, study)


def _names(host: str) -> list[str]:
    if host != "0.0.0.0":  # noqa: S104  (to compare with, not to listen on)
        return [host]
    from miburi.serving.addresses import own_addresses

    return own_addresses() or ["127.0.0.1"]
