"""Control a live partner from another Python program, with the library's own types.

:func:`connect` takes the partner's address and returns a :class:`RemotePartner`.

>>> from miburi import Stimulus, connect
>>> partner = connect("http://127.0.0.1:8080")  # doctest: +SKIP
>>> partner.stimulate(Stimulus("happiness", 0.8))  # doctest: +SKIP
>>> partner.state.felt  # doctest: +SKIP
Expressed(feeling='happiness', mood=0.41)
"""

import logging
import queue
import threading
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import closing, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import httpx
from pydantic import TypeAdapter, ValidationError
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.sync.client import connect as open_socket

from miburi.errors import BodyError, InputError, MiburiError, OutputError
from miburi.feelings import Expression, Stimulus
from miburi.feelings.temperament import RestLevel
from miburi.gestures.effort import Effort
from miburi.interface.trusting import distrust, has_collided, trust
from miburi.interface.wire import (
    AnyAct,
    BodyOut,
    GestureOut,
    PerformanceIn,
    PosesIn,
    RecordingOut,
    RobotOut,
    WishOut,
)
from miburi.live.events.model import EndOfWish, LiveEvent
from miburi.live.state import MotorsOut, State
from miburi.senses.tone import Tone
from miburi.serving.press import BY
from miburi.talk.said import SayOut

__all__ = [
    "PATIENCE",
    "WAITING",
    "ConnectionLostError",
    "RemotePartner",
    "accepted",
    "connect",
]

#: s to wait for an answer.
PATIENCE = 10.0
#: Wishes that may wait to be sent by :meth:`RemotePartner.soon`.
WAITING = 32
#: s between two attempts to reconnect, and s of silence after which a stream counts as lost.
_AGAIN, _STREAM_TIME = 0.5, 30.0
_DATA = "data: "
_LOG = logging.getLogger(__name__)
#: How many requests of a program's threads are open at once; others wait.
_CONNECTIONS = 100


def connect(
    url: str, token: str | None = None, authority: Path | str | None = None
) -> "RemotePartner":
    """Return a live partner at ``url``, such as ``http://127.0.0.1:8080``.

    It needs the token if the partner was started with ``--https`` or another ``--host``, and by
    https the certificate of the partner's home authority, a PEM file (its ``/ca.pem``), unless
    this computer trusts that already.

    Raises
    ------
    InputError
        The address does not start with ``http://`` or ``https://``, or the file is no certificate.
    """
    return RemotePartner(url, token, authority)


class ConnectionLostError(MiburiError):
    """The partner cannot be reached, or refuses access."""


