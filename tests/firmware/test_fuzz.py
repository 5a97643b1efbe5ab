"""Random bytes and spoilt frames, into the link and onto the bus: nothing gives way."""

import os
import struct
from pathlib import Path

import numpy as np
import pytest
from tests.firmware.rig import Rig
from tests.firmware.toolchain import HERE, NATIVE, SANITIZED, need, run

from miburi.card.card import wake
from miburi.card.link import ANSWER, VERSION, Frame, FrameKind, Receiver, Result, encode
from miburi.card.settings import CardSettings
from miburi.emulation.packets import STATUS, packet
from miburi.errors import BodyError
from miburi.robot import iphonoid
from miburi.safety.stop import Phase

#: Bytes for each fuzz on the AVR; `make firmware-proof` asks for 1,000,000.
AVR_BYTES = int(os.environ.get("MIBURI_FUZZ", "3000"))
NATIVE_BYTES = max(AVR_BYTES, 20_000)


def frames(rng: np.random.Generator) -> bytes:
    """A frame as a host might send it, right but for where it goes."""
    kind = int(rng.choice([*range(0, 13), 0x40, 0x7F]))
    sizes = {
        FrameKind.SETTINGS: 22,
        FrameKind.JOINT: 32,
        FrameKind.MOVE: 32,
        FrameKind.LOADS: 32,
        FrameKind.STATUS: 2,
        FrameKind.READ: 1,
    }
    size = sizes.get(kind, int(rng.choice([0, 0, 1, 2, 90])))
    return encode(
        Frame(
            kind,
            int(rng.integers(256)),
            rng.bytes(size),
            int(rng.choice([VERSION, VERSION, VERSION - 1])),
        )
    )


