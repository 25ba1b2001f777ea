"""The Delta C2000 drive of a dynamometer, register by register (C2000 User Manual, chapter 12.1-09, address list)."""

import math
from enum import IntEnum

from drivers.interfaces import Clock, CommunicationError, ReportedError, polls
from drivers.interfaces.text import text
from drivers.transport.modbus.line import ModbusLine, signed_16

#: Command and status registers.
COMMAND, FREQUENCY_COMMAND = 0x2000, 0x2001
ERROR_AND_WARNING, OUTPUT_FREQUENCY = 0x2100, 0x2103
#: Parameters: group and number are the bytes of the address.
CONTROL_MODE, STOP_METHOD, TORQUE_COMMAND = 0x000A, 0x0016, 0x0B22

STOP, RUN_FORWARD, RUN_REVERSE = 0b01, 0b01_00_10, 0b10_00_10
COAST_TO_STOP = 1

#: Frequencies are in 0.01 Hz; torque in 0.1 % of the machine's rated torque. 599 Hz is the limit of drives of this class;
#: the drive's own may be lower (parameter 01-00), and a speed beyond it then does not settle.
FREQUENCY_STEP = 0.01
MAXIMUM_FREQUENCY = 599.0
TORQUE_STEP = 1e-3
#: Output current (0.01 A) that a sensor shows although nothing flows, at most: a magnetised machine takes far more.
_NO_CURRENT = 10
#: Within this time (s) the output must be off after a coast-to-stop command.
DISABLE_TIME = 1.0
_LOOK = 0.02


class ControlMode(IntEnum):
    """Parameter 00-10 (1 is position)."""

    SPEED = 0
    TORQUE = 2


class DeltaC2000:
    """One drive: `pole_pairs` and `rated_torque` (N·m) are those of the machine behind it."""

    def __init__(self, line: ModbusLine, unit: int, clock: Clock, pole_pairs: int, rated_torque: float) -> None:
        self._line = line
        self._unit = unit
        self._clock = clock
        self._pole_pairs = pole_pairs
        self._rated_torque = rated_torque

    def check_fault(self) -> None:
        """Raise ReportedError where the drive is in fault, with its code."""
        status = self._line.read(self._unit, ERROR_AND_WARNING, 1, "error and warning code")[0]
        if status & 0xFF:
            raise ReportedError(
                self._line.name,
                text("the drive is in fault {status} (C2000 User Manual, chapter 14)", status=status & 255),
                command=f"{ERROR_AND_WARNING:04X}H",
                remedy=text("Remove the cause and reset the drive"),
            )

    def set_mode(self, mode: ControlMode) -> None:
        """Set speed or torque control, where it is not set already (the parameter is locked while running)."""
        if self._read(CONTROL_MODE, "00-10 control mode") != mode:
            self._write(CONTROL_MODE, mode, "00-10 control mode")

    def set_stop_method(self, method: int) -> None:
        """Set what a stop command does: ramp (0) or coast (1)."""
        if self._read(STOP_METHOD, "00-22 stop method") != method:
            self._write(STOP_METHOD, method, "00-22 stop method")

    def command_speed(self, speed: float) -> None:
        """Set the frequency for the amount of a mechanical speed (rad/s); `run` has its direction."""
        self._write(FREQUENCY_COMMAND, frequency_register(speed, self._pole_pairs), "frequency command")

    def command_torque(self, torque: float) -> None:
        """Set the torque (N·m)."""
        counts = round(torque / self._rated_torque / TORQUE_STEP)
        self._write(TORQUE_COMMAND, signed_16(counts), "11-34 torque command")

    def command_zero(self) -> None:
        """Command no torque and no frequency, without a change of direction."""
        try:
            self.command_torque(0.0)
        finally:
            self._write(FREQUENCY_COMMAND, 0, "frequency command")

    def run(self, *, reverse: bool = False) -> None:
        """Start in a direction; torque control starts forwards whatever the torque's sign."""
        self._write(COMMAND, RUN_REVERSE if reverse else RUN_FORWARD, "run command")

    def output_speed(self) -> float:
        """Return the mechanical speed (rad/s) of the frequency that the drive puts out, without a sign."""
        frequency = self._read(OUTPUT_FREQUENCY, "output frequency") * FREQUENCY_STEP
        return 2 * math.pi * frequency / self._pole_pairs

    def disable(self) -> None:
        """Take the output off and make sure that it is, over a renewed connection where the present one fails.

        Raises ReportedError where the drive still puts out a frequency, or a current whatever it says of itself.
        """
        try:
            self._stop()
        except CommunicationError:
            # Stop may be sent twice without harm, and must not depend on one lost message.
            self._line.reopen()
            self._stop()

    def _stop(self) -> None:
        self._write(COMMAND, STOP, "stop command")
        for last in polls(self._clock, DISABLE_TIME, _LOOK):
            if (still := self._puts_out()) is None:
                break
            if last:
                raise ReportedError(
                    self._line.name,
                    text("the drive still puts out {still}", still=still),
                    command="stop command",
                    remedy=text("Press the emergency stop"),
                )

    def _puts_out(self) -> str | None:
        """Return what the output still gives, None where it is off."""
        frequency, current = self._line.read(self._unit, OUTPUT_FREQUENCY, 2, "output frequency and current")
        if frequency:
            return f"{frequency * FREQUENCY_STEP:g} Hz"
        return f"{current * 0.01:g} A" if current > _NO_CURRENT else None

    def _read(self, address: int, what: str) -> int:
        return self._line.read(self._unit, address, 1, what)[0]

    def _write(self, address: int, value: int, what: str) -> None:
        self._line.write(self._unit, address, value, what)


def frequency_register(speed: float, pole_pairs: int) -> int:
    """Return the frequency command (0.01 Hz) for a mechanical speed (rad/s), whatever its sign."""
    return round(abs(speed) * pole_pairs / (2 * math.pi) / FREQUENCY_STEP)


def maximum_speed(pole_pairs: int) -> float:
    """Return the mechanical speed (rad/s) at the drive's highest frequency."""
    return 2 * math.pi * MAXIMUM_FREQUENCY / pole_pairs
