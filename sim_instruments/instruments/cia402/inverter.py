"""Inverter with the CiA 402 drive profile."""

import math
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sim_instruments.found_state import drawn
from sim_instruments.instruments.cia402.power import (
    ACTUAL_VELOCITY,
    DC_VOLTAGE,
    MODE,
    OUT_OF_RANGE,
    RPM,
    SI_UNIT_VELOCITY,
    DriveState,
    ObjectEntry,
    PoweredDrive,
    SdoError,
    counts_per_hertz,
    standard_entries,
)
from sim_instruments.instruments.cia402.setting_up import (
    DriveUnit,
    OwnObject,
    electrical_unit,
    own_object,
    unit_entries,
)
from sim_instruments.instruments.errors import InverterErrors

if TYPE_CHECKING:
    from sim_instruments.catalogue import Options
    from sim_instruments.world.world import World

TARGET_VELOCITY = 0x60FF
TARGET_TORQUE, ACTUAL_TORQUE, ACTUAL_CURRENT = 0x6071, 0x6077, 0x6078
MAX_TORQUE, MAX_CURRENT, RATED_CURRENT, RATED_TORQUE = 0x6072, 0x6073, 0x6075, 0x6076
POLARITY, MAX_PROFILE_VELOCITY, PROFILE_ACCELERATION, PROFILE_DECELERATION = 0x607E, 0x607F, 0x6083, 0x6084
#: Bit of 607Eh that turns the sign of velocities.
_VELOCITY_POLARITY = 0x40
_FIELD_CURRENT = OwnObject(0x2000, 0, "u32", 1.0e-3)
PROFILE_VELOCITY, PROFILE_TORQUE = 3, 4
#: mN·m, of the motor that it is set up for.
_RATED_TORQUE = 1000
_TARGET_REACHED, _INTERNAL_LIMIT = 0x0400, 0x0800
_FAULT_CODE = 0xFF00


