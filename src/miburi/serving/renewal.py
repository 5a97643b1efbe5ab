"""Keep the server reachable while addresses change and certificates expire.

The computer's addresses are checked at the start and every minute. If they have changed, or the
certificate is near its end, the certificate is renewed; the pages' codes and links change with it,
and new connections get the new certificate.
"""

import logging
import ssl
from datetime import datetime
from pathlib import Path
from urllib.parse import urlsplit

from miburi.errors import MiburiError
from miburi.serving.addresses import EVERYWHERE, Listeners
from miburi.serving.keys import Keys, kept_token
from miburi.serving.reach import Reach, way_in

#: The interval between two checks, in s (our choice).
EVERY = 60.0
_LOG = logging.getLogger(__name__)


def reach_of(listeners: Listeners, folder: Path, now: datetime) -> tuple[Reach, Path | None]:
    """Return a server's addresses, keys and authority and, with https, its certificate's file.

    The token and certificates in ``folder`` are made if missing.

    Raises the errors of :func:`miburi.serving.authority.kept_certificates`.
    """
    if not listeners.open_to_others:
        return Reach(), None
    kept_token(folder / "token")
    keys, addresses = Keys(folder), tuple(listeners.addresses())
    if listeners.encrypted is None:
        return Reach(addresses, keys), None
    from miburi.serving.authority import is_at_home, kept_certificates, own_names

    if listeners.encrypted.getsockname()[0] in EVERYWHERE:  # some may be on the internet
        addresses = tuple(each for each in addresses if is_at_home(urlsplit(each).hostname or ""))
    hosts = [urlsplit(each).hostname or "" for each in addresses]
    kept = kept_certificates(folder / "https", [*own_names(), *hosts], now)
    if kept.news:
        _LOG.warning("%s", kept.news)
    reach = Reach(addresses, keys, kept.authority.read_bytes(), kept.fingerprint)
    return reach, kept.server


class Renewal:
    """Keeps a running server's ``reach`` (in place) and certificate up to date.

    ``context`` encrypts new connections with the key and certificate in the file ``certificate``.
    Both are None without https.
    """

    def __init__(
        self,
        listeners: Listeners,
        folder: Path,
        reach: Reach,
        context: ssl.SSLContext | None,
        certificate: Path | None,
    ) -> None:
        self._listeners, self._folder = listeners, folder
        self._reach, self._context = reach, context
        self._used = None if certificate is None else certificate.read_bytes()
        self._trouble = ""

    def look(self, now: datetime) -> None:
        """Renew what is out of date at ``now``; a failure is reported once, and tried again."""
        try:
            self._renew(now)
        except (MiburiError, OSError) as error:
            if self._trouble != str(error):
                _LOG.warning("addresses could not be renewed: %s", error)
            self._trouble = str(error)
        else:
            self._trouble = ""

    def _renew(self, now: datetime) -> None:
        found, certificate = reach_of(self._listeners, self._folder, now)
        if certificate is not None and self._context is not None:
            content = certificate.read_bytes()
            if content != self._used:
                self._context.load_cert_chain(certificate)
                self._used = content
        moved = found.addresses != self._reach.addresses
        self._reach.addresses, self._reach.authority = found.addresses, found.authority
        self._reach.fingerprint = found.fingerprint
        if moved and found.addresses and self._reach.token is not None:
            how = way_in(found.addresses[0], self._reach.token)
            print(f"The partner's address has changed. On a phone, {how}", flush=True)
