"""The home authority, judged by OpenSSL's own program, and what is kept of it."""

import shutil
import stat
import subprocess
from collections.abc import Callable, Iterable
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


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with certificates that no test changes."""
    folder = tmp_path_factory.mktemp("home")
    kept_certificates(folder, HOSTS, NOW)
    return folder


def sign(authority: Path, host: str, leaf: Path) -> Path:
    """Write a certificate that a thief of the authority's key makes for a host."""
    content = authority.read_bytes()
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
    leaf.write_bytes(made.public_bytes(Encoding.PEM))
    return leaf


def verify(folder: Path, leaf: Path, *options: str) -> str:
    """What OpenSSL says of a certificate, a minute from now."""
    done = subprocess.run(
        ["openssl", "verify", "-x509_strict", "-purpose", "sslserver", "-attime",
         str(int(NOW.timestamp()) + 60), "-CAfile", str(folder / "ca.pem"), *options, str(leaf)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    return done.stdout + done.stderr


@needs_openssl
def test_openssl_accepts_the_certificate_for_each_of_our_addresses(home: Path) -> None:
    for host in HOSTS:
        option = "-verify_hostname" if host[0].isalpha() else "-verify_ip"
        assert verify(home, home / "server.pem", option, host).endswith("OK\n"), host


@needs_openssl
@pytest.mark.parametrize(
    ("hosts", "at_home", "verdict"),
    [
        (
            ["10.1.2.3", "172.31.0.1", "192.168.255.1", "100.127.0.1", "169.254.9.9", "fd12::1",
             "fe80::1", "other.local"], True, "OK\n",
        ),
        (
            ["bank.example", "local.example", "notlocal", "8.8.8.8", "172.32.0.1", "192.169.0.1",
             "100.128.0.1", "2001:db8::1", "fc00::1"], False, "permitted subtree violation",
        ),
    ],
)  # fmt: skip
def test_the_authority_vouches_for_every_address_at_home_and_a_stolen_key_for_no_other(
    home: Path, tmp_path: Path, hosts: list[str], at_home: bool, verdict: str
) -> None:
    for host in hosts:
        assert is_at_home(host) is at_home, host
        leaf = sign(home / "authority.pem", host, tmp_path / "leaf.pem")
        assert verdict in verify(home, leaf), host


@needs_openssl
def test_a_stolen_certificate_of_the_server_makes_no_other(home: Path, tmp_path: Path) -> None:
    leaf = sign(home / "server.pem", "192.168.1.4", tmp_path / "leaf.pem")
    assert "invalid CA" in verify(home, leaf, "-untrusted", str(home / "server.pem"))


def judge(folder: Path, leaf: Path, name: x509.GeneralName) -> None:
    """Verify as strictly as the rules for authorities of the internet ask."""
    authority = x509.load_pem_x509_certificate((folder / "ca.pem").read_bytes())
    assert isinstance(name, x509.DNSName | x509.IPAddress)
    verifier = PolicyBuilder().store(Store([authority])).time(NOW).build_server_verifier(name)
    verifier.verify(x509.load_pem_x509_certificate(leaf.read_bytes()), [])


def test_a_strict_verifier_agrees(home: Path, tmp_path: Path) -> None:
    judge(home, home / "server.pem", x509.IPAddress(ip_address("192.168.1.4")))
    judge(home, home / "server.pem", x509.DNSName("robot.local"))
    leaf = sign(home / "authority.pem", "bank.example", tmp_path / "leaf.pem")
    with pytest.raises(VerificationError, match="no permitted name constraints"):
        judge(home, leaf, x509.DNSName("bank.example"))


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


def mixed(path: Path) -> None:
    """Another's key before the certificate."""
    other = ec.generate_private_key(ec.SECP256R1())
    key = other.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    certificate = path.read_bytes().partition(b"-----BEGIN CERT")
    path.write_bytes(key + b"".join(certificate[1:]))


def sign_itself(path: Path, extensions: Iterable[x509.ExtensionType]) -> None:
    """Write a foreign authority with these extensions."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "Everything")])
    made = (
        x509.CertificateBuilder().subject_name(name).issuer_name(name)
        .public_key(key.public_key()).serial_number(1)
        .not_valid_before(NOW - timedelta(days=1)).not_valid_after(NOW + timedelta(days=3000))
    )  # fmt: skip
    for each in extensions:
        made = made.add_extension(each, critical=not isinstance(each, x509.ExtendedKeyUsage))
    pem = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    path.write_bytes(pem + made.sign(key, SHA256()).public_bytes(Encoding.PEM))


def widened(path: Path) -> None:
    """Write an authority like ours that may also vouch for a bank."""
    ours = x509.load_pem_x509_certificate(path.read_bytes()).extensions
    bank = x509.NameConstraints([x509.DNSName("bank.example")], excluded_subtrees=None)
    kept = [each.value for each in ours if not isinstance(each.value, x509.NameConstraints)]
    sign_itself(path, [*kept, bank])


SPOILS: dict[str, Callable[[Path], object]] = {
    "garbage": lambda path: path.write_bytes(b"\xff\x00 nonsense"),
    "cut": lambda path: path.write_bytes(path.read_bytes()[:-200]),
    "open to others": lambda path: path.chmod(0o644),
    "mixed": mixed,
    "unbound": lambda path: sign_itself(path, [x509.BasicConstraints(True, path_length=None)]),
    "widened": widened,
}


@pytest.mark.parametrize("spoil", SPOILS.values(), ids=SPOILS)
def test_spoilt_certificates_are_replaced_and_a_new_authority_is_announced(
    tmp_path: Path, spoil: Callable[[Path], object]
) -> None:
    first = kept_certificates(tmp_path, HOSTS, NOW)
    spoil(first.server)
    spoilt = first.server.read_bytes()
    assert kept_certificates(tmp_path, HOSTS, NOW) == first, "the same authority, without a word"
    assert first.server.read_bytes() != spoilt
    assert stat.S_IMODE(first.server.stat().st_mode) == 0o600
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


def test_an_authority_near_its_end_is_made_anew(tmp_path: Path) -> None:
    kept_certificates(tmp_path, HOSTS, NOW)
    assert kept_certificates(tmp_path, HOSTS, NOW + timedelta(days=3650 - 300)).news


def test_a_clock_that_starts_in_1970_replaces_nothing(tmp_path: Path) -> None:
    kept_certificates(tmp_path, HOSTS, NOW)
    before = contents(tmp_path)
    assert not kept_certificates(tmp_path, HOSTS, datetime(1970, 1, 1, 0, 1, tzinfo=UTC)).news
    assert contents(tmp_path) == before


def test_a_certificate_from_a_clock_that_was_ahead_is_replaced(tmp_path: Path) -> None:
    kept_certificates(tmp_path, HOSTS, NOW)
    before = kept_certificates(tmp_path, HOSTS[:-1], NOW + timedelta(days=3000)).server.read_bytes()
    assert kept_certificates(tmp_path, HOSTS[:-1], NOW).server.read_bytes() != before


def test_a_public_certificate_that_somebody_changed_is_written_anew(tmp_path: Path) -> None:
    kept = kept_certificates(tmp_path, HOSTS, NOW)
    right = kept.authority.read_bytes()
    kept.authority.write_bytes(b"nonsense")
    kept_certificates(tmp_path, HOSTS, NOW)
    assert kept.authority.read_bytes() == right


def test_an_address_of_the_internet_or_a_folder_that_cannot_be_written_is_refused(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "https"
    with pytest.raises(InputError, match=r"for addresses at home .*got 203\.0\.113\.7"):
        kept_certificates(folder, [*HOSTS, "203.0.113.7"], NOW)
    assert not folder.exists()
    folder.write_text("a file")
    with pytest.raises(OutputError, match="cannot be kept there"):
        kept_certificates(folder, HOSTS, NOW)
