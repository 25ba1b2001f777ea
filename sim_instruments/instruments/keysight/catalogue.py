"""The simulated instruments of Keysight."""

from typing import Any

from sim_instruments.catalogue import BenchPlace, Options, SimulatedInstrument
from sim_instruments.world.fixture.layout import MODULES
from sim_instruments.world.machine_data import SupplyStage


def _output(options: Options) -> int:
    """Return the output that goes to the motor."""
    return int(options.get("channel", 1))


def _stage(options: Options) -> SupplyStage:
    """Return an output of the E36313A; the load regulation of output 1, 2 mV over 10 A, is its output resistance."""
    from sim_instruments.instruments.keysight.e36300.output import RATINGS

    rating = RATINGS[_output(options)]
    return SupplyStage(
        maximum_voltage=rating.voltage * 1.01, maximum_current=rating.current * 1.01, output_resistance=2.0e-4
    )


def _ratings(options: Options) -> dict[str, float]:
    from sim_instruments.instruments.keysight.e36300.output import RATINGS

    rating = RATINGS[_output(options)]
    return {"maximum_voltage": rating.voltage, "maximum_current": rating.current}


def _supply(place: BenchPlace) -> Any:
    from sim_instruments.instruments.keysight.e36300.supply import KeysightE36313A

    wired = _output(place.options) if place.connected else None
    return KeysightE36313A(place.world, place.generator, place.errors, wired=wired)


def _lcr_meter(place: BenchPlace) -> Any:
    from sim_instruments.instruments.keysight.e4980a.lcr_meter import KeysightE4980A

    return KeysightE4980A(place.world, place.generator, place.errors)


def _oscilloscope(place: BenchPlace) -> Any:
    from sim_instruments.instruments.keysight.infiniivision.oscilloscope import KeysightInfiniiVision

    return KeysightInfiniiVision(place.world, place.generator, place.errors)


def _voltmeter(place: BenchPlace) -> Any:
    from sim_instruments.instruments.keysight.dmm_34461a.multimeter import Keysight34461A

    return Keysight34461A(place.world, place.generator, place.errors)


def _switch_unit(place: BenchPlace) -> Any:
    from sim_instruments.instruments.keysight.switch_unit_34970a import Keysight34970A

    if place.contacts is None:
        raise ValueError("this bench has no switch_matrix; make it with fixture=True")
    return Keysight34970A(place.world, place.generator, place.contacts, MODULES)


E36313A = SimulatedInstrument(
    "keysight-e36313a",
    "supply",
    "visa",
    _supply,
    machine=_stage,
    ratings=_ratings,
    model="output {channel} of an E36313A",
)
E4980A = SimulatedInstrument("keysight-e4980a", "lcr_meter", "visa", _lcr_meter)
INFINIIVISION = SimulatedInstrument("keysight-infiniivision", "oscilloscope", "visa", _oscilloscope)
DMM_34461A = SimulatedInstrument("keysight-34461a", "voltmeter", "visa", _voltmeter)
SWITCH_UNIT_34970A = SimulatedInstrument("keysight-34970a", "switch_matrix", "visa", _switch_unit)
