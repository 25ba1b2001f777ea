"""The data of a motor that are known before it is measured."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum


class WindingConnection(Enum):
    """Connection of the windings."""

    WYE = "wye"
    DELTA = "delta"


@dataclass(frozen=True)
class Nameplate:
    """The motor's plate and data sheet, in SI units; currents are phase, peak.

    `maximum_current` and `rated_speed_rpm` come from the data sheet only and are never guessed: where they
    are None, the nameplate procedure asks for them. `wire_colours` maps terminal to colour. `pole_pairs` is what the data
    sheet claims, if anything. `hall_sensors` says whether the motor has any; None where nobody said.
    `insulation_test_voltage` (V DC) is what the insulation between winding and frame may be tested with.
    `expected` holds type values by parameter name, in the unit in which that is reported, `tolerance` how far a motor may be from
    them, as a share of the type value.
    """

    name: str
    connection: WindingConnection
    rated_current: float
    maximum_current: float | None = None
    rated_speed_rpm: float | None = None
    rated_voltage: float | None = None
    pole_pairs: int | None = None
    maximum_speed_rpm: float | None = None
    maximum_winding_temperature: float | None = None
    wire_colours: Mapping[str, str] = field(default_factory=dict)
    serial_number: str = ""
    maximum_voltage: float | None = None
    expected: Mapping[str, float] = field(default_factory=dict)
    insulation_test_voltage: float | None = None
    tolerance: Mapping[str, float] = field(default_factory=dict)
    hall_sensors: bool | None = None

    @property
    def current_bound(self) -> float:
        """Largest current (A, peak) that any procedure may ask for: the data sheet's maximum, else the rated one."""
        return self.maximum_current if self.maximum_current is not None else self.rated_current

    @property
    def voltage_bound(self) -> float | None:
        """Largest voltage (V) between two terminals that any instrument may be set to, or None if the nameplate states none."""
        return self.maximum_voltage if self.maximum_voltage is not None else self.rated_voltage

    @property
    def speed_bound_rpm(self) -> float | None:
        """Highest speed (rpm) that any procedure may ask for, or None if the nameplate states none."""
        return self.maximum_speed_rpm if self.maximum_speed_rpm is not None else self.rated_speed_rpm
