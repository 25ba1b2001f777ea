"""Inverter with the CiA 402 drive profile (CiA 402-2, state machine and objects; CiA 301, abort codes)."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Literal

from sim_instruments.instruments.errors import InverterErrors

if TYPE_CHECKING:
    from sim_instruments.world import World

Kind = Literal["i8", "u8", "i16", "u16", "i32", "u32", "text"]

NO_OBJECT, NO_SUBINDEX = 0x06020000, 0x06090011
TOO_HIGH, TOO_LOW, OUT_OF_RANGE = 0x06090031, 0x06090032, 0x06090030
DEVICE_STATE = 0x08000022

ERROR_REGISTER = 0x1001
CONTROL_WORD, STATUS_WORD, ERROR_CODE = 0x6040, 0x6041, 0x603F
MODE, MODE_DISPLAY, SUPPORTED_MODES = 0x6060, 0x6061, 0x6502
TARGET_VELOCITY, ACTUAL_VELOCITY = 0x60FF, 0x606C
TARGET_TORQUE, ACTUAL_TORQUE, ACTUAL_CURRENT = 0x6071, 0x6077, 0x6078
RATED_CURRENT, DC_VOLTAGE = 0x6075, 0x6079
AMPLITUDE = 0x2000
PROFILE_VELOCITY, PROFILE_TORQUE = 3, 4
_VELOCITY_UNIT = 0.01
_NO_MODE = 0
_HALT, _FAULT_RESET, _REMOTE, _TARGET_REACHED = 0x0100, 0x0080, 0x0200, 0x0400
_FAULT_CODE = 0xFF00


class State(IntEnum):
    """States of the power drive system, as the status word shows them, voltage enabled."""

    SWITCH_ON_DISABLED = 0x0050
    READY_TO_SWITCH_ON = 0x0031
    SWITCHED_ON = 0x0033
    OPERATION_ENABLED = 0x0037
    QUICK_STOP_ACTIVE = 0x0017
    FAULT = 0x0018


@dataclass(frozen=True)
class Entry:
    """One object: its index and subindex, name, type and access; `value` where it is constant."""

    index: int
    name: str
    kind: Kind
    access: Literal["ro", "rw", "wo", "const"] = "ro"
    subindex: int = 0
    value: int | str | None = None


class SdoError(Exception):
    """A request that the drive aborts, with the abort code of CiA 301."""

    def __init__(self, code: int, message: str) -> None:
        self.code = code
        super().__init__(message)


class Cia402Inverter:
    """Face of the inverter.

    Velocity in 0.01 Hz electrical, torque and current in per mille of the rated current (A, peak) that 0x6075 gives
    in mA; 0x2000 is the amplitude (mA, peak) of the phase current in the open-loop velocity mode.
    """

    def __init__(self, world: "World", errors: InverterErrors | None = None, *, rated_current: float = 10.0) -> None:
        if not rated_current > 0.0:
            raise ValueError(f"rated_current {rated_current} A must be positive")
        self._world = world
        self._errors = errors or InverterErrors()
        self._rated_current = rated_current
        self._state = State.SWITCH_ON_DISABLED
        self._powered = False
        self._control = 0
        self._mode = _NO_MODE
        self._velocity = 0
        self._torque = 0
        self._amplitude = 0
        self._error = 0
        inverter, stage = world.inverter, world.inverter.stage
        self._limits: dict[int, tuple[int, int]] = {
            CONTROL_WORD: (0, 0xFFFF),
            TARGET_VELOCITY: (-_steps(stage.maximum_frequency), _steps(stage.maximum_frequency)),
            TARGET_TORQUE: (-self._per_mille(stage.maximum_current), self._per_mille(stage.maximum_current)),
            AMPLITUDE: (0, round(1000.0 * stage.maximum_current)),
        }
        self._readers: dict[int, Callable[[], int]] = {
            ERROR_REGISTER: lambda: int(self._state is State.FAULT),
            ERROR_CODE: lambda: self._error,
            CONTROL_WORD: lambda: self._control,
            STATUS_WORD: self._status,
            MODE: lambda: self._mode,
            MODE_DISPLAY: lambda: self._mode,
            TARGET_VELOCITY: lambda: self._velocity,
            TARGET_TORQUE: lambda: self._torque,
            AMPLITUDE: lambda: self._amplitude,
            RATED_CURRENT: lambda: round(1000.0 * self._rated_current),
            DC_VOLTAGE: lambda: round(1000.0 * stage.dc_voltage),
            ACTUAL_VELOCITY: lambda: _steps(inverter.output_frequency()),
            ACTUAL_TORQUE: lambda: _int16(self._per_mille(inverter.q_current())),
            ACTUAL_CURRENT: lambda: _int16(self._per_mille(inverter.current_amplitude())),
        }

    @property
    def entries(self) -> tuple[Entry, ...]:
        """Return the object dictionary."""
        return (
            Entry(0x1000, "Device type", "u32", "const", value=0x00020192),
            Entry(ERROR_REGISTER, "Error register", "u8"),
            Entry(0x1008, "Manufacturer device name", "text", "const", value="Virtual inverter"),
            Entry(0x1017, "Producer heartbeat time", "u16", "rw", value=0),
            Entry(0x1018, "Identity: highest subindex", "u8", "const", 0, 4),
            Entry(0x1018, "Identity: vendor", "u32", "const", 1, 0x000002FF),
            Entry(0x1018, "Identity: product code", "u32", "const", 2, 0x00000402),
            Entry(0x1018, "Identity: revision", "u32", "const", 3, 0x00010000),
            Entry(0x1018, "Identity: serial number", "u32", "const", 4, 0x00000001),
            Entry(AMPLITUDE, "Phase current amplitude", "u32", "rw"),
            Entry(ERROR_CODE, "Error code", "u16"),
            Entry(CONTROL_WORD, "Controlword", "u16", "rw"),
            Entry(STATUS_WORD, "Statusword", "u16"),
            Entry(MODE, "Modes of operation", "i8", "rw"),
            Entry(MODE_DISPLAY, "Modes of operation display", "i8"),
            Entry(ACTUAL_VELOCITY, "Velocity actual value", "i32"),
            Entry(TARGET_TORQUE, "Target torque", "i16", "rw"),
            Entry(RATED_CURRENT, "Motor rated current", "u32"),
            Entry(ACTUAL_TORQUE, "Torque actual value", "i16"),
            Entry(ACTUAL_CURRENT, "Current actual value", "i16"),
            Entry(DC_VOLTAGE, "DC link circuit voltage", "u32"),
            Entry(TARGET_VELOCITY, "Target velocity", "i32", "rw"),
            Entry(SUPPORTED_MODES, "Supported drive modes", "u32", value=0x0000000C),
        )

    def read(self, index: int) -> int | None:
        """Return the value of an object that changes, None for others."""
        with self._world.lock:
            self._check_fault()
            reader = self._readers.get(index)
            return None if reader is None else reader()

    def write(self, index: int, value: int) -> None:
        """Write an object. Raises SdoError where the value or the state does not allow it."""
        if index in self._limits:
            low, high = self._limits[index]
            if not low <= value <= high:
                code = TOO_HIGH if value > high else TOO_LOW
                raise SdoError(code, f"object {index:04X}h: {value} is outside {low} … {high}")
        with self._world.lock:
            self._check_fault()
            if index == CONTROL_WORD:
                self._command(value)
            elif index == MODE:
                self._set_mode(value)
            elif index == TARGET_VELOCITY:
                self._velocity = value
            elif index == TARGET_TORQUE:
                self._torque = value
            elif index == AMPLITUDE:
                self._amplitude = value
            self._apply()

    def _set_mode(self, value: int) -> None:
        if value not in (_NO_MODE, PROFILE_VELOCITY, PROFILE_TORQUE):
            raise SdoError(OUT_OF_RANGE, f"mode of operation {value} is not supported; allowed are 3 and 4")
        if value != self._mode and self._state is State.OPERATION_ENABLED:
            raise SdoError(DEVICE_STATE, "the mode of operation cannot change while operation is enabled")
        self._mode = value

    def _command(self, word: int) -> None:
        rising_reset = bool(word & _FAULT_RESET and not self._control & _FAULT_RESET)
        self._control = word
        if self._state is State.FAULT:
            if rising_reset:
                self._error = 0
                self._state = State.SWITCH_ON_DISABLED
            return
        if not word & 0b0010:
            self._state = State.SWITCH_ON_DISABLED
        elif not word & 0b0100:
            enabled = self._state is State.OPERATION_ENABLED
            active = enabled or self._state is State.QUICK_STOP_ACTIVE
            self._state = State.QUICK_STOP_ACTIVE if active else State.SWITCH_ON_DISABLED
        elif self._state is State.QUICK_STOP_ACTIVE:
            if word & 0b1111 == 0b1111:
                self._state = State.OPERATION_ENABLED
        elif not word & 0b0001:
            self._state = State.READY_TO_SWITCH_ON
        elif self._state in (State.READY_TO_SWITCH_ON, State.SWITCHED_ON, State.OPERATION_ENABLED):
            # Controlword F in "ready to switch on" passes "switched on" by itself.
            self._state = State.OPERATION_ENABLED if word & 0b1000 else State.SWITCHED_ON

    def _check_fault(self) -> None:
        # The stage keeps its fault until it is switched on again; a fault that was reset is not one any more.
        if self._powered and self._world.inverter.fault is not None:
            self._powered = False
            self._state, self._error = State.FAULT, _FAULT_CODE

    def _apply(self) -> None:
        inverter = self._world.inverter
        active = self._state is State.OPERATION_ENABLED and self._mode != _NO_MODE
        stopped = bool(self._control & _HALT) or self._state is State.QUICK_STOP_ACTIVE
        if active or self._state is State.QUICK_STOP_ACTIVE:
            amplitude = self._amplitude * 1.0e-3 * (1.0 + self._errors.current_gain)
            frequency = self._velocity * _VELOCITY_UNIT * (1.0 + self._errors.frequency_gain)
            current = self._torque * 1.0e-3 * self._rated_current * (1.0 + self._errors.current_gain)
            inverter.set_mode("current" if self._mode == PROFILE_TORQUE else "frequency")
            inverter.command_amplitude(amplitude)
            inverter.command_frequency(0.0 if stopped else frequency)
            inverter.command_q_current(0.0 if stopped else current)
            if active and not inverter.enabled:
                inverter.enable(True)
                self._powered = True
        elif inverter.enabled:
            inverter.enable(False)
            self._powered = False

    def _status(self) -> int:
        word = int(self._state) | _REMOTE
        if self._state is State.OPERATION_ENABLED and self._mode == PROFILE_VELOCITY and self._velocity:
            actual = _steps(self._world.inverter.output_frequency())
            if abs(actual - self._velocity) <= 1:
                word |= _TARGET_REACHED
        return word

    def _per_mille(self, current: float) -> int:
        return round(1000.0 * current / self._rated_current)


def _steps(frequency: float) -> int:
    return round(frequency / _VELOCITY_UNIT)


def _int16(value: int) -> int:
    return max(-0x8000, min(0x7FFF, value))
