"""The whole way: the paper's experiment on the real binary, calibration, and a live port."""

import os
from pathlib import Path

import numpy as np
import pytest
from rig import Rig

from miburi import experiment
from miburi.bodies import Phase
from miburi.bodies.calibration import calibrate, read_settings, write_settings
from miburi.bodies.card import Card, SerialLine
from miburi.bodies.emulated import EmulatedCard
from miburi.bodies.emulated_card import EmulatedBody
from miburi.bodies.servos import Bus
from miburi.bodies.terminal import pump, servos
from miburi.errors import BodyError, DescriptionError
from miburi.motion import synchronised
from miburi.robot import iphonoid


def test_the_papers_experiment_with_the_real_firmware_in_the_loop(firmware: Path) -> None:
    result = experiment.run(1, 15.0, body=EmulatedBody()).report()
    assert result["false_stops"] == 0
    assert result["missed_contacts"] == []
    assert len(result["stops"]) >= 2
    for stop in result["stops"]:
        assert stop["latency"] <= 0.25
        assert stop["mood_after"] == pytest.approx(0.8 * stop["mood_before"], abs=0.01)


def test_calibration_finds_lags_and_stores_guards_that_hold(firmware: Path, tmp_path: Path) -> None:
    rig = Rig(firmware, 3, twin=False)
    lags = [20_000 + 3_000 * i for i in range(8)]
    for servo, lag in zip(rig.servos, lags, strict=True):
        servo.shaft.lag = float(lag)
        servo.shaft.noise = lambda: float(rig.rng.uniform(-0.6, 0.6))
    settings = calibrate(rig.body)
    for joint, lag in zip(settings.joints, lags, strict=True):
        # As the card sees it: a servo answers up to 2 ms after it was asked.
        assert -1_000 <= lag - joint.lag <= 3_000
        assert 3 <= joint.slack <= 8
    rig.body.stop()
    rig.body.configure(settings)
    rig.body.save()
    path = tmp_path / "calibration.toml"
    write_settings(settings, path)
    assert read_settings(rig.settings, path) == settings
    path.write_text("[waist]\n")
    with pytest.raises(DescriptionError, match="not a calibration"):
        read_settings(rig.settings, path)
    rig.body.wake()
    for _ in range(5):
        move = rig.random_move()
        rig.body.move(move)
        assert rig.settle() is Phase.IDLE, rig.body.state.stop
    # Another host finds the calibration on the card.
    again = Card(lambda: rig.line, rig.robot)
    assert again.settings == settings
    rig.close()


def test_a_body_on_a_pseudo_terminal(firmware: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """pyserial at one end, the emulated card at the other; time passes as the host waits."""
    robot = iphonoid()
    emulation = EmulatedCard(Bus(servos(robot)))
    ours, theirs = os.openpty()
    os.set_blocking(ours, False)
    clock = 0.0

    def now(self: SerialLine) -> float:
        return clock

    def read(self: SerialLine, until: float) -> bytes:
        nonlocal clock
        clock = max(clock, min(until, clock + 0.002))
        pump(emulation, ours, clock)
        return bytes(self._port.read(self._port.in_waiting))

    monkeypatch.setattr(SerialLine, "now", now)
    monkeypatch.setattr(SerialLine, "read", read)
    body = Card(os.ttyname(theirs), robot)
    body.wake()
    angles = robot.neutral.copy()
    angles[0] += 0.4
    body.move(synchronised(robot, robot.neutral, angles, 0.5))
    for _ in range(60):
        body.step(0.02)
    assert body.state.phase is Phase.IDLE
    assert np.abs(body.state.angles - angles).max() < 0.01
    body.close()
    os.close(ours)
    os.close(theirs)
    emulation.close()


def test_no_card_is_said_in_words() -> None:
    with pytest.raises(BodyError, match="cannot be reached"):
        Card("/dev/no-such-port")
