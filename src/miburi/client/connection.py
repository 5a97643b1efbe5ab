"""One program's connection to a live partner over HTTP: requests, and streams that reconnect.

An error status raises one of Miburi's errors, with the server's message.
"""

import json
import threading
import time
from collections.abc import Generator
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue

import httpx
import numpy as np
from pydantic_core import to_jsonable_python
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidStatus
from websockets.sync.client import connect as open_socket

from miburi.client.answers import Answer, read
from miburi.client.trusting import bearer, distrust, has_collided, trust
from miburi.errors import BodyError, InputError, MiburiError, OutputError
from miburi.live.events.event import LiveEvent
from miburi.live.state import State
from miburi.serving.press import BY
from miburi.wire.messages import WishOut

#: How long to wait for an answer, in s.
PATIENCE = 10.0
#: The time between two attempts to reconnect, and the silence after which a stream counts as lost,
#: in s.
_AGAIN, _STREAM_TIME = 0.5, 30.0
#: How often the receiving thread checks whether the program still wants states, in s.
_LOOK = 0.5
_DATA = "data: "
#: The error for a program that uses a connection after closing it.
CLOSED = "this connection is closed, or its `with` has ended: connect again."
#: How many requests of a program's threads are open at once; others wait.
_CONNECTIONS = 100


class ConnectionLostError(MiburiError):
    """The partner cannot be reached, or has no time: wait before you try again."""


class Connection:
    """A connection to the partner at ``url``; see :func:`miburi.connect` for the parameters.

    Its methods raise the errors of :class:`miburi.RemotePartner`. Any thread may use it.
    """

    def __init__(self, url: str, token: str | None, authority: Path | str | None) -> None:
        self._trust = trust(url, authority)
        self._url = url.rstrip("/")
        # "program", so that this program may release what it has stopped
        self._headers = {BY: "program"} | bearer(token)
        self._watched: set[_Newest] = set()
        self._http = self._open()
        self._stop = self._open()  # so that Stop does not wait for another thread's answer

    def close(self) -> None:
        """Close the connection."""
        self._http.close()
        self._stop.close()
        for newest in tuple(self._watched):
            newest.end(InputError(CLOSED))

    def get(self, kind: type[Answer], path: str) -> Answer:
        """Return the answer to a GET."""
        return read(kind, self.ask("GET", path).content, self._url)

    def send(self, kind: type[Answer], path: str, content: object) -> Answer:
        """Send a request and return its answer."""
        return read(kind, self.ask("POST", path, content).content, self._url)

    def wish(self, path: str, content: object) -> str:
        """Send a wish and return its id."""
        return self.send(WishOut, path, content).id

    def post(self, path: str, content: object = None) -> None:
        """Send a request whose answer is empty."""
        self.ask("POST", path, content)

    def ask(
        self, method: str, path: str, content: object = None, by: httpx.Client | None = None
    ) -> httpx.Response:
        """Send a request and return the answer, or raise an error if it is a refusal.

        ``by`` is the HTTP client to send with.
        """
        client = by or self._http
        try:
            sent = to_jsonable_python(content, fallback=plain)
            request = client.build_request(method, path, json=sent)
        except UnicodeEncodeError as error:
            raise InputError(f"this text has half a character: {error.object!r:.80}.") from error
        except (ValueError, httpx.InvalidURL) as error:
            raise InputError(f"this cannot be sent: {error}.") from error
        try:
            response = client.send(request)
        except RuntimeError as error:
            if not self._http.is_closed:
                raise
            raise InputError(CLOSED) from error
        except httpx.HTTPError as error:
            words = f"{self._url} does not answer ({error}); is `miburi run` running there?"
            raise ConnectionLostError(distrust(self._url, error) or words) from error
        return accepted(self._url, response)

    def stop(self, *, by_person: bool) -> None:
        """Stop the body, even if the server has closed the connection reserved for Stop."""
        head = {BY: "person"} if by_person else {}
        # A full server may have closed the connection reserved for Stop, or this program has closed
        # it.
        with suppress(httpx.TransportError, RuntimeError):
            accepted(self._url, self._stop.post("/stop", headers=head))
            return
        with self._open() as new:
            new.headers.update(head)
            self.ask("POST", "/stop", by=new)

    def states(self, rate: float, patience: float) -> Generator[State, None, None]:
        """Yield the newest state, ``rate`` a second; retry a lost connection for ``patience`` s."""
        address = "ws" + self._url.removeprefix("http") + f"/api/v1/live?rate={rate:g}"
        newest = _Newest()
        self._watched.add(newest)
        try:
            if self._http.is_closed:
                raise InputError(CLOSED)
            threading.Thread(
                target=self._receive, args=(newest, address, patience), name="watch", daemon=True
            ).start()
            while True:
                yield read(State, newest.get(), self._url)
        finally:
            self._watched.discard(newest)
            newest.end(InputError(CLOSED))

    def _receive(self, newest: "_Newest", address: str, patience: float) -> None:
        """Receive states until nobody wants them; retry a lost connection for ``patience`` s."""
        heard = None  # when, on the monotonic clock
        try:
            while not newest.is_over():
                failure: Exception
                try:
                    with open_socket(
                        address, additional_headers=self._headers, ssl=self._trust or None
                    ) as socket:
                        while not newest.is_over():
                            with suppress(TimeoutError):
                                newest.put(socket.recv(_LOOK))
                                heard = time.monotonic()
                    return
                except InvalidStatus as error:
                    failure = _refusal(self._url, error.response.status_code, error.response.body)
                    if not isinstance(failure, ConnectionLostError):
                        raise failure from error
                except (OSError, ConnectionClosed, InvalidHandshake) as error:
                    failure = error
                    if has_collided(error):
                        heard = heard or time.monotonic()
                self._wait_to_connect(heard, patience, failure)
        except Exception as error:  # whoever reads the states gets it
            newest.end(error)

    def events(self, cursor: str, patience: float) -> Generator[LiveEvent, None, None]:
        """Yield the events after an id; retry a lost connection for ``patience`` s."""
        heard = None  # when, on the monotonic clock
        while True:
            failure: Exception = ConnectionLostError(f"{self._url} closed the connection.")
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
                            event = read(LiveEvent, line.removeprefix(_DATA), self._url)
                            cursor = event.id
                            yield event
            except RuntimeError as error:
                if not self._http.is_closed:
                    raise
                raise InputError(CLOSED) from error
            except (httpx.HTTPError, ConnectionLostError) as error:
                failure = error
            self._wait_to_connect(heard, patience, failure)

    def _wait_to_connect(self, heard: float | None, patience: float, failure: Exception) -> None:
        """Wait a moment; give up if the partner was never heard, or not for ``patience`` s."""
        if heard is None or time.monotonic() - heard > patience:
            if isinstance(failure, ConnectionLostError):
                raise failure
            words = f"{self._url} does not answer ({failure}); is `miburi run` running there?"
            raise ConnectionLostError(distrust(self._url, failure) or words) from failure
        time.sleep(min(_AGAIN, patience))

    def _open(self) -> httpx.Client:
        # A pool that closes surplus connections may close one that a thread has just got.
        limits = httpx.Limits(max_connections=_CONNECTIONS, max_keepalive_connections=_CONNECTIONS)
        return httpx.Client(
            base_url=self._url + "/api/v1",
            headers=self._headers,
            timeout=PATIENCE,
            limits=limits,
            verify=self._trust,
        )


