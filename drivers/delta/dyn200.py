"""The DYN-200 torque and speed transducer, register by register. Every quantity takes two registers, high word first.

Sources: the maker's manual (as quoted in PapaKarloSochi/DYN200), and three programs used with real sensors,
savakrstovic/dyn200-logger, v0lker/dyn200-python and samuelknowles923/DYN200 (J. Deuter's library).

- 00H torque, 08H its decimals, 02H speed: all four. The speed has no sign: the pulse disc does not tell a direction.
- 20H decimals of the speed: two programs; the manual does not have it, and one sensor's display proved 0.1 rpm, fixed.
- 04H power: "10 W" and "kW" in the manual, whole watts in all three programs, of which one compared the display.
- 06H level of the torque's filter, 1 … 99: the manual and three programs. 1EH that of the speed: two programs, not the manual.
- 12H *setting*: torque direction as it is (0) or inverted (1): the manual and all three programs.
- Zero: FC05, coil 0 (the manual, and one program on a real sensor). By FC16 at 00H the manual writes 1, two programs 0 and
  FF00H, one of them doubting that it works.
- Framing: 8 data bits without parity. 19200, two stop bits (manual); 38400 8N2, 19200 and 14400 8N1 (programs).
"""

import math
from dataclasses import dataclass

from drivers.interfaces import CommunicationError, ReportedError
from drivers.interfaces.text import text
from drivers.transport.modbus.line import ModbusLine, signed_32

READINGS, TORQUE_DECIMALS, INVERTED, SPEED_DECIMALS = 0x00, 0x08, 0x12, 0x20
ZERO_COIL = 0
#: What FC16 writes to 00H to zero the torque (manual).
_ZERO = (0, 1)
HIGHEST_DECIMALS = 6
#: Decimals of the speed of a sensor that has no register for them: 0.1 rpm, as one display proved.
FIXED_SPEED_DECIMALS = 1
RPM = 2 * math.pi / 60
_SENSOR_SETTINGS = text(
    "At the sensor (K1 held, K1 again for the next page): 09 must be 1 (Modbus RTU), 08 and 11 the rate and format of the "
    "address (19200 or below, N82 as delivered), 10 the unit; then A and B of the cable, and its own 24 V"
)


@dataclass(frozen=True)
class ShaftReading:
    """Torque (N·m), magnitude of the speed (rad/s) and the counts of the power's register, from one block of registers."""

    torque: float
    speed: float
    power_counts: int


class Dyn200:
    """One transducer; its decimals are read when this is made, those of the speed unless they are given."""

    def __init__(self, line: ModbusLine, unit: int, speed_decimals: int | None = None) -> None:
        self._line = line
        self._unit = unit
        self._torque_decimals = self._setting(TORQUE_DECIMALS, HIGHEST_DECIMALS, "torque decimals")
        self.speed_decimals = self._decimals_of_speed() if speed_decimals is None else speed_decimals

    @property
    def torque_resolution(self) -> float:
        """One count of the torque (N·m)."""
        return 10.0**-self._torque_decimals

    @property
    def speed_resolution(self) -> float:
        """One count of the speed (rad/s)."""
        return 10.0**-self.speed_decimals * RPM

    def read(self) -> ShaftReading:
        """Return torque, speed and power, read in one transaction."""
        registers = self._line.read(self._unit, READINGS, 6, "torque, speed, power")
        torque, speed, power = (signed_32(*registers[start : start + 2]) for start in (0, 2, 4))
        # Divided, not multiplied by a step: 1234/10**3 is the nearest number to 1.234.
        return ShaftReading(torque / 10**self._torque_decimals, abs(speed) / 10**self.speed_decimals * RPM, power)

    def zero_by_coil(self) -> None:
        """Ask the sensor to take the present torque as zero (FC05); raises ReportedError where it has no such coil."""
        self._line.write_coil(self._unit, ZERO_COIL, True, "zero the torque")

    def zero_by_register(self) -> None:
        """Ask the same by FC16 at 00H; raises ReportedError where that is refused."""
        self._line.write_block(self._unit, READINGS, _ZERO, "zero the torque")

    def setting(self, address: int, what: str) -> int:
        """Return a setting."""
        return signed_32(*self._line.read(self._unit, address, 2, what))

    def _decimals_of_speed(self) -> int:
        try:
            return self._setting(SPEED_DECIMALS, HIGHEST_DECIMALS, "speed decimals")
        except ReportedError:
            return FIXED_SPEED_DECIMALS

    def _setting(self, address: int, highest: int, what: str) -> int:
        try:
            value = self.setting(address, what)
        except CommunicationError as error:
            raise CommunicationError(
                error.instrument, error.what, command=error.command, remedy=_SENSOR_SETTINGS
            ) from error
        if not 0 <= value <= highest:
            raise CommunicationError(
                self._line.name,
                text("{what} = {value} is outside 0 … {highest}", what=what, value=value, highest=highest),
                command=f"read {address:04X}H of unit {self._unit}",
                remedy=text("Check that this unit is a DYN-200"),
            )
        return value
