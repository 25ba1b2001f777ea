"""Resistance and inductance from the recorded voltage and current of a step (§3.3.1, erratum E10)."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import same_length, series, uniform_step
from procedures.estimation.fitting.first_order import (
    gathered_evenly,
    recursion,
    respond_evenly,
    response_and_slope_evenly,
)
from procedures.estimation.fitting.fit import EstimationError, Fit, FloatArray
from procedures.estimation.fitting.noise import undithered, white_noise
from procedures.estimation.fitting.nonlinear import solve
from procedures.estimation.fitting.smoothing import components
from procedures.estimation.winding.step_record import StepRecord, read_step

Filter = Callable[[FloatArray], FloatArray]

NAMES = ("resistance", "inductance", "offset", "voltage_offset", "delay")

#: Noise, as a share of the step, through which 63 % of it are read off.
_JITTER = 0.01


def _start(record: StepRecord) -> tuple[float, float, float]:
    """Resistance, inductance and current offset from ∫v dt = R·∫i dt + L·i, linear and indifferent to the supply's shape."""
    offset = float(np.mean(record.current[: record.edge])) if record.edge else float(record.current[0])
    v, i = record.drive[record.edge :], record.current[record.edge :] - offset

    def integral(x: FloatArray) -> FloatArray:
        return np.append(0.0, np.cumsum(0.5 * (x[1:] + x[:-1]))) * record.step

    design = np.array((integral(i), i, np.ones_like(i)))
    scale = np.sqrt(np.mean(design**2, axis=1))
    design /= scale[:, None]
    solution = np.linalg.lstsq(design @ design.T, design @ integral(v), rcond=None)[0] / scale
    resistance, inductance = solution[:2]
    if not resistance > 0:
        raise EstimationError(
            "the current does not follow the voltage (negative resistance): reverse the current probe, or check that both "
            "probes are on the stepped circuit"
        )
    if not inductance > 0.05 * resistance * record.step:
        raise EstimationError("the current follows the voltage within a sample: sample faster, or check the probes")
    return float(resistance), float(inductance), offset


def _drive(record: StepRecord, p: FloatArray) -> FloatArray:
    """Return what drives the current's change (A/s): the voltage without the probe's offset, over the inductance."""
    drive = record.drive.copy()
    drive[record.edge :] -= p[3]
    return np.asarray(drive / p[1], dtype=np.float64)


def _late(record: StepRecord, p: FloatArray) -> tuple[slice, FloatArray, FloatArray]:
    """Return the samples after the step, the time since (s), and the current (A) that a delay of 1 s takes off them."""
    after = slice(record.jump, None)
    since = record.time[after] - record.time[record.jump]
    rise = (record.drive[record.jump] - record.drive[record.jump - 1]) / p[1]
    return after, since, rise * np.exp(-p[0] / p[1] * since)