class _Newest:
    """The newest state that a thread has received, as JSON; older ones are forgotten.

    So a slow program reads no old states, and the thread answers the server's pings all the time.
    """

    def __init__(self) -> None:
        self._texts: SimpleQueue[str | bytes] = SimpleQueue()
        self._end: Exception | None = None

    def put(self, text: str | bytes) -> None:
        """Replace the state."""
        with suppress(Empty):
            self._texts.get_nowait()
        self._texts.put(text)

    def get(self) -> str | bytes:
        """Wait for a state that was not read yet; raise the error if there are no more."""
        text = self._texts.get()
        if self._end is not None:
            raise self._end
        return text

    def is_over(self) -> bool:
        """Whether there are no more states."""
        return self._end is not None

    def end(self, error: Exception) -> None:
        """Let there be no more states."""
        self._end = self._end or error
        self._texts.put("")  # for whoever waits


def plain(value: object) -> object:
    """Return a number or an array of NumPy as JSON has it, for a request.

    Raises InputError if it is neither.
    """
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise InputError(f"{type(value).__name__} has no form in JSON")


def accepted(url: str, response: httpx.Response) -> httpx.Response:
    """Return the answer of the partner at ``url`` unless it is a refusal.

    Raises
    ------
    InputError, BodyError, OutputError, ConnectionLostError
        It is a refusal; see :class:`miburi.RemotePartner`.
    """
    if response.is_success:
        return response
    raise _refusal(url, response.status_code, response.content)


def _refusal(url: str, status: int, content: bytes | bytearray | None) -> MiburiError:
    """Return the error that stands for a refusal, with the partner's words."""
    try:
        words = str(json.loads(content or b"")["detail"])
    except (ValueError, KeyError, TypeError):
        words = f"{url} answered {status}; is this a Miburi server?"
    match status:
        case 400 | 404 | 405 | 413 | 422:
            return InputError(words)
        case 401:
            return InputError(f"{url}: {words} Here: connect(url, TOKEN); commands: MIBURI_TOKEN.")
        case 403 | 426:
            return InputError(f"{url}: {words}")
        case 409:
            return BodyError(words)
        case 507:
            return OutputError(words)
        case _:
            return ConnectionLostError(f"{url}: {words}")
