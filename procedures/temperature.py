"""Copper and magnets at the temperature they were measured at, and at 25 °C."""

from GTC.lib import UncertainReal

from procedures.actions import EnterReading
from procedures.bench import Bench
from procedures.text import text

#: Where every resistance and flux linkage is referred to (°C).
COLD = 25.0


def winding_temperature(bench: Bench, given: float | None) -> float:
    """Return the winding's temperature (°C): as set, else as a person reads it."""
    if given is not None:
        return given
    return bench.reading(EnterReading("winding_temperature", text("the winding's temperature"), "°C", -60.0, 250.0))


def copper_factor(
    measured_at: UncertainReal | float, to: float, coefficient: float, reference: float
) -> UncertainReal | float:
    """Return what takes a resistance from one temperature (°C) to another; `coefficient` (1/K) holds at `reference` (°C)."""
    return (1.0 + coefficient * (to - reference)) / (1.0 + coefficient * (measured_at - reference))


def magnet_factor(measured_at: UncertainReal, coefficient: float) -> UncertainReal:
    """Return what takes a flux linkage from a temperature (°C) to 25 °C; `coefficient` (1/K) is the magnets', about −0.001."""
    return 1.0 / (1.0 + coefficient * (measured_at - COLD))
