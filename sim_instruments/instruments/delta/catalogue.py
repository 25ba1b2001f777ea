"""The simulated instruments of Delta, with a torque transducer on the same line."""

from typing import Any

from sim_instruments.catalogue import BenchPlace, Options, SimulatedInstrument
from sim_instruments.world.machine_data import DynamometerMachine

#: Rated torque (N·m) where nothing is said of it, and the share of it that the machine can give for a while.
_RATED_TORQUE, _OVERLOAD = 5.0, 2.0
#: What options say of the transducer's make, with `sensor_` before it.
_MAKE = ("power_unit", "speed_unit", "power_sign", "zeroed", "modbus", "rate")


def _rated_torque(options: Options) -> float:
    return float(options.get("rated_torque") or options.get("maximum_torque") or _RATED_TORQUE)


def _machine(options: Options) -> DynamometerMachine:
    usual = DynamometerMachine()
    if options.get("maximum_speed") is None and options.get("maximum_torque") is None:
        return usual
    size = max(_rated_torque(options) / _RATED_TORQUE, 1.0)
    return DynamometerMachine(
        # Of machines of one shape, inertia grows with the fifth power of length, torque with the third.
        inertia=usual.inertia * size ** (5.0 / 3.0),
        coulomb_friction=usual.coulomb_friction * size,
        viscous_friction=usual.viscous_friction * size,
        maximum_speed=options.get("maximum_speed") or usual.maximum_speed,
        maximum_torque=_OVERLOAD * _rated_torque(options),
    )


def _dynamometer(place: BenchPlace) -> Any:
    from sim_instruments.instruments.delta.c2000 import DeltaDrive
    from sim_instruments.instruments.delta.dyn200 import Dyn200, Dyn200Make
    from sim_instruments.transports.modbus.unit import ModbusLine

    torque = _rated_torque(place.options)
    drive = DeltaDrive(
        place.world,
        pole_pairs=place.options.get("pole_pairs", 2),
        rated_torque=torque,
        framing_acts=place.options.get("drive_framing_acts", "at once"),
    )
    make = Dyn200Make(**{key: place.options[f"sensor_{key}"] for key in _MAKE if f"sensor_{key}" in place.options})
    transducer = Dyn200(place.world, place.generator, place.errors, rated_torque=torque, make=make)
    return ModbusLine((drive, transducer), place.world.clock, place.generator)


#: The drive is unit 1, the transducer unit 2. Options `sensor_power_unit` (W), `sensor_speed_unit` (rpm), `sensor_power_sign`,
#: `sensor_zeroed` ("coil" or "write"), `sensor_modbus` and `sensor_rate` (bit/s) say which DYN-200 it is (see Dyn200Make),
#: `drive_framing_acts` when the drive follows its framing parameters (see DeltaDrive).
DELTA_DYN200 = SimulatedInstrument("delta-dyn200", "dynamometer", "modbus", _dynamometer, machine=_machine)
