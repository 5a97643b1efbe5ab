import json
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from tests.fixtures.live import Server
from typer.testing import CliRunner, Result

from miburi.cli.gestures import gesture_app, record
from miburi.client.remote import RemotePartner, connect
from miburi.errors import InputError, OutputError
from miburi.gestures import key_poses, load
from miburi.robot import forward


def run(*arguments: str) -> Result:
    return CliRunner().invoke(gesture_app, arguments)


def test_measures_are_printed_in_a_line_for_each_mood() -> None:
    lines = run("measures", "sadness", "--step", "1").stdout.splitlines()
    assert [line.split()[2] for line in lines] == ["0", "1"]
    assert all("contact stops 0" in line for line in lines)


def test_a_step_of_zero_is_refused() -> None:
    assert isinstance(run("measures", "--step", "0").exception, InputError)


def test_the_schema_is_that_of_a_gesture_file() -> None:
    schema = json.loads(run("schema").stdout)
    assert {"name", "feeling", "duration", "effort", "pose"} == set(schema["required"])


@pytest.mark.proof("test_it_goes_where_it_was_led")
def test_what_a_hand_shows_is_kept_as_a_gesture(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The simulated hand comes from the front and leads the right hand back by 6 cm."""
    mine = tmp_path / "mine"  # not there yet
    options = ["record", "pushed", "--feeling", "fear", "--out", str(mine)]
    options += ["--url", server.url, "--step", "0.5"]

    def second() -> None:
        record("second", "fear", mine, server.url, 0.5)

    def lead() -> None:
        along, ahead = (0.0, 1.0, 0.0), np.array([1.0, 0.0, 0.0])
        with connect(server.url) as partner:
            states = partner.watch(50)
            rested = next(state for state in states if state.paused and state.phase == "idle")
            others.append(pool.submit(second))  # somebody records at the same time
            hand = forward(server.runner.robot, np.array(rested.angles))[:3]
            partner.place_hand(hand + 0.06 * ahead, along)
            for state in states:
                way = max(0.06 - 0.08 * (state.time - rested.time - 0.6), -0.06)
                partner.place_hand(hand + min(way, 0.06) * ahead, along)
                if way == -0.06:
                    break
            partner.remove_hand()

    asked: list[bool] = []
    pause = RemotePartner.pause

    def listening(partner: RemotePartner, paused: bool = True) -> None:
        asked.append(paused)
        pause(partner, paused)

    monkeypatch.setattr(RemotePartner, "pause", listening)
    others: list[Future[None]] = []
    with ThreadPoolExecutor(2) as pool:
        done = pool.submit(lead)
        result = CliRunner().invoke(gesture_app, options)
        done.result()
        others[0].result()
    assert (mine / "second.toml").exists()
    assert asked == [True, False]  # who came second leaves that to the first
    assert not server.runner.snapshot.state.paused
    assert "Recording." in result.stdout
    assert "key poses in" in result.stdout
    function = load(str(mine / "pushed.toml"))
    assert (function.name, function.feeling) == ("pushed", "fear")
    farthest = key_poses(server.runner.robot, function, 1.0)
    rest = forward(server.runner.robot, server.runner.robot.neutral)[:3]
    assert max(np.linalg.norm(pose.right - rest) for pose in farthest) > 0.03
    again = CliRunner().invoke(gesture_app, options)
    assert isinstance(again.exception, OutputError)
    assert "already exists" in str(again.exception)
