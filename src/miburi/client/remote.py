"""Control a live partner from another Python program, with the library's own types.

>>> from miburi import Stimulus, connect
>>> partner = connect("http://127.0.0.1:8080")  # doctest: +SKIP
>>> partner.stimulate(Stimulus("happiness", 0.8))  # doctest: +SKIP
>>> partner.state.felt  # doctest: +SKIP
Expressed(feeling='happiness', mood=0.41)
"""

import threading
from collections.abc import Callable, Generator, Mapping
from contextlib import closing
from math import inf, nan
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, Self
from urllib.parse import quote

from miburi.client.connection import CLOSED, Connection
from miburi.client.sending import Sender
from miburi.errors import BodyError, InputError, OutputError
from miburi.feelings import Expression, Stimulus
from miburi.feelings.temperament import RestLevel
from miburi.gestures import Direction
from miburi.gestures.effort import Effort
from miburi.live.attention import Turn
from miburi.live.events.event import EndOfWish, LiveEvent
from miburi.live.state import MotorsOut, State
from miburi.senses.tone import Tone
from miburi.talk.said import SayOut
from miburi.wire.messages import (
    FASTEST,
    SLOWEST,
    AnyAct,
    BodyOut,
    GestureOut,
    PosesIn,
    RecordingOut,
    fields_of,
)
from miburi.wire.robot import RobotOut


def connect(
    url: str, token: str | None = None, authority: Path | str | None = None
) -> "RemotePartner":
    """Return a live partner at ``url``, such as ``http://127.0.0.1:8080``.

    A partner that was started with ``--https`` or another ``--host`` needs its ``token``. An https
    address also needs ``authority``, the PEM file of the partner's certificate authority (served as
    ``/ca.pem``), unless this computer trusts that authority already.

    Raises
    ------
    InputError
        The address does not start with ``http://`` or ``https://``, the token is not one line of
        ASCII, or the file is no certificate.
    """
    return RemotePartner(url, token, authority)


