"""Back-EMF: fundamental, harmonics and flux linkage from recorded voltages (§3.4)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from procedures.estimation.emf.agreement import Combined, combine, judged
from procedures.estimation.emf.further_orders import further_orders
from procedures.estimation.emf.harmonics import HarmonicModel, at_full_rate, fit_harmonics, thin, waveforms
from procedures.estimation.emf.period import rising_crossings
from procedures.estimation.emf.phase_jumps import find_jump, longest_whole, with_jump
from procedures.estimation.emf.record import DigitizedChannel, channels_told, colour, prepare, start, usable
from procedures.estimation.emf.record_preparation import (
    PreparedRecord,
    as_recorded,
    prepare_record,
    rounding,
    too_coarse,
)
from procedures.estimation.emf.speed_ripple import speed_ripples, swings_in_few
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import NO_MISFIT, Misfit
from procedures.estimation.fitting.repeated_rows import repeated_rows

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class BackEmfFit:
    """Waveforms v_c(t) = offset + Re Σ_k amplitudes[c, k]·exp(j·harmonics[k]·2π·frequency·(t − time_origin)).

    `frequency` (Hz, of the fundamental) with its standard uncertainty; `amplitudes` (C, H) complex, peak, V, with
    `amplitude_uncertainties` of their magnitudes; `phases` of the fundamentals against channel 0 (rad, −π … π) with
    uncertainties; `thd` (C,) over the fitted harmonics; `residual_rms` (C,); `offsets` (C,).
    `drift` is the relative change of speed over the record, significant where `drift_p_value` is small: the amplitudes then hold at
    the record's middle; `ripples` whether the speed swings besides, so that they are too small. `colour` ≥ 1 tells how much denser
    the residual is around the fundamental than white noise of its rms would be; the uncertainties include its root. `flux_linkage`
    is the mean over channels of fundamental ÷ electrical speed (V·s/rad), and `misfit` what the record shows beyond the model, the
    channels' agreement included. `further` are amplitudes (C,), V, peak, of orders that were not asked for and that the record
    shows; `residuals` (C, n) are without them.
    """

    frequency: float
    frequency_uncertainty: float
    harmonics: tuple[int, ...]
    amplitudes: ComplexArray
    amplitude_uncertainties: FloatArray
    phases: FloatArray
    phase_uncertainties: FloatArray
    offsets: FloatArray
    thd: FloatArray
    residuals: FloatArray
    residual_rms: FloatArray
    degrees_of_freedom: float
    drift: float
    drift_uncertainty: float
    drift_p_value: float
    ripples: bool
    colour: float
    time_origin: float
    model: HarmonicModel
    flux_linkage: Combined
    misfit: Misfit = NO_MISFIT
    further: Mapping[int, FloatArray] = field(default_factory=dict)

    @property
    def electrical_speed(self) -> float:
        """Electrical speed (rad/s)."""
        return 2 * np.pi * self.frequency

    @property
    def speed_changes(self) -> bool:
        """True if the speed drifts or ripples over the record: the flux linkage then is the integrated voltage's."""
        return self.drift_significant or self.ripples

    @property
    def drift_significant(self) -> bool:
        """True if the speed changed over the record by more than noise explains (1 %), and by more than 10⁻⁵."""
        return self.drift_p_value < 0.01 and abs(self.drift) > 1e-5

    def fundamental(self, channel: int = 0) -> tuple[float, float]:
        """Return the fundamental's amplitude (V, peak) and its standard uncertainty."""
        index = self.harmonics.index(1)
        return float(abs(self.amplitudes[channel, index])), float(self.amplitude_uncertainties[channel, index])


@dataclass(frozen=True)
class _Solved:
    """A model of a whole record (all samples), how its speed drifts, and how its residual is coloured."""

    model: HarmonicModel
    drift: tuple[float, float, float]
    colour: float
    points: int
    ripples: bool


