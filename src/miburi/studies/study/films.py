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
from miburi.studies.study.plan import Study

#: The folder of films in a study's folder.
FILMS = "films"
#: A film's width and height in pixels.
_PIXELS = 640
#: The endings of a film made here, and of a sheet of pictures without ffmpeg.
_ENDINGS = (".mp4", ".sheet.png")


def find_films(study: Study, folder: Path) -> dict[str, Path]:
    """Return a study's existing film files by name."""
    there = {}
    for film in study.films:
        names = [film.file] if film.file else [film.name + end for end in _ENDINGS]
        files = [folder / FILMS / name for name in names if not film.live]
        if found := [file for file in files if file.is_file()]:
            there[film.name] = found[0]
    return there


def draw_missing(
    study: Study,
    folder: Path,
    robot: Robot,
    repertoire: Repertoire,
    progress: Callable[[int, int], None],
) -> dict[str, Path]:
    """Draw missing films, each whole or not at all; return every film's file by name.

    Raises InputError if one of the study's own films is not in its folder; OutputError if the
    folder cannot be written to, or this machine cannot draw.
    """
    there = find_films(study, folder)
    missing = [film for film in study.films if not film.live and film.name not in there]
    if own := [film.file for film in missing if film.file is not None]:
        raise InputError(f"{folder / FILMS} has no {', '.join(own)}; put it there.")
    for number, film in enumerate(missing):
        progress(number, len(missing))
        function = repertoire.of(film.feeling)[0]
        performance = rehearse(robot, key_poses(robot, function, film.mood))
        screen = face(Expression(film.feeling, film.mood)) if film.face else None
        with whole_files(folder / FILMS) as draft:
            path = draft / f"{film.name}.mp4"
            write_film(robot, performance, path, screen, pixels=_PIXELS, every=1)
    progress(len(missing), len(missing))
    return find_films(study, folder)
