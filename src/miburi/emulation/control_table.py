"""The XL330-M288-T's control table as data: addresses, ranges, and what is writable.

Source: ROBOTIS's e-manual of the XL330-M288-T, tables "Control Table of EEPROM Area" and "of RAM
Area", up to the indirect addresses. Where another register sets a limit, the limit is given as that
register's name.
"""

from dataclasses import dataclass

#: The end of the EEPROM, which can be written only while torque is off; and the table's size.
EEPROM_END, SIZE = 64, 148


@dataclass(frozen=True)
class Register:
    """One entry: first byte, size in bytes, factory value, least and largest value.

    ``limit`` names another register, whose value bounds this register's value on both sides of 0. A
    register without a range (``low`` > ``high``) is read-only.
    """

    address: int
    size: int
    default: int = 0
    low: int = 1
    high: int = 0
    limit: str | None = None

    @property
    def writable(self) -> bool:
        """Whether a master may write the register."""
        return self.low <= self.high


_GAIN = 16_383
REGISTERS = {
    "model": Register(0, 2, 1200),
    "model_information": Register(2, 4),
    "firmware": Register(6, 1, 46),
    "id": Register(7, 1, 1, 0, 252),
    "baud": Register(8, 1, 1, 0, 6),
    "return_delay": Register(9, 1, 250, 0, 254),
    "drive_mode": Register(10, 1, 0, 0, 13),
    "operating_mode": Register(11, 1, 3, 0, 16),
    "secondary_id": Register(12, 1, 255, 0, 255),
    "protocol": Register(13, 1, 2, 2, 22),
    "homing_offset": Register(20, 4, 0, -1_044_479, 1_044_479),
    "moving_threshold": Register(24, 4, 10, 0, 1023),
    "temperature_limit": Register(31, 1, 70, 0, 100),
    "max_voltage_limit": Register(32, 2, 70, 31, 70),
    "min_voltage_limit": Register(34, 2, 35, 31, 70),
    "pwm_limit": Register(36, 2, 885, 0, 885),
    "current_limit": Register(38, 2, 1750, 0, 1750),
    "velocity_limit": Register(44, 4, 445, 0, 2047),
    "max_position_limit": Register(48, 4, 4095, 0, 4095),
    "min_position_limit": Register(52, 4, 0, 0, 4095),
    "startup": Register(60, 1, 0, 0, 3),
    "pwm_slope": Register(62, 1, 140, 1, 255),
    "shutdown": Register(63, 1, 53, 0, 255),
    "torque_enable": Register(64, 1, 0, 0, 1),
    "led": Register(65, 1, 0, 0, 1),
    "status_return_level": Register(68, 1, 2, 0, 2),
    "registered_instruction": Register(69, 1),
    "hardware_error": Register(70, 1),
    "velocity_i_gain": Register(76, 2, 1600, 0, _GAIN),
    "velocity_p_gain": Register(78, 2, 180, 0, _GAIN),
    "position_d_gain": Register(80, 2, 0, 0, _GAIN),
    "position_i_gain": Register(82, 2, 0, 0, _GAIN),
    "position_p_gain": Register(84, 2, 400, 0, _GAIN),
    "feedforward_2nd_gain": Register(88, 2, 0, 0, _GAIN),
    "feedforward_1st_gain": Register(90, 2, 0, 0, _GAIN),
    "bus_watchdog": Register(98, 1, 0, 0, 127),
    "goal_pwm": Register(100, 2, 885, -885, 885, "pwm_limit"),
    "goal_current": Register(102, 2, 1750, -32_768, 32_767, "current_limit"),
    "goal_velocity": Register(104, 4, 0, -(1 << 31), (1 << 31) - 1, "velocity_limit"),
    "profile_acceleration": Register(108, 4, 0, 0, 32_767),
    "profile_speed": Register(112, 4, 0, 0, 32_767),
    "goal_position": Register(116, 4, 0, -(1 << 31), (1 << 31) - 1),
    "realtime_tick": Register(120, 2),
    "moving": Register(122, 1),
    "moving_status": Register(123, 1),
    "pwm": Register(124, 2),
    "current": Register(126, 2),
    "speed": Register(128, 4),
    "position": Register(132, 4),
    "velocity_trajectory": Register(136, 4),
    "position_trajectory": Register(140, 4),
    "voltage": Register(144, 2, 50),
    "temperature": Register(146, 1, 35),
    "backup_ready": Register(147, 1),
}
