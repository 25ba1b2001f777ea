"""Back-EMF: fundamental, harmonics and flux linkage from recorded voltages (§3.4)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from procedures.estimation.emf.harmonics import HarmonicModel, at_full_rate, fit_harmonics, thin
from procedures.estimation.emf.period import start_frequency
from procedures.estimation.fitting.checks import positive, same_length, series, uniform_step
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.noise import undithered

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class BackEmfFit:
    """Waveforms v_c(t) = offset + Re Σ_k amplitudes[c, k]·exp(j·harmonics[k]·2π·frequency·(t − time_origin)).

    `frequency` (Hz, of the fundamental) with its standard uncertainty; `amplitudes` (C, H) complex, peak, V, with
    `amplitude_uncertainties` of their magnitudes; `phases` of the fundamentals against channel 0 (rad, −π … π) with
    uncertainties; `thd` (C,) over the fitted harmonics; `residual_rms` (C,); `offsets` (C,).
    `drift` is the relative change of speed over the record, significant where `drift_p_value` is small: the amplitudes then
    hold at the record's middle. `colour` ≥ 1 tells how much denser the residual is around the fundamental than white noise
    of its rms would be; the uncertainties include its root.
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
    colour: float
    time_origin: float
    model: HarmonicModel

    @property
    def electrical_speed(self) -> float:
        """Electrical speed (rad/s)."""
        return 2 * np.pi * self.frequency

    @property
    def drift_significant(self) -> bool:
        """Whether the speed changed over the record by more than noise explains (1 %), and by more than 10⁻⁵."""
        return self.drift_p_value < 0.01 and abs(self.drift) > 1e-5

    def fundamental(self, channel: int = 0) -> tuple[float, float]:
        """Return the fundamental's amplitude (V, peak) and its standard uncertainty."""
        index = self.harmonics.index(1)
        return float(abs(self.amplitudes[channel, index])), float(self.amplitude_uncertainties[channel, index])

    def mean_flux_linkage(self) -> tuple[float, float]:
        """Return the mean over channels of fundamental ÷ electrical speed (V·s/rad) and its standard uncertainty."""
        index = self.harmonics.index(1)
        size = np.abs(self.amplitudes[:, index])
        relative = float(np.sqrt(np.sum(self.amplitude_uncertainties[:, index] ** 2)) / np.sum(size))
        value = float(np.mean(size)) / self.electrical_speed
        return value, value * float(np.hypot(relative, self.frequency_uncertainty / self.frequency))


@dataclass(frozen=True)
class FluxEstimate:
    """Flux linkage of the fundamental by integrating the voltage over whole periods, speed drift or not (V·s/rad, peak).

    `values` (C,) with `uncertainties` and `degrees_of_freedom`; `per_period` (C, P) each whole period's own; `half_swings`
    (C, P) half of the flux's swing over each period, harmonics included; `period_frequencies` (P,) in Hz; `offsets` (C,) in V.
    """

    values: FloatArray
    uncertainties: FloatArray
    degrees_of_freedom: float
    per_period: FloatArray
    half_swings: FloatArray
    period_frequencies: FloatArray
    offsets: FloatArray
    drift: float
    drift_uncertainty: float
    model: HarmonicModel

    def mean(self) -> tuple[float, float]:
        """Return the mean over channels and its standard uncertainty (V·s/rad)."""
        return float(np.mean(self.values)), float(np.sqrt(np.sum(self.uncertainties**2)) / self.values.size)


def line_to_phase(line: float) -> float:
    """Return the phase amplitude that belongs to a fundamental measured between two lines: a √3-th (§3.4.2)."""
    return line / float(np.sqrt(3.0))


def _prepare(time: ArrayLike, channels: ArrayLike) -> tuple[FloatArray, FloatArray]:
    t = series("time", time, least=16)
    array = np.atleast_2d(np.asarray(channels, dtype=np.float64))
    if array.ndim != 2:
        raise EstimationError("channels must have the shape (channels, points)")
    rows = [series(f"channel {k}", row, least=16) for k, row in enumerate(array)]
    for k, row in enumerate(rows):
        same_length(time=t, **{f"channel {k}": row})
        if np.ptp(row) == 0:
            raise EstimationError(f"channel {k} is constant; check its probe and that the shaft turns")
    uniform_step(t)
    return t, np.vstack(rows)


def _start(t: FloatArray, v: FloatArray, frequency: float | None) -> FloatArray:
    half = float(t[-1] - t[0]) / 2
    f = positive("frequency", frequency, "Hz") if frequency is not None else start_frequency(t, v)
    if f * 2 * half * t.size / (t.size - 1) < 0.98:
        raise EstimationError(f"the record holds no whole period of {f:g} Hz; turn faster or record longer")
    return np.array([0.0, 2 * np.pi * f * half])


