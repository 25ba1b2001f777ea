"""From a map's readings to its estimate."""

from procedures.estimation.flux.estimator import FluxMapEstimate, estimate_flux_map
from procedures.estimation.flux.flux_map import TRUSTED_DELAY, GainLimits
from procedures.estimation.flux.readings import FluxReadings
from procedures.techniques.maps.readings import MapReadings

_COLUMNS = {
    "time": "time",
    "i_d": "d_current",
    "i_q": "q_current",
    "u_d": "d_voltage",
    "u_q": "q_voltage",
    "electrical_speed": "electrical_speed",
}


def estimate_of(taken: MapReadings, *, symmetric: bool | None) -> FluxMapEstimate:
    """Return the map of what was read; `symmetric` says whether ψ_d is even and ψ_q odd in i_q, None that it is tested.

    Raises EstimationError where the readings are too few, or no motor's.
    """
    readings = FluxReadings.of(**{name: taken.column(field) for name, field in _COLUMNS.items()})
    return estimate_flux_map(readings, gains=gains_of(taken), wanted=taken.planned, symmetric=symmetric)


def gains_of(taken: MapReadings) -> GainLimits:
    """Return the limits of the gains and of the delay that all readings share."""
    last = taken.points[-1].reading
    return GainLimits(last.voltage_accuracy.gain, last.current_accuracy.gain, delay=TRUSTED_DELAY)
