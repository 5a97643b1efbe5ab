"""The keys to a partner: a token for programs and pairing, and a key of its own for each device.

All of them are small files, read anew at each use, so that what `miburi devices` forgets is locked
out at once, in every process. A device's file keeps the hash of its key, never the key.
"""

import hmac
import json
import os
import re
import secrets
import time
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

from miburi.errors import InputError, OutputError

__all__ = ["LIFE", "MOST", "Device", "Keys", "kept_token", "same"]

#: s for which a device's key is good, and devices that may have one (ours).
LIFE, MOST = 30 * 24 * 3600, 50
#: s between two notes that a device was here (ours).
_NOTED = 600.0
#: s by which a clock may have been ahead when a device was paired (ours).
_CLOCK = 86_400.0
_TOKEN = re.compile(r"[A-Za-z0-9_-]{32,}")
_KEY = re.compile(r"([0-9a-f]{8})\.([A-Za-z0-9_-]{43})")
#: What a browser says of itself, and our words for it; the first that is found counts.
_MACHINES = {
    "iPhone": "iPhone",
    "iPad": "iPad",
    "Android": "Android",
    "Windows": "Windows",
    "Macintosh": "Mac",
    "Linux": "Linux",
}
_BROWSERS = {"Edg": "Edge", "Firefox": "Firefox", "FxiOS": "Firefox", "Chrome": "Chrome"} | {
    "CriOS": "Chrome",
    "Safari": "Safari",
}


def same(given: str, token: str) -> bool:
    """Compare two tokens in a time that tells nothing about them."""
    return hmac.compare_digest(given.encode("utf-8", "replace"), token.encode())


def kept_token(path: Path) -> str:
    """Return the token in a file that only its owner can read.

    It is made where there is none, and anew where others could read it or it is no token.

    Raises
    ------
    OutputError
        It can be neither read nor written.
    """
    # Windows knows no such bits: there a user's own folder is closed to others.
    try:
        open_to_others = os.name == "posix" and path.is_file() and path.stat().st_mode & 0o077
        token = "" if open_to_others else _read(path)
        return token if _TOKEN.fullmatch(token) else _new_token(path)
    except OSError as error:
        raise OutputError(f"{path}: the token cannot be kept there: {error.strerror}.") from error


@dataclass(frozen=True)
class Device:
    """A device that was paired.

    Attributes
    ----------
    name
        What forgets it: eight hexadecimal digits.
    kind
        Machine and browser, as far as the browser says.
    paired, seen
        When it was paired, and when it was here last, give or take ten minutes; s since 1970.
    """

    name: str
    kind: str
    paired: float
    seen: float