class Cia402Inverter(PoweredDrive):
    """Simulated side of the inverter.

    Velocity in the unit of 60A9h (turns a minute by a power of ten; 0.001 rpm as it comes), set up with one pole pair; torque
    and current in per mille of rated torque and rated current (A, peak), which 6075h gives in mA. 2000h, the maker's, is the
    amplitude (mA, peak) of the phase current in the open-loop velocity mode. 6072h, 6073h, 607Fh and 607Eh act.
    `modes` are the mode that turns and the one that regulates a torque.
    """

    modes: ClassVar[tuple[int, int]] = (PROFILE_VELOCITY, PROFILE_TORQUE)

    def __init__(
        self,
        world: "World",
        errors: InverterErrors | None = None,
        *,
        rated_current: float = 10.0,
        options: "Options" = MappingProxyType({}),
    ) -> None:
        if not rated_current > 0.0:
            raise ValueError(f"rated_current {rated_current} A must be positive")
        super().__init__(world, self.modes)
        self._errors = errors or InverterErrors()
        self._rated_current = rated_current
        self._velocity = 0
        self._torque = 0
        self._amplitude = 0
        inverter, stage = world.inverter, world.inverter.stage
        self._unit = electrical_unit(options)
        self._field = own_object(options, "field_current", _FIELD_CURRENT)
        # Peak amperes an ampere of its own scale.
        self._scale = options.get("current_scale") or 1.0
        self._polarity = 0
        self._maximum = {
            MAX_TORQUE: min(0xFFFF, self._per_mille(stage.maximum_current)),
            MAX_CURRENT: min(0xFFFF, self._per_mille(stage.maximum_current)),
            MAX_PROFILE_VELOCITY: math.floor(stage.maximum_frequency * self._unit.counts),
        }
        # The drive regulates what its own sensor shows, so it reports what it was told.
        seen = 1.0 + self._errors.current_gain
        self._readers = {
            **self._power.readers(self._status),
            TARGET_VELOCITY: lambda: self._velocity,
            TARGET_TORQUE: lambda: self._torque,
            self._field.key: lambda: self._amplitude,
            RATED_CURRENT: lambda: round(1000.0 * self._rated_current / self._scale),
            DC_VOLTAGE: lambda: round(1000.0 * stage.dc_voltage),
            ACTUAL_VELOCITY: lambda: round(inverter.output_frequency() * self._per_hertz),
            SI_UNIT_VELOCITY: lambda: self._unit.code or 0,
            POLARITY: lambda: self._polarity,
            PROFILE_ACCELERATION: lambda: round(stage.frequency_ramp * abs(self._per_hertz)),
            PROFILE_DECELERATION: lambda: round(stage.frequency_ramp * abs(self._per_hertz)),
            **{index: lambda index=index: self._maximum[index] for index in self._maximum},  # type: ignore[misc]
            ACTUAL_TORQUE: lambda: _int16(self._per_mille(inverter.q_current() / seen)),
            ACTUAL_CURRENT: lambda: _int16(self._per_mille(inverter.current_amplitude() / seen)),
        }

    @property
    def entries(self) -> tuple[ObjectEntry, ...]:
        """Return the object dictionary."""
        return (
            *standard_entries("Virtual inverter", 0x00000402, sum(1 << mode - 1 for mode in self.modes)),
            ObjectEntry(
                self._field.index, "Phase current amplitude", self._field.kind, "rw", subindex=self._field.subindex
            ),
            ObjectEntry(TARGET_TORQUE, "Target torque", "i16", "rw"),
            ObjectEntry(MAX_TORQUE, "Max torque", "u16", "rw"),
            ObjectEntry(MAX_CURRENT, "Max current", "u16", "rw"),
            ObjectEntry(RATED_CURRENT, "Motor rated current", "u32"),
            ObjectEntry(RATED_TORQUE, "Motor rated torque", "u32", "const", value=_RATED_TORQUE),
            ObjectEntry(ACTUAL_TORQUE, "Torque actual value", "i16", mappable=True),
            ObjectEntry(ACTUAL_CURRENT, "Current actual value", "i16", mappable=True),
            ObjectEntry(POLARITY, "Polarity", "u8", "rw"),
            ObjectEntry(MAX_PROFILE_VELOCITY, "Max profile velocity", "u32", "rw"),
            ObjectEntry(PROFILE_ACCELERATION, "Profile acceleration", "u32"),
            ObjectEntry(PROFILE_DECELERATION, "Profile deceleration", "u32"),
            *unit_entries(self._unit, "rw"),
            ObjectEntry(TARGET_VELOCITY, "Target velocity", "i32", "rw"),
        )

    def leave(self, generator: np.random.Generator) -> tuple[str, ...]:
        """Start with other settings: unit and sign of velocities, mode of operation, targets that were not reset."""
        objects = {
            MODE: drawn(generator, (0, *self.modes)),
            POLARITY: drawn(generator, (0, _VELOCITY_POLARITY)),
            TARGET_TORQUE: drawn(generator, (0, 50)),
        }
        if self._unit.code is not None:
            objects[SI_UNIT_VELOCITY] = drawn(generator, (RPM, 0xFF000000 | RPM, 0xFD000000 | RPM))
        for index, value in objects.items():
            self.write(index, value)
        return tuple(f"{index:04X}h = {value:X}h" for index, value in objects.items())

    def _limits(self) -> dict[int, tuple[int, int]]:
        fastest, stage = self._maximum[MAX_PROFILE_VELOCITY], self._world.inverter.stage
        torque = self._per_mille(stage.maximum_current)
        return {
            **super()._limits(),
            TARGET_VELOCITY: (-fastest, fastest),
            TARGET_TORQUE: (-torque, torque),
            self._field.key: (0, math.floor(stage.maximum_current / self._scale / self._field.scale)),
        }

    def _set(self, index: int, value: int) -> None:
        super()._set(index, value)
        if index == TARGET_VELOCITY:
            self._velocity = value
        elif index == TARGET_TORQUE:
            self._torque = value
        elif index == self._field.key:
            self._amplitude = value
        elif index == POLARITY:
            self._polarity = value
        elif index == SI_UNIT_VELOCITY:
            self._set_unit(value)
        elif index in self._maximum:
            self._maximum[index] = value

    @property
    def _per_hertz(self) -> float:
        """Counts of a velocity in one Hz; negative where the polarity turns it."""
        counts = self._unit.counts
        return -counts if self._polarity & _VELOCITY_POLARITY else counts

    def _set_unit(self, unit: int) -> None:
        # Turns a minute, whole or in up to a millionth.
        if unit & 0xFFFFFF != RPM or not (unit >> 24 == 0 or unit >> 24 >= 0xFA):
            raise SdoError(OUT_OF_RANGE, f"object 60A9h: {unit:08X}h is no unit that this drive has")
        counts = self._unit.counts * counts_per_hertz(unit) / counts_per_hertz(self._unit.code or 0)
        limit = self._maximum[MAX_PROFILE_VELOCITY] / self._unit.counts
        self._unit = DriveUnit(counts, unit)
        self._maximum[MAX_PROFILE_VELOCITY] = math.floor(limit * counts)

    def _fault_code(self) -> int | None:
        return None if self._world.inverter.fault is None else _FAULT_CODE

    def _apply(self) -> None:
        inverter, power = self._world.inverter, self._power
        if power.active or power.state is DriveState.QUICK_STOP_ACTIVE:
            amplitude = self._amplitude * self._field.scale * self._scale * (1.0 + self._errors.current_gain)
            frequency = self._velocity / self._per_hertz * (1.0 + self._errors.frequency_gain)
            bound = min(self._maximum[MAX_TORQUE], self._maximum[MAX_CURRENT])
            current = (
                max(-bound, min(bound, self._torque)) * 1.0e-3 * self._rated_current * (1.0 + self._errors.current_gain)
            )
            inverter.set_mode("current" if power.mode == self.modes[1] else "frequency")
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
        if power.state is DriveState.OPERATION_ENABLED and power.mode == self.modes[0] and self._velocity:
            actual = round(self._world.inverter.output_frequency() * self._per_hertz)
            if abs(actual - self._velocity) <= 0.01 * abs(self._per_hertz):
                word |= _TARGET_REACHED
        if power.active and abs(self._torque) > min(self._maximum[MAX_TORQUE], self._maximum[MAX_CURRENT]):
            word |= _INTERNAL_LIMIT
        return word

    def _per_mille(self, current: float) -> int:
        return round(1000.0 * current / self._rated_current)


def _int16(value: int) -> int:
    return max(-0x8000, min(0x7FFF, value))
