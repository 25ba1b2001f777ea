"""The extremes of the inductance while a shaft is turned by hand: both axes without a known angle."""

from dataclasses import dataclass, replace
from statistics import NormalDist

import numpy as np

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.winding.sweep.rotor_sweep import SweepFit, resemblance

#: A turning point is the readings within this share of the swing; a reversal is one beyond this share and so many deviations.
_NEAR, _REVERSAL, _REVERSAL_NOISE = 0.12, 0.1, 6.0
#: Reversals this share of the swing from the extremes are the hand's, not the rotor's.
_INNER = 0.15
#: Readings on the way between the extremes change by more than this share of the swing while they would show a stop.
_STANDING = 0.1
#: Inner levels within this share of the swing come again alike.
_AGAIN = 0.1
#: What a parabola is off at a cosine's crest, share of the amplitude.
_CREST = 0.003
#: A swing below so many deviations of the readings tells no turning point; one that exceeds what the noise of all readings ranges over
#: by fewer than so many hides some of them.
_SWING, _LEGIBLE = 7.0, 4.0
#: Residuals up to so many times the readings' noise, and figures within so many uncertainties, are a fit that agrees.
_NOISE, _AGREE, _ALIKE = 1.3, 3.5, 0.35
_NEEDED = 2
#: A fit with too few turning points to hold it against is worth this many times its uncertainty.
_FEW = 2.0
#: Levels drift beyond so many standard uncertainties, of so many turning points or more.
_DRIFTS, _DRIFTING = 4.0, 5


@dataclass(frozen=True)
class TurningPoints:
    """Levels of maxima and minima, their standard uncertainties, and how often the hand stopped or turned back between.

    `inner` are the levels of maxima (True) and minima that lie too far within the swing to be the rotor's alone, but come again alike, or
    between two of the other kind that do not. `drift` is the rise of all levels from the first reading to the last, where it is beyond
    chance, else 0.
    """

    maxima: FloatArray
    minima: FloatArray
    uncertainty: float
    stops: int
    inner: dict[bool, list[float]]
    drift: float

    @property
    def enough(self) -> bool:
        """True if both axes were passed twice."""
        return min(self.maxima.size, self.minima.size) >= _NEEDED

    @property
    def inner_doubt(self) -> float:
        """Return by how much both axes together would change if the inner levels were the rotor's, as where turning induces a voltage."""
        moved = [
            float(np.mean([*levels, *self.inner[upper]]) - np.mean(levels))
            if levels.size and self.inner[upper]
            else 0.0
            for upper, levels in ((True, self.maxima), (False, self.minima))
        ]
        return float(np.linalg.norm(moved))

    def level(self, which: FloatArray) -> tuple[float, float]:
        """Return the mean level of maxima or minima and its standard uncertainty."""
        spread = float(np.std(which, ddof=1)) if which.size > 1 else 0.0
        return float(np.mean(which)), max(self.uncertainty, spread) / float(np.sqrt(which.size))


def readings_noise(values: FloatArray, resolution: float) -> float:
    """Return the standard deviation of readings by their third differences, in which a slow course does not count."""
    third = np.abs(np.diff(values, 3))
    kept = third[third <= 6.0 * (1.4826 * float(np.median(third)) + resolution)]
    spread = float(np.sqrt(np.mean(kept**2) / 20.0)) if kept.size else 0.0
    return max(spread, resolution / float(np.sqrt(12.0)))


def turning_points(values: FloatArray, noise: float) -> TurningPoints:
    """Return what readings (n,) show of their turning points, those at the ends left out."""
    swing = float(np.ptp(values))
    pivots = _pivots(values, max(_REVERSAL * swing, _REVERSAL_NOISE * noise))
    top, bottom = float(np.max(values)), float(np.min(values))
    levels: dict[bool, list[float]] = {True: [], False: []}
    inner: dict[bool, list[float]] = {True: [], False: []}
    places: dict[bool, list[int]] = {True: [], False: []}
    uncertainties, stops = [0.0], 0
    off = [top - values[place] if upper else values[place] - bottom for place, upper in pivots]
    within = [each > _INNER * swing + 3.0 * noise for each in off]
    for k, (place, upper) in enumerate(pivots):
        if within[k]:
            stops += 1
            between = 0 < k < len(pivots) - 1 and not (within[k - 1] or within[k + 1])
            alike = _AGAIN * swing + _REVERSAL_NOISE * noise
            again = any(
                j != k and kind is upper and within[j] and abs(off[j] - off[k]) < alike
                for j, (_, kind) in enumerate(pivots)
            )
            if between or again:
                inner[upper].append(float(values[place]))
            continue
        level = _vertex(values, place, upper, _NEAR * swing + 2.0 * noise, noise)
        if level is not None:
            levels[upper].append(level[0])
            places[upper].append(place)
            uncertainties.append(level[1])
    maxima, minima = np.array(levels[True]), np.array(levels[False])
    drift = _drift((maxima, minima), (places[True], places[False]), max(uncertainties), values.size)
    return TurningPoints(maxima, minima, max(uncertainties), stops + _standing(values, noise, swing), inner, drift)


