"""Talk to a live partner from another program, with the library's own words.

>>> from miburi import Stimulus, connect
>>> partner = connect("http://127.0.0.1:8080")  # doctest: +SKIP
>>> partner.stimulate(Stimulus("happiness", 0.8))  # doctest: +SKIP
>>> partner.state.felt  # doctest: +SKIP
Expressed(feeling='happiness', mood=0.41)
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self
from urllib.parse import urlsplit

import httpx
from pydantic import TypeAdapter, ValidationError
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.sync.client import connect as open_socket

from miburi.errors import BodyError, InputError, MiburiError, OutputError
from miburi.feelings import Expression, Stimulus
from miburi.gestures.effort import Effort
from miburi.interface.wire import BodyOut, GestureOut, RecordingOut, RobotOut
from miburi.live.state import Entry, MotorsOut, State

__all__ = ["ConnectionLostError", "RemotePartner", "connect"]

_PATIENCE = 10.0


def connect(url: str, token: str | None = None) -> "RemotePartner":
    """Return a live partner at ``url``, such as ``http://127.0.0.1:8080``.

    The token is needed where the partner was started with another ``--host``.

    Raises
    ------
    InputError
        The address is not one.
    """
    return RemotePartner(url, token)


class ConnectionLostError(MiburiError):
    """The partner cannot be reached, or does not let us in."""


class RemotePartner:
    """A live partner at the other end of a connection; made by :func:`miburi.connect`.

    Use it as a context manager, or call :meth:`close`. Every method raises
    :class:`ConnectionLostError` where the partner cannot be reached or the token is wrong,
    ``InputError`` where a value is not allowed, and ``BodyError`` where the body cannot do it
    now, ``OutputError`` where recordings have no room.
    """

    def __init__(self, url: str, token: str | None = None) -> None:
        if urlsplit(url).scheme not in ("http", "https"):
            raise InputError(f"a partner's address starts with http:// or https://, got {url!r}.")
        self._url = url.rstrip("/")
        self._headers = {"Authorization": f"Bearer {token}"} if token else {}
        self._http = httpx.Client(
            base_url=self._url + "/api/v1", headers=self._headers, timeout=_PATIENCE
        )

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
        """Close the connection."""
        self._http.close()

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
        """The motors' temperatures and supply, and what they were calibrated to."""
        return MotorsOut.model_validate(self._get("/motors"))

    def watch(self, rate: float = 30.0) -> Iterator[State]:
        """Yield states as they come, ``rate`` a second (0.1 to 50), until the loop is left."""
        address = "ws" + self._url.removeprefix("http") + f"/api/v1/live?rate={rate:g}"
        try:
            with open_socket(address, additional_headers=self._headers) as socket:
                for text in socket:
                    yield self._state(text)
        except (OSError, ConnectionClosed, InvalidHandshake) as error:
            raise ConnectionLostError(
                f"{self._url}: {error or 'the connection was closed'}."
            ) from error

    def stimulate(self, stimulus: Stimulus) -> None:
        """Let the partner feel something."""
        self._post(
            "/stimulus",
            {
                "feeling": stimulus.feeling,
                "strength": stimulus.strength,
                "source": stimulus.source,
            },
        )

    def express(
        self,
        expression: Expression,
        *,
        blend: Mapping[str, float] | None = None,
        effort: Effort | None = None,
    ) -> None:
        """Perform a gesture once, alone or blended with others, with its own or another effort."""
        self._post(
            "/express",
            {
                "feeling": expression.feeling,
                "mood": expression.mood,
                "blend": dict(blend or {}),
                "effort": effort.model_dump() if effort else None,
            },
        )

    def stop(self) -> None:
        """Stop all motors until :meth:`release`."""
        self._post("/stop")

    def release(self) -> None:
        """Let a stopped body go back to neutral, and go on."""
        self._post("/release")

    def pause(self, paused: bool = True) -> None:
        """Let the partner rest at neutral, or go on."""
        self._post("/pause", {"paused": paused})

    def place_hand(
        self, position: tuple[float, float, float], along: tuple[float, float, float]
    ) -> None:
        """Move the simulated human hand to ``position`` (m), its fingers pointing ``along``."""
        self._post("/hand", {"position": list(position), "along": list(along)})

    def remove_hand(self) -> None:
        """Take the simulated human hand away."""
        self._post("/hand", {"position": None})

    def temperament(self, name: str) -> None:
        """Go on with another of the temperaments that ship with Miburi."""
        self._post("/temperament", {"name": name})

    def gestures(self) -> list[GestureOut]:
        """Return the movement functions."""
        return TypeAdapter(list[GestureOut]).validate_python(self._get("/gestures"))

    def log(self, after: int = 0) -> list[Entry]:
        """Return what happened since the entry of number ``after``."""
        return TypeAdapter(list[Entry]).validate_python(self._get(f"/log?after={after}"))

    def bodies(self) -> list[BodyOut]:
        """Return the kinds of body."""
        return TypeAdapter(list[BodyOut]).validate_python(self._get("/bodies"))

    def use_body(self, name: str, port: str | None = None) -> None:
        """Move another body from now on."""
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
                f"{self._url}: this partner's state is not one that this program knows. If the "
                "partner has feelings of its own, start this program with the same file of "
                "feelings (MIBURI_FEELINGS)."
            ) from error

    def _get(self, path: str) -> Any:
        return self._ask("GET", path).json()

    def _post(self, path: str, content: object = None) -> None:
        self._ask("POST", path, content)

    def _ask(self, method: str, path: str, content: object = None) -> httpx.Response:
        try:
            response = self._http.request(method, path, json=content)
        except httpx.HTTPError as error:
            raise ConnectionLostError(
                f"{self._url} does not answer ({error}); is `miburi run` running there?"
            ) from error
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
                raise ConnectionLostError(f"{self._url}: {words}")


def _detail(response: httpx.Response) -> str:
    try:
        return str(response.json()["detail"])
    except (ValueError, KeyError, TypeError):
        return f"it answered {response.status_code}; is this a Miburi server?"
