"""The flux map that readings at constant speed give, and what they show beyond its model."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, fdtrc, ndtri

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.flux.flux_map import GainLimits, MeasuredFluxMap
from procedures.estimation.flux.map_fit import MapFit, fit_map
from procedures.estimation.flux.odd_location import least_foreseen, odd_location
from procedures.estimation.flux.readings import FluxReadings, locations_of
from procedures.estimation.flux.repeats import Contradiction, contradiction, rough_contradiction, rough_repeats

#: A residual variance this unlikely is told, one this unlikely lets the intervals grow.
_TOLD, _WIDENED = 1e-4, 0.02
#: Symmetry is given up where so unlikely a part of the residuals goes with it, and is more than this share of the largest flux linkage.
_ASYMMETRIC, _SEEN_SHARE = 1e-6, 1e-3
#: Locations read at both signs of i_q that a judgement of the symmetry takes.
_LEAST_PAIRS = 6
#: A single reading this far beyond its neighbours' noise (standard deviations) is told.
_ODD_READING = 5.0
#: From so many of them on it is no slip of one: what is read once may be off as far, which no residual shows, and the worst lies within
#: so many standard deviations of the intervals.
_MANY_ODD, _WITHIN = 2, 2.0
#: Without a current (share of the largest); and what the inverter's angle may be off by (rad, electrical).
_NO_CURRENT, _FAR = 0.002, np.radians(4.0)
#: Flux linkages without a current that show an angle are so many times as large as their scatter.
_SEEN = 20.0
#: So many locations are worth reading again.
_AGAIN = 6
#: Noise that is taken at first where none is stated, in shares of the largest voltage.
_NOISE = 5e-4


@dataclass(frozen=True)
class OddPart:
    """The part that breaks the symmetry at a location (A): odd part of ψ_d and even part of ψ_q (V·s), with standard
    uncertainties.
    """

    i_d: float
    i_q: float
    psi_d: float
    psi_q: float
    u_psi_d: float
    u_psi_q: float


@dataclass(frozen=True)
class FluxMapEstimate:
    """A flux map with how it was found: the least squares behind it, odd parts where it was read on both sides, and its misfit.

    `symmetry_tested` says whether enough locations were read at both signs of i_q to judge it by. `kept` (n,) are the readings that the
    map is of: a repeat that contradicts the others of its location is left out. `doubtful` are the readings, counted among those kept, that
    contradict a repeat while nothing says which of the two is right.
    """

    map: MeasuredFluxMap
    fit: MapFit
    symmetric: bool
    symmetry_tested: bool
    odd_parts: Sequence[OddPart]
    misfit: Misfit
    kept: NDArray[np.bool_]
    doubtful: Sequence[int] = ()

    def least_foreseen(self) -> list[int]:
        """Return the readings, among those kept, that are worth taking again: read once, and least foreseen by the others."""
        of = self.fit.locations.of
        return [int(np.flatnonzero(of == place)[0]) for place in least_foreseen(self.fit)[:_AGAIN]]


def estimate_flux_map(
    readings: FluxReadings,
    *,
    gains: GainLimits | None = None,
    wanted: FloatArray | None = None,
    symmetric: bool | None = None,
) -> FluxMapEstimate:
    """Estimate ψ_d and ψ_q at each location by one weighted least squares of all readings.

    `gains` are the limits of what all readings share; `wanted` (n, 2) the currents (A) that were asked for, at which the map is given, with
    the magnet as it was at the first reading. Where the symmetry (ψ_d even, ψ_q odd in i_q) is not stated by
    `symmetric` it is taken, and given up where readings on both sides contradict it.
    Raises EstimationError where the readings do not determine a map.
    """
    kept = np.ones(readings.time.size, dtype=np.bool_)
    asked = None if wanted is None else np.asarray(wanted, dtype=np.float64)
    told: list[tuple[Contradiction, tuple[float, float]]] = []
    while True:
        taken, at = readings.those(kept), None if asked is None else asked[kept]
        locations = locations_of(taken, symmetric=False, wanted=at)
        first = rough_repeats(taken, locations)
        if first is not None:
            alone = _estimate(taken.those(first), gains, None if at is None else at[first], symmetric)
            found = rough_contradiction(alone.fit, first, taken, locations)
        if first is None or found is None:
            made = _estimate(taken, gains, at, symmetric)
            locations = made.fit.locations
            found = contradiction(made.fit, taken)
        if found is None:
            break
        current = locations.points[found.place]
        numbers = np.flatnonzero(kept)[found.left_out]
        told.append((replace(found, left_out=numbers), (float(current[0]), float(current[1]))))
        kept[numbers] = False
    covariance, findings, doubtful = made.map.covariance, [], []
    for each, at_current in told:
        if np.any(each.apart):
            folded = np.array([at_current[0], abs(at_current[1])]) if made.symmetric else np.array(at_current)
            place = int(np.argmin(np.hypot(*(made.map.points - folded).T)))
            covariance = each.widened(covariance, place)
            doubtful.append(int(np.flatnonzero(made.fit.locations.of == place)[0]))
        findings += [_odd_reading(readings, int(k), each.score) for k in each.left_out]
    grown = replace(made.map, covariance=covariance)
    others = [_renumbered(each, np.flatnonzero(kept)) for each in made.misfit.findings]
    return replace(
        made,
        map=grown,
        fit=replace(made.fit, map=grown),
        kept=kept,
        misfit=Misfit((*findings, *others)),
        doubtful=doubtful,
    )


def _renumbered(finding: Finding, numbers: NDArray[np.intp]) -> Finding:
    """Return a finding with the reading's number among all readings, those left out counted."""
    if "number" not in finding.figures:
        return finding
    return replace(
        finding, figures={**finding.figures, "number": float(numbers[int(finding.figures["number"]) - 1] + 1)}
    )


