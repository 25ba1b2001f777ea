"""Six-step drive with the CiA 402 drive profile: block commutation by Hall sensors, at full voltage."""

import math
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.instruments.cia402.power import (
    ACTUAL_VELOCITY,
    DC_VOLTAGE,
    DriveState,
    ObjectEntry,
    PoweredDrive,
    standard_entries,
)
from sim_instruments.instruments.cia402.setting_up import OwnObject, electrical_unit, own_object, unit_entries
from sim_instruments.instruments.errors import DriveErrors
from sim_instruments.world.settings import SixStepFault

if TYPE_CHECKING:
    from sim_instruments.catalogue import Options
    from sim_instruments.world.world import World

_BUS_CURRENT, _HALL_STATE = OwnObject(0x2010, 0, "i32", 1.0e-3), OwnObject(0x2011, 0, "u8", 1.0)
BLOCK_COMMUTATION = -1
#: Error codes of CiA 402-2 for what the drive switches itself off by.
ERROR_CODES: dict[SixStepFault, int] = {"overcurrent": 0x2310, "no rotation": 0x7121, "output phase missing": 0x7122}
#: Bus voltage and current are means over this time (s).
_APERTURE = 0.02


class Cia402SixStep(PoweredDrive):
    """Simulated side of the six-step drive.

    Bus voltage (6079h) in mV and current (2010h, the maker's) in mA, means over 20 ms; velocity from the Hall edges, in 0.001 rpm
    as set up with one pole pair; Hall signals H1, H2, H3 in the bits 0 to 2 of 2011h, the maker's. Options may say otherwise.
    Raises ValueError on a bench without the drive.
    """

    def __init__(
        self,
        world: "World",
        generator: np.random.Generator,
        errors: DriveErrors | None = None,
        options: "Options" = MappingProxyType({}),
    ) -> None:
        if world.six_step is None:
            raise ValueError("this bench has no six-step drive; give World a SixStepDrive")
        super().__init__(world, (options.get("mode") or BLOCK_COMMUTATION,))
        self._output = world.six_step
        self._random = generator
        self._errors = errors or DriveErrors()
        self._unit = electrical_unit(options)
        self._own_current = own_object(options, "bus_current", _BUS_CURRENT)
        self._own_halls = own_object(options, "hall_state", _HALL_STATE)
        self._readers = {
            **self._power.readers(self._status),
            ACTUAL_VELOCITY: self._velocity,
            DC_VOLTAGE: self._bus_voltage,
            self._own_current.key: self._bus_current,
            self._own_halls.key: lambda: sum(
                1 << place for place, high in enumerate(self._output.hall_state()) if high
            ),
        }

    @property
    def entries(self) -> tuple[ObjectEntry, ...]:
        """Return the object dictionary."""
        return (
            *standard_entries("Virtual six-step drive", 0x00000403, 0x00010000),
            *(
                ObjectEntry(own.index, name, own.kind, subindex=own.subindex)
                for own, name in (
                    (self._own_current, "DC link current actual value"),
                    (self._own_halls, "Hall state"),
                )
            ),
            *unit_entries(self._unit),
        )

    def _fault_code(self) -> int | None:
        fault = self._output.fault
        return None if fault is None else ERROR_CODES[fault]

    def _apply(self) -> None:
        # Full voltage knows no ramp: halt and quick stop switch the bridge off.
        wanted = self._power.active and not self._power.stopped
        if wanted and not self._powered:
            self._output.enable(True)
            self._powered = True
        elif not wanted and self._powered:
            self._output.enable(False)
            self._powered = False

    def _status(self) -> int:
        output, power = self._output, self._power
        shown = output.stuck_output.shown(False, output.enabled) and power.state is not DriveState.FAULT
        return power.status & ~power.state | DriveState.OPERATION_ENABLED if shown else power.status

    def _velocity(self) -> int:
        return round(self._output.electrical_frequency() * (1.0 + self._errors.frequency_gain) * self._unit.counts)

    def _bus_voltage(self) -> int:
        errors = self._errors
        seen = self._output.bus_voltage(_APERTURE) * (1.0 + errors.voltage_gain) + errors.voltage_offset
        return max(0, self._counted(seen, errors.voltage_noise))

    def _bus_current(self) -> int:
        errors = self._errors
        seen = self._output.bus_current(_APERTURE) * (1.0 + errors.current_gain) + errors.current_offset
        return self._counted(seen, errors.current_noise, self._own_current.scale)

    def _counted(self, value: float, noise: float, step: float = 1.0e-3) -> int:
        return math.floor((value + float(self._random.normal(0.0, noise))) / step + 0.5)
