"""Inverter with the CiA 402 drive profile."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from sim_instruments.instruments.cia402.power import (
    ACTUAL_VELOCITY,
    CONTROL_WORD,
    DC_VOLTAGE,
    MODE,
    VELOCITY_UNIT,
    DriveState,
    ObjectEntry,
    PowerStage,
    check_limits,
    standard_entries,
    velocity_steps,
)
from sim_instruments.instruments.errors import InverterErrors

if TYPE_CHECKING:
    from sim_instruments.world.world import World

TARGET_VELOCITY = 0x60FF
TARGET_TORQUE, ACTUAL_TORQUE, ACTUAL_CURRENT = 0x6071, 0x6077, 0x6078
RATED_CURRENT = 0x6075
AMPLITUDE = 0x2000
PROFILE_VELOCITY, PROFILE_TORQUE = 3, 4
_TARGET_REACHED = 0x0400
_FAULT_CODE = 0xFF00


class Cia402Inverter:
    """Simulated side of the inverter.

    Velocity in 0.01 Hz electrical, torque and current in per mille of the rated current (A, peak) that 0x6075 gives
    in mA; 0x2000 is the amplitude (mA, peak) of the phase current in the open-loop velocity mode.
    """

    def __init__(self, world: "World", errors: InverterErrors | None = None, *, rated_current: float = 10.0) -> None:
        if not rated_current > 0.0:
            raise ValueError(f"rated_current {rated_current} A must be positive")
        self._world = world
        self._errors = errors or InverterErrors()
        self._rated_current = rated_current
        self._power = PowerStage((PROFILE_VELOCITY, PROFILE_TORQUE))
        self._powered = False
        self._velocity = 0
        self._torque = 0
        self._amplitude = 0
        inverter, stage = world.inverter, world.inverter.stage
        highest = velocity_steps(stage.maximum_frequency)
        self._limits: dict[int, tuple[int, int]] = {
            CONTROL_WORD: (0, 0xFFFF),
            TARGET_VELOCITY: (-highest, highest),
            TARGET_TORQUE: (-self._per_mille(stage.maximum_current), self._per_mille(stage.maximum_current)),
            AMPLITUDE: (0, round(1000.0 * stage.maximum_current)),
        }
        # The drive regulates what its own sensor shows, so it reports what it was told.
        seen = 1.0 + self._errors.current_gain
        self._readers: dict[int, Callable[[], int]] = {
            **self._power.readers(self._status),
            TARGET_VELOCITY: lambda: self._velocity,
            TARGET_TORQUE: lambda: self._torque,
            AMPLITUDE: lambda: self._amplitude,
            RATED_CURRENT: lambda: round(1000.0 * self._rated_current),
            DC_VOLTAGE: lambda: round(1000.0 * stage.dc_voltage),
            ACTUAL_VELOCITY: lambda: velocity_steps(inverter.output_frequency()),
            ACTUAL_TORQUE: lambda: _int16(self._per_mille(inverter.q_current() / seen)),
            ACTUAL_CURRENT: lambda: _int16(self._per_mille(inverter.current_amplitude() / seen)),
        }

    @property
    def entries(self) -> tuple[ObjectEntry, ...]:
        """Return the object dictionary."""
        return (
            *standard_entries("Virtual inverter", 0x00000402, 0x0000000C),
            ObjectEntry(AMPLITUDE, "Phase current amplitude", "u32", "rw"),
            ObjectEntry(TARGET_TORQUE, "Target torque", "i16", "rw"),
            ObjectEntry(RATED_CURRENT, "Motor rated current", "u32"),
            ObjectEntry(ACTUAL_TORQUE, "Torque actual value", "i16"),
            ObjectEntry(ACTUAL_CURRENT, "Current actual value", "i16"),
            ObjectEntry(TARGET_VELOCITY, "Target velocity", "i32", "rw"),
        )

    def read(self, index: int) -> int | None:
        """Return the value of an object that changes, None for others."""
        with self._world.lock:
            self._check_fault()
            reader = self._readers.get(index)
            return None if reader is None else reader()

    def write(self, index: int, value: int) -> None:
        """Write an object. Raises SdoError where the value or the state does not allow it."""
        check_limits(index, value, self._limits)
        with self._world.lock:
            self._check_fault()
            if index == CONTROL_WORD:
                self._power.command(value)
            elif index == MODE:
                self._power.set_mode(value)
            elif index == TARGET_VELOCITY:
                self._velocity = value
            elif index == TARGET_TORQUE:
                self._torque = value
            elif index == AMPLITUDE:
                self._amplitude = value
            self._apply()

    def _check_fault(self) -> None:
        # The stage keeps its fault until it is switched on again; a fault that was reset is not one any more.
        if self._powered and self._world.inverter.fault is not None:
            self._powered = False
            self._power.trip(_FAULT_CODE)

    def _apply(self) -> None:
        inverter, power = self._world.inverter, self._power
        if power.active or power.state is DriveState.QUICK_STOP_ACTIVE:
            amplitude = self._amplitude * 1.0e-3 * (1.0 + self._errors.current_gain)
            frequency = self._velocity * VELOCITY_UNIT * (1.0 + self._errors.frequency_gain)
            current = self._torque * 1.0e-3 * self._rated_current * (1.0 + self._errors.current_gain)
            inverter.set_mode("current" if power.mode == PROFILE_TORQUE else "frequency")
            inverter.command_amplitude(amplitude)
            inverter.command_frequency(0.0 if power.stopped else frequency)
            inverter.command_q_current(0.0 if power.stopped else current)
            if power.active and not inverter.enabled:
                inverter.enable(True)
                self._powered = True
        elif inverter.enabled:
            inverter.enable(False)
            self._powered = False

    def _status(self) -> int:
        word, power, inverter = self._power.status, self._power, self._world.inverter
        if inverter.stuck_output.shown(False, inverter.enabled) and power.state is not DriveState.FAULT:
            word = word & ~power.state | DriveState.OPERATION_ENABLED
        if power.state is DriveState.OPERATION_ENABLED and power.mode == PROFILE_VELOCITY and self._velocity:
            actual = velocity_steps(self._world.inverter.output_frequency())
            if abs(actual - self._velocity) <= 1:
                word |= _TARGET_REACHED
        return word

    def _per_mille(self, current: float) -> int:
        return round(1000.0 * current / self._rated_current)


def _int16(value: int) -> int:
    return max(-0x8000, min(0x7FFF, value))
