"""Where a broker is, and how one gets in."""

import asyncio
import subprocess
from pathlib import Path
from typing import Any

import pytest
from tests.fixtures.broker import start_broker
from tests.fixtures.gate import Clock

from miburi.doors.broker import PASSWORD, Broker, check_name, find_broker, stay_at
from miburi.errors import InputError


def failures(broker: Broker, capsys: pytest.CaptureFixture[str], tries: int = 7) -> list[str]:
    """Return what is said while every try fails, at a try every 1000 s."""
    clock = Clock()

    async def pause(_seconds: float) -> None:
        clock.now += 1000.0
        if clock.now >= 1000.0 * tries:
            raise asyncio.CancelledError

    async def live(_client: Any) -> None:
        pytest.fail("it got in")

    with pytest.raises(asyncio.CancelledError):
        asyncio.run(stay_at(broker, None, live, clock=clock, pause=pause))
    return capsys.readouterr().err.splitlines()


def test_the_same_reason_is_told_once_an_hour(capsys: pytest.CaptureFixture[str]) -> None:
    told = failures(Broker("127.0.0.1", 9), capsys)
    assert len(told) == 2
    assert "refused" in told[0]
    assert told[0] == told[1]


@pytest.mark.parametrize(
    ("user", "words"), [("robin", "it refuses the user 'robin'"), (None, "without a user")]
)
def test_a_wrong_password_is_told_with_the_user_and_where_it_comes_from(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], user: str | None, words: str
) -> None:
    users = tmp_path / "users"
    users.touch(mode=0o600)
    subprocess.run(["mosquitto_passwd", "-b", users, "robin", "secret"], check=True)
    there = start_broker(tmp_path, f"password_file {users}\nuser root")
    (told,) = failures(Broker("127.0.0.1", there.port, user=user, password="wrong"), capsys, 1)
    there.kill()
    for each in (words, "ot authori", PASSWORD, f"{PASSWORD}_FILE"):
        assert each in told
    assert "wrong" not in told


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