def _estimate(
    readings: FluxReadings,
    gains: GainLimits | None,
    wanted: FloatArray | None,
    symmetric: bool | None,
) -> FluxMapEstimate:
    """Return the map of readings that count all."""
    for own in readings.sessions():
        _check_angle(readings.those(own), None if wanted is None else wanted[own])
    stated = readings.noise_stated
    if not stated:
        readings = replace(
            readings, voltage_noise=np.full(readings.time.size, _NOISE * float(np.max(np.abs(readings.voltage))))
        )
    fits: dict[bool, MapFit] = {}

    def fitted(even: bool, noisy: FluxReadings, *, unsure: bool = False) -> MapFit:
        return fit_map(noisy, symmetric=even, gains=gains, wanted=wanted, unsure=unsure)

    # Between sessions magnets and gains move readings farther than within one: then what the surface is not known to counts here too.
    several = bool(np.any(readings.session))
    pairs = _pairs(readings, wanted)
    tested = symmetric is None and len(pairs) >= _LEAST_PAIRS
    for even in (True, False) if tested else ((symmetric is not False),):
        try:
            fits[even] = fitted(even, readings, unsure=several)
        except EstimationError:
            # On a motor far from symmetric the symmetric fit finds no end.
            if not (tested and even):
                raise
    if not stated:
        # The model with the most freedom says what the noise is.
        ratio = fits[min(fits)].variance_ratio
        readings = replace(readings, voltage_noise=readings.voltage_noise * np.sqrt(ratio))
        fits = {even: fitted(even, readings, unsure=several) for even in fits}
    odd_parts = _odd_parts(fits[False]) if False in fits else []
    even = True in fits and not (tested and _contradicted(fits, odd_parts))
    fit = fitted(even, readings, unsure=True)
    findings: list[Finding] = []
    if tested and not even:
        worst = max(odd_parts, key=lambda each: np.hypot(each.psi_d, each.psi_q))
        size = float(np.hypot(worst.psi_d, worst.psi_q))
        findings.append(
            Finding(
                Cause.ASYMMETRIC_MAP, Answer.MODELLED, ("flux_map",), size / float(np.hypot(worst.u_psi_d, worst.u_psi_q)),
                {"odd": size, "share": size / fit.map.full_scale, "i_d": worst.i_d, "i_q": worst.i_q},
            )
        )  # fmt: skip
    growth = 1.0
    if stated:
        ratio, freedom = fit.variance_ratio, fit.degrees_of_freedom
        chance = float(chdtrc(freedom, fit.cost))
        growth = ratio if chance < _WIDENED else 1.0
        if chance < _TOLD:
            findings.append(
                Finding(Cause.RESIDUAL_VARIANCE, Answer.WIDENED, ("flux_map",), float(-ndtri(max(chance, 1e-300))), {
                    "ratio": ratio
                })
            )  # fmt: skip
    odd = _odd_readings(readings, fit, growth)
    if len(odd) >= _MANY_ODD:
        growth *= (max(finding.score for finding in odd) / _WITHIN) ** 2
    findings += odd
    by_sessions = None if fit.map.by_sessions is None else fit.map.by_sessions * growth
    covariance = fit.map.covariance * growth
    if (alone := odd_location(fit)) is not None:
        covariance = alone.widened(covariance)
        findings.append(_odd_reading(readings, alone.reading, alone.score))
    grown = replace(fit.map, covariance=covariance, by_sessions=by_sessions)
    every = np.ones(readings.time.size, dtype=np.bool_)
    return FluxMapEstimate(grown, replace(fit, map=grown), even, tested, odd_parts, Misfit(tuple(findings)), every)


