"""The simulated drives with the CiA 402 profile."""

from typing import TYPE_CHECKING, Any

from sim_instruments.catalogue import BenchPlace, Options, SimulatedInstrument
from sim_instruments.world.machine_data import InverterStage

if TYPE_CHECKING:
    from sim_instruments.instruments.cia402.inverter import Cia402Inverter

#: Least rated current (A): its torque objects count in thousandths of it.
_RATED_CURRENT = 10.0


def _stage(options: Options) -> InverterStage:
    usual = InverterStage()
    frequency = options.get("maximum_frequency")
    return InverterStage(
        dc_voltage=options.get("dc_voltage") or usual.dc_voltage,
        maximum_current=options.get("maximum_current") or usual.maximum_current,
        maximum_frequency=frequency or usual.maximum_frequency,
        frequency_ramp=max(20.0, frequency / 50.0) if frequency else usual.frequency_ramp,
    )


def _inverter(place: BenchPlace) -> Any:
    from sim_instruments.instruments.cia402.inverter import Cia402Inverter

    return _made(Cia402Inverter, place)


def _velocity_inverter(place: BenchPlace) -> Any:
    from sim_instruments.instruments.cia402.velocity_inverter import Cia402VelocityInverter

    return _made(Cia402VelocityInverter, place)


def _made(kind: type["Cia402Inverter"], place: BenchPlace) -> "Cia402Inverter":
    stated, scale = place.options.get("rated_current"), place.options.get("current_scale") or 1.0
    # The torque objects reach three times the rated current and a little.
    rated = stated * scale if stated else max(_RATED_CURRENT, (place.options.get("maximum_current") or 0.0) / 3.0)
    return kind(place.world, place.errors, rated_current=rated, options=place.options)


def _six_step(place: BenchPlace) -> Any:
    from sim_instruments.instruments.cia402.six_step import Cia402SixStep

    return Cia402SixStep(place.world, place.generator, place.errors, place.options)


def _rotor_actuator(place: BenchPlace) -> Any:
    from sim_instruments.instruments.cia402.rotor_actuator import Cia402Actuator

    return Cia402Actuator(place.world, options=place.options)


INVERTER = SimulatedInstrument("cia402-inverter", "inverter", "can", _inverter, machine=_stage)
#: A drive of velocity mode, which no station names: the inverter's driver is checked with it.
VELOCITY_INVERTER = SimulatedInstrument(
    "cia402-velocity-inverter", "inverter", "can", _velocity_inverter, machine=_stage
)
SIX_STEP = SimulatedInstrument("cia402-six-step", "drive", "can", _six_step)
ROTOR_ACTUATOR = SimulatedInstrument("cia402-rotor-actuator", "rotor_actuator", "can", _rotor_actuator)
