"""The DYN-200 torque and speed transducer, register by register (maker's communication sheet).

Every quantity takes two registers, high word first; settings included.
"""

import math
from dataclasses import dataclass

from drivers.interfaces import CommunicationError
from drivers.interfaces.text import text
from drivers.transport.modbus.line import ModbusLine, signed_32

READINGS, TORQUE_DECIMALS, DIRECTION, SPEED_DECIMALS = 0x00, 0x08, 0x12, 0x20
POWER_DECIMALS = 1
HIGHEST_DECIMALS = 6
RPM = 2 * math.pi / 60


@dataclass(frozen=True)
class ShaftReading:
    """Torque (N·m), magnitude of the speed (rad/s) and of the power (W), from one block of registers."""

    torque: float
    speed: float
    power: float


class Dyn200:
    """One transducer; its decimals are read when this is made."""

    def __init__(self, line: ModbusLine, unit: int) -> None:
        self._line = line
        self._unit = unit
        self._torque_decimals = self._setting(TORQUE_DECIMALS, HIGHEST_DECIMALS, "torque decimals")
        self._speed_decimals = self._setting(SPEED_DECIMALS, HIGHEST_DECIMALS, "speed decimals")

    @property
    def torque_resolution(self) -> float:
        """One count of the torque (N·m)."""
        return 10.0**-self._torque_decimals

    @property
    def speed_resolution(self) -> float:
        """One count of the speed (rad/s)."""
        return 10.0**-self._speed_decimals * RPM

    def read(self) -> ShaftReading:
        """Return torque, speed and power, read in one transaction."""
        registers = self._line.read(self._unit, READINGS, 6, "torque, speed, power")
        torque, speed, power = (signed_32(*registers[start : start + 2]) for start in (0, 2, 4))
        # Divided, not multiplied by a step: 1234/10**3 is the nearest number to 1.234.
        return ShaftReading(
            torque / 10**self._torque_decimals,
            abs(speed) / 10**self._speed_decimals * RPM,
            abs(power) / 10**POWER_DECIMALS,
        )

    def direction(self) -> int:
        """Return +1 for forwards, −1 for reverse."""
        return -1 if self._setting(DIRECTION, 1, "direction") else 1

    def zero(self) -> None:
        """Take the present torque as zero."""
        self._line.write_block(self._unit, READINGS, [0, 0], "zero the torque")

    def _setting(self, address: int, highest: int, what: str) -> int:
        value = signed_32(*self._line.read(self._unit, address, 2, what))
        if not 0 <= value <= highest:
            raise CommunicationError(
                self._line.name,
                text("{what} = {value} is outside 0 … {highest}", what=what, value=value, highest=highest),
                command=f"read {address:04X}H of unit {self._unit}",
                remedy=text("Check that this unit is a DYN-200"),
            )
        return value
