"""Start the live partner and its server, and end both cleanly.

The partner's loop and its watchdog run here. The server (:mod:`miburi.host.process`) and the
reception, which accepts connections, are separate processes, so that neither can starve the loop or
the watchdog.
"""

import gc
import logging
import os
import sys
import threading
import webbrowser
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from queue import Empty, SimpleQueue

from miburi.bma.settings import Settings
from miburi.bodies import Body
from miburi.doors.doors import Doors
from miburi.errors import BodyError, InputError, OutputError, need
from miburi.feelings import EmotionalModel, FeelingModel, Stimulus, Temperament
from miburi.gestures import Repertoire
from miburi.ground.cores import coming_first
from miburi.ground.files import alone_in, check_readable, remove_whole
from miburi.host.given import Pages
from miburi.host.helpers import GLANCE, Helpers, Moment, signals, start_helpers, watch_process
from miburi.live.bodies import KINDS
from miburi.live.crossing.answering import Answering
from miburi.live.events.event import LiveEvent
from miburi.live.events.store import kept_events
from miburi.live.held import KeptHold
from miburi.live.memory import keep, remember, remembered
from miburi.live.recording.archive import Archive
from miburi.live.runner import Runner
from miburi.partner import solve_with
from miburi.robot import JOINTS, Robot
from miburi.safety.contact import Rule
from miburi.serving.addresses import listening_plainly, listening_twice
from miburi.serving.files import raise_limit
from miburi.serving.press import Press
from miburi.serving.reach import Reach, pairing_url, way_in
from miburi.serving.renewal import reach_of
from miburi.studio.words import FALLBACK, pressed_by, words
from miburi.talk.endpoint import Endpoint

#: Files without which the partner would forget something, so that it does not start if they cannot
#: be read. If stopped.txt cannot be read, it wakes up stopped.
_OWN = ("people.json", "manners.json", "events.sqlite", "events.sqlite-wal")
#: The stimulus that the partner feels at each start (our number).
GREETING = Stimulus("happiness", 0.8)
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Launch:
    """The settings of a partner and its server.

    Attributes
    ----------
    robot, repertoire, temperament
        The description of the body, its gestures, and the first temperament.
    emotional_model
        The model of emotion, feeling and mood.
    rule
        The contact rule for simulated bodies; None: the robot's own.
    settings
        Settings of the inverse kinematics; None: Miburi's default solver.
    body, port_of_body
        The kind of body, and the serial port of its Arduino card.
    host, port
        Where to listen; port 0 takes any free port.
    https
        Whether to serve https at ``host``, one port higher, and http only on this computer.
    headless
        Whether to open no browser.
    doors
        The doors (other protocols) that are open besides HTTP.
    folder
        The folder of the token, the partner's state and the recordings.
    forget
        Whether to delete the moods of the last run, and start in the resting moods.
    seed
        The seed for gestures and their small variations; 0 or more.
    programs_may_release
        Whether programs may release a person's Stop.
    """

    robot: Robot
    repertoire: Repertoire
    temperament: Temperament
    emotional_model: type[FeelingModel] = EmotionalModel
    rule: Rule | None = None
    settings: Settings | None = None
    body: str = "simulated"
    port_of_body: str | None = None
    host: str = "127.0.0.1"
    port: int = 8080
    https: bool = False
    headless: bool = False
    doors: Doors = field(default_factory=Doors)
    folder: Path | None = None
    forget: bool = False
    seed: int = 0
    programs_may_release: bool = False


def own_folder() -> Path:
    """Return Miburi's folder within XDG_STATE_HOME, by default ~/.local/state."""
    base = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(base) / "miburi"


def serve(launch: Launch, meanwhile: Callable[[], None] = lambda: None) -> None:
    """Run the live partner and its server until a signal to end; then return to neutral.

    The server answers until the body is at neutral. A body that somebody stopped stays where it is.

    Raises InputError if the seed, the host, the port or the body is not valid, or a file of the
    folder cannot be read; OutputError if the port or the folder is taken; BodyError if the body
    cannot be reached, or if the loop or the server has failed and the body was stopped.

    Parameters
    ----------
    meanwhile
        Called while the server's process loads its libraries.
    """
    _check(launch)
    with coming_first(), ExitStack() as alone:  # a Stop must not wait for other programs
        _serve(launch, meanwhile, alone)


