"""The home authority, judged by OpenSSL's own program, and what is kept of it."""

import shutil
import stat
import subprocess
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import NameOID
from cryptography.x509.verification import PolicyBuilder, Store, VerificationError

from miburi.errors import InputError, OutputError
from miburi.serving.authority import is_at_home, kept_certificates

NOW = datetime(2026, 5, 1, tzinfo=UTC)
HOSTS = ["localhost", "127.0.0.1", "::1", "robot.local", "192.168.1.4"]
needs_openssl = pytest.mark.skipif(shutil.which("openssl") is None, reason="needs openssl")


def sign(folder: Path, host: str) -> Path:
    """A certificate that a thief of the authority's key makes for a host."""
    content = (folder / "authority.pem").read_bytes()
    key, issuer = load_pem_private_key(content, None), x509.load_pem_x509_certificate(content)
    assert isinstance(key, ec.EllipticCurvePrivateKey)
    try:
        name: x509.GeneralName = x509.IPAddress(ip_address(host))
    except ValueError:
        name = x509.DNSName(host)
    made = (
        x509.CertificateBuilder()
        .subject_name(x509.Name([]))
        .issuer_name(issuer.subject)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(NOW)
        .not_valid_after(NOW + timedelta(days=30))
        .add_extension(x509.SubjectAlternativeName([name]), critical=True)
        .add_extension(x509.AuthorityKeyIdentifier.from_issuer_public_key(key.public_key()), False)
        .sign(key, SHA256())
    )
    path = folder / "leaf.pem"
    path.write_bytes(made.public_bytes(Encoding.PEM))
    return path


def verify(folder: Path, leaf: Path, *options: str) -> str:
    """What OpenSSL says of a certificate, a minute from now."""
    done = subprocess.run(
        ["openssl", "verify", "-x509_strict", "-purpose", "sslserver", "-attime",
         str(int(NOW.timestamp()) + 60), "-CAfile", str(folder / "ca.pem"), *options, str(leaf)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    return done.stdout + done.stderr


@needs_openssl
@pytest.mark.parametrize(
    ("option", "host"),
    [("-verify_ip", "192.168.1.4"), ("-verify_ip", "127.0.0.1"), ("-verify_ip", "::1"),
     ("-verify_hostname", "robot.local"), ("-verify_hostname", "localhost")],
)  # fmt: skip
def test_openssl_accepts_the_certificate_for_each_of_our_addresses(
    tmp_path: Path, option: str, host: str
) -> None:
    kept = kept_certificates(tmp_path, HOSTS, NOW)
    assert verify(tmp_path, kept.server, option, host) == f"{kept.server}: OK\n"


@needs_openssl
@pytest.mark.parametrize(
    "host",
    ["10.1.2.3", "172.31.0.1", "192.168.255.1", "100.127.0.1", "169.254.9.9", "fd12::1", "fe80::1",
     "other.local"],
)  # fmt: skip
def test_the_authority_may_vouch_for_every_address_at_home(tmp_path: Path, host: str) -> None:
    kept_certificates(tmp_path, HOSTS, NOW)
    assert is_at_home(host)
    assert verify(tmp_path, sign(tmp_path, host)).endswith("OK\n")


@needs_openssl
@pytest.mark.parametrize(
    "host",
    ["bank.example", "local.example", "notlocal", "8.8.8.8", "172.32.0.1", "192.169.0.1",
     "100.128.0.1", "2001:db8::1", "fc00::1"],
)  # fmt: skip
def test_a_stolen_key_vouches_for_nothing_elsewhere(tmp_path: Path, host: str) -> None:
    kept_certificates(tmp_path, HOSTS, NOW)
    assert not is_at_home(host)
    assert "permitted subtree violation" in verify(tmp_path, sign(tmp_path, host))


@needs_openssl
def test_a_stolen_certificate_of_the_server_makes_no_other(tmp_path: Path) -> None:
    kept = kept_certificates(tmp_path, HOSTS, NOW)
    (tmp_path / "authority.pem").write_bytes(kept.server.read_bytes())  # the thief's authority
    leaf = sign(tmp_path, "192.168.1.4")
    assert "invalid CA" in verify(tmp_path, leaf, "-untrusted", str(kept.server))


def judge(folder: Path, leaf: Path, name: x509.GeneralName) -> None:
    """Verify as strictly as the rules for authorities of the internet ask."""
    authority = x509.load_pem_x509_certificate((folder / "ca.pem").read_bytes())
    assert isinstance(name, x509.DNSName | x509.IPAddress)
    verifier = PolicyBuilder().store(Store([authority])).time(NOW).build_server_verifier(name)
    verifier.verify(x509.load_pem_x509_certificate(leaf.read_bytes()), [])


def test_a_strict_verifier_agrees(tmp_path: Path) -> None:
    kept = kept_certificates(tmp_path, HOSTS, NOW)
    judge(tmp_path, kept.server, x509.IPAddress(ip_address("192.168.1.4")))
    judge(tmp_path, kept.server, x509.DNSName("robot.local"))
    with pytest.raises(VerificationError, match="no permitted name constraints"):
        judge(tmp_path, sign(tmp_path, "bank.example"), x509.DNSName("bank.example"))


def test_keys_are_for_their_owner_alone(tmp_path: Path) -> None:
    folder = tmp_path / "https"
    kept = kept_certificates(folder, HOSTS, NOW)
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    keys = [path for path in folder.iterdir() if b"PRIVATE KEY" in path.read_bytes()]
    assert sorted(path.name for path in keys) == ["authority.pem", "server.pem"]
    assert {stat.S_IMODE(path.stat().st_mode) for path in keys} == {0o600}
    assert b"PRIVATE" not in kept.authority.read_bytes()


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_second_start_uses_the_same(tmp_path: Path) -> None:
    first = kept_certificates(tmp_path, HOSTS, NOW)
    before = contents(tmp_path)
    again = kept_certificates(tmp_path, reversed(HOSTS), NOW + timedelta(days=300))
    assert (again, contents(tmp_path)) == (first, before)


def days(path: Path) -> int:
    certificate = x509.load_pem_x509_certificate(path.read_bytes())
    return (certificate.not_valid_after_utc - certificate.not_valid_before_utc).days


@pytest.mark.parametrize(
    ("hosts", "later"),
    [([*HOSTS[:-1], "192.168.7.7"], 0), (HOSTS[:-1], 0), (HOSTS, 340), (HOSTS, 500)],
    ids=["moved", "an address less", "near its end", "ended"],
)
def test_another_certificate_is_made_by_the_same_authority(
    tmp_path: Path, hosts: list[str], later: int
) -> None:
    first = kept_certificates(tmp_path, HOSTS, NOW)
    before = contents(tmp_path)
    again = kept_certificates(tmp_path, hosts, NOW + timedelta(days=later))
    after = contents(tmp_path)
    assert again == first
    assert {name for name in after if after[name] != before[name]} == {"server.pem"}
    assert days(again.server) <= 396


def garbage(path: Path) -> None:
    path.write_bytes(b"\xff\x00 nonsense")


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-200])


