"""The simulated instruments of GW Instek."""

from typing import Any

from sim_instruments.catalogue import BenchPlace, SimulatedInstrument


def _tester(place: BenchPlace) -> Any:
    from sim_instruments.instruments.gwinstek.gpt9800 import Gpt9800

    return Gpt9800(place.world, place.generator, place.errors)


GPT9800 = SimulatedInstrument("gwinstek-gpt9800", "insulation_tester", "visa", _tester)
