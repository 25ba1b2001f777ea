"""The simulated instruments of mjbots."""

from typing import Any

from sim_instruments.catalogue import BenchPlace, Options, SimulatedInstrument
from sim_instruments.world.machine_data import InverterStage

#: A moteus-n1: its PWM (Hz), its legs' dead time (s) and transistors (Ω), and the current (A) below which dead time fades.
_PWM, _DEAD_TIME, _RESISTANCE, _KNEE = 30_000.0, 1.0e-7, 3.0e-3, 0.3
#: The share of a period that its current measurement leaves for the voltage (`RateConfig` in `fw/bldc_servo_control.h`).
_MODULATION = 1.0 - 2.0 * 0.6e-6 / (0.5 / _PWM)
#: Hz/s: what turns a field in open loop here has no ramp of the drive's own.
_RAMP = 20.0


def _stage(options: Options) -> InverterStage:
    usual = InverterStage()
    frequency, highest = options.get("maximum_frequency"), options.get("maximum_voltage")
    return InverterStage(
        dc_voltage=options.get("dc_voltage") or min(usual.dc_voltage, highest or usual.dc_voltage),
        maximum_current=options.get("maximum_current") or usual.maximum_current,
        maximum_frequency=frequency or usual.maximum_frequency,
        frequency_ramp=max(_RAMP, frequency / 50.0) if frequency else usual.frequency_ramp,
        switching_frequency=_PWM,
        dead_time=_DEAD_TIME,
        device_resistance=_RESISTANCE,
        knee_current=_KNEE,
        modulation=_MODULATION,
    )


def _inverter(place: BenchPlace) -> Any:
    from sim_instruments.instruments.mjbots.moteus import SimulatedMoteus

    return SimulatedMoteus(place.world, place.generator, place.errors, node=place.node, options=place.options)


#: Options `dc_voltage` (V, of its bus; 48 V, or what `maximum_voltage` says where that is less) and `conf` (the configuration's items
#: by name) say how it is set up.
MOTEUS = SimulatedInstrument("mjbots-moteus", "inverter", "can-fd", _inverter, machine=_stage)
