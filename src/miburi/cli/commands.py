"""The command ``miburi``: parse the arguments, call the library, print the result."""

import io
import os
import signal
import sys
import threading
from importlib import import_module
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer

from miburi.cli.card import app as card_app
from miburi.cli.devices import devices_app
from miburi.cli.experiments import day, experiment, paper
from miburi.cli.export import export, template, to_ros
from miburi.cli.fleet import fleet
from miburi.cli.gestures import gallery, gesture_app
from miburi.cli.hardware import hardware_app
from miburi.cli.kinematics import forward, ik
from miburi.cli.live import feel, mcp, status, stop
from miburi.cli.robots import robot_app
from miburi.cli.run import run
from miburi.cli.senses import listen, say, words
from miburi.cli.study import study_app
from miburi.cli.trials import calibrate, safety_page, trials, tune
from miburi.cli.wrong import Explaining
from miburi.errors import InputError, MiburiError
from miburi.ground.ending import ending_signals
from miburi.ground.log import log_to_stderr
from miburi.version import __version__

app = typer.Typer(
    cls=Explaining,
    help="Feelings that show in a small robot's whole body, and a body that is safe to touch.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
_NEGATIVE_NUMBERS = {"ignore_unknown_options": True}
#: The groups of commands, in the order of their help.
_LIVE, _MAKE, _MEASURE = "Live with it", "Make it yours", "Measure"
_BUILD, _DOCUMENTS = "Build and calibrate", "For Miburi's own documents"

#: A signal whose exception was swallowed is raised again after this time, in s (our choice).
_LATER = 0.02


class _Interrupted(BaseException):
    """A signal to end; no except clause for errors catches it, so only clean-up code runs."""

    #: The latest signal, if any.
    signum: int | None = None


def main() -> None:
    """Run the command line; an error becomes one clear line and an exit code."""
    for number in ending_signals():
        signal.signal(number, _interrupt)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # On Windows, a pipe cannot encode arrows or a mu, so these are replaced. Lines are not
            # held back, so that a reader gets each line at once.
            stream.reconfigure(errors="replace", line_buffering=True)
    try:
        log_to_stderr()
        app()
    except InputError as error:
        sys.exit(_report(error, 2))
    except MiburiError as error:
        sys.exit(_report(error, 1))
    except BaseException as error:
        # Interrupted code, such as a compiler, may raise its own error.
        if _Interrupted.signum is None or isinstance(error, SystemExit):
            raise
        print("miburi: interrupted.", file=sys.stderr)
        sys.exit(128 + _Interrupted.signum)
    finally:
        # From now on a signal just ends the process.
        for number in ending_signals():
            signal.signal(number, signal.SIG_DFL)


def _interrupt(signum: int, frame: FrameType | None) -> None:
    _Interrupted.signum = signum
    sys.unraisablehook = _after_an_interruption
    while frame is not None:
        if frame.f_code.co_name in ("__del__", _after_an_interruption.__name__):
            _interrupt_later(signum)  # an exception raised there would be lost
            return
        frame = frame.f_back
    raise _Interrupted


def _after_an_interruption(lost: "sys.UnraisableHookArgs") -> None:
    """Hide errors of objects that were left half-made; if a signal was lost there, send it again.

    Numba's compiler calls Python from C, where an exception cannot propagate.
    """
    if lost.exc_type is _Interrupted and _Interrupted.signum is not None:
        _interrupt_later(_Interrupted.signum)


def _interrupt_later(signum: int) -> None:
    again = threading.Timer(_LATER, signal.raise_signal, [signum])
    again.daemon = True
    again.start()


def _report(error: MiburiError, code: int) -> int:
    print(f"miburi: {error}", file=sys.stderr)
    return code


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"miburi {__version__}")
        raise typer.Exit


def _choose_feelings(path: Path | None) -> Path | None:
    if path is not None:
        # child processes inherit the variable
        os.environ["MIBURI_FEELINGS"] = str(path.resolve())
        import_module("miburi.feelings")  # refuses a wrong file now, before anything else
    return path


@app.callback()
def common(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
    feelings: Annotated[
        Path | None,
        typer.Option(
            help="A file of feelings; by default, the eight of the paper that Miburi is built on.",
            envvar="MIBURI_FEELINGS",
            callback=_choose_feelings,
        ),
    ] = None,
) -> None:
    """Miburi (身振り): gesture."""


feelings_app = typer.Typer(help="The emotional model.", no_args_is_help=True)
feelings_app.command()(day)


for panel, commands in (
    (_LIVE, (run, status, feel, say, stop, listen, mcp, fleet)),
    (_MAKE, (words, template, export, forward, ik)),
    (_MEASURE, (experiment, trials, to_ros)),
    (_BUILD, (calibrate, tune)),
    (_DOCUMENTS, (paper, gallery, safety_page)),
):
    for command in commands:
        settings = _NEGATIVE_NUMBERS if command in (forward, ik) else None
        app.command(rich_help_panel=panel, context_settings=settings)(command)
for panel, name, group in (
    (_LIVE, "devices", devices_app),
    (_MAKE, "gesture", gesture_app),
    (_MAKE, "feelings", feelings_app),
    (_MAKE, "robot", robot_app),
    (_MEASURE, "study", study_app),
    (_BUILD, "card", card_app),
    (_BUILD, "hardware", hardware_app),
):
    app.add_typer(group, name=name, rich_help_panel=panel)
