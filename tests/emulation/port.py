"""A serial port for the official SDK, with an emulated bus at its other end."""

from miburi.emulation.bus import Bus


class Port:
    """It answers at once; its time passes by 1 ms with each packet, and as a test sets it."""

    is_using = False

    def __init__(self, bus: Bus) -> None:
        self.bus, self.time, self.baud, self._received = bus, 0.0, 1_000_000, b""

    def clearPort(self) -> None:  # noqa: N802  (the SDK's name)
        self._received = b""

    def writePort(self, data: list[int]) -> int:  # noqa: N802  (the SDK's name)
        self.time += 1000
        said = self.bus.answer(bytes(data), self.time, self.baud)
        self._received += b"".join(reply for _, reply in sorted(said))
        return len(data)

    def readPort(self, count: int) -> bytes:  # noqa: N802  (the SDK's name)
        data, self._received = self._received[:count], self._received[count:]
        return data

    def getBaudRate(self) -> int:  # noqa: N802  (the SDK's name)
        return self.baud

    def setPacketTimeout(self, _length: int) -> None:  # noqa: N802  (the SDK's name)
        pass

    def setPacketTimeoutMillis(self, _ms: float) -> None:  # noqa: N802  (the SDK's name)
        pass

    def isPacketTimeout(self) -> bool:  # noqa: N802  (the SDK's name)
        return not self._received
