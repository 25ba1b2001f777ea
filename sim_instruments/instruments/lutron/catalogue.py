"""The simulated instruments of Lutron."""

from typing import Any

from sim_instruments.catalogue import BenchPlace, SimulatedInstrument


def _tachometer(place: BenchPlace) -> Any:
    from sim_instruments.instruments.lutron.tachometer import LutronTachometer

    return LutronTachometer(place.world, place.generator, place.errors)


TACHOMETER = SimulatedInstrument("lutron-tachometer", "tachometer", "serial", _tachometer)
