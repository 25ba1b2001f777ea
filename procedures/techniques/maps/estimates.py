"""From a map's readings to its estimate."""

from dataclasses import replace

import numpy as np

from procedures.estimation.flux.estimator import FluxMapEstimate, estimate_flux_map
from procedures.estimation.flux.flux_map import TRUSTED_DELAY, GainLimits
from procedures.estimation.flux.readings import FluxReadings
from procedures.estimation.flux.session_ties import BrokenTie, broken_tie
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
    return estimate_flux_map(_readings_of(taken), gains=gains_of(taken), wanted=taken.planned, symmetric=symmetric)


def joined(taken: MapReadings, *, symmetric: bool | None) -> tuple[MapReadings, FluxMapEstimate, BrokenTie | None]:
    """Return the readings that count of all sessions with their map; where sessions contradict each other those of the session that has
    most, their map and the contradiction.

    A last session that was left before anything tied it to the others is left out without a word: its readings are those of the ties.
    Raises EstimationError where the readings are too few, or no motor's.
    """
    if np.unique(taken.sessions).size < 2:
        made = estimate_of(taken, symmetric=symmetric)
        return _kept(taken, made), made, None
    last = int(np.max(taken.sessions))
    if not _is_tied(taken, last):
        earlier = [point for point in taken.points if point.session != last]
        return joined(replace(taken, points=earlier), symmetric=symmetric)
    made = estimate_of(taken, symmetric=symmetric)
    taken = _kept(taken, made)
    broken = broken_tie(_readings_of(taken), symmetric=made.symmetric, gains=gains_of(taken), wanted=taken.planned)
    if broken is None:
        return taken, made, None
    most = max(range(last + 1), key=lambda session: np.count_nonzero(taken.sessions == session))
    alone = replace(taken, points=taken.of_session(most).points)
    made = estimate_of(alone, symmetric=symmetric)
    return _kept(alone, made), made, broken


def _kept(taken: MapReadings, made: FluxMapEstimate) -> MapReadings:
    """Return the readings that the map is of: without repeats that contradict the others of their location."""
    return replace(taken, points=[point for point, kept in zip(taken.points, made.kept, strict=True) if kept])


def _is_tied(taken: MapReadings, session: int) -> bool:
    """Tell whether a session has zero current at both speeds, and two currents that were read before it."""
    own: set[tuple[float, float]] = set()
    before: set[tuple[float, float]] = set()
    for point in taken.points:
        if point.session <= session:
            (own if point.session == session else before).add((point.planned.i_d, point.planned.i_q))
    at_rest = {
        point.planned.direction
        for point in taken.points
        if point.session == session and not (point.planned.i_d or point.planned.i_q)
    }
    return len(at_rest) > 1 and len(own & before - {(0.0, 0.0)}) > 1


def _readings_of(taken: MapReadings) -> FluxReadings:
    return FluxReadings.of(**{name: taken.column(field) for name, field in _COLUMNS.items()}, session=taken.sessions)


def gains_of(taken: MapReadings) -> GainLimits:
    """Return the limits of the gains and of the delay that all readings share."""
    last = taken.points[-1].reading
    return GainLimits(last.voltage_accuracy.gain, last.current_accuracy.gain, delay=TRUSTED_DELAY)