class RemotePartner:
    """A live partner at the other end of a connection; made by :func:`miburi.connect`.

    Use it as a context manager, or call :meth:`close`. Every method raises

    - :class:`ConnectionLostError` if the partner cannot be reached or the token is wrong,
    - ``InputError`` if a value is not allowed,
    - ``BodyError`` if the body cannot do it now,
    - ``OutputError`` if there is no room for recordings.
    """

    def __init__(
        self, url: str, token: str | None = None, authority: Path | str | None = None
    ) -> None:
        self._trust = trust(url, authority)
        self._url = url.rstrip("/")
        self._headers = {BY: "program"}  # so that this program may release what it has stopped
        if token:
            self._headers["Authorization"] = f"Bearer {token}"
        self._http = self._open()
        self._stop = self._open()  # Stop waits for no other thread's answer
        self._wishes: queue.Queue[Callable[[], object] | None] = queue.Queue(WAITING)
        self._sender: threading.Thread | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection; wishes still waiting are dropped."""
        if self._sender is not None:
            with suppress(queue.Empty):
                while True:
                    self._wishes.get_nowait()
            self._wishes.put(None)
        self._http.close()
        self._stop.close()

    @property
    def state(self) -> State:
        """Everything about the partner, now."""
        return self._state(self._ask("GET", "/state").content)

    @property
    def robot(self) -> RobotOut:
        """The robot's description."""
        return RobotOut.model_validate(self._get("/robot"))

    @property
    def motors(self) -> MotorsOut:
        """The motors' temperatures, supply and calibration."""
        return MotorsOut.model_validate(self._get("/motors"))

    def watch(self, rate: float = 30.0, patience: float = 60.0) -> Generator[State, None, None]:
        """Yield states, ``rate`` a second (0.1 to 50), until you leave the loop.

        At 50 a second every step of the robot is among them. A connection that is lost, as when the
        partner restarts, is retried for up to ``patience`` s.
        """
        address = "ws" + self._url.removeprefix("http") + f"/api/v1/live?rate={rate:g}"
        heard = None  # when, on the monotonic clock
        while True:
            failure: Exception = ConnectionLostError("the connection was closed")
            try:
                with open_socket(
                    address, additional_headers=self._headers, ssl=self._trust
                ) as socket:
                    for text in socket:
                        heard = time.monotonic()
                        yield self._state(text)
            except (OSError, ConnectionClosed, InvalidHandshake) as error:
                failure = error
                if has_collided(error):
                    heard = heard or time.monotonic()
            self._wait_to_connect(heard, patience, failure)

    def _wait_to_connect(self, heard: float | None, patience: float, failure: Exception) -> None:
        """Wait a moment; give up if nothing was ever heard, or not for ``patience`` s."""
        if heard is None or time.monotonic() - heard > patience:
            words = f"{self._url} does not answer ({failure}); is `miburi run` running there?"
            raise ConnectionLostError(distrust(self._url, failure) or words) from failure
        time.sleep(min(_AGAIN, patience))

    def events(
        self, after: str | None = None, patience: float = 60.0
    ) -> Generator[LiveEvent, None, None]:
        """Yield the events after the one with this id, or from now on, until you leave the loop.

        A connection that is lost is retried for up to ``patience`` s; events missed meanwhile are
        then yielded, even those from before the partner's last start. A ``gap`` says if some are
        missing. With ``after="0"`` it begins with all events that are kept.

        Raises
        ------
        ConnectionLostError
            The partner does not answer at first, or has not answered for ``patience`` s: wait
            before you ask again.
        """
        return self._events_after(after or self.state.cursor, patience)

    def until_ended(self, wish: str, patience: float = 60.0) -> LiveEvent:
        """Wait until a wish has ended, well or not, and return the event that says so.

        Raises
        ------
        BodyError
            The partner was restarted, so nobody knows how the wish ended.
        ConnectionLostError
            The partner has not answered for ``patience`` s.
        """
        end = EndOfWish(wish)
        with closing(self.events(wish, patience)) as events:
            return next(event for event in events if end.is_in(event))

    def _events_after(self, cursor: str, patience: float) -> Generator[LiveEvent, None, None]:
        heard = None  # when, on the monotonic clock
        while True:
            failure: Exception = ConnectionLostError("the connection was closed")
            try:
                with self._http.stream(
                    "GET", "/events", params={"after": cursor}, timeout=_STREAM_TIME
                ) as answer:
                    if not answer.is_success:
                        answer.read()
                    accepted(self._url, answer)
                    for line in answer.iter_lines():
                        heard = time.monotonic()
                        if line.startswith(_DATA):
                            event = LiveEvent.model_validate_json(line.removeprefix(_DATA))
                            cursor = event.id
                            yield event
            except (httpx.HTTPError, ConnectionLostError) as error:
                failure = error
            self._wait_to_connect(heard, patience, failure)

    def soon(self, wish: Callable[..., object], *args: Any, **kwargs: Any) -> bool:
        """Let a thread carry out a wish, such as ``soon(partner.stimulate, stimulus)``.

        This returns at once, so a game loses no frame. It returns False and does nothing if
        :data:`WAITING` wishes wait already. Failures are logged.
        """
        if self._sender is None:
            self._sender = threading.Thread(target=self._send_all, name="wishes", daemon=True)
            self._sender.start()
        try:
            self._wishes.put_nowait(lambda: wish(*args, **kwargs))
        except queue.Full:
            return False
        return True

    def _send_all(self) -> None:
        while (wish := self._wishes.get()) is not None:
            try:
                wish()
            except MiburiError as error:
                _LOG.warning("a wish was not carried out: %s", error)

    def stimulate(self, stimulus: Stimulus) -> str:
        """Let the partner feel something; return the event's id."""
        return self._wish(
            "/stimulus",
            {
                "feeling": stimulus.feeling,
                "strength": stimulus.strength,
                "source": stimulus.source,
            },
        )

    def say(self, text: str, tone: Tone = "plain") -> SayOut:
        """Say something to the partner; returns what it heard, why, what it felt and answered."""
        said = {"text": text, "tone": tone}
        return SayOut.model_validate_json(self._ask("POST", "/say", said).content)

    def speak(self, text: str) -> str:
        """Let the partner say something aloud, where a page has its voice on; return its id."""
        return self._wish("/speak", {"text": text})

    def express(
        self,
        expression: Expression,
        *,
        blend: Mapping[str, float] | None = None,
        effort: Effort | None = None,
    ) -> str:
        """Perform a gesture once; ``blend`` mixes in other feelings' gestures, each with its μ.

        Like ``look``, ``poses`` and ``perform``, it returns an id, which events carry as ``wish``.
        """
        return self._wish(
            "/express",
            {
                "feeling": expression.feeling,
                "mood": expression.mood,
                "blend": dict(blend or {}),
                "effort": effort.model_dump() if effort else None,
            },
        )

    def look(self, at: str, seconds: float = 2.0) -> str:
        """Look at the user (ahead), left, right, up, down or aside, for ``seconds`` s."""
        return self._wish("/look", {"at": at, "seconds": seconds})

    def attend(self, turn: str = "listening") -> None:
        """Face somebody who is about to speak, or who waits for an answer (``thinking``)."""
        self._post("/attend", {"turn": turn})

    def poses(self, poses: PosesIn) -> str:
        """Perform your own key poses once, written as in a gesture file."""
        return self._wish("/poses", poses.model_dump(mode="json"))

    def perform(self, *acts: AnyAct, now: bool = False) -> str:
        """Perform gestures, looks, key poses and sentences together, each at its offset.

        It follows the wishes that wait or, with ``now``, replaces them and what is under way.
        """
        wish = PerformanceIn(acts=list(acts), when="now" if now else "next")
        return self._wish("/performance", wish.model_dump(mode="json"))

    def stop(self, *, by_person: bool = False) -> None:
        """Stop all motors until :meth:`release`; a person's Stop needs a person to release it."""
        head = {BY: "person"} if by_person else {}
        with suppress(httpx.TransportError):  # a full server may have closed that connection
            accepted(self._url, self._stop.post("/stop", headers=head))
            return
        with self._open() as new:
            new.headers.update(head)
            self._ask("POST", "/stop", by=new)

    def release(self) -> None:
        """Let a stopped body go back to neutral, then continue.

        Raises
        ------
        BodyError
            A person pressed Stop, so a person must release it; :meth:`wait` until then.
        """
        self._post("/release")

    def wait(self) -> State:
        """Wait until the body is not stopped, however long that takes, and return that state."""
        states = self.watch(rate=10)
        try:
            return next(state for state in states if not state.stop)
        finally:
            states.close()

    def pause(self, paused: bool = True) -> None:
        """Let the partner rest at neutral, or continue."""
        self._post("/pause", {"paused": paused})

    def place_hand(
        self, position: tuple[float, float, float], along: tuple[float, float, float]
    ) -> None:
        """Move the simulated human hand to ``position``, m, with its fingers along ``along``."""
        self._post("/hand", {"position": list(position), "along": list(along)})

    def remove_hand(self) -> None:
        """Take the simulated human hand away."""
        self._post("/hand", {"position": None})

    def temperament(self, name: str, rest: RestLevel | None = None) -> None:
        """Change the temperament to a shipped one, or the one that the partner was started with.

        ``rest`` says how much it moves while it shows nothing; default: the temperament's own.
        """
        self._post("/temperament", {"name": name, "rest": rest})

    def gestures(self) -> list[GestureOut]:
        """Return the movement functions."""
        return TypeAdapter(list[GestureOut]).validate_python(self._get("/gestures"))

    def log(self, after: str | None = None) -> list[LiveEvent]:
        """Return up to 1,000 events after the one with this id; without an id, the latest."""
        known = "" if after is None else f"?after={after}"
        return TypeAdapter(list[LiveEvent]).validate_python(self._get(f"/log{known}"))

    def bodies(self) -> list[BodyOut]:
        """Return the kinds of body."""
        return TypeAdapter(list[BodyOut]).validate_python(self._get("/bodies"))

    def use_body(self, name: str, port: str | None = None) -> None:
        """Change the body."""
        self._post("/bodies", {"name": name, "port": port})

    def record(self, on: bool = True) -> None:
        """Start or end a recording."""
        self._post("/recordings", {"on": on})

    def recordings(self) -> list[RecordingOut]:
        """Return all recordings."""
        return TypeAdapter(list[RecordingOut]).validate_python(self._get("/recordings"))

    def download(self, name: str, path: Path | str) -> Path:
        """Save a recording as ``path``."""
        content = self._ask("GET", f"/recordings/{name}").content
        try:
            Path(path).write_bytes(content)
        except OSError as error:
            raise OutputError(f"{path}: cannot be written: {error.strerror}.") from error
        return Path(path)

    def delete(self, name: str) -> None:
        """Delete a recording."""
        self._ask("DELETE", f"/recordings/{name}")

    def _state(self, text: str | bytes) -> State:
        try:
            return State.model_validate_json(text)
        except ValidationError as error:
            raise InputError(
                f"{self._url}: this program does not understand this partner's state; use the "
                "same version of Miburi for both."
            ) from error

    def _get(self, path: str) -> Any:
        return self._ask("GET", path).json()

    def _wish(self, path: str, content: object) -> str:
        return WishOut.model_validate_json(self._ask("POST", path, content).content).id

    def _post(self, path: str, content: object = None) -> None:
        self._ask("POST", path, content)

    def _open(self) -> httpx.Client:
        # A pool that closes surplus connections may close one that a thread has just been given.
        limits = httpx.Limits(max_connections=_CONNECTIONS, max_keepalive_connections=_CONNECTIONS)
        return httpx.Client(
            base_url=self._url + "/api/v1",
            headers=self._headers,
            timeout=PATIENCE,
            limits=limits,
            verify=self._trust or True,
        )

    def _ask(
        self, method: str, path: str, content: object = None, by: httpx.Client | None = None
    ) -> httpx.Response:
        try:
            response = (by or self._http).request(method, path, json=content)
        except httpx.HTTPError as error:
            words = f"{self._url} does not answer ({error}); is `miburi run` running there?"
            raise ConnectionLostError(distrust(self._url, error) or words) from error
        return accepted(self._url, response)


def accepted(url: str, response: httpx.Response) -> httpx.Response:
    """Return the answer of the partner at ``url`` unless it is a refusal.

    Raises
    ------
    InputError, BodyError, OutputError, ConnectionLostError
        It is a refusal; see :class:`RemotePartner`.
    """
    if response.is_success:
        return response
    words = _detail(response)
    match response.status_code:
        case 400 | 404 | 422:
            raise InputError(words)
        case 409:
            raise BodyError(words)
        case 507:
            raise OutputError(words)
        case _:
            raise ConnectionLostError(f"{url}: {words}")


def _detail(response: httpx.Response) -> str:
    try:
        return str(response.json()["detail"])
    except (ValueError, KeyError, TypeError):
        return f"{response.url} answered {response.status_code}; is this a Miburi server?"