def _serve(launch: Launch, meanwhile: Callable[[], None], alone: ExitStack) -> None:
    folder = launch.folder or own_folder()
    memory = _memory(folder, launch.emotional_model)
    for own in (memory, *map(folder.joinpath, _OWN)):
        check_readable(own)
    _keep_private(folder)
    listen = listening_twice if launch.https else listening_plainly
    with listen(launch.host, launch.port) as listeners:
        alone.enter_context(alone_in(folder))
        reach, certificate = reach_of(listeners, folder, datetime.now(UTC))
        helpers = start_helpers(Pages(listeners, reach, launch.doors, folder, certificate))
        url = listeners.url
    try:
        meanwhile()
        feelings = _feelings(launch, memory)
        runner = _wake(launch, feelings, folder)
        announce = partial(_announce, url, reach, folder, launch.doors.talk, launch.headless)
        end = _live(runner, helpers, memory, announce)
    finally:
        with signals(SimpleQueue()):  # a second Ctrl-C must leave no process behind
            helpers.end()
    kept = _keep(memory, feelings)
    if runner.failure is not None:
        raise BodyError(runner.failure)
    if end in _LEFT_ALONE:
        raise BodyError(
            f"{_LEFT_ALONE[end]}, so Stop would not have worked any more: the body was stopped "
            "where it was. If a line above says why, mend that; then start Miburi again."
        )
    _say_good_bye(runner, folder, kept=kept)


def _keep_private(folder: Path) -> None:
    """Make the partner's files, including those of earlier runs, readable by this user alone."""
    os.umask(0o077)  # in the helpers, too: they inherit it
    own = [folder / name for name in ("events.sqlite", "recordings")]
    for one in (*own, *folder.glob("feelings*.json"), *folder.glob("recordings/*.mcap")):
        with suppress(OSError):  # it is missing, or belongs to somebody else
            one.chmod(0o700 if one.is_dir() else 0o600)


def _check(launch: Launch) -> None:
    raise_limit()
    launch.doors.need()
    if launch.https:
        need("cryptography", "https")
    if launch.seed < 0:
        raise InputError(f"the seed must be 0 or more, got {launch.seed}.")
    if launch.body not in KINDS:
        raise InputError(f"the body must be one of {', '.join(KINDS)}, got {launch.body!r}.")
    if KINDS[launch.body].needs_port and not launch.port_of_body:
        raise InputError(
            f"the {launch.body} body needs a port, such as /dev/ttyACM0; give it one with "
            "--serial. `miburi card list` names the available ports."
        )
    if launch.rule is not None and launch.body == "card":
        raise InputError(
            "the card stores its calibration, so leave --calibration out; `miburi card load` puts "
            "a file onto a card."
        )


def _memory(folder: Path, model: type[FeelingModel]) -> Path:
    """Return the file of a model's feelings, which no other model can read."""
    other = "" if model is EmotionalModel else f"-{model.kind}"
    return folder / f"feelings{other}.json"


def _feelings(launch: Launch, memory: Path) -> FeelingModel:
    """Return the saved feelings or new ones, with the greeting."""
    kept = None
    try:
        if launch.forget:
            for earlier in (*memory.parent.glob("feelings*.json*"), memory):
                remove_whole(earlier)
        else:
            kept = remembered(memory, launch.temperament, launch.emotional_model)
    except InputError as error:
        _LOG.warning("%s", error)
    except OSError as error:
        _LOG.warning("%s: the last run's feelings cannot be deleted: %s.", memory, error)
    feelings = kept or launch.emotional_model(launch.temperament)
    feelings.stimulate(GREETING)
    return feelings


def _wake(launch: Launch, feelings: FeelingModel, folder: Path) -> Runner:
    runner = Runner(
        launch.robot,
        feelings,
        Archive(folder / "recordings"),
        body=launch.body,
        port=launch.port_of_body,
        seed=launch.seed,
        rule=launch.rule,
        repertoire=launch.repertoire,
        solve=solve_with(launch.settings),
        hold=KeptHold(folder / "stopped.txt", programs_may_release=launch.programs_may_release),
        events=kept_events(folder),
    )
    pressed = runner.history.latest
    if pressed is None or pressed.kind != "pressed":
        pressed = None
    if stopped := why_stopped(runner.body, pressed):
        print(stopped)
    return runner


