"""Copper and magnets at the temperature they were measured at, and at 25 °C."""

from GTC.lib import UncertainReal

from drivers.interfaces.text import text
from procedures.core.actions import EnterReading
from procedures.core.bench import Bench, ProcedureError
from procedures.core.budget import Uncertainties
from procedures.core.nameplate import Nameplate
from procedures.techniques.temperature_settings import COLD

#: By which share the temperature coefficient of the remanence differs between grades of one magnet material.
MAGNET_SPREAD = 0.3


def winding_temperature(bench: Bench, nameplate: Nameplate, given: float | None, half_width: float) -> UncertainReal:
    """Return the winding's temperature (°C), known within ± `half_width` (K): as set, as last read, else as a person reads it now.

    Raises ProcedureError where it is above the motor's.
    """
    now = bench.clock.now()
    known = bench.thermometer.known(now) if given is None else given
    if known is None:
        asked = EnterReading("winding_temperature", text("the winding's temperature"), "°C", -60.0, 250.0)
        known = bench.reading(asked)
    return bench.thermometer.take(check_temperature(nameplate, known), half_width, now)


def check_temperature(nameplate: Nameplate, temperature: float) -> float:
    """Return a winding's temperature (°C). Raises ProcedureError where it is above the motor's."""
    limit = nameplate.maximum_winding_temperature
    if limit is not None and temperature > limit:
        raise ProcedureError(
            text(
                "winding temperature = {temperature:.4g} °C is above {limit:.4g} °C, the limit of the motor "
                "(nameplate.maximum_winding_temperature); let it cool",
                temperature=temperature,
                limit=limit,
            )
        )
    return temperature


def warmed(temperature: float, rise: float, coefficient: float, reference: float) -> float:
    """Return the temperature (°C) of copper whose resistance rose by `rise` (relative) from what it was at `temperature`.

    `coefficient` (1/K) holds at `reference` (°C).
    """
    return temperature + rise * (1.0 / coefficient + temperature - reference)


def magnet_factor(
    uncertainties: Uncertainties, measured_at: UncertainReal, coefficient: float, half_width: float | None = None
) -> UncertainReal:
    """Return what takes a flux linkage from a temperature (°C) to 25 °C.

    `coefficient` (1/K) is the magnets', about −0.001, known within ± `half_width`, or within the spread of NdFeB grades.
    """
    known = abs(coefficient) * MAGNET_SPREAD if half_width is None else half_width
    magnets = uncertainties.limit("magnets' temperature coefficient", coefficient, known)
    factor: UncertainReal = 1.0 / (1.0 + magnets * (measured_at - COLD))
    return factor