def _drift(
    levels: tuple[FloatArray, FloatArray], places: tuple[list[int], list[int]], uncertainty: float, count: int
) -> float:
    """Return by how much maxima and minima rise together from the first of `count` readings to the last; 0 where chance does as much."""
    along = [np.array(each, dtype=np.float64) / max(count - 1, 1) for each in places]
    x = np.concatenate([each - np.mean(each) for each in along if each.size > 1] or [np.zeros(1)])
    y = np.concatenate([each - np.mean(each) for each in levels if each.size > 1] or [np.zeros(1)])
    square = float(x @ x)
    if x.size < _DRIFTING or not square:
        return 0.0
    rise = float(x @ y) / square
    left = y - rise * x
    # Both kinds have a mean of their own.
    spread = max(uncertainty, float(np.sqrt(left @ left / (x.size - 3))))
    return rise if abs(rise) > _DRIFTS * spread / np.sqrt(square) else 0.0


def _pivots(values: FloatArray, reversal: float) -> list[tuple[int, bool]]:
    """Return where the readings turn back by more than a reversal, and whether that is a maximum."""
    result: list[tuple[int, bool]] = []
    high = low = 0
    rising: bool | None = None
    for k, value in enumerate(values):
        high, low = (k if value > values[high] else high), (k if value < values[low] else low)
        if rising is not False and values[high] - value > reversal:
            if rising or (high > 0 and values[high] - values[0] > reversal):
                result.append((high, True))
            rising, low, high = False, k, k
        elif rising is not True and value - values[low] > reversal:
            if rising is False:
                result.append((low, False))
            rising, low, high = True, k, k
        if rising is True:
            low = k
        elif rising is False:
            high = k
    return result


