"""Flux linkage by integrating a turning machine's voltage, which needs no constant speed (§3.4)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.emf.agreement import Combined, combine, judged
from procedures.estimation.emf.harmonics import HarmonicModel, at_full_rate, fit_harmonics, thin
from procedures.estimation.emf.phase_jumps import find_jump, longest_whole, with_jump
from procedures.estimation.emf.record import DigitizedChannel, channels_told, colour, prepare, start, usable
from procedures.estimation.emf.record_preparation import as_recorded, prepare_record, rounding, too_coarse
from procedures.estimation.emf.speed_ripple import most_degree, rippling_courses
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import NO_MISFIT, Misfit
from procedures.estimation.fitting.repeated_rows import repeated_rows

#: Rounds in which the course of a speed that ripples is refined.
_ROUNDS = 4


@dataclass(frozen=True)
class FluxEstimate:
    """Flux linkage of the fundamental by integrating the voltage over whole periods, speed drift or not (V·s/rad, peak).

    `values` (C,) with `uncertainties` and `degrees_of_freedom`; `per_period` (C, P) each whole period's own;
    `period_frequencies` (P,) in Hz; `offsets` (C,) in V.
    `flux_linkage` is the mean over channels, `misfit` what the record shows beyond the model, the channels' agreement included.
    """

    values: FloatArray
    uncertainties: FloatArray
    degrees_of_freedom: float
    per_period: FloatArray
    period_frequencies: FloatArray
    offsets: FloatArray
    drift: float
    drift_uncertainty: float
    model: HarmonicModel
    flux_linkage: Combined
    misfit: Misfit = NO_MISFIT

    def mean(self) -> tuple[float, float]:
        """Return the mean over channels and its standard uncertainty (V·s/rad)."""
        return self.flux_linkage.value, self.flux_linkage.uncertainty


def _drifting_model(
    t: FloatArray, v: FloatArray, kept: tuple[int, ...], begin: FloatArray, largest_degree: int
) -> HarmonicModel:
    """Phase polynomial of the degree that Bayes' criterion chooses, grown from constant speed and from a grid of drifts."""
    starts = [fit_harmonics(t, v, kept, begin)]
    for drift in (-0.3, -0.15, 0.15, 0.3):
        try:
            starts.append(fit_harmonics(t, v, kept, np.array([0.0, begin[1], begin[1] * drift / 8])))
        except EstimationError:
            continue

    def cost(model: HarmonicModel) -> float:
        rms = np.mean(model.residuals**2, axis=1) + 1e-24 * np.var(v, axis=1)
        return float(t.size * np.sum(np.log(rms)) + (model.course.size - 1) * np.log(v.size))

    best = min(starts, key=cost)
    model = best
    # Few periods show no ripple of their own; their course is grown as long as that explains more.
    most = most_degree(float(begin[1]) / np.pi)
    while model.course.size <= largest_degree or (model is best and model.course.size <= most):
        try:
            model = fit_harmonics(t, v, kept, np.append(model.course, 0.0))
        except EstimationError:
            break
        speed = model.speed(t)
        if cost(model) < cost(best) and np.min(speed) > 0.1 * np.max(speed):
            best = model
    for _ in range(_ROUNDS):
        nearer = _nearest(t, v, kept, best, cost)
        if nearer is None:
            break
        best = nearer
    return best


def _nearest(
    t: FloatArray, v: FloatArray, kept: tuple[int, ...], model: HarmonicModel, cost: Callable[[HarmonicModel], float]
) -> HarmonicModel | None:
    """Return the first of the courses of a rippling speed with which a fit converges and costs less; None without one."""
    for course in rippling_courses(t, v, kept, model):
        try:
            found = fit_harmonics(t, v, kept, course)
        except EstimationError:
            continue
        speed = found.speed(t)
        if cost(found) < cost(model) and np.min(speed) > 0.1 * np.max(speed):
            return found
    return None


def _jump(t: FloatArray, v: FloatArray, kept: tuple[int, ...], course: FloatArray, highest: float) -> int | None:
    """Return the sample where the phase jumps; a course of a higher degree would bend along with it."""
    few_t, few_v, block = thin(t, v, highest)
    at = find_jump(few_t, kept, fit_harmonics(few_t, few_v, kept, course))
    return None if at is None else at * block


