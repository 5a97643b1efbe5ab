"""What the card takes from its host: settings, moves, and nothing twice."""

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.firmware.endings import recovers
from tests.firmware.rig import LOAD, NO_LOADS, Rig

from miburi.card.card import Card, wake
from miburi.card.link import FrameKind
from miburi.card.settings import ALLOWED, CardSettings
from miburi.card.transfer import greet
from miburi.errors import BodyError
from miburi.robot import JOINTS
from miburi.robot.guards import GUARDS, Guards
from miburi.safety.move import Move
from miburi.safety.stop import Phase


def test_no_move_without_its_loads_nor_with_more_than_a_motor_holds(rig: Rig) -> None:
    here = struct.pack("<8h8H", *[joint.neutral for joint in rig.settings.joints], *[100] * 8)
    for _ in range(2):
        with pytest.raises(BodyError, match="does not know the loads"):
            rig.body.ask(FrameKind.MOVE, here)
        rig.body.ask(FrameKind.LOADS, NO_LOADS)
        rig.body.ask(FrameKind.MOVE, here)  # it takes the loads: the next needs its own
        rig.run(0.1)
        assert rig.settle() is Phase.IDLE
    held = rig.settings.general.error_per_pwm * 60 // 256 // 64  # quarters of a step
    light = LOAD.pack(0, 0, 885, 885)
    for load in (
        (held + 1, 0, 60, 60),
        (0, -held - 1, 61, 60),
        (0, 0, 0, 0),
        (0, 0, 886, 885),
        (0, 0, 60, 0),
        (0, 0, 60, 61),
    ):
        wrong = light * 4 + LOAD.pack(*load) + light * 3
        with pytest.raises(BodyError, match=f"load of {JOINTS[4]}: it is more"):
            rig.body.ask(FrameKind.LOADS, wrong)
    assert rig.body.state.phase is Phase.IDLE
    rig.body.stop()
    with pytest.raises(BodyError, match="does not know the loads"):
        rig.body.ask(FrameKind.RELEASE)


def test_limits_and_caps_stand_on_the_card_itself(rig: Rig) -> None:
    """Past the host's own checks: the card refuses by itself, and nothing moves."""
    joints, general = rig.settings.joints, rig.settings.general
    here = [joint.neutral for joint in joints]
    before = rig.bus.instructions

    def ask(goals: list[int], speeds: list[int]) -> str:
        rig.body.ask(FrameKind.LOADS, NO_LOADS)
        with pytest.raises(BodyError) as refused:
            rig.body.ask(FrameKind.MOVE, struct.pack("<8h8H", *goals, *speeds))
        return str(refused.value)

    for i, joint in enumerate(joints):
        for goal in (joint.min - 1, joint.max + 1, -32768, 32767):
            goals = here.copy()
            goals[i] = goal
            assert f"goal of {JOINTS[i]}" in ask(goals, [100] * 8)
        speeds = [100] * 8
        speeds[i] = general.max_speed + 1
        assert f"speed of {JOINTS[i]}" in ask(here, speeds)
    assert rig.body.state.phase is Phase.IDLE
    assert rig.bus.instructions > before
    assert rig.at_rest()
    for end in (rig.robot.lower, rig.robot.upper):
        rig.body.move(Move(end, np.full(8, rig.robot.servo.max_speed)))
        assert rig.settle() is Phase.IDLE
        np.testing.assert_allclose(rig.body.state.angles, end, atol=2e-3)


def test_settings_stay_inside_safe_ranges_and_change_only_while_stopped(rig: Rig) -> None:
    settings = rig.settings
    with pytest.raises(BodyError, match="idle"):
        rig.body.configure(settings)
    rig.body.stop()
    for name in vars(settings.general):
        low, high = ALLOWED[name][:2]
        for value in (low - 1, high + 1) if low else (high + 1,):
            wrong = replace(settings, general=replace(settings.general, **{name: value}))
            said = f"refuses {name} .*: it must be from "
            with pytest.raises(BodyError, match=said):
                rig.body.configure(wrong)
    joint = settings.joints[0]  # the ranges of its guards: test_settings.py
    beyond = {"servo": (253,), "direction": (0, 2, -2), "zero": (4096, 0)}
    beyond |= {"neutral": (-3000, 3000), "min": (3000, -4096), "max": (-3000, 4096)}
    for name, values in beyond.items():
        for value in values:
            joints = (replace(joint, **{name: value}), *settings.joints[1:])
            seam = name in ("min", "max") or (name, value) == ("zero", 0)
            said = (
                "crosses the servo's seam"
                if seam
                else f"refuses waist's {name} .*: it must be from "
            )
            with pytest.raises(BodyError, match=said):
                rig.body.configure(replace(settings, joints=joints))
    # What is just allowed is taken: the ranges in words are the card's.
    for end in (0, 1):
        guards = Guards(*(ALLOWED[name][end] for name in GUARDS))
        joints = tuple(replace(j, guards=guards) for j in settings.joints)
        general = type(settings.general)(*(ALLOWED[name][end] for name in vars(settings.general)))
        rig.body.configure(CardSettings(general, joints))
    twice = (replace(settings.joints[0], servo=2), *settings.joints[1:])
    rig.body.configure(settings)
    with pytest.raises(BodyError):
        rig.body.configure(replace(settings, joints=twice))
        wake(rig.body)
    rig.body.configure(settings)
    recovers(rig)


def test_settings_outlast_a_loss_of_power_and_a_blank_or_torn_eeprom_is_no_setting(
    rig: Rig, firmware: Path
) -> None:
    rig.body.stop()
    rig.body.save()
    kept = rig.line.mega.eeprom
    for damage, complete in ((None, True), (0, False), (100, False), (195, False)):
        torn = bytearray(kept)
        if damage is not None:
            torn[damage] ^= 1
        rig.line.mega.eeprom = bytes(torn)
        rig.line.mega.reset()
        rig.line.run(rig.line.mega.time + 100_000)
        crc, has_all, stored, _ = greet(rig.body.ask)
        assert has_all == complete
        if complete:
            assert crc == rig.settings.crc
            assert stored


def test_a_repeated_frame_is_obeyed_once(rig: Rig) -> None:
    joints = rig.settings.joints
    goal = struct.pack("<8h8H", *[j.neutral + 200 for j in joints], *[2000] * 8)
    back = struct.pack("<8h8H", *[j.neutral for j in joints], *[2000] * 8)
    rig.body.ask(FrameKind.LOADS, NO_LOADS)
    rig.body.ask(FrameKind.MOVE, goal)
    rig.run(0.1)
    assert rig.settle() is Phase.IDLE
    rig.body.ask(FrameKind.LOADS, NO_LOADS)
    rig.body.ask(FrameKind.MOVE, back)
    rig.run(0.1)
    assert rig.settle() is Phase.IDLE
    rig.line.write(rig.line.sent)
    rig.run(0.1)
    assert rig.body.state.phase is Phase.IDLE


def test_settings_of_another_layout_are_noticed(rig: Rig) -> None:
    rig.body.stop()
    rig.body.save()
    other = bytearray(rig.line.mega.eeprom)
    other[1] += 1
    rig.line.mega.eeprom = bytes(other)
    rig.line.mega.reset()
    for _ in range(2):  # the second finds on the card what the first has sent
        again = Card(lambda: rig.line, rig.robot)
        with pytest.raises(BodyError, match=r"another version of the firmware.* card load"):
            wake(again)
    again.configure(rig.settings)  # as `miburi card load` and `calibrate` do
    wake(again)