class RemotePartner:
    """A live partner at the other end of a connection; made by :func:`miburi.connect`.

    Use it as a context manager, or call :meth:`close`. Every method raises

    - :class:`miburi.ConnectionLostError` if the partner cannot be reached,
    - ``InputError`` if a value is not allowed, or the token is missing or wrong,
    - ``BodyError`` if the body cannot do it now,
    - ``OutputError`` if there is no room for recordings.
    """

    def __init__(
        self, url: str, token: str | None = None, authority: Path | str | None = None
    ) -> None:
        self._line = Connection(url, token, authority)
        self._sender: Sender | None = None
        self._closed = False
        self._beginning = threading.Lock()  # two threads share one sender

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
        """Send what :meth:`soon` has accepted, for up to 5 s, and close the connection."""
        with self._beginning:
            self._closed, sender, self._sender = True, self._sender, None
        if sender is not None:
            sender.close()
        self._line.close()

    @property
    def state(self) -> State:
        """The partner's present state."""
        return self._line.get(State, "/state")

    @property
    def robot(self) -> RobotOut:
        """The robot's description."""
        return self._line.get(RobotOut, "/robot")

    @property
    def motors(self) -> MotorsOut:
        """The motors' temperatures, supply and calibration."""
        return self._line.get(MotorsOut, "/motors")

    def watch(self, rate: float = 30.0, patience: float = 60.0) -> Generator[State, None, None]:
        """Yield the newest state, ``rate`` a second (0.1 to 50), until you leave the loop.

        A thread receives the states, and a slow program misses some. At 50 a second, a program that
        is quick enough gets each state of the robot's loop. If the connection is lost, as when the
        partner restarts, this tries to reconnect for up to ``patience`` s.
        """
        try:
            wanted = float(rate)
        except (TypeError, ValueError):
            wanted = nan
        if not SLOWEST <= wanted <= FASTEST:
            raise InputError(f"rate must be {SLOWEST} to {FASTEST} states a second, got {rate!r}.")
        return self._line.states(wanted, patience)

    def events(
        self, after: str | None = None, patience: float = 60.0
    ) -> Generator[LiveEvent, None, None]:
        """Yield the events after the one with this id, or from now on, until you leave the loop.

        If the connection is lost, this tries to reconnect for up to ``patience`` s. Events from the
        time without a connection are then yielded, even if the partner restarted after them. If
        events are missing, a ``gap`` says so. With ``after="0"``, all stored events come first.

        Raises
        ------
        ConnectionLostError
            The partner does not answer at first, or for ``patience`` s: wait before you try again.
        """
        return self._line.events(after or self.state.cursor, patience)

    def until_ended(self, wish: str, patience: float = 60.0) -> LiveEvent:
        """Wait until a wish has ended, in any way; return the event of its end.

        There is no time limit: each wish ends. ``patience``, in s, is for a lost connection alone.

        Raises
        ------
        InputError
            The id does not belong to a wish. A stimulus, for example, has an id, but no end.
        BodyError
            The partner was restarted, or no longer has the events, so nobody knows how it ended.
        ConnectionLostError
            The partner has not answered for ``patience`` s.
        """
        end = EndOfWish(wish)
        end.check(self.log(end.before))
        with closing(self.events(wish, patience)) as events:
            return next(event for event in events if end.is_in(event))

    def soon(self, wish: Callable[..., object], *args: Any, **kwargs: Any) -> bool:
        """Send a command in a background thread, as in ``soon(partner.stimulate, stimulus)``.

        This returns at once, so that a game, for instance, misses no frame. It returns False, and
        sends nothing, if :data:`~miburi.client.sending.WAITING` wishes are queued already. Failures
        are logged, and so is what :meth:`close` could not send.
        """
        with self._beginning:
            if self._closed:
                raise InputError(CLOSED)
            sender = self._sender = self._sender or Sender()
        return sender.send(lambda: wish(*args, **kwargs))

    def stimulate(self, stimulus: Stimulus) -> str:
        """Make the partner feel something; return the id of the event."""
        return self._line.wish("/stimulus", fields_of(stimulus, Stimulus))

    def sense(self, kind: str, clearness: float = 1.0) -> None:
        """Report something that has happened to the partner, such as a pat.

        ``kind`` is a built-in kind, or one in the file given to ``miburi run --senses``.
        """
        self._line.post("/sense", {"kind": kind, "clearness": clearness})

    def say(self, text: str, tone: Tone = "plain") -> SayOut:
        """Say something to the partner; return the feeling it heard, the reason, and its answer."""
        said = {"text": text, "tone": tone}
        return self._line.send(SayOut, "/say", said)

    def speak(self, text: str) -> str:
        """Let the partner say something on pages whose voice is on; return the request's id."""
        return self._line.wish("/speak", {"text": text})

    def express(
        self,
        expression: Expression,
        *,
        blend: Mapping[str, float] | None = None,
        effort: Effort | None = None,
    ) -> str:
        """Perform a gesture once; ``blend`` mixes in other feelings' gestures by their weights μ.

        Like ``look``, ``poses`` and ``perform``, it returns an id, which events carry as ``wish``.
        """
        return self._line.wish(
            "/express",
            {
                **fields_of(expression, Expression),
                "blend": dict(blend or {}),
                "effort": effort,
            },
        )

    def look(self, at: Direction, seconds: float = 2.0) -> str:
        """Look at the user (ahead), left, right, up, down or aside, for ``seconds`` s."""
        return self._line.wish("/look", {"at": at, "seconds": seconds})

    def attend(self, turn: Turn = "listening") -> None:
        """Face somebody who is about to speak, or who waits for an answer (``thinking``)."""
        self._line.post("/attend", {"turn": turn})

    def poses(self, poses: PosesIn) -> str:
        """Perform your own key poses once, written as in a gesture file."""
        return self._line.wish("/poses", poses)

    def perform(self, *acts: AnyAct, now: bool = False) -> str:
        """Perform gestures, looks, key poses and sentences together, each at its offset.

        The performance begins after the queued ones or, with ``now``, replaces them and the one
        that is running.
        """
        return self._line.wish("/performance", {"acts": acts, "when": "now" if now else "next"})

    def stop(self, *, by_person: bool = False) -> None:
        """Stop all motors until :meth:`release`; only a person can release a person's Stop."""
        self._line.stop(by_person=by_person)

    def release(self) -> None:
        """Release a stopped body: it returns to neutral and continues.

        Raises
        ------
        BodyError
            Only a person can release a person's Stop; :meth:`wait` until somebody has released it.
        """
        self._line.post("/release")

    def wait(self, timeout: float = inf) -> State:
        """Wait until the body is free, and return the partner's state.

        Raises
        ------
        BodyError
            The body is not free after ``timeout`` s.
        """
        end = monotonic() + timeout
        with closing(self.watch(rate=10)) as states:
            for state in states:
                if not state.stop:
                    return state
                if monotonic() >= end:
                    break
        raise BodyError(f"the body is still stopped after {timeout:g} s.")

    def pause(self, paused: bool = True) -> None:
        """Let the partner rest at neutral, or continue."""
        self._line.post("/pause", {"paused": paused})

    def place_hand(
        self, position: tuple[float, float, float], along: tuple[float, float, float]
    ) -> None:
        """Move the simulated human hand to ``position``, in m, with its fingers along ``along``."""
        self._line.post("/hand", {"position": position, "along": along})

    def remove_hand(self) -> None:
        """Remove the simulated human hand."""
        self._line.post("/hand", {"position": None})

    def temperament(self, name: str, rest: RestLevel | None = None) -> None:
        """Change to a shipped temperament, or to the one that the partner was started with.

        ``rest`` is the level of idle motion; by default the temperament sets it.
        """
        self._line.post("/temperament", {"name": name, "rest": rest})

    def gestures(self) -> list[GestureOut]:
        """Return the partner's gestures (the paper's movement functions)."""
        return self._line.get(list[GestureOut], "/gestures")

    def log(self, after: str | None = None) -> list[LiveEvent]:
        """Return up to 1,000 events after the one with this id; without an id, the latest."""
        known = "" if after is None else f"?after={quote(after)}"
        return self._line.get(list[LiveEvent], f"/log{known}")

    def bodies(self) -> list[BodyOut]:
        """Return the kinds of body."""
        return self._line.get(list[BodyOut], "/bodies")

    def use_body(self, name: str, port: str | None = None) -> None:
        """Change to another body; ``port`` is a card's serial port."""
        self._line.post("/bodies", {"name": name, "port": port})

    def record(self, on: bool = True) -> None:
        """Start or end a recording."""
        self._line.post("/recordings", {"on": on})

    def recordings(self) -> list[RecordingOut]:
        """Return all recordings."""
        return self._line.get(list[RecordingOut], "/recordings")

    def download(self, name: str, path: Path | str) -> Path:
        """Save a recording as ``path``."""
        content = self._line.ask("GET", f"/recordings/{name}").content
        try:
            Path(path).write_bytes(content)
        except OSError as error:
            raise OutputError(f"{path}: cannot be written: {error.strerror}.") from error
        return Path(path)

    def delete(self, name: str) -> None:
        """Delete a recording."""
        self._line.ask("DELETE", f"/recordings/{name}")
