"""Pages that were asked for, and whose browser has not connected yet."""

import time

import pytest
from nicegui import Client
from nicegui.page import page

from miburi.studio.studio_page import forget_pages


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Client]:
    """Asks for one page; more can be added."""
    monkeypatch.setattr(Client, "instances", {})
    return [ask_for_page()]


def ask_for_page(age: float = 30.0) -> Client:
    client = Client(page("/somewhere"), request=None)
    client.created = time.time() - age
    return client


def test_a_slow_computer_is_waited_for(asked: list[Client]) -> None:
    """Under load and without a graphics card the studio took 32 s to connect."""
    forget_pages()
    assert asked[0].id in Client.instances


def test_a_flood_of_pages_takes_no_memory_for_long(asked: list[Client]) -> None:
    asked += [ask_for_page() for _ in range(50)]
    late = ask_for_page(age=5.0)
    forget_pages()
    assert list(Client.instances) == [late.id]