def _check_angle(readings: FluxReadings, wanted: FloatArray | None) -> None:
    """Raise EstimationError where the voltages without a current show the d axis far from the magnet: the currents then lie elsewhere than
    they are said to, by more than a surface through them tells.
    """
    asked = readings.current if wanted is None else wanted[:, 0] + 1j * wanted[:, 1]
    none = np.abs(asked) <= _NO_CURRENT * readings.largest_current
    flux = readings.voltage / (1j * readings.electrical_speed)
    ways = [flux[none & (np.sign(readings.electrical_speed) == sign)] for sign in (-1.0, 1.0)]
    if not all(way.size for way in ways):
        return
    seen = min(abs(np.mean(way)) for way in ways)
    if seen <= _SEEN * float(np.max([np.std(way) for way in ways])):
        # A motor with hardly a magnet has no angle.
        return
    # A delay of the voltages turns them the other way at the other sign of the speed.
    late = [float(np.angle(np.sum(way))) for way in ways]
    ahead = -0.5 * (late[0] + late[1])
    if abs(ahead) > _FAR:
        raise EstimationError(
            f"without a current the voltages show that the inverter's d axis leads the magnet by {np.degrees(ahead):.1f}° electrical: the "
            f"currents are not those that are asked for. Calibrate the inverter's angle (the offset of its encoder, the commutation angle) "
            f"to within {np.degrees(_FAR):.0f}°, and read again"
        )


def _pairs(readings: FluxReadings, wanted: FloatArray | None) -> list[int]:
    """Return the locations that were read at both signs of i_q, and at both signs of the speed on one side."""
    locations = locations_of(readings, symmetric=True, wanted=wanted)
    result = []
    for place in range(len(locations.points)):
        here = locations.of == place
        sides = locations.mirrored[here]
        if locations.points[place, 1] > 0.0 and np.any(sides) and not np.all(sides):
            result.append(place)
    return result


def _odd_parts(fit: MapFit) -> list[OddPart]:
    """Return what breaks the symmetry where a free map has both of a pair."""
    points, flux, covariance = fit.map.points, fit.map.flux, fit.map.covariance
    near = 0.02 * fit.map.largest_current
    result = []
    for k in np.flatnonzero(points[:, 1] > near):
        apart = np.hypot(points[:, 0] - points[k, 0], points[:, 1] + points[k, 1])
        m = int(np.argmin(apart))
        if apart[m] > near:
            continue
        d, q = np.zeros(flux.size), np.zeros(flux.size)
        d[2 * k], d[2 * m] = 0.5, -0.5
        q[2 * k + 1] = q[2 * m + 1] = 0.5
        spread = [float(np.sqrt(max(float(each @ covariance @ each), 0.0))) for each in (d, q)]
        values = flux.ravel()
        result.append(
            OddPart(
                float(points[k, 0]), float(points[k, 1]), float(d @ values), float(q @ values), spread[0], spread[1]
            )
        )
    return result


def _contradicted(fits: dict[bool, MapFit], odd_parts: Sequence[OddPart]) -> bool:
    """Tell whether the readings are better off without the symmetry than chance allows, by more than nothing."""
    even, free = fits[True], fits[False]
    more = even.degrees_of_freedom - free.degrees_of_freedom
    if more < 1 or not odd_parts:
        return False
    gained = (even.cost - free.cost) / more / max(free.variance_ratio, 1.0)
    largest = max(np.hypot(each.psi_d, each.psi_q) for each in odd_parts)
    unlikely = float(fdtrc(more, free.degrees_of_freedom, gained)) < _ASYMMETRIC
    return unlikely and bool(largest > _SEEN_SHARE * free.map.full_scale)


def _odd_readings(readings: FluxReadings, fit: MapFit, growth: float) -> list[Finding]:
    """Return what is told of single readings that lie far off what all others say."""
    size = np.abs(fit.residuals.reshape(-1, 2)).max(axis=1) / np.sqrt(growth)
    return [_odd_reading(readings, int(k), float(size[k])) for k in np.flatnonzero(size > _ODD_READING)]


def _odd_reading(readings: FluxReadings, k: int, score: float) -> Finding:
    figures: dict[str, float | str] = {
        "number": float(k + 1),
        "i_d": float(readings.i_d[k]),
        "i_q": float(readings.i_q[k]),
    }
    return Finding(Cause.ODD_READING, Answer.WIDENED, ("flux_map",), score, figures)