def _model(record: StepRecord, p: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the current (A, shape (n,)) of a circuit at rest before the step, and its derivatives (5, n) by the parameters:
    resistance, inductance, offset, voltage offset and delay.
    """
    resistance, inductance, offset, _, delay = p
    rate = resistance / inductance
    response, by_rate = response_and_slope_evenly(record.step, _drive(record, p), rate)
    after, since, missing = _late(record, p)
    if delay:
        response[after] -= delay * missing
        by_rate[after] += delay * missing * since
    extra = np.zeros_like(response)
    extra[record.edge :] = -1.0 / inductance
    slopes = np.zeros((5, response.size))
    slopes[0] = by_rate / inductance
    slopes[1] = (response + rate * by_rate) / -inductance
    slopes[2] = 1.0
    slopes[3] = respond_evenly(record.step, extra, rate)
    slopes[4, after] = -missing
    return offset + response, slopes


def _whitener(record: StepRecord, resistance: float, inductance: float) -> Callable[[FloatArray], FloatArray]:
    """Return the filter (n, …) that makes white, of standard deviation 1, the current's noise, plus, where the voltage could not
    be smoothed, the voltage's through the circuit.
    """
    if record.noise_left is not None:
        return lambda rows: rows / record.current_noise
    x = resistance / inductance * record.step
    a = float(np.exp(-x))
    hold = (1 - a) / x
    first, last = (hold - a) / resistance, (1 - hold) / resistance
    vi, vv = record.current_noise**2, record.voltage_noise**2
    zero = vi * (1 + a**2) + vv * (first**2 + last**2)
    one = -vi * a + vv * first * last
    if abs(one) < 1e-9 * zero:
        root, scale = 0.0, zero
    else:
        half = zero / (2 * one)
        root = float(-half + np.sign(half) * np.sqrt(max(half**2 - 1, 0.0)))
        scale = -one / root

    def whitened(rows: FloatArray) -> FloatArray:
        gain = rows.copy()
        gain[1:] -= a * rows[:-1]
        return recursion(root, gain / np.sqrt(scale))

    return whitened


def fit_step_response(
    time: ArrayLike,
    voltage: ArrayLike,
    current: ArrayLike,
    *,
    voltage_resolution: float = 0.0,
    current_resolution: float = 0.0,
) -> Fit:
    """Fit `resistance` (Ω), `inductance` (H), `offset` (A, of the current probe) to a recorded step (V, A; evenly sampled).

    The circuit is at rest at the start of the record; the voltage's samples are its input, straight between them, so
    the supply may rise slowly or overshoot. With at least five samples before the step also `voltage_offset` (V), the
    probe's reading at rest; where the step is sharper than a sampling interval also `delay` (s), its instant against
    mid-interval. The resolutions (V, A) are one converter step. Raises EstimationError where there is no step, the
    record is too short, or a probe is reversed.
    """
    record = read_step(time, voltage, current, voltage_resolution, current_resolution)
    resistance, inductance, offset = _start(record)
    prior_voltage = record.voltage_noise / np.sqrt(record.edge) if record.edge else 0.0
    prior_delay = record.step / np.sqrt(12.0) if record.sharp else 0.0
    free = np.array([True, True, True, prior_voltage > 0, prior_delay > 0])
    names = tuple(m for m, f in zip(NAMES, free, strict=True) if f)
    full = np.array([resistance, inductance, offset, 0.0, 0.0])
    level = float(np.max(np.abs(record.current - offset)))
    scale = np.array([resistance, inductance, level, prior_voltage or 1.0, prior_delay or 1.0])
    for _ in range(1 if record.noise_left is not None else 2):
        whitened = _whitener(record, full[0], full[1])

        def evaluate(p: FloatArray, base: FloatArray = full, white: Filter = whitened) -> tuple[FloatArray, FloatArray]:
            q = base.copy()
            q[free] = p
            q[:2] = np.maximum(q[:2], 1e-3 * scale[:2])
            current, slopes = _model(record, q)
            # What is known beforehand of the voltage's offset and the delay, as two readings more.
            known = np.zeros((5, 2))
            known[3, 0] = 1.0 / prior_voltage if free[3] else 0.0
            known[4, 1] = 1.0 / prior_delay if free[4] else 0.0
            residuals = np.append(white(record.current - current), q @ known)
            rows = np.empty((len(names), residuals.size))
            rows[:, :-2] = -white(slopes[free].T).T
            rows[:, -2:] = known[free]
            return residuals, rows

        solution = solve(evaluate, full[free], scale[free], names)
        full = full.copy()
        full[free] = solution.values
    _check_window(record, full)
    freedom = float(record.time.size - 3)
    covariance = max(1.0, solution.cost / freedom) * solution.covariance
    gain = solution.gain[:, :-2]
    shift = gain @ whitened(_lasting_errors(record, full, voltage_resolution, current_resolution))
    covariance = covariance + shift @ shift.T
    if record.noise_left is not None:
        # Noise is left in a smoothed voltage; what it shifts is asked of the few parameters, not of the many shapes.
        through = gathered_evenly(record.step, gain.T, full[0] / full[1]) / (full[1] * record.current_noise)
        shift = record.voltage_noise * components(record.noise_left, through.T)
        covariance = covariance + shift @ shift.T
    left = record.current - _model(record, full)[0]
    full[3] += record.baseline
    return Fit(names, full[free], covariance, freedom, left, float(np.sqrt(np.mean(left**2))))


def _check_window(record: StepRecord, full: FloatArray) -> None:
    """Raise EstimationError unless the record is long and fine enough for what was found."""
    tau = full[1] / full[0]
    window = record.time[-1] - record.time[record.edge]
    if tau < 0.5 * record.step:
        raise EstimationError(f"the time constant ({tau:g} s) is less than half a sampling interval; sample faster")
    if window < 0.7 * tau:
        raise EstimationError(
            f"the record ends {window / tau:.2f} time constants after the step; record at least three (about {3 * tau:g} s)"
        )


def _lasting_errors(
    record: StepRecord, full: FloatArray, voltage_resolution: float, current_resolution: float
) -> FloatArray:
    """Errors of the current's model (A, shape (n, m)) of one standard deviation each, that do not average out over the record.

    Rounding without dither may shift the level of the current and of the voltage.
    """
    rate, inductance = full[0] / full[1], full[1]
    after = (np.arange(record.time.size) >= record.edge).astype(np.float64)
    through = respond_evenly(
        record.step, undithered(record.voltage_noise, voltage_resolution) / inductance * after, rate
    )
    return np.column_stack((undithered(record.current_noise, current_resolution) * after, through))


def time_constant_63(time: ArrayLike, current: ArrayLike) -> float:
    """Return the time (s) from the step's start to 63.2 % of the current's change (§3.3.1), as read off a screen.

    Start: the last sample before the current leaves its first level. Raises EstimationError where there is no step.
    """
    t, i = series("time", time, least=10), series("current", current, least=10)
    same_length(time=t, current=i)
    noise = white_noise(i)
    final, first = _ends(i)
    if abs(final - first) > 0.0:
        # The eye averages over what jitters: noise of a step's percent is left.
        together = int(np.clip((noise / (_JITTER * (final - first))) ** 2, 1, max(1, i.size // 100)))
        whole = i.size // together * together
        t, i = (x[:whole].reshape(-1, together).mean(axis=1) for x in (t, i))
        noise /= np.sqrt(together)
    final, first = _ends(i)
    change = final - first
    if abs(change) <= 8 * noise or change == 0:
        raise EstimationError("the current shows no step; check the current probe and the trigger")
    rise = (i - first) / change
    crossed = int(np.argmax(rise >= 1 - np.exp(-1.0)))
    still = np.flatnonzero(rise[: crossed + 1] <= max(0.02, 4 * noise / abs(change)))
    begin = int(still[-1]) if still.size else 0
    if crossed == 0:
        raise EstimationError(
            "the first sample already lies beyond 63 % of the step; cut it off, or move the trigger towards the middle"
        )
    share = (1 - np.exp(-1.0) - rise[crossed - 1]) / (rise[crossed] - rise[crossed - 1])
    return float(t[crossed - 1] + share * (t[crossed] - t[crossed - 1]) - t[begin])


def _ends(current: FloatArray) -> tuple[float, float]:
    """Return a record's last level and its first."""
    last, first = max(1, current.size // 50), max(1, current.size // 200)
    return float(np.mean(current[-last:])), float(np.mean(current[:first]))


class Apparent(NamedTuple):
    """Flux linkage over current at the end of a step (H), and that current (A)."""

    inductance: float
    current: float


def apparent_inductance(time: ArrayLike, voltage: ArrayLike, current: ArrayLike) -> Apparent:
    """Return the flux linkage that a step built up over the current it ended at, whatever the iron does on the way.

    Flux is ∫(v − R·i) dt with probe offsets from before the step and R from its end, so that the settled part adds nothing.
    Raises EstimationError where the record has no baseline or does not settle.
    """
    t, v, i = (series(n, x, least=100) for n, x in (("time", time), ("voltage", voltage), ("current", current)))
    same_length(time=t, voltage=v, current=i)
    step = uniform_step(t)
    head, tail = slice(0, max(5, t.size // 20)), slice(-(t.size // 8), None)
    v, i = v - float(np.mean(v[head])), i - float(np.mean(i[head]))
    end = float(np.mean(i[tail]))
    noise = white_noise(i)
    if abs(end) <= 8 * noise:
        raise EstimationError("the current shows no step; check the current probe and the trigger")
    half = i[tail].size // 2
    if abs(float(np.mean(i[tail][half:]) - np.mean(i[tail][:half]))) > 0.01 * abs(end) + 4 * noise / np.sqrt(half):
        raise EstimationError("the current has not settled at the end of the record; record longer")
    resistance = float(np.mean(v[tail])) / end
    return Apparent(float(np.sum(v - resistance * i)) * step / end, end)
