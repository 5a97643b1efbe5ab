"""What a command prints can be read by a program: `--json`."""

import json
from pathlib import Path

from tests.fixtures.command import miburi


def printed(*words: str | Path) -> list[dict]:
    done = miburi(*words, "--json")
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_an_experiment_is_what_its_file_holds(tmp_path: Path) -> None:
    words = ("experiment", "--seconds", "2", "--no-film", "--out", tmp_path)
    done = miburi(*words, "--json")
    assert json.loads(done.stdout) == json.loads((tmp_path / "experiment.json").read_text("utf-8"))


def test_a_gesture_and_its_problems(tmp_path: Path) -> None:
    [well] = printed("gesture", "check", "surprise", "--step", "1")
    assert well == {"source": "surprise", "problems": []}
    text = miburi("template", "gesture", "surprise").stdout.replace("space = 1.0", "space = 0.0")
    file = tmp_path / "still.toml"
    file.write_text(text, encoding="utf-8")
    done = miburi("gesture", "check", file, "--step", "1", "--json")
    assert done.returncode == 1
    assert "does not use more space" in json.loads(done.stdout)["problems"][0]


def test_the_bill_and_the_claims() -> None:
    rows = printed("hardware", "bill")
    (servo,) = [row for row in rows if row["name"].startswith("servo")]
    assert (servo["count"], servo["price"], servo["currency"]) == (8, 27.49, "USD")
    assert {type(row["grams"]) for row in rows} == {int, type(None)}
    [claim] = printed("paper", "--claim", "table-1")
    assert (claim["claim"], claim["verdict"]) == ("table-1", "holds")


def test_devices_and_ports(tmp_path: Path) -> None:
    assert printed("devices", "--folder", tmp_path) == []
    assert all({"device", "what", "usb"} == set(port) for port in printed("card", "list"))