def fit_back_emf(
    time: ArrayLike,
    channels: ArrayLike,
    *,
    harmonics: Sequence[int] = (1, 3, 5, 7),
    frequency: float | None = None,
    resolution: float | Sequence[float] = 0.0,
    digitized: Sequence[DigitizedChannel] = (),
) -> BackEmfFit:
    """Fit fundamental and harmonics of all channels (C, n), V, with one common frequency, evenly sampled time (s).

    `frequency` (Hz) is a start value only. Harmonics beyond the sampling limit are left out. `digitized` says what is known of each
    channel: then what clipped or is no reading is left out, hum is taken out, and of a record in which samples are missing under a time
    column without a gap the longest whole part is fitted. `resolution` (V) is one converter step, one value or one a channel, where no
    more is told. Raises EstimationError on a gap, a constant channel, or less than a period.
    """
    t, v = prepare(time, channels, digitized)
    if (repeated := repeated_rows(v)) is not None:
        fit = fit_back_emf(
            repeated.times(t),
            v[:, repeated.new],
            harmonics=harmonics,
            frequency=frequency,
            resolution=resolution,
            digitized=digitized,
        )
        return replace(fit, residuals=repeated.over_all(fit.residuals), misfit=repeated.beside(fit.misfit))
    told = channels_told(v.shape[0], digitized, resolution)
    begin = start(t, v, frequency)
    kept = usable(t, harmonics, begin)
    if t.size < 2 * len(kept) + 8:
        raise EstimationError(f"{t.size} samples do not suffice for {len(kept)} harmonics; sample faster")
    solved = _solve(t, v, kept, begin)

    def refit(values: FloatArray) -> HarmonicModel:
        return _solve(t, values, kept, begin).model

    good = (
        prepare_record(t, v, kept, solved.model, solved.colour, told, refit) if len(digitized) else as_recorded(v, kept)
    )
    if good.values is not v:
        solved = _solve(t, good.values, kept, begin)
    fit = _result(solved, good, kept, told)
    if good.values is not v:
        fit = _beside_crossings(fit, t, v)
    jump = find_jump(t, kept, solved.model) if len(digitized) else None
    if jump is None:
        further, left = further_orders(t, fit.residuals, fit.model, kept)
        return replace(fit, further=further, residuals=left)
    part, found = longest_whole(t, jump, fit.frequency, fit.misfit)
    if part is None:
        return replace(fit, misfit=found)
    of_part = fit_back_emf(t[part], v[:, part], harmonics=harmonics, frequency=fit.frequency, digitized=digitized)
    model = of_part.model
    values = np.column_stack((model.offsets, model.flux.real, model.flux.imag))
    left = v - waveforms(model, of_part.harmonics, values, t)
    return replace(of_part, residuals=left, misfit=with_jump(of_part.misfit, found))


def _beside_crossings(fit: BackEmfFit, t: FloatArray, v: FloatArray) -> BackEmfFit:
    """Let the frequency's uncertainty span that of the crossings of the readings as they were: what a model stands for follows it."""
    found = [crossing_frequency(t, row, fit.frequency) for row in v]
    apart = max((abs(one - fit.frequency) for one in found if one is not None), default=0.0)
    return replace(fit, frequency_uncertainty=float(np.hypot(fit.frequency_uncertainty, apart)))


def crossing_frequency(t: FloatArray, row: FloatArray, near: float) -> float | None:
    """Return the frequency (Hz) at which a record crosses its middle upwards; None where it does so in less than two periods."""
    times = rising_crossings(t, row, near)
    if times.size < 3:
        return None
    periods = np.round((times - times[0]) * near)
    return None if np.ptp(periods) < 2 else float(1.0 / np.polyfit(periods, times, 1)[0])


def _solve(t: FloatArray, v: FloatArray, kept: tuple[int, ...], begin: FloatArray) -> _Solved:
    """Fit a record at steady speed, and at a drifting one where the record shows that it drifts."""
    every = t, v
    t, v, block = thin(t, v, max(kept) * begin[1] / np.pi / float(t[-1] - t[0]))
    steady = fit_harmonics(t, v, kept, begin)
    freedom = float(v.size - v.shape[0] * (1 + 2 * len(kept)) - 1)
    periods = steady.course[1] / np.pi
    if periods < 0.98:
        raise EstimationError(f"the record holds only {periods:.2f} of a period; turn faster or record longer")
    drifting = fit_harmonics(t, v, kept, np.append(steady.course, 0.0))
    density = colour(t, drifting, periods / (2 * steady.half))
    # φ = c1·x + c2·(2x² − 1): the speed runs from c1 − 4·c2 to c1 + 4·c2.
    drift = 8 * drifting.course[2] / drifting.course[1]
    u_drift = 8 * float(np.sqrt(density * drifting.course_covariance[1, 1])) / drifting.course[1]
    p_value = float(2 * special.stdtr(freedom, -(abs(drift) / u_drift))) if u_drift > 0 else (0.0 if drift else 1.0)
    reduced = drifting if p_value < 0.01 and abs(drift) > 1e-5 else steady
    model = at_full_rate(reduced, kept, *every, block)
    ripples = speed_ripples(*every, kept, model) or swings_in_few(t, v, kept, reduced)
    return _Solved(model, (float(drift), u_drift, p_value), density, t.size, ripples)


