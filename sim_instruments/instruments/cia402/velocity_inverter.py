"""Inverter with the CiA 402 drive profile that has no profile modes: velocity mode (vl) and cyclic synchronous torque."""

from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

from sim_instruments.instruments.cia402.inverter import (
    MAX_PROFILE_VELOCITY,
    POLARITY,
    PROFILE_ACCELERATION,
    PROFILE_DECELERATION,
    TARGET_VELOCITY,
    Cia402Inverter,
)
from sim_instruments.instruments.cia402.power import ACTUAL_VELOCITY, ObjectEntry
from sim_instruments.instruments.errors import InverterErrors

if TYPE_CHECKING:
    from sim_instruments.catalogue import Options
    from sim_instruments.world.world import World

VL_TARGET_VELOCITY, VL_ACTUAL_VELOCITY = 0x6042, 0x6044
VELOCITY_MODE, CYCLIC_TORQUE = 2, 10
#: What profile velocity has; 607Fh is there, and nobody has set it up.
_ABSENT = (ACTUAL_VELOCITY, TARGET_VELOCITY, POLARITY, PROFILE_ACCELERATION, PROFILE_DECELERATION)
_SAME = {VL_TARGET_VELOCITY: TARGET_VELOCITY, VL_ACTUAL_VELOCITY: ACTUAL_VELOCITY}


class Cia402VelocityInverter(Cia402Inverter):
    """Simulated side of the inverter: velocities in whole turns a minute, 16 bits wide, in 6042h and 6044h."""

    modes: ClassVar[tuple[int, int]] = (VELOCITY_MODE, CYCLIC_TORQUE)

    def __init__(
        self,
        world: "World",
        errors: InverterErrors | None = None,
        *,
        rated_current: float = 10.0,
        options: "Options" = MappingProxyType({}),
    ) -> None:
        super().__init__(world, errors, rated_current=rated_current, options={**options, "velocity_unit": "rpm"})

    @property
    def entries(self) -> tuple[ObjectEntry, ...]:
        """Return the object dictionary."""
        kept = (entry for entry in super().entries if entry.index not in _ABSENT)
        return (
            *(replace(one, access="const", value=0) if one.index == MAX_PROFILE_VELOCITY else one for one in kept),
            ObjectEntry(VL_TARGET_VELOCITY, "vl target velocity", "i16", "rw"),
            ObjectEntry(VL_ACTUAL_VELOCITY, "vl velocity actual value", "i16", mappable=True),
        )

    def read(self, index: int) -> int | None:
        """Return the value of an object that changes, None for others."""
        return super().read(_SAME.get(index, index))

    def write(self, index: int, value: int) -> None:
        """Write an object. Raises SdoError where the value or the state does not allow it."""
        super().write(_SAME.get(index, index), value)
