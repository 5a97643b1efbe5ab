"""Addresses and certificates, renewed while the server runs, as a device sees them."""

import ssl
import sys
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

x509 = pytest.importorskip("cryptography.x509")

from miburi.errors import OutputError  # noqa: E402  (below what may be missing)
from miburi.serving.addresses import Listeners, listening_plainly, listening_twice  # noqa: E402
from miburi.serving.http import encryption  # noqa: E402
from miburi.serving.reach import Reach  # noqa: E402
from miburi.serving.renewal import Renewal, reach_of  # noqa: E402

NOW = datetime(2026, 5, 1, tzinfo=UTC)


def shown(context: ssl.SSLContext) -> "x509.Certificate":
    """Return the certificate that a new connection is shown."""
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    trusting = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    trusting.check_hostname, trusting.verify_mode = False, ssl.CERT_NONE
    client = trusting.wrap_bio(to_client, to_server)
    server = context.wrap_bio(to_server, to_client, server_side=True)
    for side in (client, server, client):
        try:
            side.do_handshake()
        except ssl.SSLWantReadError:
            continue
    content = client.getpeercert(binary_form=True)
    assert content
    return x509.load_der_x509_certificate(content)


def hosts(certificate: "x509.Certificate") -> list[str]:
    names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    return [str(address) for address in names.get_values_for_type(x509.IPAddress)]


class Home:
    """A server at home whose address may change."""

    def __init__(self, listeners: Listeners, folder: Path) -> None:
        self.reach, certificate = reach_of(listeners, folder, NOW)
        self.context = None if certificate is None else encryption(certificate)
        self.renewal = Renewal(listeners, folder, self.reach, self.context, certificate)


@pytest.fixture
def address(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """This computer's addresses, to be changed."""
    there = ["192.168.1.4"]
    monkeypatch.setattr("miburi.serving.addresses.own_addresses", lambda: list(there))
    return there


@pytest.fixture
def home(address: list[str], tmp_path: Path) -> Iterator[Home]:
    with listening_twice("0.0.0.0", 0) as listeners:
        yield Home(listeners, tmp_path)


@pytest.mark.parametrize("terminal", [True, False])
def test_a_new_address_gets_a_certificate_a_code_and_links(
    home: Home,
    address: list[str],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    terminal: bool,
) -> None:
    monkeypatch.setattr(sys.stdout, "isatty", lambda: terminal)
    assert home.context is not None
    before = shown(home.context)
    home.renewal.look(NOW + timedelta(minutes=1))
    assert shown(home.context) == before, "nothing has changed"
    assert capsys.readouterr().out == ""
    token, authority = home.reach.token, home.reach.authority
    address[:] = ["192.168.1.9"]
    home.renewal.look(NOW + timedelta(minutes=2))
    assert "192.168.1.9" in hosts(shown(home.context))
    assert "192.168.1.4" not in hosts(shown(home.context))
    assert [part.split(":")[1] for part in home.reach.addresses] == ["//192.168.1.9"]
    assert (home.reach.token, home.reach.authority) == (token, authority), "phones know it already"
    told = capsys.readouterr().out
    assert f"{home.reach.addresses[0]}/pair" in told
    assert token is not None
    assert (f"/pair#{token}" in told, token in told) == (terminal, terminal)


def test_a_certificate_is_renewed_before_it_ends(home: Home) -> None:
    assert home.context is not None
    first = shown(home.context)
    for days in range(0, 800, 20):
        now = NOW + timedelta(days=days)
        home.renewal.look(now)
        assert shown(home.context).not_valid_after_utc > now + timedelta(days=50)
    assert shown(home.context) != first


def test_internet_addresses_are_left_out_and_the_server_serves_on(
    home: Home, address: list[str]
) -> None:
    for there, left in (
        (["8.8.8.8", "10.0.0.7"], ["//10.0.0.7"]),
        (["8.8.8.8"], []),
        (["192.168.1.4"], ["//192.168.1.4"]),
    ):
        address[:] = there
        home.renewal.look(NOW)
        assert [part.split(":")[1] for part in home.reach.addresses] == left


def test_what_fails_is_said_once_and_tried_again(
    home: Home,
    address: list[str],
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    def full(*_: object) -> None:
        raise OutputError("the disk is full.")

    address[:] = ["192.168.1.9"]
    with monkeypatch.context() as patched:
        patched.setattr("miburi.serving.authority.kept_certificates", full)
        home.renewal.look(NOW)
        home.renewal.look(NOW)
    assert caplog.text.count("the disk is full") == 1
    assert "192.168.1.4" in home.reach.addresses[0]
    home.renewal.look(NOW)
    assert "192.168.1.9" in home.reach.addresses[0]


def test_by_plain_http_links_follow_too(address: list[str], tmp_path: Path) -> None:
    with listening_plainly("0.0.0.0", 0) as listeners:
        home = Home(listeners, tmp_path)
        address[:] = ["192.168.1.9"]
        home.renewal.look(NOW)
        assert "//192.168.1.9:" in home.reach.addresses[0]
    with listening_plainly("127.0.0.1", 0) as listeners:
        home = Home(listeners, tmp_path)
        home.renewal.look(NOW)
        assert home.reach == Reach()