def _vertex(values: FloatArray, place: int, upper: bool, near: float, noise: float) -> tuple[float, float] | None:
    """Return the level of a parabola through the readings near a turning point, and its uncertainty; None where an end is too close."""
    inside = np.abs(values - values[place]) <= near
    begin = end = place
    while begin > 0 and inside[begin - 1]:
        begin -= 1
    while end < values.size - 1 and inside[end + 1]:
        end += 1
    if begin == 0 or end == values.size - 1 or end - begin < 2:
        return None
    x = np.linspace(-1.0, 1.0, end - begin + 1)
    part = values[begin : end + 1]
    design = np.vander(x, 3)
    coefficients, *_ = np.linalg.lstsq(design, part, rcond=None)
    left = part - design @ coefficients
    bent, slope, _ = (float(c) for c in coefficients)
    at = float(np.clip(-0.5 * slope / bent, -1.0, 1.0)) if bent else 0.0
    row = np.array([at**2, at, 1.0])
    scatter = max(noise, float(np.sqrt(left @ left / max(part.size - 3, 1))))
    if (bent > 0.0) is upper:
        # The hand stood there: a mean of the highest (lowest) third tells the level.
        third = np.sort(part if not upper else -part)[: max(part.size // 3, 1)]
        return float(np.mean(third)) * (-1.0 if upper else 1.0), scatter
    return float(row @ coefficients), scatter * float(np.sqrt(row @ np.linalg.pinv(design.T @ design) @ row))


def _standing(values: FloatArray, noise: float, swing: float) -> int:
    """Return how often readings stay alike on the way between the extremes, where a turning shaft changes them most."""
    span, alike = max(5, values.size // 25), max(5.0 * noise, 0.02 * swing)
    if alike > _STANDING * swing or values.size <= span:
        # Noise would pass for standing.
        return 0
    low, high = float(np.min(values)) + 0.25 * swing, float(np.max(values)) - 0.25 * swing
    still = [
        float(np.ptp(part)) < alike and low < float(np.mean(part)) < high
        for part in np.lib.stride_tricks.sliding_window_view(values, span)
    ]
    return int(np.count_nonzero(np.diff(np.concatenate(([0], np.array(still, dtype=np.int8)))) == 1))


def held_to_turning_points(fit: SweepFit, values: FloatArray, resolution: float) -> SweepFit:
    """Return the fit where the readings' turning points agree with it, else figures by the turning points; both told in `misfit`.

    Readings that swing more than they scatter are withheld where neither tells both axes.
    """
    noise = readings_noise(values, resolution)
    left = values - (fit.value("mean") - fit.value("amplitude") * np.cos(fit.course))
    good = float(np.std(left)) <= _NOISE * noise and resemblance(left) < _ALIKE
    swing = float(np.ptp(values))
    if swing < _SWING * noise:
        return fit if good else _by_levels(fit, 0.5 * (np.max(values) + np.min(values)), 0.0, 0.5 * swing, 0.5 * swing)
    points = turning_points(values, noise)
    if good and not (points.stops or swing > noise * (_LEGIBLE + _range_of_noise(values.size))):
        # Turning points that the noise hides are not missing.
        return replace(fit, turns=True)
    findings: list[Finding] = []
    if points.stops:
        findings.append(Finding(Cause.REGRIP, Answer.WIDENED, figures={"count": float(points.stops)}))
    if points.drift:
        findings.append(Finding(Cause.SLOPE, Answer.WIDENED))
    counts: dict[str, float | str] = {"maxima": float(points.maxima.size), "minima": float(points.minima.size)}
    if not (points.maxima.size and points.minima.size) or not (points.enough or good):
        findings = [Finding(Cause.TURNING_POINTS, Answer.WITHHELD, figures=counts), *findings]
        return replace(fit, misfit=Misfit(tuple(findings)), turns=True)
    (high, u_high), (low, u_low) = points.level(points.maxima), points.level(points.minima)
    mean, amplitude = 0.5 * (high + low), 0.5 * (high - low)
    # A parabola is not the cosine's crest, and a hand that stands at it is no parabola.
    own = float(np.hypot(0.5 * np.hypot(u_high, u_low), _CREST * amplitude))
    u_mean, u_amplitude = fit.uncertainty("mean"), fit.uncertainty("amplitude")
    agree = abs(fit.value("mean") - mean) < _AGREE * np.hypot(own, u_mean) and abs(
        fit.value("amplitude") - amplitude
    ) < _AGREE * np.hypot(own, u_amplitude)
    # When on its way a drifting meter was right is not known.
    u_drift, u_inner = 0.5 * points.drift, points.inner_doubt
    beside = np.diag([u_drift**2 + 0.5 * u_inner**2, 0.5 * u_inner**2, 0.0])
    if good and agree and points.enough and not points.stops:
        return replace(fit, covariance=fit.covariance + beside, misfit=Misfit(tuple(findings)), turns=True)
    if good and agree:
        if not points.enough:
            findings.append(Finding(Cause.TURNING_POINTS, Answer.WIDENED, figures=counts))
        covariance = fit.covariance * _FEW**2 + beside
        return replace(fit, covariance=covariance, misfit=Misfit(tuple(findings)), turns=True)
    if not points.enough:
        findings = [Finding(Cause.TURNING_POINTS, Answer.WITHHELD, figures=counts), *findings]
        return replace(fit, misfit=Misfit(tuple(findings)), turns=True)
    if not (findings or agree):
        # A course that the fit does not follow is the hand's; figures that differ by it are something else's.
        findings = [Finding(Cause.UNEXPLAINED, Answer.WIDENED)]
    by_levels = _by_levels(fit, mean, amplitude, own, own)
    return replace(by_levels, covariance=by_levels.covariance + beside, misfit=Misfit(tuple(findings)), turns=True)


def _range_of_noise(count: int) -> float:
    """Return what so many readings of noise range over, in standard deviations."""
    return 2.0 * NormalDist().inv_cdf(1.0 - 0.5 / count)


def _by_levels(fit: SweepFit, mean: float, amplitude: float, u_mean: float, u_amplitude: float) -> SweepFit:
    values, covariance = fit.values.copy(), np.zeros_like(fit.covariance)
    values[:2] = mean, amplitude
    covariance[:2, :2] = np.diag([u_mean**2, u_amplitude**2])
    covariance[2, 2] = fit.covariance[2, 2]
    return replace(fit, values=values, covariance=covariance)
