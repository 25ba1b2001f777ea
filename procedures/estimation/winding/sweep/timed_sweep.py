"""Inductance readings while the shaft is turned slowly by hand: the angle is unknown, the speed not quite constant."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray
from scipy import special

from procedures.estimation.fitting.checks import increasing, same_length, series
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.fitting.nonlinear import minimise
from procedures.estimation.fitting.randomness import chance_of_pattern
from procedures.estimation.winding.sweep.cut_readings import cut_off
from procedures.estimation.winding.sweep.rotor_sweep import SweepFit, resemblance, saliency_significant, sweep_fit
from procedures.estimation.winding.sweep.turning_points import held_to_turning_points
from procedures.estimation.winding.sweep.wild_readings import led_to, named, wild_over_time

ComplexArray = NDArray[np.complex128]
_CHIRPS, _FINE = np.linspace(-0.6, 0.6, 25), 16
#: Degrees of the course that are tried; a hand that wavers several times during the sweep needs the high ones.
_DEGREES = (1, 2, 3, 4, 5, 6, 8, 10, 13, 17, 22, 27, 32, 38, 45, 53, 63)
#: Up to this degree the phase of the analytic signal, which ends short of the sweep's ends, determines a course.
_FOLLOWED = 32
#: So many degrees in a row without a better score, and no higher one is tried, unless what is left still hangs together:
#: neighbouring residuals correlate beyond chance where the course has yet to follow the hand.
_PATIENCE = 5
#: Degrees, as shares of the readings, that are tried where they still hang together, until what is left is random at this chance.
_BEYOND, _RANDOM = (0.28, 0.33, 0.4), 0.01
#: The rotor's voltage is taken out where chance alone would show as much in this share of sweeps.
_CHANCE = 1e-3
_HANGS_TOGETHER = 0.35
#: Weight of a coefficient of the course (rad) against a residual in standard deviations of the readings: too little to move
#: what the readings show, enough to keep a high degree from swinging where they show nothing (an extreme at an end).
_SMOOTH = 2e-3
#: A step of the course below this share of its standard uncertainty is the last one.
_LAST_STEP = 1e-4
#: Fewer periods than this determine no saliency; below this share of the mean there is none to determine.
LEAST_PERIODS, _NOTEWORTHY = 1.6, 2.5e-3
#: Up to this share of the periods that the way has, readings may go with a voltage and not with the rotor, unless they swing by more
#: than this share of their mean: so much no voltage makes.
_TOO_FEW, _BY_VOLTAGE = 0.72, 0.25
#: Over a period or more the amplitude is half the readings' range; much more is a fit that mean and cosine cancel in.
_PLAUSIBLE = 0.6
#: Readings that a first look at a sweep takes, and the degree of its course.
_LOOKED_AT, _LOOK_DEGREE = 64, 5
#: Keeps a normal matrix regular whose course stands still.
_RIDGE = 1e-13


def _scan(x: FloatArray, values: FloatArray) -> tuple[FloatArray, float]:
    """Best course rate·x + chirp·T₂(x) of 2θ, and how many independent courses were compared; x runs from −1 to 1."""
    centred = values - np.mean(values)
    highest = min(0.45 * (values.size - 1), 60.0)
    periods = np.arange(0.7, max(highest, 2.0), 0.2)
    # The rate runs from (1 − chirp) to (1 + chirp) of its mean.
    shapes = x + 0.5 * _CHIRPS[:, None] * (x**2 - 1)
    # Each number of periods is so many times _FINE steps of 0.2 and some steps more: the waves are products of two.
    step = np.exp(0.2j * np.pi * shapes)
    fine = _turning(np.ones_like(step), step, _FINE)
    coarse = _turning(np.exp(0.7j * np.pi * shapes), fine[:, -1] * step, -(-periods.size // _FINE))
    sums = (coarse * centred) @ fine.transpose(0, 2, 1)
    power = np.abs(sums).reshape(_CHIRPS.size, -1)[:, : periods.size]
    chirp, period = np.unravel_index(int(np.argmax(power)), power.shape)
    found = np.pi * periods[period] * np.array([0.0, 1.0, 0.25 * _CHIRPS[chirp]])
    return found, float(periods.size * 0.2 * _CHIRPS.size)


def _turning(first: ComplexArray, turn: ComplexArray, count: int) -> ComplexArray:
    """Return first, first·turn, first·turn², … (m, count, n) for arrays (m, n)."""
    factors = np.repeat(turn[:, None], count, axis=1)
    factors[:, 0] = first
    return np.asarray(np.cumprod(factors, axis=1), dtype=np.complex128)


def _analytic_phase(x: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return places and phase (rad) of the analytic signal away from its ends; it follows a strongly varying speed."""
    even = np.linspace(-1.0, 1.0, x.size)
    centred = np.interp(even, x, values - np.mean(values))
    # Only what turns one way is left of the spectrum (as scipy.signal's hilbert does, which takes half a second to load).
    spectrum = np.fft.fft(centred)
    half = (x.size + 1) // 2
    spectrum[1:half] *= 2.0
    spectrum[x.size // 2 + 1 :] = 0.0
    phase = np.unwrap(np.angle(np.fft.ifft(spectrum)))
    inner = slice(x.size // 12, x.size - x.size // 12)
    return even[inner], np.asarray(phase[inner], dtype=np.float64)


def _refine(x: FloatArray, values: FloatArray, start: FloatArray, degree: int) -> tuple[FloatArray, float]:
    """Refine the course's coefficients (Chebyshev, constant left out), mean and amplitude solved for each."""
    basis = chebyshev.chebvander(x, degree)[:, 1:].T
    begin = np.zeros(degree)
    known = min(degree, start.size - 1)
    begin[:known] = start[1 : known + 1]
    size = float(np.std(values))
    smooth = np.full(degree, _SMOOTH)
    smooth[:2] = 0.0

    def evaluate(c: FloatArray) -> tuple[FloatArray, FloatArray]:
        course = c @ basis
        design, inverse, found = _wave(course, values)
        # What mean and amplitude take up of a change of course does not count.
        slopes = (found[2] * design[1] - found[1] * design[2]) * basis
        slopes -= slopes @ design.T @ inverse @ design
        return np.append((values - found @ design) / size, smooth * c), np.hstack((slopes / -size, np.diag(smooth)))

    found = minimise(evaluate, begin, np.ones(degree), least=_LAST_STEP**2, floor=1e-20, rounds=40)
    return np.append(0.0, found.values), found.cost * size**2


def _hangs_together(x: FloatArray, values: FloatArray, coefficients: FloatArray) -> bool:
    """Return whether each residual resembles its neighbour."""
    return resemblance(_residuals(x, values, coefficients)) > _HANGS_TOGETHER


def _left(x: FloatArray, values: FloatArray, coefficients: FloatArray) -> float:
    """Return what a course leaves of the readings' squares."""
    left = _residuals(x, values, coefficients)
    return float(left @ left)


def _residuals(x: FloatArray, values: FloatArray, coefficients: FloatArray) -> FloatArray:
    design, _, found = _wave(_course(x, coefficients), values)
    return np.asarray(values - found @ design, dtype=np.float64)


def _course(x: FloatArray, coefficients: FloatArray) -> FloatArray:
    return np.asarray(chebyshev.chebval(x, coefficients), dtype=np.float64)


def _wave(course: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return 1, cosine and sine of a course (3, n), the inverse of their normal matrix, and their coefficients in the readings."""
    design = np.array((np.ones_like(course), np.cos(course), np.sin(course)))
    inverse = np.linalg.inv(design @ design.T + _RIDGE * values.size * np.eye(3))
    return design, inverse, inverse @ (design @ values)


def _acceptable(x: FloatArray, values: FloatArray, coefficients: FloatArray) -> bool:
    """Return whether the course never turns back, every period of it was sampled, and the amplitude is one the readings show."""
    course = _course(x, coefficients)
    # From reading to reading, the first and the last left out: beside an extreme at an end, both sides fit as well.
    steps = np.diff(course)
    inner = steps[1:-1] * np.sign(course[-1] - course[0])
    if np.min(inner) <= 0.0 or np.max(np.abs(steps)) >= 0.97 * np.pi:
        return False
    _, cosine, sine = _wave(course, values)[2]
    return bool(np.hypot(cosine, sine) <= _PLAUSIBLE * np.ptp(values))


def _explained(
    x: FloatArray, values: FloatArray, best: FloatArray, largest_degree: int
) -> tuple[FloatArray, FloatArray]:
    """Return readings and a course that leave no pattern, by the rotor's voltage, a more wavering hand, or both; as they are where none
    does.
    """
    # A high degree would bend the course after the voltage, which is therefore looked for first.
    without = _without_emf(x, values, best)
    if not _shows_pattern(x, *without):
        return without
    followed = _followed(x, values, best, largest_degree)
    if not _shows_pattern(x, values, followed):
        return values, followed
    both = _without_emf(x, values, followed)
    return (values, best) if _shows_pattern(x, *both) else both


def _followed(x: FloatArray, values: FloatArray, best: FloatArray, largest_degree: int) -> FloatArray:
    """Return a course that follows a hand through what the `best` one so far has left, or that one where none does.

    Beginning at a good course, a high degree costs a hundredth of a second.
    """
    for share in _BEYOND:
        degree = min(int(share * x.size), largest_degree)
        if degree < best.size:
            continue
        course, _ = _refine(x, values, best, degree)
        if not _shows_pattern(x, values, course) and _acceptable(x, values, course):
            return course
    return best


def _without_emf(x: FloatArray, values: FloatArray, best: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return readings without what the turning rotor's voltage leaves in them, and their course; as they are where it leaves nothing.

    It goes round once where the inductance goes round twice, and grows with the speed.
    """
    course, degree = _course(x, best), best.size - 1
    design, _, found = _wave(course, values)
    basis = chebyshev.chebvander(x, degree)[:, 1:].T
    model = np.vstack((design, (found[2] * design[1] - found[1] * design[2]) * basis))
    speed = chebyshev.chebval(x, chebyshev.chebder(best)) / float(best[1])
    emf = np.vstack((speed * np.cos(0.5 * course), speed * np.sin(0.5 * course)))
    q, _ = np.linalg.qr(model.T)
    left, own = values - q @ (q.T @ values), emf - (emf @ q) @ q.T
    size = np.linalg.lstsq(own.T, left, rcond=None)[0]
    squares, explained = float(left @ left), float((size @ own) @ left)
    freedom = values.size - model.shape[0] - 2
    if freedom < 1 or special.fdtrc(2, freedom, 0.5 * explained / (squares - explained) * freedom) > _CHANCE:
        return values, best
    mended = values - size @ emf
    refined, _ = _refine(x, mended, best, degree)
    return (mended, refined) if _acceptable(x, mended, refined) else (values, best)


def _shows_pattern(x: FloatArray, values: FloatArray, coefficients: FloatArray) -> bool:
    chance = chance_of_pattern(_residuals(x, values, coefficients))
    return chance is not None and chance < _RANDOM


class SweepLook(NamedTuple):
    """The second harmonic at first sight: `fitted` (H, (n,)) and the `periods` of the inductance seen so far; `explained` is the share of
    the readings' squares about their mean.
    """

    fitted: FloatArray
    periods: float
    explained: float


def look_at_sweep(time: ArrayLike, inductance: ArrayLike) -> SweepLook:
    """Return mean and second harmonic along a course of low degree (s, H, shape (n,)), in a few hundredths of a second.

    Raises EstimationError on fewer than 12 readings, and where all are alike.
    """
    t, values = series("time", time, least=12), series("inductance", inductance, least=12)
    same_length(time=t, inductance=values)
    increasing(t)
    squares = float(np.sum((values - np.mean(values)) ** 2))
    if not squares:
        raise EstimationError("all inductance readings are alike")
    x = 2 * (t - t[0]) / (t[-1] - t[0]) - 1
    few = slice(None, None, -(-t.size // _LOOKED_AT))
    course = _course(x, _refine(x[few], values[few], _scan(x[few], values[few])[0], _LOOK_DEGREE)[0])
    design, _, found = _wave(course, values)
    fitted = found @ design
    left = float(np.sum((values - fitted) ** 2))
    return SweepLook(fitted, float(np.ptp(course)) / (2.0 * np.pi), 1.0 - left / squares)


def fit_timed_sweep(
    time: ArrayLike,
    inductance: ArrayLike,
    *,
    largest_degree: int = 128,
    resolution: float = 0.0,
    expected_periods: float | None = None,
) -> SweepFit:
    """Fit L = mean − amplitude·cos(2θ(t) + phase) to readings (H, shape (n,)) of a shaft turned slowly one way.

    θ(t) is a polynomial whose degree the data choose (corrected Akaike criterion), rising all along. At least one
    electrical turn (two periods of L) must be covered. `resolution` is one step of the readings (H); `expected_periods` how many periods
    of L the way that was turned has, where it is known: of half as many nothing is given. Raises
    EstimationError on fewer than 12 readings; a motor without saliency gives an amplitude that is not significant, or a small one
    of fewer periods: the induced voltage goes round once where the inductance goes round twice. The fit is held against the readings'
    turning points, see `misfit`.
    """
    t, values = series("time", time, least=12), series("inductance", inductance, least=12)
    same_length(time=t, inductance=values)
    increasing(t)
    if np.ptp(values) == 0:
        raise EstimationError("all inductance readings are alike; check that the meter triggers anew for each reading")
    cut = cut_off(values, resolution)
    wild = wild_over_time(values, resolution)[: 0 if cut else None]
    odd = named(wild, values, led_to(values))
    t, values = np.delete(t, wild), np.delete(values, wild)
    x = 2 * (t - t[0]) / (t[-1] - t[0]) - 1
    scanned, tried = _scan(x, values)
    n = t.size
    places, phase = _analytic_phase(x, values)
    degrees = [degree for degree in _DEGREES if degree <= min(largest_degree, n // 3)]
    # One decomposition serves the polynomials of all degrees: its leading part is that of a lower one.
    q, r = np.linalg.qr(chebyshev.chebvander(places, max(d for d in degrees if d <= _FOLLOWED)))
    along = phase @ q
    best_score, best = np.inf, scanned[:2]
    course, worse = scanned, 0
    for degree in degrees:
        starts = [scanned if degree <= 2 else course]
        if degree <= _FOLLOWED:
            starts.append(np.linalg.solve(r[: degree + 1, : degree + 1], along[: degree + 1]))
        begin = min(starts, key=lambda start: _left(x, values, start[: degree + 1]))
        course, squares = _refine(x, values, begin, degree)
        parameters = degree + 4
        floor = n * resolution**2 / 12.0 + 1e-24 * float(values @ values)
        score = n * np.log((squares + floor) / n) + 2 * parameters * n / (n - parameters - 1)
        if score < best_score - 1e-9 and _acceptable(x, values, course):
            best_score, best, worse = float(score), course, 0
        elif not _hangs_together(x, values, course):
            worse += 1
        if worse >= _PATIENCE and degree > 6:
            break
    if _shows_pattern(x, values, best):
        values, best = _explained(x, values, best, largest_degree)
    degree = best.size - 1
    fit = sweep_fit(chebyshev.chebval(x, best), values, chebyshev.chebvander(x, degree)[:, 1:], tried, resolution)
    noteworthy = fit.value("amplitude") > _NOTEWORTHY * fit.value("mean")
    if fit.periods < LEAST_PERIODS and noteworthy and saliency_significant(fit)[0]:
        raise EstimationError(
            f"the readings show only {fit.periods:.1f} periods of the inductance; turn the shaft over at least one electrical "
            "turn (two periods) during the sweep"
        )
    held = held_to_turning_points(fit, values, resolution)
    # Readings that swing by more than their scatter do so whether or not a cosine follows them.
    others = (*cut, *odd, *_by_voltage(held, values, expected_periods))
    return replace(held, misfit=Misfit((*others, *held.misfit.findings)), left_out=tuple(wild.tolist()))


def _by_voltage(fit: SweepFit, values: FloatArray, expected: float | None) -> tuple[Finding, ...]:
    """Return the finding of readings that swing half as often as the rotor's inductance would: as a voltage does that turning induces."""
    if expected is None or fit.periods > _TOO_FEW * expected or not saliency_significant(fit)[0]:
        return ()
    swing = float(np.ptp(values)) / float(np.mean(values))
    if swing > _BY_VOLTAGE:
        return ()
    figures: dict[str, float | str] = {
        "periods": fit.periods,
        "expected": expected,
        "swing": swing,
        "record": "hand-sweep",
    }
    return (Finding(Cause.WRONG_PERIOD, Answer.WITHHELD, figures=figures),)