def _result(
    solved: _Solved, good: PreparedRecord, kept: tuple[int, ...], channels: Sequence[DigitizedChannel]
) -> BackEmfFit:
    model, density = solved.model, solved.colour
    count, number = len(kept), len(channels)
    speed = float(model.speed(np.array([model.middle]))[0])
    # T'ₖ in the middle: 1, 0, −3, 0, 5 …
    degrees = np.arange(1, model.course.size)
    by_course = (degrees * np.sin(0.5 * np.pi * degrees) / model.half)[None, :]
    u_speed = float(np.sqrt(density * (by_course @ model.course_covariance @ by_course.T)[0, 0]))
    at_middle = 0.0 if model.course.size < 3 else float(model.phase(np.array([model.middle]))[0])
    amplitudes = model.flux * (1j * speed * np.array(kept)) * np.exp(1j * at_middle * np.array(kept))
    size = np.abs(model.flux)
    # Of readings that the model stands for nothing is left.
    rms = np.sqrt(np.mean(model.residuals**2, axis=1) / good.kept)
    steps = np.hypot(rounding(size[:, 0] * speed, rms, channels, good) / speed, good.beside)
    u_size, u_angle = np.empty_like(size), np.empty_like(size)
    for c in range(number):
        grown = good.growth[c, 1:]
        for k in range(count):
            chosen = [k, count + k]
            part = density * model.flux_covariance[c][np.ix_(chosen, chosen)] * np.outer(grown[chosen], grown[chosen])
            along = np.array([model.flux[c, k].real, model.flux[c, k].imag]) / max(size[c, k], 1e-300)
            across = np.array([-along[1], along[0]])
            u_size[c, k] = np.sqrt(max(along @ part @ along, 0.0))
            u_angle[c, k] = np.sqrt(max(across @ part @ across, 0.0)) / max(size[c, k], 1e-300)
    orders = np.array(kept)
    # The amplitude's own uncertainty at this speed, which the flux's covariance holds together with the speed's.
    u_flux = size * np.sqrt(np.maximum((u_size / np.maximum(size, 1e-300)) ** 2 - (u_speed / speed) ** 2, 0.0))
    own_angle = np.sqrt(2.0 * density / solved.points) * model.noise / np.abs(amplitudes[:, 0])
    phases = np.angle(amplitudes[:, 0] / amplitudes[0, 0])
    u_phases = np.hypot(own_angle, own_angle[0])
    u_phases[0] = 0.0
    rest = np.sqrt(np.sum(np.abs(amplitudes[:, 1:]) ** 2, axis=1)) if count > 1 else np.zeros(number)
    freedom = float(solved.points * number - number * (1 + 2 * count) - 1)
    combined = combine(size[:, 0], u_flux[:, 0], steps, freedom, channels)
    by_speed = combined.value * u_speed / speed
    combined = replace(combined, uncertainty=float(np.hypot(combined.uncertainty, by_speed)))
    return BackEmfFit(
        frequency=speed / (2 * np.pi),
        frequency_uncertainty=u_speed / (2 * np.pi),
        harmonics=kept,
        amplitudes=amplitudes,
        amplitude_uncertainties=np.hypot(u_flux, steps[:, None]) * speed * orders,
        phases=phases,
        phase_uncertainties=u_phases,
        offsets=model.offsets,
        thd=rest / np.abs(amplitudes[:, 0]),
        residuals=model.residuals,
        residual_rms=rms,
        degrees_of_freedom=freedom,
        drift=solved.drift[0],
        drift_uncertainty=solved.drift[1],
        drift_p_value=solved.drift[2],
        ripples=solved.ripples,
        colour=density,
        time_origin=model.middle,
        model=model,
        flux_linkage=combined,
        misfit=judged(combined, (*good.findings, *good.unlike(model, rms, channels), *too_coarse(rms, channels))),
    )