def flux_by_integration(
    time: ArrayLike,
    channels: ArrayLike,
    *,
    harmonics: Sequence[int] = (1, 3, 5, 7),
    frequency: float | None = None,
    largest_degree: int = 6,
    resolution: float | Sequence[float] = 0.0,
    digitized: Sequence[DigitizedChannel] = (),
) -> FluxEstimate:
    """Integrate the voltages (C, n), V, over each whole period, offsets removed: ψ₁ = |∫ v·exp(−j·φ(t)) dt| / π.

    As ∫ v dt is the flux itself, the speed need not be known or constant; only the angle φ(t) is taken from the waveform, as a
    polynomial of up to `largest_degree`, of more where the speed ripples. `digitized` and `resolution` are those of `fit_back_emf`.
    Raises EstimationError where the record holds no whole period.
    """
    t, v = prepare(time, channels, digitized)
    if (repeated := repeated_rows(v)) is not None:
        of_new = flux_by_integration(
            repeated.times(t),
            v[:, repeated.new],
            harmonics=harmonics,
            frequency=frequency,
            largest_degree=largest_degree,
            resolution=resolution,
            digitized=digitized,
        )
        return replace(of_new, misfit=repeated.beside(of_new.misfit))
    told = channels_told(v.shape[0], digitized, resolution)
    begin = start(t, v, frequency)
    kept = usable(t, harmonics, begin)
    highest = max(kept) * begin[1] / np.pi / float(t[-1] - t[0])

    def reduced_model(values: FloatArray) -> tuple[HarmonicModel, HarmonicModel, FloatArray, int]:
        few_t, few_v, block = thin(t, values, highest)
        reduced = _drifting_model(few_t, few_v, kept, begin, largest_degree)
        return at_full_rate(reduced, kept, t, values, block), reduced, few_t, block

    model, reduced, few_t, block = reduced_model(v)
    density = colour(few_t, reduced, float(reduced.course[1]) / (2 * np.pi * reduced.half))
    good = (
        prepare_record(t, v, kept, model, density, told, lambda values: reduced_model(values)[0])
        if len(digitized)
        else as_recorded(v, kept)
    )
    if good.values is not v:
        v = good.values
        model, reduced, few_t, block = reduced_model(v)
    if len(digitized) and (jump := _jump(t, v, kept, reduced.course[: max(3, begin.size)], highest)) is not None:
        part, found = longest_whole(t, jump, float(begin[1]) / (np.pi * float(t[-1] - t[0])), Misfit(good.findings))
        if part is not None:
            of_part = flux_by_integration(
                t[part],
                np.atleast_2d(np.asarray(channels, dtype=np.float64))[:, part],
                harmonics=harmonics,
                frequency=frequency,
                largest_degree=largest_degree,
                digitized=digitized,
            )
            return replace(of_part, misfit=with_jump(of_part.misfit, found))
        good = replace(good, findings=found.findings)
    phase = model.phase(t)
    turns = np.floor((phase[-1] - phase[0]) / (2 * np.pi) + 1e-9)
    if turns < 1:
        raise EstimationError(
            f"the record holds only {(phase[-1] - phase[0]) / (2 * np.pi):.2f} of a period; record longer"
        )
    slack = (phase[-1] - phase[0]) - 2 * np.pi * turns
    limits = phase[0] + slack / 2 + 2 * np.pi * np.arange(turns + 1)
    borders = np.interp(limits, phase, t)
    borders[0], borders[-1] = max(borders[0], t[0]), min(borders[-1], t[-1])
    step = float(t[-1] - t[0]) / (t.size - 1)
    running = np.column_stack((np.zeros(v.shape[0]), np.cumsum(0.5 * (v[:, 1:] + v[:, :-1]), axis=1) * step))
    whole = [np.interp(borders, t, row) for row in running]
    offsets = np.array([(w[-1] - w[0]) / (borders[-1] - borders[0]) for w in whole])
    turning = (v - offsets[:, None]) * np.exp(-1j * phase)
    summed = np.column_stack(
        (np.zeros(v.shape[0], dtype=complex), np.cumsum(0.5 * (turning[:, 1:] + turning[:, :-1]), axis=1) * step)
    )
    at = np.array([np.interp(borders, t, row.real) + 1j * np.interp(borders, t, row.imag) for row in summed])
    per_period = np.abs(np.diff(at, axis=1)) / np.pi
    values = np.abs(at[:, -1] - at[:, 0]) / (np.pi * turns)
    length = borders[-1] - borders[0]
    density = colour(few_t, reduced, turns / length)
    noise = model.noise * step * block * np.sqrt(density * length / (step * block) / 2) / (np.pi * turns)
    rms = np.sqrt(np.mean(model.residuals**2, axis=1) / good.kept)
    mean_speed = float(phase[-1] - phase[0]) / float(t[-1] - t[0])
    # Over a drifting speed the amplitude passes several steps, and their errors average out: this one is the most.
    steps = np.hypot(rounding(values * mean_speed, rms, told, good) / mean_speed, good.beside)
    noise *= np.max(good.growth[:, 1:], axis=1)
    spread = np.std(per_period, axis=1, ddof=1) / np.sqrt(turns) if turns > 1 else np.zeros(v.shape[0])
    speed = model.speed(t)
    change = float((speed[-1] - speed[0]) / np.mean(speed))
    degree = model.course.size - 1
    ends = np.array([(1.0 - (-1.0) ** (k - 1)) * k**2 for k in range(1, degree + 1)]) / model.course[1]
    own = np.maximum(noise, spread)
    freedom = float(turns - 1) if np.any(spread > noise) and turns > 1 else float(v.size - degree)
    combined = combine(values, own, steps, freedom, told)
    return FluxEstimate(
        values=values,
        uncertainties=np.hypot(own, steps),
        degrees_of_freedom=freedom,
        per_period=per_period,
        period_frequencies=1.0 / np.diff(borders),
        offsets=offsets,
        drift=change,
        drift_uncertainty=float(np.sqrt(density * ends @ model.course_covariance @ ends)),
        model=model,
        flux_linkage=combined,
        misfit=judged(combined, (*good.findings, *good.unlike(model, rms, told), *too_coarse(rms, told))),
    )
