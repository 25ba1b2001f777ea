"""The instruments that a person works, one a role, under one name."""

from pkgutil import resolve_name
from typing import Any

from drivers.catalogue import MANUAL, Driver, Surroundings
from drivers.interfaces import Instrument, InverterAbility, Role
from drivers.manual import options as manual


def _by_hand(
    role: Role, options: type[Any], instrument: str, abilities: frozenset[InverterAbility] | None = None
) -> Driver:
    def opened(_: str, chosen: Any, surroundings: Surroundings, name: str) -> Instrument:
        made: Instrument = resolve_name(f"drivers.manual.{instrument}")(
            surroundings.person(), surroundings.clock, chosen, name=name
        )
        return made

    return Driver(MANUAL, role, options, opened, needs_address=False, abilities=abilities)


DRIVERS = (
    _by_hand(Role.SUPPLY, manual.ManualSupplyOptions, "supply:ManualSupply"),
    _by_hand(Role.LCR_METER, manual.ManualLcrMeterOptions, "lcr_meter:ManualLcrMeter"),
    _by_hand(Role.OSCILLOSCOPE, manual.ManualOscilloscopeOptions, "oscilloscope:ManualOscilloscope"),
    _by_hand(Role.DYNAMOMETER, manual.ManualDynamometerOptions, "dynamometer:ManualDynamometer"),
    _by_hand(Role.TACHOMETER, manual.ManualTachometerOptions, "tachometer:ManualTachometer"),
    _by_hand(Role.INVERTER, manual.ManualInverterOptions, "inverter:ManualInverter", manual.INVERTER_ABILITIES),
    _by_hand(Role.VOLTMETER, manual.ManualVoltmeterOptions, "voltmeter:ManualVoltmeter"),
    _by_hand(Role.DRIVE, manual.ManualDriveOptions, "drive:ManualDrive"),
)
