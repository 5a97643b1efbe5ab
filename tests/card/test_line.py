"""A port is opened under its name; after a replug, the same device under the name that it has."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from miburi.card.line import SamePort


@pytest.mark.parametrize(
    ("later", "opened"),
    [
        ({"ttyACM1": "A"}, "ttyACM1"),  # somebody else still held its name
        ({"ttyACM0": "B", "ttyACM1": "A"}, "ttyACM1"),  # another robot has its name
        ({"ttyACM0": "A", "ttyACM1": "A"}, "card"),  # a device with two ports
        ({"ttyACM0": "B"}, "card"),  # another board, plugged in instead
        ({"ttyACM0": None}, "card"),
        ({}, "card"),
    ],
)
def test_a_device_is_found_under_another_name(
    later: dict[str, str | None], opened: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names: list[str] = []
    ports: dict[str, str | None] = {"ttyACM0": "A"}
    link = tmp_path / "card"
    link.symlink_to(tmp_path / "ttyACM0")
    monkeypatch.setattr("serial.Serial", lambda name, *_, **__: names.append(Path(name).name))
    monkeypatch.setattr(
        "serial.tools.list_ports.comports",
        lambda: [
            SimpleNamespace(device=str(tmp_path / name), vid=1, pid=2, serial_number=number)
            for name, number in ports.items()
        ],
    )
    same = SamePort(str(link))
    same()
    ports = later
    same()
    assert names == ["card", opened]
