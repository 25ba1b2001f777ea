"""Six-step drive with the CiA 402 drive profile: block commutation by Hall sensors, at full voltage."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.instruments.cia402.power import (
    ACTUAL_VELOCITY,
    CONTROL_WORD,
    DC_VOLTAGE,
    MODE,
    DriveState,
    ObjectEntry,
    PowerStage,
    check_limits,
    standard_entries,
    velocity_steps,
)
from sim_instruments.instruments.errors import DriveErrors
from sim_instruments.world.settings import SixStepFault

if TYPE_CHECKING:
    from sim_instruments.world.world import World

BUS_CURRENT, HALL_STATE = 0x2010, 0x2011
BLOCK_COMMUTATION = -1
#: Error codes of CiA 402-2 for what the drive switches itself off by.
ERROR_CODES: dict[SixStepFault, int] = {"overcurrent": 0x2310, "no rotation": 0x7121, "output phase missing": 0x7122}
#: Bus voltage and current are means over this time (s).
_APERTURE = 0.02


class Cia402SixStep:
    """Simulated side of the six-step drive.

    Bus voltage (0x6079) in mV and current (0x2010) in mA, means over 20 ms; velocity in 0.01 Hz electrical from the
    Hall edges; Hall signals H1, H2, H3 in the bits 0 to 2 of 0x2011. Raises ValueError on a bench without the drive.
    """

    def __init__(self, world: "World", generator: np.random.Generator, errors: DriveErrors | None = None) -> None:
        if world.six_step is None:
            raise ValueError("this bench has no six-step drive; give World a SixStepDrive")
        self._world = world
        self._output = world.six_step
        self._random = generator
        self._errors = errors or DriveErrors()
        self._power = PowerStage((BLOCK_COMMUTATION,))
        self._powered = False
        self._readers: dict[int, Callable[[], int]] = {
            **self._power.readers(self._status),
            ACTUAL_VELOCITY: self._velocity,
            DC_VOLTAGE: self._bus_voltage,
            BUS_CURRENT: self._bus_current,
            HALL_STATE: lambda: sum(1 << place for place, high in enumerate(self._output.hall_state()) if high),
        }

    @property
    def entries(self) -> tuple[ObjectEntry, ...]:
        """Return the object dictionary."""
        return (
            *standard_entries("Virtual six-step drive", 0x00000403, 0x00010000),
            ObjectEntry(BUS_CURRENT, "DC link current actual value", "i32"),
            ObjectEntry(HALL_STATE, "Hall state", "u8"),
        )

    def read(self, index: int) -> int | None:
        """Return the value of an object that changes, None for others."""
        with self._world.lock:
            self._check_fault()
            reader = self._readers.get(index)
            return None if reader is None else reader()

    def write(self, index: int, value: int) -> None:
        """Write an object. Raises SdoError where the value or the state does not allow it."""
        check_limits(index, value, {CONTROL_WORD: (0, 0xFFFF)})
        with self._world.lock:
            self._check_fault()
            if index == CONTROL_WORD:
                self._power.command(value)
            elif index == MODE:
                self._power.set_mode(value)
            self._apply()

    def _check_fault(self) -> None:
        fault = self._output.fault
        # The stage keeps its fault until it is switched on again; a fault that was reset is not one any more.
        if self._powered and fault is not None:
            self._powered = False
            self._power.trip(ERROR_CODES[fault])

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
        return velocity_steps(self._output.electrical_frequency() * (1.0 + self._errors.frequency_gain))

    def _bus_voltage(self) -> int:
        errors = self._errors
        seen = self._output.bus_voltage(_APERTURE) * (1.0 + errors.voltage_gain) + errors.voltage_offset
        return max(0, self._counted(seen, errors.voltage_noise))

    def _bus_current(self) -> int:
        errors = self._errors
        seen = self._output.bus_current(_APERTURE) * (1.0 + errors.current_gain) + errors.current_offset
        return self._counted(seen, errors.current_noise)

    def _counted(self, value: float, noise: float) -> int:
        return math.floor(1000.0 * (value + float(self._random.normal(0.0, noise))) + 0.5)