def _usable(t: FloatArray, harmonics: Sequence[int], course: FloatArray) -> tuple[int, ...]:
    """Harmonics below the sampling limit, the fundamental among them."""
    if 1 not in harmonics or any(k < 1 for k in harmonics):
        raise EstimationError("the harmonics to fit must be positive and include 1, the fundamental")
    per_sample = 2 * float(course[1]) / (t.size - 1)
    kept = tuple(sorted({int(k) for k in harmonics if k * per_sample < 0.9 * np.pi}))
    if not kept:
        raise EstimationError("fewer than two samples a period; sample faster")
    return kept


def _colour(t: FloatArray, model: HarmonicModel, frequency: float) -> float:
    """Density of the residuals around the fundamental against their mean density; 1 unless clearly more."""
    n = t.size
    bins = frequency * float(t[-1] - t[0]) * n / (n - 1)
    reach = max(int(0.5 * bins), 4)
    low, high = max(1, int(bins) - reach), min(n // 2, int(bins) + reach + 1)
    total = 0.0
    for row in model.residuals:
        power = np.abs(np.fft.rfft(row)) ** 2
        mean = float(np.mean(power[1:]))
        total += float(np.mean(power[low:high])) / mean if mean > 0 else 1.0
    ratio = total / model.residuals.shape[0]
    count = 2 * (high - low) * model.residuals.shape[0]
    return ratio if ratio > float(special.chdtri(count, 0.01)) / count else 1.0


def fit_back_emf(
    time: ArrayLike,
    channels: ArrayLike,
    *,
    harmonics: Sequence[int] = (1, 3, 5, 7),
    frequency: float | None = None,
    resolution: float | Sequence[float] = 0.0,
) -> BackEmfFit:
    """Fit fundamental and harmonics of all channels (C, n), V, with one common frequency, evenly sampled time (s).

    `frequency` (Hz) is a start value only. Harmonics beyond the sampling limit are left out. `resolution` (V) is one
    converter step, one value or one a channel. Raises EstimationError on a gap, a constant channel, or less than a period.
    """
    t, v = _prepare(time, channels)
    begin = _start(t, v, frequency)
    kept = _usable(t, harmonics, begin)
    if t.size < 2 * len(kept) + 8:
        raise EstimationError(f"{t.size} samples do not suffice for {len(kept)} harmonics; sample faster")
    every = t, v
    t, v, block = thin(t, v, max(kept) * begin[1] / np.pi / float(t[-1] - t[0]))
    steady = fit_harmonics(t, v, kept, begin)
    freedom = float(v.size - v.shape[0] * (1 + 2 * len(kept)) - 1)
    periods = steady.course[1] / np.pi
    if periods < 0.98:
        raise EstimationError(f"the record holds only {periods:.2f} of a period; turn faster or record longer")
    drifting = fit_harmonics(t, v, kept, np.append(steady.course, 0.0))
    colour = _colour(t, drifting, periods / (2 * steady.half))
    # φ = c1·x + c2·(2x² − 1): the speed runs from c1 − 4·c2 to c1 + 4·c2.
    drift = 8 * drifting.course[2] / drifting.course[1]
    u_drift = 8 * float(np.sqrt(colour * drifting.course_covariance[1, 1])) / drifting.course[1]
    p_value = float(2 * special.stdtr(freedom, -(abs(drift) / u_drift))) if u_drift > 0 else (0.0 if drift else 1.0)
    model = at_full_rate(drifting if p_value < 0.01 and abs(drift) > 1e-5 else steady, kept, *every, block)
    return _result(t, v, model, kept, freedom, (float(drift), u_drift, p_value), colour, resolution)


def _result(
    t: FloatArray,
    v: FloatArray,
    model: HarmonicModel,
    kept: tuple[int, ...],
    freedom: float,
    drift: tuple[float, float, float],
    colour: float,
    resolution: float | Sequence[float],
) -> BackEmfFit:
    count = len(kept)
    speed = float(model.speed(np.array([model.middle]))[0])
    by_course = np.array([[0.0, 1.0 / model.half, 0.0][1:]])[:, : model.course.size - 1]
    u_speed = float(np.sqrt(colour * (by_course @ model.course_covariance @ by_course.T)[0, 0]))
    at_middle = 0.0 if model.course.size < 3 else float(model.phase(np.array([model.middle]))[0])
    amplitudes = model.flux * (1j * speed * np.array(kept)) * np.exp(1j * at_middle * np.array(kept))
    size = np.abs(model.flux)
    steps = np.broadcast_to(np.asarray(resolution, dtype=np.float64), (v.shape[0],))
    u_size, u_angle = np.empty_like(size), np.empty_like(size)
    for c in range(v.shape[0]):
        rounding = undithered(float(np.std(model.residuals[c])), float(steps[c])) / (speed * np.sqrt(t.size / 8.0 + 1))
        for k in range(count):
            part = colour * model.flux_covariance[c][np.ix_([k, count + k], [k, count + k])]
            along = np.array([model.flux[c, k].real, model.flux[c, k].imag]) / max(size[c, k], 1e-300)
            across = np.array([-along[1], along[0]])
            u_size[c, k] = np.hypot(np.sqrt(max(along @ part @ along, 0.0)), rounding)
            u_angle[c, k] = np.sqrt(max(across @ part @ across, 0.0)) / max(size[c, k], 1e-300)
    # The amplitude's own uncertainty at this speed, which the flux's covariance holds together with the speed's.
    relative = np.sqrt(np.maximum((u_size / np.maximum(size, 1e-300)) ** 2 - (u_speed / speed) ** 2, 0.0))
    orders = np.array(kept)
    own_angle = np.sqrt(2.0 * colour / t.size) * model.noise / np.abs(amplitudes[:, 0])
    phases = np.angle(amplitudes[:, 0] / amplitudes[0, 0])
    u_phases = np.hypot(own_angle, own_angle[0])
    u_phases[0] = 0.0
    rest = np.sqrt(np.sum(np.abs(amplitudes[:, 1:]) ** 2, axis=1)) if count > 1 else np.zeros(v.shape[0])
    return BackEmfFit(
        frequency=speed / (2 * np.pi),
        frequency_uncertainty=u_speed / (2 * np.pi),
        harmonics=kept,
        amplitudes=amplitudes,
        amplitude_uncertainties=relative * size * speed * orders,
        phases=phases,
        phase_uncertainties=u_phases,
        offsets=model.offsets,
        thd=rest / np.abs(amplitudes[:, 0]),
        residuals=model.residuals,
        residual_rms=np.sqrt(np.mean(model.residuals**2, axis=1)),
        degrees_of_freedom=freedom,
        drift=drift[0],
        drift_uncertainty=drift[1],
        drift_p_value=drift[2],
        colour=colour,
        time_origin=model.middle,
        model=model,
    )


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
    for _ in range(best.course.size, largest_degree + 1):
        try:
            model = fit_harmonics(t, v, kept, np.append(model.course, 0.0))
        except EstimationError:
            break
        speed = model.speed(t)
        if cost(model) < cost(best) and np.min(speed) > 0.1 * np.max(speed):
            best = model
    return best


def flux_by_integration(
    time: ArrayLike,
    channels: ArrayLike,
    *,
    harmonics: Sequence[int] = (1, 3, 5, 7),
    frequency: float | None = None,
    largest_degree: int = 6,
) -> FluxEstimate:
    """Integrate the voltages (C, n), V, over each whole period, offsets removed: ψ₁ = |∫ v·exp(−j·φ(t)) dt| / π.

    As ∫ v dt is the flux itself, the speed need not be known or constant; only the angle φ(t) is taken from the waveform, as
    a polynomial of up to `largest_degree`. Raises EstimationError where the record holds no whole period.
    """
    t, v = _prepare(time, channels)
    begin = _start(t, v, frequency)
    kept = _usable(t, harmonics, begin)
    few_t, few_v, block = thin(t, v, max(kept) * begin[1] / np.pi / float(t[-1] - t[0]))
    reduced = _drifting_model(few_t, few_v, kept, begin, largest_degree)
    model = at_full_rate(reduced, kept, t, v, block)
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
    flux = running - offsets[:, None] * (t - t[0])
    swings = np.empty_like(per_period)
    for k in range(int(turns)):
        part = (t >= borders[k]) & (t <= borders[k + 1])
        swings[:, k] = 0.5 * np.ptp(flux[:, part], axis=1)
    length = borders[-1] - borders[0]
    colour = _colour(few_t, reduced, turns / length)
    noise = model.noise * step * block * np.sqrt(colour * length / (step * block) / 2) / (np.pi * turns)
    spread = np.std(per_period, axis=1, ddof=1) / np.sqrt(turns) if turns > 1 else np.zeros(v.shape[0])
    speed = model.speed(t)
    change = float((speed[-1] - speed[0]) / np.mean(speed))
    degree = model.course.size - 1
    ends = np.array([(1.0 - (-1.0) ** (k - 1)) * k**2 for k in range(1, degree + 1)]) / model.course[1]
    return FluxEstimate(
        values=values,
        uncertainties=np.maximum(noise, spread),
        degrees_of_freedom=float(turns - 1) if np.any(spread > noise) and turns > 1 else float(v.size - degree),
        per_period=per_period,
        half_swings=swings,
        period_frequencies=1.0 / np.diff(borders),
        offsets=offsets,
        drift=change,
        drift_uncertainty=float(np.sqrt(colour * ends @ model.course_covariance @ ends)),
        model=model,
    )
