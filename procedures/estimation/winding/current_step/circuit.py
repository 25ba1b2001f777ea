"""The current that a recorded voltage drives through resistance and inductance, and what makes its noise white."""

from dataclasses import dataclass

import numpy as np

from procedures.estimation.fitting.first_order import (
    gathered_evenly,
    recursion,
    respond_evenly,
    response_and_slope_evenly,
)
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.winding.current_step.record import StepRecord

#: What is fitted: resistance (Ω), inductance (H), offset of the current (A) and of the voltage (V), delay (s).
NAMES = ("resistance", "inductance", "offset", "voltage_offset", "delay")


def drive(record: StepRecord, p: FloatArray) -> FloatArray:
    """Return what drives the current's change (A/s): the voltage without the probe's offset, over the inductance."""
    result = record.drive.copy()
    result[record.edge :] -= p[3]
    return np.asarray(result / p[1], dtype=np.float64)


def _late(record: StepRecord, p: FloatArray) -> tuple[slice, FloatArray, FloatArray]:
    """Return the samples after the step, the time since (s), and the current (A) that a delay of 1 s takes off them."""
    after = slice(record.jump, None)
    since = record.time[after] - record.time[record.jump]
    rise = (record.drive[record.jump] - record.drive[record.jump - 1]) / p[1]
    return after, since, rise * np.exp(-p[0] / p[1] * since)


def response(record: StepRecord, p: FloatArray) -> FloatArray:
    """Return the current (A, shape (n,)) of a circuit at rest before the step, without the probe's offset."""
    result = respond_evenly(record.step, drive(record, p), p[0] / p[1])
    if p[4]:
        after, _, missing = _late(record, p)
        result[after] -= p[4] * missing
    return result


def response_and_slopes(
    record: StepRecord, p: FloatArray, known: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return what `response` does, and the derivatives (5, n) of the current with its offset by the parameters; the response may be
    `known`.
    """
    resistance, inductance, _, _, delay = p
    rate = resistance / inductance
    after, since, missing = _late(record, p)
    if known is not None and delay:
        known = known.copy()
        known[after] += delay * missing
    current, by_rate = response_and_slope_evenly(record.step, drive(record, p), rate, known)
    if delay:
        current[after] -= delay * missing
        by_rate[after] += delay * missing * since
    extra = np.zeros_like(current)
    extra[record.edge :] = -1.0 / inductance
    slopes = np.zeros((5, current.size))
    slopes[0] = by_rate / inductance
    slopes[1] = (current + rate * by_rate) / -inductance
    slopes[2] = 1.0
    slopes[3] = respond_evenly(record.step, extra, rate)
    slopes[4, after] = -missing
    return current, slopes


@dataclass(frozen=True)
class Whitener:
    """Makes the current's noise white, of standard deviation 1, and where the voltage could not be smoothed the voltage's through
    the circuit with it: rows[k] − `pole`·rows[k − 1] over `scale`, run through a recursion of `root`.

    Samples whose `kept` is 0 do not count; None where all do.
    """

    scale: float
    pole: float = 0.0
    root: float = 0.0
    kept: FloatArray | None = None

    def apply(self, rows: FloatArray) -> FloatArray:
        """Return rows (…, n), whitened."""
        result = rows / self.scale
        if self.pole or self.root:
            result[..., 1:] -= self.pole / self.scale * rows[..., :-1]
            result = recursion(self.root, result.T).T
        return result if self.kept is None else result * self.kept

    def back(self, rows: FloatArray) -> FloatArray:
        """Return shares (…, n) in the samples for shares in what is whitened."""
        result = rows if self.kept is None else rows * self.kept
        result = result / self.scale
        if self.pole or self.root:
            result = recursion(self.root, result[..., ::-1].T).T[..., ::-1]
            earlier = np.zeros_like(result)
            earlier[..., :-1] = result[..., 1:]
            result = result - self.pole * earlier
        return result


def whitener(record: StepRecord, resistance: float, inductance: float) -> Whitener:
    """Return what whitens a record of a circuit with this resistance (Ω) and inductance (H)."""
    if record.noise_left is not None:
        return Whitener(record.current_noise, kept=record.kept)
    x = resistance / inductance * record.step
    a = float(np.exp(-x))
    hold = (1 - a) / x
    first, last = (hold - a) / resistance, (1 - hold) / resistance
    vi, vv = record.current_noise**2, record.voltage_noise**2
    zero = vi * (1 + a**2) + vv * (first**2 + last**2)
    one = -vi * a + vv * first * last
    if abs(one) < 1e-9 * zero:
        return Whitener(float(np.sqrt(zero)), a, 0.0, record.kept)
    half = zero / (2 * one)
    root = float(-half + np.sign(half) * np.sqrt(max(half**2 - 1, 0.0)))
    return Whitener(float(np.sqrt(-one / root)), a, root, record.kept)


def voltage_shares(record: StepRecord, p: FloatArray, shares: FloatArray) -> FloatArray:
    """Return shares (m, n) in the voltage's samples for shares in the current's."""
    return np.asarray(gathered_evenly(record.step, shares.T, p[0] / p[1]).T / p[1])