def why_stopped(body: Body, pressed: LiveEvent | None = None) -> str | None:
    """Say why a body is stopped, which servos do not answer, and what to do; None if it is not.

    ``pressed`` tells who had stopped the body before this start.
    """
    stop = body.state.stop
    if stop is None:
        return None
    why = words(FALLBACK)["reason"][stop.reason]
    if pressed is not None:
        why = pressed_by(pressed.by or "person", pressed.detail, words(FALLBACK))
    said = f"The body is stopped: {why}. "
    silent = [
        f"{joint.replace('_', ' ')} (servo {motor.servo})"
        for joint, motor in zip(JOINTS, body.motors().each, strict=True)
        if motor.answers is False
    ]
    if silent:
        said += (
            f"No answer from: {', '.join(silent)}; check plugs and supply, and that no two servos "
            "have one number. "
        )
    return f"{said}Clear the space around the robot, then release it in the studio."


def _live(runner: Runner, helpers: Helpers, memory: Path, announce: Callable[[], None]) -> Moment:
    """Run the partner until something ends it, and close it; return the cause."""
    happenings: SimpleQueue[Moment] = SimpleQueue()
    runner.start(on_failure=lambda: happenings.put(Moment.LOOP_GAVE_UP))
    ending = threading.Event()
    threads = [
        threading.Thread(target=watch_process, args=(process, happening, happenings), daemon=True)
        for process, happening in zip(helpers.processes, _LEFT_ALONE, strict=False)
    ]
    arguments = (memory, runner.feelings, ending.wait)
    threads.append(threading.Thread(target=keep, args=arguments, daemon=True))
    for thread in threads:
        thread.start()
    gc.freeze()  # else a garbage collection of all this would make the loop late
    with signals(happenings):
        Answering(
            runner,
            helpers.server,
            on_ready=lambda: happenings.put(Moment.LISTENS),
            on_hang=lambda: happenings.put(Moment.HELPER_HANGS),
            reception=helpers.reception,
        )
        end = _next(happenings)
        if end is Moment.LISTENS:
            announce()
            end = _next(happenings)
        if end in _LEFT_ALONE:
            runner.stop(Press("partner"))  # nobody else can stop it now
        ending.set()
        runner.close()
    return end


#: Events after which Stop no longer works, each with a message. The first two are the ends of the
#: helper processes, in the order of ``Helpers.processes``.
_LEFT_ALONE = {
    Moment.SERVER_ENDED: "the server has ended",
    Moment.RECEPTION_ENDED: "the process that receives Stop has ended",
    Moment.HELPER_HANGS: "the server, or the process that receives Stop, hangs",
}


def _next(happenings: "SimpleQueue[Moment]") -> Moment:
    while True:
        with suppress(Empty):
            return happenings.get(timeout=GLANCE)


def _keep(path: Path, feelings: FeelingModel) -> bool:
    try:
        remember(path, feelings.save())
    except OutputError as error:
        print(f"miburi: {error}", file=sys.stderr)
        return False
    return True


def _say_good_bye(runner: Runner, folder: Path, *, kept: bool) -> None:
    if runner.held:
        how = "was stopped and holds its position with little force"
    elif runner.at_home:
        how = "rests at neutral"
    else:
        how = "could not be brought to neutral; please check it"
    remembers = f"; its feelings are saved in {folder}" if kept else ""
    with suppress(OSError):  # its terminal was closed
        print(f"Good-bye. The body {how}{remembers}.", flush=True)


def _announce(url: str, reach: Reach, folder: Path, talk: Endpoint | None, headless: bool) -> None:
    token, safe = reach.token, reach.authority is not None
    opened = url if token is None or safe else pairing_url(url, token)
    terminal = sys.stdout.isatty()  # others may read a file or a journal, so it gets no token
    shown = opened if terminal else url
    print(f"Miburi is awake. Studio: {shown}   face: {url}/face   (end with Ctrl-C)", flush=True)
    if talk is not None:
        print(f"What people say to the partner is sent to {talk}.", flush=True)
    if token is not None:
        where = token if terminal else f"in {folder / 'token'}, which only its owner may read."
        print(f"Token for programs and other devices: {where}")
    if token is not None and reach.addresses:
        first, *others = reach.addresses
        print(f"On a phone on the same network, {way_in(first, token)}")
        for other in others:
            print(f"On another network: {pairing_url(other, token if terminal else '')}")
    elif token is not None:
        print(
            "No phone can connect: this computer is not connected to a home network. Connect "
            "it, then start Miburi again."
        )
    if safe:
        print(
            "The phone warns once, because it does not trust this home's authority yet: continue, "
            f"or install the authority; {url}/pair says how.\nIts SHA-256 is {reach.fingerprint}"
        )
    sys.stdout.flush()
    if headless:
        return
    can_show = sys.platform in ("darwin", "win32") or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    )
    if not (can_show and webbrowser.open(opened)):
        print("No browser could be opened here; open the address above in one.", flush=True)
