"""The emulated servo on a bench: what it says beside its maker's data sheet and others' figures.

    python bench/servos/emulated.py

One emulated XL330-M288-T is told by protocol 2.0 what to do, and its registers are read. The stall
torque is the largest load that it still lifts at full PWM. Its stiffness is by how much more load
it hangs a rad deeper: as more is hung on, the gears' friction helps it; as some is taken off again,
it has to lift against that friction.
"""

import struct

from miburi.emulation.bus import Bus
from miburi.emulation.gearmotor import Gearmotor
from miburi.emulation.packets import READ, WRITE, packet, packets
from miburi.emulation.servos import SPEED_UNIT, Servo
from miburi.servos import load_servo

MODE, TORQUE, GAIN, PWM, GOAL, CURRENT, SPEED = 11, 64, 84, 100, 116, 126, 128
#: The e-manual's specifications: V, stall torque N·m and current A, no-load speed turns/min.
SHEET = ((3.7, 0.42, 1.11, 76), (5.0, 0.52, 1.47, 103), (6.0, 0.60, 1.74, 123))


class Bench:
    """One servo on a supply without resistance, and the wire to it."""

    def __init__(self, volts: float) -> None:
        servo = load_servo("xl330-m288-t")
        supply = servo.supply.model_copy(update={"voltage": volts, "resistance": 0.0})
        self.shaft = Gearmotor(servo.model_copy(update={"supply": supply}))
        self.servo = Servo.new(1, shaft=self.shaft, model=self.shaft.axis.servo)
        self.bus, self.time = Bus([self.servo]), 0.0

    def ask(self, instruction: int, parameters: bytes) -> bytes:
        self.time += 1000.0
        ((_, said),) = self.bus.answer(packet(1, instruction, parameters), self.time)
        ((_, _, answer),) = packets(said)[0]
        return answer[1:]

    def write(self, address: int, code: str, value: int) -> None:
        self.ask(WRITE, struct.pack("<H" + code, address, value))

    def read(self, address: int, code: str) -> int:
        count = struct.calcsize("<" + code)
        return struct.unpack("<" + code, self.ask(READ, struct.pack("<HH", address, count)))[0]

    def wait(self, seconds: float) -> float:
        """Let time pass; return how far the shaft is from where it was mounted, rad."""
        self.time += seconds * 1e6
        step = self.shaft.axis.servo.step
        return (self.shaft.position(self.servo, self.time) - 2048) * step

    def push(self) -> None:
        self.write(MODE, "B", 16)
        self.write(TORQUE, "B", 1)
        self.write(PWM, "h", 885)


def stall(volts: float) -> float:
    low, high = 0.0, 1.0
    while high - low > 1e-3:
        bench, load = Bench(volts), (low + high) / 2
        bench.shaft.load = -load
        bench.push()
        low, high = (load, high) if bench.wait(3.0) > 0.1 else (low, load)
    return low


def stall_current(volts: float) -> float:
    bench = Bench(volts)
    bench.shaft.high = 2048.0
    bench.push()
    bench.wait(0.5)
    return bench.read(CURRENT, "h") / 1000


def no_load_speed(volts: float) -> float:
    bench = Bench(volts)
    bench.push()
    bench.wait(0.5)
    return bench.read(SPEED, "i") * SPEED_UNIT / 4096 * 60


def stiffness(gain: int, loads: tuple[float, ...]) -> float:
    """Return the stiffness between the last two of ``loads``, hung on one after the other."""
    bench = Bench(5.0)
    bench.write(GAIN, "H", gain)
    bench.write(GOAL, "i", 2048)
    bench.write(TORQUE, "B", 1)
    sags = []
    for load in loads:
        bench.shaft.load = -load
        sags.append(-bench.wait(3.0))
    return (loads[-1] - loads[-2]) / (sags[-1] - sags[-2])


def main() -> None:
    print("       stall N·m       stall A         no-load turns/min   (emulated / data sheet)")
    for volts, torque, amperes, turns in SHEET:
        print(
            f"{volts:.1f} V  {stall(volts):.3f} / {torque:.2f}    {stall_current(volts):.2f} / "
            f"{amperes:.2f}     {no_load_speed(volts):.0f} / {turns}"
        )
    print("       N·m/rad as more is hung on / taken off / mean   (M6: before friction, behind it)")
    for gain, theirs in ((400, "0.749, 0.55"), (3200, "5.99, 4.4")):
        more, less = stiffness(gain, (0.0, 0.05, 0.15)), stiffness(gain, (0.3, 0.15, 0.05))
        print(f"P {gain:<5}{more:.3f} / {less:.3f} / {(more + less) / 2:.3f}   ({theirs})")


if __name__ == "__main__":
    main()
