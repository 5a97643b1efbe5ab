"""A study's films, in its folder ``films``; Miburi makes those that the study does not supply."""

from collections.abc import Callable
from pathlib import Path

from miburi.bodies.rehearsal import rehearse
from miburi.errors import InputError
from miburi.feelings import Expression
from miburi.gestures import Repertoire, key_poses
from miburi.ground.files import whole_files
from miburi.robot import Robot
from miburi.studies.face import face
from miburi.studies.gestures.pictures import film as write_film
from miburi.studies.study.plan import Film, Study

__all__ = ["FILMS", "draw_missing", "find_films"]

#: The folder of films in a study's folder.
FILMS = "films"
#: A film's width and height. Every sample of the recording becomes a frame, 50 per second.
_PIXELS = 640
#: The endings of a film that is made here; without ffmpeg it is a sheet of pictures.
_ENDINGS = (".mp4", ".sheet.png")


def find_films(study: Study, folder: Path) -> dict[str, Path]:
    """Return a study's existing film files, keyed by the films' names."""
    files = {
        film.name: [
            folder / FILMS / name
            for name in ([film.file] if film.file else [film.name + end for end in _ENDINGS])
        ]
        for film in study.films
        if not film.live
    }
    there = {name: [file for file in each if file.is_file()] for name, each in files.items()}
    return {name: each[0] for name, each in there.items() if each}


def draw_missing(
    study: Study,
    folder: Path,
    robot: Robot,
    repertoire: Repertoire,
    progress: Callable[[int, int], None] = lambda _done, _of: None,
) -> dict[str, Path]:
    """Draw the films that are missing, one after another; each is written whole or not at all.

    Returns
    -------
    The file of every film, by the films' names.

    Raises
    ------
    InputError
        A film that the study supplies itself is not in its folder.
    OutputError
        The folder cannot be written to, or this machine cannot draw.
    """
    there = find_films(study, folder)
    missing = [film for film in study.films if not film.live and film.name not in there]
    if own := [film.file for film in missing if film.file is not None]:
        raise InputError(f"{folder / FILMS} has no {', '.join(own)}; put it there.")
    for number, film in enumerate(missing):
        progress(number, len(missing))
        _draw(film, folder / FILMS, robot, repertoire)
    progress(len(missing), len(missing))
    return find_films(study, folder)


def _draw(film: Film, folder: Path, robot: Robot, repertoire: Repertoire) -> None:
    function = repertoire.of(film.feeling)[0]
    performance = rehearse(robot, key_poses(robot, function, film.mood))
    screen = face(Expression(film.feeling, film.mood)) if film.face else None
    with whole_files(folder) as draft:
        path = draft / f"{film.name}.mp4"
        write_film(robot, performance, path, screen, pixels=_PIXELS, every=1)
