"""A local certificate authority (CA), made on this computer, which phones can trust.

A browser grants camera, microphone and motion only to pages over https, and no public authority
vouches for an address at home. So this computer makes its own authority, and signs with it a
certificate for its present addresses. X.509 name constraints limit the authority to names and
networks at home, so a stolen key cannot be used to impersonate sites on the internet.

This module needs the extra ``https``.
"""

import os
import socket
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address, ip_network
from pathlib import Path

from miburi.errors import InputError, OutputError, needs_extra
from miburi.ground.files import write_whole

try:
    from cryptography import x509
    from cryptography.exceptions import InvalidSignature
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.hazmat.primitives.hashes import SHA256
    from cryptography.hazmat.primitives.serialization import (
        Encoding,
        NoEncryption,
        PrivateFormat,
        load_pem_private_key,
    )
    from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID
except ModuleNotFoundError as error:
    raise needs_extra("https", error) from error


#: Domains that the authority may vouch for, each with its subdomains.
NAMES = ("local", "localhost")
#: Networks outside the internet: private (RFC 1918, 4193), shared (RFC 6598, used by VPNs, too),
#: link-local, loopback, and for tests (RFC 5737).
NETWORKS = tuple(
    ip_network(text)
    for text in (
        *("10.0.0.0/8", "172.16.0.0/12", "192.168.0.0/16", "100.64.0.0/10", "169.254.0.0/16"),
        *("127.0.0.0/8", "192.0.2.0/24", "fd00::/8", "fe80::/10", "::1/128"),
    )
)
#: How long an authority and a certificate are valid (our choice). Phones refuse a certificate that
#: is valid for more than 398 days.
_AUTHORITY_LASTS, _CERTIFICATE_LASTS = timedelta(days=3650), timedelta(days=396)
#: A certificate that expires within this time is renewed, even while the partner runs.
_LEFT = timedelta(days=60)
#: The clocks of two devices at home may differ by this much.
_SKEW = timedelta(days=1)


def _usage(*, signs: bool) -> x509.KeyUsage:
    """Return a key's use: to sign certificates, or to serve."""
    others = dict.fromkeys(
        ("content_commitment", "key_encipherment", "data_encipherment", "key_agreement",
         "encipher_only", "decipher_only"),
        False,
    )  # fmt: skip
    return x509.KeyUsage(digital_signature=not signs, key_cert_sign=signs, crl_sign=signs, **others)


_FOR_SERVERS = x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH])
#: The extensions of our authorities, and whether each is critical. Strict verifiers require that
#: the last extension is not critical.
_BOUNDS = {
    x509.BasicConstraints(ca=True, path_length=0): True,
    _usage(signs=True): True,
    x509.NameConstraints(
        [*map(x509.DNSName, NAMES), *map(x509.IPAddress, NETWORKS)], excluded_subtrees=None
    ): True,
    _FOR_SERVERS: False,
}


@dataclass(frozen=True)
class Certificates:
    """The files of the certificates."""

    server: Path  # the server's key and certificate, PEM; only their owner can read the file
    authority: Path  # the authority's certificate, PEM, for phones and programs to trust
    fingerprint: str  # SHA-256 of the authority, as phones show it
    news: str | None  # a message for the user if an existing authority had to be replaced


@dataclass(frozen=True)
class _Identity:
    key: ec.EllipticCurvePrivateKey
    certificate: x509.Certificate


class _UnfitError(Exception):
    """A file is unusable; the message continues a sentence that begins with the file's path."""


def is_at_home(host: str) -> bool:
    """Whether the authority may vouch for a name or an address."""
    try:
        address = ip_address(host)
    except ValueError:
        return any(host.lower() == name or host.lower().endswith(f".{name}") for name in NAMES)
    return any(address in network for network in NETWORKS)


def own_names() -> list[str]:
    """Return the names and addresses by which this computer reaches itself."""
    name = socket.gethostname().split(".")[0].lower()
    known = [f"{name}.local"] if name.replace("-", "").isalnum() and name.isascii() else []
    return [*known, "localhost", "127.0.0.1", "::1"]


def kept_certificates(folder: Path, hosts: Iterable[str], now: datetime) -> Certificates:
    """Return the certificates in a folder; replace missing and unusable ones.

    An authority is replaced only if its file is broken, not ours, open to others, or near its end.
    The server's certificate is also replaced if ``hosts``, the names and addresses of this
    computer, change. ``now`` has a time zone.

    Raises InputError if a host is not at home; OutputError if the folder cannot be read or written.
    """
    names = sorted(set(hosts))
    for host in names:
        if not is_at_home(host):
            raise InputError(
                f"--https is for addresses at home ({', '.join(map(str, NETWORKS[:4]))}, ..., "
                f"*.local), got {host}. On the internet, put a server with a certificate of its "
                "own in front."
            )
    kept, server, public = (folder / f"{name}.pem" for name in ("authority", "server", "ca"))
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        authority, news = _authority(kept, now)
        shown = authority.certificate.public_bytes(Encoding.PEM).decode()
        if not public.is_file() or public.read_bytes() != shown.encode():
            write_whole(public, shown)
        try:
            _check_server(_load(server), authority, names, now)
        except (FileNotFoundError, _UnfitError):
            write_whole(server, _pem(_sign_server(authority, names, now)), private=True)
    except OSError as error:
        raise OutputError(
            f"{error.filename or folder}: the certificates cannot be kept there: {error.strerror}."
        ) from error
    return Certificates(
        server, public, authority.certificate.fingerprint(SHA256()).hex(":").upper(), news
    )


