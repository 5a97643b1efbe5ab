"""Start the live partner and its server, and bring both to a good end."""

import os
import signal
import socket
import sys
import threading
import time
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

import uvicorn

from miburi.errors import BodyError, InputError, OutputError
from miburi.feelings import EmotionalModel, Stimulus, Temperament
from miburi.gestures import Repertoire
from miburi.interface.access import Gate, is_loopback, kept_token
from miburi.interface.http import configure
from miburi.live.archive import Archive
from miburi.live.bodies import KINDS
from miburi.live.memory import keep, remember, remembered
from miburi.live.runner import Runner
from miburi.robot import Robot
from miburi.safety.contact import Rule
from miburi.studio.words import FALLBACK, words

__all__ = ["GREETING", "Wish", "own_folder", "serve"]

#: A partner that wakes is glad to see people (ours).
GREETING = Stimulus("happiness", 0.8)
#: Hosts that mean every address of this computer. To compare with, not to listen on: S104.
_EVERYWHERE = ("0.0.0.0", "::", "")  # noqa: S104


@dataclass(frozen=True)
class Wish:
    """How the server shall be started.

    Attributes
    ----------
    robot, repertoire, temperament
        The body on paper, its gestures, and the character to begin with.
    rule
        The contact rule of simulated bodies; None: the robot's own.
    body, port_of_body
        The kind of body, and a card's serial port.
    host, port
        Where to listen; port 0 takes any that is free.
    headless
        Open no browser.
    folder
        Where the token, the partner's state and recordings are kept.
    forget
        Start in the resting moods, and keep none.
    seed
        Chooses among gestures, and their small variations; 0 or more.
    """

    robot: Robot
    repertoire: Repertoire
    temperament: Temperament
    rule: Rule | None = None
    body: str = "simulated"
    port_of_body: str | None = None
    host: str = "127.0.0.1"
    port: int = 8080
    headless: bool = False
    folder: Path | None = None
    forget: bool = False
    seed: int = 0


def own_folder() -> Path:
    """Return where a user's programs keep their state (XDG_STATE_HOME), with our name."""
    base = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(base) / "miburi"


def serve(wish: Wish) -> None:
    """Run the live partner and its server until SIGINT or SIGTERM; then bring the body home.

    A body that somebody stopped stays where it is.

    Raises
    ------
    InputError
        The seed, the host, the port or the body is not one.
    OutputError
        The port is taken.
    """
    if wish.seed < 0:
        raise InputError(f"the seed must be 0 or more, got {wish.seed}.")
    folder = wish.folder or own_folder()
    token = None if is_loopback(wish.host) else kept_token(folder / "token")
    feelings = EmotionalModel(wish.temperament)
    if wish.body not in KINDS:
        raise InputError(f"the body must be one of {', '.join(KINDS)}, got {wish.body!r}.")
    if KINDS[wish.body].needs_port and not wish.port_of_body:
        raise InputError(
            f"the {wish.body} body needs a port, such as /dev/ttyACM0; give it one with --serial. "
            "`miburi card list` names the ports that are there."
        )
    if wish.rule is not None and wish.body == "card":
        raise InputError(
            "a card has its own calibration; load this one onto it with `miburi card load`."
        )
    with _listening(wish.host, wish.port) as listener:
        memory = folder / "feelings.json"
        kept = None if wish.forget else _recall(memory, feelings.temperament)
        feelings = kept or feelings
        feelings.stimulate(GREETING)
        robot = wish.robot
        runner = Runner(
            robot,
            feelings,
            Archive(folder / "recordings"),
            body=wish.body,
            port=wish.port_of_body,
            seed=wish.seed,
            rule=wish.rule,
            repertoire=wish.repertoire,
        )
        stop = runner.body.state.stop
        if stop is not None:
            why = words(FALLBACK)["reason"][stop.reason]
            print(f"The body is stopped: {why}. Make room, then release it in the studio.")
        runner.start(on_failure=lambda: signal.raise_signal(signal.SIGTERM))
        ending = threading.Event()
        keeper = threading.Thread(
            target=keep, args=(memory, runner.feelings, ending.wait), daemon=True
        )
        if not wish.forget:
            keeper.start()
        try:
            # NiceGUI takes a second to load: the robot moves already.
            from miburi.studio.app import make_app

            app = Gate(make_app(runner, _addresses(listener, wish.host), token), token)
            _run(app, listener, lambda url: _announce(url, token, wish.headless), wish.host)
        finally:
            ending.set()
            runner.close()
            if not wish.forget:
                keeper.join()
            kept_now = not wish.forget and _keep(memory, feelings)
            if runner.failure is None:
                _say_good_bye(runner, folder, kept=kept_now)
        if runner.failure is not None:
            raise BodyError(runner.failure)


