"""The time of an emulated card, on a processor that stops exactly when it should."""

from math import ceil

import pytest

from miburi.emulation import firmware as emulated
from miburi.emulation.bus import Bus
from miburi.emulation.firmware import EmulatedCard


class Asleep:
    """An idle processor of 16 MHz; it stops without the delay of an unfinished instruction."""

    def __init__(self, *_files: object) -> None:
        self.time = 0.0

    def run(self, until: float) -> bool:
        self.time = ceil(until * 16) / 16
        return False

    def take(self, _port: int) -> bytes:
        return b""


@pytest.mark.parametrize("method", ["read", "wait"])
def test_waiting_for_a_time_ends(monkeypatch: pytest.MonkeyPatch, method: str) -> None:
    """Even a rounding error before that time would let a caller wait for ever."""
    monkeypatch.setattr(emulated, "Mega", Asleep)
    monkeypatch.setattr(emulated, "firmware_file", lambda name: name)
    card = EmulatedCard(Bus([]))
    for steps in range(1, 201):
        until = steps * 0.02  # 0.9400000000000001 s is 940000.0 µs, and that is 0.94 s
        getattr(card, method)(until)
        assert card.now() >= until