def flipped(rng: np.random.Generator, data: bytes) -> bytes:
    """One or more bits of it are wrong."""
    broken = bytearray(data)
    for bit in rng.choice(8 * len(data), int(rng.integers(1, 4)), replace=False).tolist():
        broken[bit // 8] ^= 1 << bit % 8
    return bytes(broken)


def moves(rng: np.random.Generator) -> bytes:
    """A good move, to be spoilt: no bit may get through that makes another move of it."""
    joints = CardSettings.of(iphonoid()).joints
    goals = [int(rng.integers(j.min, j.max + 1)) for j in joints]
    speeds = rng.integers(100, 3000, 8).tolist()
    return encode(
        Frame(FrameKind.MOVE, int(rng.integers(256)), struct.pack("<8h8H", *goals, *speeds))
    )


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The card, natively, under the sanitizers."""
    need("g++", "g++")
    program = tmp_path_factory.mktemp("fuzz") / "fuzz"
    run(*NATIVE, *SANITIZED, HERE / "fuzz_native.cpp", "-o", program)
    return program


@pytest.mark.parametrize("what", ["random bytes", "frames", "flipped frames"])
def test_native_card_under_the_sanitizers(what: str, program: Path) -> None:
    rng = np.random.default_rng(len(what))
    settings = CardSettings.of(iphonoid())
    pieces = [encode(Frame(FrameKind.SETTINGS, 1, settings.general.pack()))]
    pieces += [
        encode(Frame(FrameKind.JOINT, 2, bytes((i,)) + joint.pack()))
        for i, joint in enumerate(settings.joints)
    ]
    sent = sum(map(len, pieces))
    good = [frames(rng) if i % 2 else moves(rng) for i in range(1000)]
    while sent < NATIVE_BYTES:
        if what == "random bytes":
            pieces.append(rng.bytes(500))
        else:
            one = good[int(rng.integers(len(good)))]
            pieces.append(one if what == "frames" else flipped(rng, one))
        sent += len(pieces[-1])
    host = b"".join(pieces) + b"\0" + encode(Frame(FrameKind.HELLO, 77))
    answers = [
        packet(int(rng.integers(1, 9)), STATUS, bytes(1) + rng.bytes(int(rng.choice([0, 3, 8]))))
        for _ in range(1000)
    ]
    said_by_servos = [answers[i] for i in rng.integers(0, 1000, NATIVE_BYTES // 16)]
    if what == "flipped frames":
        said_by_servos = [flipped(rng, answer) for answer in said_by_servos]
    bus = rng.bytes(NATIVE_BYTES) if what == "random bytes" else b"".join(said_by_servos)
    length = min(len(host), len(bus))
    mixed = np.zeros((2 * length, 2), dtype=np.uint8)
    mixed[0::2, 1] = np.frombuffer(host[-length:], np.uint8)
    mixed[1::2, 0] = 1
    mixed[1::2, 1] = np.frombuffer(bus[:length], np.uint8)
    rest = np.zeros((len(host) - length, 2), dtype=np.uint8)
    rest[:, 1] = np.frombuffer(host[: len(host) - length], np.uint8)
    said = Receiver().add(run(program, data=rest.tobytes() + mixed.tobytes()))
    hello = [f for f in said if (f.kind, f.sequence) == (FrameKind.HELLO + ANSWER, 77)]
    assert hello
    assert hello[-1].payload[0] == Result.OK


def inside(rig: Rig) -> bool:
    """Whether every servo's goal is within its joint's limits, give or take a step."""
    for joint, servo in zip(rig.settings.joints, rig.servos, strict=True):
        angle = (servo.get("goal_position") - joint.zero) * joint.direction
        if not joint.min - 2 <= angle <= joint.max + 2:
            return False
    return True


def obeys(rig: Rig) -> bool:
    """Whether the next good frames are obeyed."""
    rig.body.step(1.0)
    rig.body.stop()
    rig.body.configure(rig.settings)
    wake(rig.body)
    rig.turn([0], by=0.5, speed=1.0)
    goal = rig.robot.neutral[0] + 0.5
    return rig.settle() is Phase.IDLE and abs(rig.body.state.angles[0] - goal) < 0.01


@pytest.mark.parametrize("what", ["random bytes", "flipped frames"])
def test_link_of_the_real_binary(firmware: Path, what: str) -> None:
    rig = Rig(firmware, 1, twin=False)
    sent, before = 0, rig.body.report.time
    while sent < AVR_BYTES:
        piece = (
            rig.rng.bytes(400)
            if what == "random bytes"
            else b"".join(flipped(rig.rng, moves(rig.rng)) for _ in range(9))
        )
        rig.line.write(piece)
        sent += len(piece)
        rig.line.run(rig.line.mega.time + len(piece) * 87)
        assert inside(rig)
    rig.line.write(b"\0")
    rig.body.step(0.5)
    neutral = [joint.neutral for joint in rig.settings.joints]
    assert list(rig.body.report.positions) == pytest.approx(neutral, abs=1)  # not one moved
    assert rig.at_rest()
    assert rig.body.report.time > before  # its clock never began anew: no reset
    assert obeys(rig)
    rig.line.mega.close()


@pytest.mark.parametrize("what", ["random bytes", "flipped packets"])
def test_bus_of_the_real_binary(firmware: Path, what: str) -> None:
    rig = Rig(firmware, 2, twin=False)
    sent, before = 0, rig.body.report.time

    def spoil(data: bytes) -> bytes:
        nonlocal sent
        sent += len(data)
        return rig.rng.bytes(len(data)) if what == "random bytes" else flipped(rig.rng, data)

    wild = 0
    while sent < AVR_BYTES:
        rig.bus.spoil = spoil
        rig.run(1.0)
        assert inside(rig)
        # In between it is well, and gets into motion again.
        rig.bus.spoil = lambda data: data
        rig.run(0.2)
        if rig.body.state.phase is Phase.STOPPED:
            try:
                wake(rig.body)
            except BodyError:
                wild += 1
        if rig.body.state.phase is Phase.IDLE:
            rig.body.move(rig.random_move())
        assert wild < 5
    assert rig.body.report.time > before
    rig.run(0.5)
    rig.body.stop()
    rig.run(0.1)  # as far as its servos lagged behind, they still go
    assert rig.at_rest()
    assert obeys(rig)
    rig.line.mega.close()