def _run(app: Gate, listener: socket.socket, ready: object, host: str) -> None:
    server = _Server(configure(app))
    threading.Thread(
        target=_when_started, args=(server, ready, _url(listener, host)), daemon=True
    ).start()
    server.run(sockets=[listener])


def _when_started(server: uvicorn.Server, ready: object, url: str) -> None:
    while not (server.started or server.should_exit):
        time.sleep(0.02)  # uvicorn has no event for it
    if server.started and callable(ready):
        ready(url)


class _Server(uvicorn.Server):
    """Ends at SIGINT and SIGTERM, and leaves it at that: both are a good end."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Take the signals while the server runs."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        kept = {number: signal.signal(number, self._end) for number in _ENDING}
        try:
            yield
        finally:
            for number, handler in kept.items():
                signal.signal(number, handler)

    def _end(self, number: int, frame: FrameType | None) -> None:
        self.handle_exit(number, frame)


_ENDING = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def _listening(host: str, port: int) -> Iterator[socket.socket]:
    """Take the port before anything else is done."""
    if not 0 <= port <= 65_535:
        raise InputError(f"the port must be from 0 to 65535, got {port}.")
    try:
        family, kind, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except (OSError, UnicodeError) as error:
        raise InputError(f"{host!r} is not an address of this computer: {error}.") from error
    listener = socket.socket(family, kind)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind(address)
            listener.listen(256)
        except OSError as error:
            raise OutputError(
                f"cannot listen on {host} port {port}: {error.strerror}. If another Miburi is "
                "running, use its page or end it; or choose another port with --port, 0 for any "
                "that is free."
            ) from error
        listener.setblocking(False)
        yield listener
    finally:
        listener.close()


def _url(listener: socket.socket, host: str) -> str:
    shown = f"[{host}]" if ":" in host else host
    if host in _EVERYWHERE:
        shown = "127.0.0.1"
    return f"http://{shown}:{listener.getsockname()[1]}"


def _addresses(listener: socket.socket, host: str) -> list[str]:
    """Return the addresses under which other devices reach us, the likeliest first."""
    if is_loopback(host):
        return []
    port = listener.getsockname()[1]
    if host not in _EVERYWHERE:
        return [_url(listener, host)]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # sends nothing: asks which interface leads outside
            name = probe.getsockname()[0]
        except OSError:
            name = socket.gethostname()
    return [f"http://{name}:{port}"]


def _recall(path: Path, temperament: Temperament) -> EmotionalModel | None:
    try:
        return remembered(path, temperament)
    except InputError as error:
        print(f"miburi: {error}", file=sys.stderr)
        return None


def _keep(path: Path, feelings: EmotionalModel) -> bool:
    try:
        remember(path, feelings.save())
    except OutputError as error:
        print(f"miburi: {error}", file=sys.stderr)
        return False
    return True


def _say_good_bye(runner: Runner, folder: Path, *, kept: bool) -> None:
    """Say in one line how the partner was left."""
    if runner.held:
        how = "was stopped and stays where it is, softly held"
    elif runner.at_home:
        how = "rests at neutral"
    else:
        how = "could not be brought to neutral; look at it"
    remembers = f"; what it feels is kept in {folder}" if kept else ""
    print(f"Good-bye. The body {how}{remembers}.", flush=True)


def _announce(url: str, token: str | None, headless: bool) -> None:
    """Say where the studio is; open it unless told otherwise."""
    from miburi.interface.pairing import pairing_url, qr_for_terminal

    shown = url if token is None else pairing_url(url, token)
    print(f"Miburi is awake. Studio: {shown}   face: {url}/face   (end with Ctrl-C)", flush=True)
    if token is not None:
        print(f"Token for programs and other devices: {token}")
        print(qr_for_terminal(shown), flush=True)
    if headless:
        return
    can_show = sys.platform in ("darwin", "win32") or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    )
    if not (can_show and webbrowser.open(shown)):
        print("No browser could be opened here; open the address above in one.", flush=True)
