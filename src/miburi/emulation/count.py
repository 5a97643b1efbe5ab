"""Convert between a host's position and the shaft's, by the servo's control table."""

from miburi.emulation.table import ControlTable

__all__ = ["POSITION", "TURN", "Count"]

#: The operating mode of position control, which counts within one turn.
POSITION = 3
#: Steps in a turn.
TURN = 4096
#: The largest homing offset that takes effect in position control.
_HOMING = 1024
#: A bit of Drive Mode.
_REVERSE = 0x01


class Count:
    """One servo's count.

    Parameters
    ----------
    table
        Its control table, which it only reads.
    """

    def __init__(self, table: ControlTable) -> None:
        self._table = table
        self._turns = 0  # whole turns that are not counted, in steps

    @property
    def sign(self) -> int:
        """−1 where positions count the other way round."""
        return -1 if self._table.get("drive_mode") & _REVERSE else 1

    def to_shaft(self, position: float) -> float:
        """Return the shaft's position for a position as the host counts it."""
        return (position - self._offset) * self.sign

    def to_host(self, place: float) -> int:
        """Convert a position of the shaft to the host's position."""
        return round(place * self.sign) + self._offset

    def start_anew(self, place: float) -> None:
        """Reset the count of whole turns, with the shaft at ``place``."""
        self._turns = round(place * self.sign) // TURN * TURN

    @property
    def _offset(self) -> int:
        """What is added to the shaft's own steps, after their sign is applied."""
        homing = self._table.get("homing_offset")
        if self._table.get("operating_mode") == POSITION and abs(homing) > _HOMING:
            homing = 0
        return homing - self._turns