def opened(path: Path) -> None:
    path.chmod(0o644)


def mixed(path: Path) -> None:
    """Another's key before the certificate."""
    other = ec.generate_private_key(ec.SECP256R1())
    key = other.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    certificate = path.read_bytes().partition(b"-----BEGIN CERT")
    path.write_bytes(key + b"".join(certificate[1:]))


def unbound(path: Path) -> None:
    """An authority as others make them: it could vouch for the whole internet."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "Everything")])
    made = (
        x509.CertificateBuilder().subject_name(name).issuer_name(name)
        .public_key(key.public_key()).serial_number(1)
        .not_valid_before(NOW - timedelta(days=1)).not_valid_after(NOW + timedelta(days=3000))
        .add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
        .sign(key, SHA256())
    )  # fmt: skip
    pem = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    path.write_bytes(pem + made.public_bytes(Encoding.PEM))


SPOILS = [garbage, cut, opened, mixed, unbound]


@pytest.mark.parametrize("spoil", SPOILS)
def test_an_authority_that_serves_no_longer_is_made_anew_and_that_is_said(
    tmp_path: Path, spoil: Callable[[Path], None]
) -> None:
    first = kept_certificates(tmp_path, HOSTS, NOW)
    spoil(tmp_path / "authority.pem")
    spoilt = contents(tmp_path)["authority.pem"]
    again = kept_certificates(tmp_path, HOSTS, NOW)
    assert again.news is not None
    assert "\n" not in again.news
    assert "a new home authority was made" in again.news
    assert again.fingerprint != first.fingerprint
    assert contents(tmp_path)["authority.pem"] != spoilt
    assert kept_certificates(tmp_path, HOSTS, NOW).news is None
    if shutil.which("openssl"):
        assert verify(tmp_path, again.server, "-verify_ip", "127.0.0.1").endswith("OK\n")


@pytest.mark.parametrize("later", [timedelta(days=3650 - 300), timedelta(days=-2)])
def test_an_authority_out_of_its_time_is_made_anew(tmp_path: Path, later: timedelta) -> None:
    kept_certificates(tmp_path, HOSTS, NOW)
    assert kept_certificates(tmp_path, HOSTS, NOW + later).news


@pytest.mark.parametrize("spoil", SPOILS)
def test_a_certificate_that_serves_no_longer_is_made_anew_without_a_word(
    tmp_path: Path, spoil: Callable[[Path], None]
) -> None:
    first = kept_certificates(tmp_path, HOSTS, NOW)
    spoil(first.server)
    spoilt = first.server.read_bytes()
    again = kept_certificates(tmp_path, HOSTS, NOW)
    assert again == first
    assert again.server.read_bytes() != spoilt
    assert stat.S_IMODE(again.server.stat().st_mode) == 0o600


def test_a_public_certificate_that_somebody_changed_is_written_anew(tmp_path: Path) -> None:
    kept = kept_certificates(tmp_path, HOSTS, NOW)
    right = kept.authority.read_bytes()
    garbage(kept.authority)
    kept_certificates(tmp_path, HOSTS, NOW)
    assert kept.authority.read_bytes() == right


def test_an_address_of_the_internet_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"for addresses at home .*got 203\.0\.113\.7"):
        kept_certificates(tmp_path / "https", [*HOSTS, "203.0.113.7"], NOW)
    assert not (tmp_path / "https").exists()


def test_a_folder_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    (tmp_path / "https").write_text("a file")
    with pytest.raises(OutputError, match="cannot be kept there"):
        kept_certificates(tmp_path / "https", HOSTS, NOW)
