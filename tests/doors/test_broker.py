"""Where a broker is, and how one gets in."""

from pathlib import Path

import pytest

from miburi.doors.broker import PASSWORD, Broker, check_name, find_broker
from miburi.errors import InputError


@pytest.mark.parametrize(
    ("address", "broker"),
    [
        ("localhost", Broker("localhost", 1883)),
        ("localhost:1884", Broker("localhost", 1884)),
        ("[::1]:1884", Broker("::1", 1884)),
        ("mqtt://robin@10.0.0.2", Broker("10.0.0.2", 1883, user="robin")),
        ("mqtts://home.example/", Broker("home.example", 8883, tls=True)),
    ],
)
def test_addresses(address: str, broker: Broker) -> None:
    assert find_broker(address, environment={}) == broker


def test_a_wrong_address_is_refused_in_words() -> None:
    wrong = ("http://localhost", "localhost:much", "localhost:99999", "mqtt://", "",
             "localhost/a/topic")  # fmt: skip
    for address, words in (*((one, "mqtts://") for one in wrong),
                           ("mqtt://robin:secret@localhost", PASSWORD)):  # fmt: skip
        with pytest.raises(InputError, match=words) as refused:
            find_broker(address, environment={})
        assert "secret" not in str(refused.value)


def test_the_password_comes_from_the_environment_or_a_file_and_is_not_shown(tmp_path: Path) -> None:
    file = tmp_path / "password"
    file.write_text("from a file\n")
    both = {PASSWORD: "from the environment", PASSWORD + "_FILE": str(file)}
    assert find_broker("localhost", environment=both).password == "from a file"
    del both[PASSWORD + "_FILE"]
    broker = find_broker("localhost", environment=both)
    assert broker.password == "from the environment"
    assert "environment" not in repr(broker)
    with pytest.raises(InputError, match="cannot be read"):
        find_broker("localhost", environment={PASSWORD + "_FILE": str(tmp_path / "none")})


def test_certificates_are_looked_at_before_anything_starts(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        find_broker("mqtts://localhost", tmp_path / "none.pem", {})
    with pytest.raises(InputError, match="mqtts"):
        find_broker("localhost", tmp_path / "none.pem", {})


@pytest.mark.parametrize("name", ["", "all", "Kitchen", "a/b", "+", "#", "-a", "x" * 41])
def test_a_name_must_fit_into_a_topic(name: str) -> None:
    with pytest.raises(InputError, match="a-z"):
        check_name(name)
