"""How the program ends and what it leaves: Ctrl-C, a closed terminal, a helper's end, a kill."""

import os
import signal
import sys
from contextlib import suppress
from pathlib import Path

import httpx
import numpy as np
import pytest
from tests.fixtures.program import RECEPTION, SERVER, address, helpers_of, nobody_left, running
from tests.fixtures.waiting import get, post, until

import miburi
from miburi.client.connection import ConnectionLostError
from miburi.feelings import SpikingModel, shipped_temperament
from miburi.live.memory import remembered
from miburi.live.recording.recorder import read


def test_ctrl_c_in_a_terminal_is_a_good_end_of_all_processes(tmp_path: Path) -> None:
    """What it felt last time cannot be read, and is kept aside."""
    path, content = tmp_path / "feelings.json", b"[" * 100_000
    path.write_bytes(content)
    with running(tmp_path) as program:
        program.errors.next("the partner starts afresh")
        url = address(program.out.next())
        helpers = helpers_of(program.process.pid)
        assert post(url + "/api/v1/recordings", json={"on": True}).status_code == 204
        os.killpg(program.process.pid, signal.SIGINT)
        good = f"Good-bye. The body rests at neutral; its feelings are saved in {tmp_path}.\n"
        assert program.end(None) == (0, good, "")
        nobody_left(program.process.pid, helpers)
    assert (tmp_path / "recordings" / "miburi-0001.mcap").read_bytes().endswith(b"\x89MCAP0\r\n")
    assert path.with_name("feelings.json.bad").read_bytes() == content
    assert remembered(path, shipped_temperament("playful")) is not None


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signal")
def test_a_closed_terminal_is_a_good_end_and_nohup_keeps_it_alive(tmp_path: Path) -> None:
    with running(tmp_path, within=("nohup",)) as program:
        url = address(program.out.next("Miburi is awake"))
        program.process.send_signal(signal.SIGHUP)
        assert post(url + "/api/v1/pause", json={"paused": True}).status_code == 204
        until(lambda: get(url + "/api/v1/state").json()["phase"] == "idle")
        assert program.process.poll() is None
    path = tmp_path / "feelings.json"
    path.write_text("unless they are forgotten, these feelings are put aside")
    (tmp_path / "feelings-spiking.json").write_text("those of the other model")
    with running(tmp_path, "--forget") as program:  # the old feelings go at once, the new ones stay
        program.out.next("Miburi is awake")
        assert not path.exists()
        code, said, _ = program.end(signal.SIGHUP)
    assert (code, "feelings are saved" in said) == (0, True)
    assert [file.name for file in tmp_path.glob("feelings*")] == [path.name]
    assert remembered(path, shipped_temperament("playful")) is not None


@pytest.mark.proof("test_ctrl_c_in_a_terminal_is_a_good_end_of_all_processes")
def test_a_stream_of_events_ends_with_the_partner_and_without_a_word(tmp_path: Path) -> None:
    with running(tmp_path) as program:
        url = address(program.out.next())
        with httpx.stream("GET", url + "/api/v1/events", timeout=30) as events:
            lines = events.iter_lines()
            next(lines)
            assert post(url + "/api/v1/pause", json={"paused": True}).status_code == 204
            until(lambda: get(url + "/api/v1/state").json()["phase"] == "idle")
            program.process.terminate()
            assert [*lines], "it ended well"
        assert program.end(None)[::2] == (0, "")


@pytest.mark.proof("test_ctrl_c_in_a_terminal_is_a_good_end_of_all_processes")
def test_who_asks_it_twice_to_end_leaves_nobody_behind(tmp_path: Path) -> None:
    """The second time falls into the moment in which it ends its helpers, or soon after."""
    with running(tmp_path) as program:
        url = address(program.out.next())
        helpers = helpers_of(program.process.pid)
        program.process.terminate()

        def gone() -> bool:
            try:
                return get(url + "/api/v1/state") is None
            except httpx.TransportError:
                return True

        until(gone)
        _, said, errors = program.end()
        assert said.startswith("Good-bye. ") or "interrupted" in errors
        nobody_left(program.process.pid, helpers)


def ends_with_a_helper(tmp_path: Path, which: int, how: signal.Signals, words: str) -> None:
    """Check that the body is stopped, and that the program says which of its helpers has ended."""
    with running(tmp_path, "--emotional-model", "spiking") as program:
        program.out.next()
        helpers = helpers_of(program.process.pid)
        os.kill(helpers[which], how)
        code, said, errors = program.end(None)
        nobody_left(program.process.pid, helpers)
    assert (code, said) == (1, "")
    assert words in errors
    assert "stopped where it was" in errors
    # Nobody else on this computer reads what it feels.
    path = tmp_path / "feelings-spiking.json"
    assert path.stat().st_mode & 0o077 == 0
    assert remembered(path, shipped_temperament("playful"), SpikingModel) is not None


def test_if_the_reception_ends_the_body_is_stopped_and_the_program_says_so(tmp_path: Path) -> None:
    ends_with_a_helper(
        tmp_path, RECEPTION, signal.SIGKILL, "the process that receives Stop has ended"
    )


@pytest.mark.proof("test_if_the_reception_ends_the_body_is_stopped_and_the_program_says_so")
def test_if_the_server_ends_the_body_is_stopped_and_the_program_says_so(tmp_path: Path) -> None:
    ends_with_a_helper(tmp_path, SERVER, signal.SIGTERM, "the server has ended")


def test_if_the_partner_is_killed_the_server_ends_and_the_recording_is_read_up_to_its_last_second(
    tmp_path: Path,
) -> None:
    with running(tmp_path) as program:
        url = address(program.out.next())
        helpers = helpers_of(program.process.pid)
        with miburi.connect(url) as partner:
            partner.record()
            began = partner.state.time
            with suppress(ConnectionLostError):  # the server may still say good-bye
                for state in partner.watch(50, patience=0.0):
                    if state.time > began + 3.5:
                        program.process.kill()
        nobody_left(program.process.pid, helpers)
    (path,) = (tmp_path / "recordings").glob("*.mcap")
    times = [message.time for message in read(path, ["/joint_states"])]
    assert times[0] <= began + 0.1
    assert times[-1] > state.time - 1.1
    assert np.diff(times) == pytest.approx(0.02)


def test_after_a_kill_the_body_is_still_stopped_and_the_terminal_says_by_whom(
    tmp_path: Path,
) -> None:
    with running(tmp_path) as program:
        url = address(program.out.next())
        assert post(url + "/api/v1/stop").status_code == 204
        until(lambda: "person" in (tmp_path / "stopped.txt").read_text())
        helpers = helpers_of(program.process.pid)
        program.process.kill()
        nobody_left(program.process.pid, helpers)
    with running(tmp_path) as program:
        assert "Stop was pressed by a person before this start, at 20" in program.out.next()
        url = address(program.out.next("Miburi is awake"))
        state = get(url + "/api/v1/state").json()
        assert (state["phase"], state["held"], state["stop"]["reason"]) == (
            "stopped",
            True,
            "asked",
        )
        assert post(url + "/api/v1/release").status_code == 409
        page = {"Origin": url}
        assert post(url + "/api/page/release", json={}, headers=page).status_code == 204
