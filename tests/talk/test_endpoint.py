"""Which addresses of a language model are taken, and which options and keys are refused."""

import pytest
from tests.fixtures.command import miburi

from miburi.errors import InputError
from miburi.talk.endpoint import KEY, Endpoint, find_endpoint


@pytest.mark.parametrize(
    ("url", "base"),
    [
        ("http://localhost:11434/v1", "http://localhost:11434/v1"),
        ("http://localhost:11434", "http://localhost:11434/v1"),
        ("http://127.0.0.1:8080/v1/", "http://127.0.0.1:8080/v1"),
        ("http://192.168.1.7:1234/v1", "http://192.168.1.7:1234/v1"),
        ("http://100.100.3.4/v1", "http://100.100.3.4/v1"),
        ("http://[fd00::7]:8080/v1", "http://[fd00::7]:8080/v1"),
        ("http://nas:8080/v1", "http://nas:8080/v1"),
        ("http://robot.local:8080/v1", "http://robot.local:8080/v1"),
        ("https://example.org/v1", "https://example.org/v1"),
        ("https://example.org/openai/v1", "https://example.org/openai/v1"),
    ],
)
def test_addresses_at_home_and_safe_ones_elsewhere(url: str, base: str) -> None:
    assert find_endpoint(url, "m", {}) == Endpoint(base, "m")


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("http://example.org/v1", "https://"),
        ("http://8.8.8.8/v1", "https://"),
        ("http://134744072/v1", "https://"),
        ("http://[2001:4860:4860::8888]/v1", "https://"),
        ("http://evil.localhost.example.org/v1", "https://"),
        ("localhost:11434", "base address"),
        ("ftp://localhost/v1", "base address"),
        ("file:///etc/passwd", "base address"),
        ("http://", "base address"),
        ("http://localhost:99999/v1", "base address"),
        ("http://localhost:0/v1", "base address"),
        ("http://local\nhost/v1", "base address"),
        ("http://localhost/v1?key=1", "base address"),
        ("http://localhost/" + "v" * 300, "base address"),
        ("http://[::1/v1", "base address"),
        ("https://me:secret@example.org/v1", KEY),
    ],
)
def test_other_addresses_are_refused_kindly(url: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as refusal:
        find_endpoint(url, "m", {})
    assert "secret" not in str(refusal.value)


@pytest.mark.parametrize("key", ["two words", "new\nline", "schlüssel"])
def test_a_key_that_no_header_takes_is_refused_unsaid(key: str) -> None:
    with pytest.raises(InputError, match=KEY) as refusal:
        find_endpoint("http://localhost", "m", {KEY: key})
    assert key not in str(refusal.value)


@pytest.mark.parametrize(
    "options",
    [
        ["--talk", "http://localhost"],
        ["--model", "m"],
        ["--talk", "http://localhost", "--model", " "],
    ],
)
def test_wrong_options_are_refused_in_a_line(options: list[str]) -> None:
    done = miburi("run", "--headless", *options)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1
    assert "--model" in done.stderr