class Keys:
    """The keys that are kept in a folder.

    Parameters
    ----------
    folder
        Where the token and the devices are kept. The token must be there: see :func:`kept_token`.
    """

    def __init__(self, folder: Path) -> None:
        self._token, self._devices = folder / "token", folder / "devices"
        self._latest = ""  # the token that was read last
        self._good: dict[str, None] = {}  # keys that fitted last, where a disk fails for a moment

    @property
    def token(self) -> str:
        """The token as it is now; empty if it is gone, and then nothing fits."""
        with suppress(OSError):
            token = _read(self._token)
            self._latest = token if _TOKEN.fullmatch(token) else ""
        return self._latest

    def is_token(self, given: str) -> bool:
        """Whether this is the token."""
        token = self.token if _TOKEN.fullmatch(given) else ""
        return bool(token) and same(given, token)

    def fits(self, given: str, now: float | None = None) -> bool:
        """Whether this is the token, or the key of a device that is not forgotten; notes it."""
        key = _KEY.fullmatch(given)
        if key is None:
            return self.is_token(given)
        now = time.time() if now is None else now
        path = self._devices / f"{key[1]}.json"
        try:
            kept = _kept(path)
        except OSError:  # of a moment: to forget a device removes its file
            return given in self._good
        self._good.pop(given, None)
        if kept is None or not kept.lives(now) or not same(_hash(key[2]), kept.hash):
            return False
        self._good[given] = None
        while len(self._good) > MOST:
            del self._good[next(iter(self._good))]
        with suppress(OSError):
            if abs(now - path.stat().st_mtime) > _NOTED:
                os.utime(path, (now, now))
        return True

    def pair(self, agent: str, earlier: str = "", now: float | None = None) -> str:
        """Return a new device's key.

        Parameters
        ----------
        agent
            What its browser says of itself.
        earlier
            The key that it has already; it is forgotten.
        now
            The time, s since 1970.

        Raises
        ------
        OutputError
            It cannot be kept.
        """
        now = time.time() if now is None else now
        name, secret = secrets.token_hex(4), secrets.token_urlsafe(32)
        kept = {"kind": _kind(agent), "paired": float(now), "hash": _hash(secret)}
        known = _KEY.fullmatch(earlier) if self.fits(earlier, now) else None
        try:
            self._devices.mkdir(mode=0o700, parents=True, exist_ok=True)
            _write_private(self._devices / f"{name}.json", json.dumps(kept))
            if known is not None:
                self.drop(earlier)
            others = [device for device in self.devices(now) if device.name != name]
            for device in others[MOST - 1 :]:
                self._drop(device.name)
        except OSError as error:
            raise OutputError(
                f"{self._devices}: the device's key cannot be kept there: {error.strerror}."
            ) from error
        return f"{name}.{secret}"

    def drop(self, key: str) -> None:
        """Forget the device with this key."""
        self._drop(key.partition(".")[0])

    def devices(self, now: float | None = None) -> list[Device]:
        """Return the devices whose keys are good, the latest here first."""
        now = time.time() if now is None else now
        found = []
        for path in self._devices.glob("*.json"):
            with suppress(OSError):
                kept = _kept(path)
                if kept is not None and kept.lives(now):
                    seen = max(kept.paired, path.stat().st_mtime)
                    found.append(Device(path.stem, kept.kind, kept.paired, seen))
        return sorted(found, key=lambda device: (device.seen, device.name), reverse=True)

    def forget(self, name: str | None = None) -> int:
        """Forget a device, or all (None), and make a new token: they have seen the old one.

        Returns
        -------
        How many were forgotten.

        Raises
        ------
        InputError
            There is no such device, or no partner has been let in from this folder.
        OutputError
            The folder cannot be written to.
        """
        folder = self._token.parent
        if not self._token.is_file():
            raise InputError(
                f"{folder}: no partner has kept a token there; name its folder with --folder."
            )
        if name is not None and name not in {device.name for device in self.devices()}:
            raise InputError(
                f"no device is called {name!r} in {folder}; `miburi devices` lists those that are "
                "paired."
            )
        try:
            _new_token(self._token)  # first: nobody comes in by the old one meanwhile
            names = [path.stem for path in self._devices.glob("*.json")] if name is None else [name]
            for each in names:
                self._drop(each)
        except OSError as error:
            raise OutputError(f"{folder}: cannot write there: {error.strerror}.") from error
        return len(names)

    def _drop(self, name: str) -> None:
        (self._devices / f"{name}.json").unlink(missing_ok=True)


class _Kept(NamedTuple):
    """What a device's file holds."""

    kind: str
    paired: float
    hash: str

    def lives(self, now: float) -> bool:
        """Whether the key is good; a clock that was set back a little does not end it."""
        return -_CLOCK <= now - self.paired < LIFE


def _kept(path: Path) -> _Kept | None:
    """Return what a file holds; None if there is none, or no sense in it."""
    try:
        kept = json.loads(_read(path))
    except (ValueError, RecursionError):
        return None
    if not isinstance(kept, dict):
        return None
    kind, paired, digest = kept.get("kind"), kept.get("paired"), kept.get("hash")
    if not (isinstance(kind, str) and isinstance(digest, str) and isinstance(paired, float)):
        return None
    return _Kept(kind, paired, digest)


def _kind(agent: str) -> str:
    """Name machine and browser in words of ours, never in the browser's own."""
    machine = next((word for sign, word in _MACHINES.items() if sign in agent), "a device")
    browser = next((word for sign, word in _BROWSERS.items() if sign in agent), "")
    return f"{machine}, {browser}" if browser else machine


def _hash(secret: str) -> str:
    return sha256(secret.encode()).hexdigest()


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except FileNotFoundError:
        return ""


def _new_token(path: Path) -> str:
    token = secrets.token_urlsafe(32)
    path.parent.mkdir(parents=True, exist_ok=True)
    _write_private(path, token + "\n")
    return token


def _write_private(path: Path, text: str) -> None:
    """Write a file that only its owner can read; it is whole, or as before."""
    draft = path.with_name(f".{path.name}.new")
    draft.unlink(missing_ok=True)
    draft.touch(mode=0o600)
    with draft.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    if hasattr(os, "chown"):
        with suppress(OSError):  # whoever may use sudo writes for the owner of the folder
            folder = path.parent.stat()
            os.chown(draft, folder.st_uid, folder.st_gid)
    draft.replace(path)