def _authority(path: Path, now: datetime) -> tuple[_Identity, str | None]:
    news = None
    try:
        found = _load(path)
        _check_authority(found, now)
    except FileNotFoundError:
        pass
    except _UnfitError as error:
        news = (
            f"{path} {error}, so a new home authority was made. Devices that have installed the "
            "old one will warn again: install the new one there."
        )
    else:
        return found, None
    made = _sign_authority(now)
    write_whole(path, _pem(made), private=True)
    return made, news


def _load(path: Path) -> _Identity:
    content = path.read_bytes()
    # Windows has no such permission bits; there, others cannot open a user's own folder.
    if os.name == "posix" and path.stat().st_mode & 0o077:
        raise _UnfitError("could be read by others")
    try:
        key = load_pem_private_key(content, None)
        certificate = x509.load_pem_x509_certificate(content)
        whole = certificate.public_key() == key.public_key()
    except (ValueError, TypeError) as error:
        raise _UnfitError("does not hold a key and its certificate") from error
    if not whole or not isinstance(key, ec.EllipticCurvePrivateKey):
        raise _UnfitError("holds a certificate that does not match its key")
    return _Identity(key, certificate)


def _check_authority(found: _Identity, now: datetime) -> None:
    certificate = found.certificate
    try:
        certificate.verify_directly_issued_by(certificate)
        # The bounds must match exactly: an authority without them could imitate any site.
        kept = [certificate.extensions.get_extension_for_class(type(each)) for each in _BOUNDS]
        bound = {each.value: each.critical for each in kept} == _BOUNDS
    except (ValueError, TypeError, InvalidSignature, x509.ExtensionNotFound):
        bound = False
    if not bound:
        raise _UnfitError("is not an authority limited to this home")
    # An authority that is not valid yet is kept: a small computer's clock may start in 1970.
    if certificate.not_valid_after_utc < now + _CERTIFICATE_LASTS:
        raise _UnfitError("expires too soon")


def _check_server(found: _Identity, authority: _Identity, names: list[str], now: datetime) -> None:
    certificate = found.certificate
    try:
        certificate.verify_directly_issued_by(authority.certificate)
        vouched = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName)
    except (ValueError, TypeError, InvalidSignature, x509.ExtensionNotFound) as error:
        raise _UnfitError("is another authority's") from error
    if vouched.value != x509.SubjectAlternativeName([_name(name) for name in names]):
        raise _UnfitError("is for other addresses")
    early = authority.certificate.not_valid_before_utc <= now < certificate.not_valid_before_utc
    if early or now > certificate.not_valid_after_utc - _LEFT:
        raise _UnfitError("is not valid, or not for long")


def _sign_authority(now: datetime) -> _Identity:
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "Miburi at home")])
    builder = _builder(key, name, name, now - _SKEW, _AUTHORITY_LASTS).add_extension(
        x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False
    )
    for bound, critical in _BOUNDS.items():
        builder = builder.add_extension(bound, critical=critical)
    return _Identity(key, builder.sign(key, SHA256()))


def _sign_server(authority: _Identity, names: list[str], now: datetime) -> _Identity:
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "Miburi")])
    issuer = authority.certificate
    known = issuer.extensions.get_extension_for_class(x509.SubjectKeyIdentifier).value
    builder = (
        _builder(key, name, issuer.subject, now - _SKEW, _CERTIFICATE_LASTS)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs=False), critical=True)
        .add_extension(_FOR_SERVERS, critical=False)
        .add_extension(x509.SubjectAlternativeName([_name(each) for each in names]), critical=False)
        .add_extension(
            x509.AuthorityKeyIdentifier.from_issuer_subject_key_identifier(known), critical=False
        )
    )
    return _Identity(key, builder.sign(authority.key, SHA256()))


def _builder(
    key: ec.EllipticCurvePrivateKey,
    subject: x509.Name,
    issuer: x509.Name,
    begin: datetime,
    lasts: timedelta,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(begin.astimezone(UTC))
        .not_valid_after(begin.astimezone(UTC) + lasts)
    )


def _name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _pem(identity: _Identity) -> str:
    key = identity.key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    return (key + identity.certificate.public_bytes(Encoding.PEM)).decode()
