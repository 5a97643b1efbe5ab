"""The keys to a partner: a token for programs and pairing, and a separate key for each device.

Each is a small file that is read at every use, so a device that `miburi devices` forgets is locked
out of every process at once. A device's file holds the hash of its key, never the key itself.
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
from miburi.ground.files import write_whole

#: The lifetime of a device's key, in s, and the largest number of devices with keys (our choice).
LIFE, MOST = 30 * 24 * 3600, 50
#: The interval, in s, between two updates of a device's last visit (our choice).
_NOTED = 600.0
#: By how much, in s, the clock may have been ahead when a device was paired (our choice).
_CLOCK = 86_400.0
_TOKEN = re.compile(r"[A-Za-z0-9_-]{32,}")
_KEY = re.compile(r"([0-9a-f]{8})\.([A-Za-z0-9_-]{43})")
#: Words in a User-Agent, and our names for them; the first match counts.
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
    """Compare two tokens in constant time."""
    return hmac.compare_digest(given.encode("utf-8", "replace"), token.encode())


def kept_token(path: Path) -> str:
    """Return the token in a file that only its owner can read.

    A token that is missing, malformed or readable by others is replaced by a new one.

    Raises OutputError if the file cannot be read or written.
    """
    # Windows has no such permission bits; there, others cannot open a user's own folder.
    try:
        open_to_others = os.name == "posix" and path.is_file() and path.stat().st_mode & 0o077
        token = "" if open_to_others else _read(path)
        return token if _TOKEN.fullmatch(token) else _new_token(path)
    except OSError as error:
        raise OutputError(f"{path}: the token cannot be kept there: {error.strerror}.") from error


@dataclass(frozen=True)
class Device:
    """A device that was paired; times are in s since 1970."""

    name: str  # eight hexadecimal digits, for `miburi devices forget`
    kind: str  # machine and browser, in our words, from the browser's User-Agent
    paired: float
    seen: float  # its last visit, to ten minutes


class Keys:
    """The keys in a folder, which must contain the token already: see :func:`kept_token`."""

    def __init__(self, folder: Path) -> None:
        self._token, self._devices = folder / "token", folder / "devices"
        self._latest = ""  # the last token read
        self._good: dict[str, None] = {}  # recent keys, for when the disk cannot be read

    @property
    def token(self) -> str:
        """The current token; empty if the file is gone, and then no token is accepted."""
        with suppress(OSError):
            token = _read(self._token)
            self._latest = token if _TOKEN.fullmatch(token) else ""
        return self._latest

    def is_token(self, given: str) -> bool:
        """Whether this is the token."""
        token = self.token if _TOKEN.fullmatch(given) else ""
        return bool(token) and same(given, token)

    def fits(self, given: str, now: float | None = None) -> bool:
        """Whether this is the token or a device's key; a device's visit is recorded."""
        key = _KEY.fullmatch(given)
        if key is None:
            return self.is_token(given)
        now = time.time() if now is None else now
        path = self._devices / f"{key[1]}.json"
        try:
            kept = _kept(path)
        except OSError:  # a failing disk; forgetting a device removes its file
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
        """Return the key of a new device with this User-Agent; forget its ``earlier`` key.

        Raises OutputError if the key cannot be kept.
        """
        now = time.time() if now is None else now
        name, secret = secrets.token_hex(4), secrets.token_urlsafe(32)
        kept = {"kind": _kind(agent), "paired": float(now), "hash": _hash(secret)}
        known = _KEY.fullmatch(earlier) if self.fits(earlier, now) else None
        try:
            self._devices.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_whole(self._devices / f"{name}.json", json.dumps(kept), private=True)
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
        """Return the devices with valid keys, the most recently seen first."""
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
        """Forget a device (or all, for None), and replace the token, which the device may know.

        Return the number of devices that were forgotten.

        Raises InputError if there is no such device, or the folder is not a partner's; OutputError
        if the folder cannot be written to.
        """
        folder = self._token.parent
        if not self._token.is_file():
            raise InputError(
                f"{folder}: there is no token there; give the partner's folder with --folder."
            )
        if name is not None and name not in {device.name for device in self.devices()}:
            raise InputError(
                f"no device is called {name!r} in {folder}; `miburi devices` lists those that are "
                "paired."
            )
        try:
            _new_token(self._token)  # first, so that nobody pairs with the old one meanwhile
            names = [path.stem for path in self._devices.glob("*.json")] if name is None else [name]
            for each in names:
                self._drop(each)
        except OSError as error:
            raise OutputError(f"{folder}: cannot write there: {error.strerror}.") from error
        return len(names)

    def _drop(self, name: str) -> None:
        (self._devices / f"{name}.json").unlink(missing_ok=True)


class _Kept(NamedTuple):
    """The content of a device's file."""

    kind: str
    paired: float
    hash: str

    def lives(self, now: float) -> bool:
        """Whether the key is still valid; setting a clock back a little does not invalidate it."""
        return -_CLOCK <= now - self.paired < LIFE


def _kept(path: Path) -> _Kept | None:
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
    """Name the machine and the browser in our own words."""
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
    write_whole(path, token + "\n", private=True)
    return token
