"""The variance of what a step's fit leaves in a direction: noise that is white, rounding, and noise left in a smoothed voltage."""

import numpy as np

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.noise import undithered
from procedures.estimation.fitting.smoothing import components
from procedures.estimation.winding.current_step.circuit import voltage_shares
from procedures.estimation.winding.current_step.closed_circuits import other_axis_errors
from procedures.estimation.winding.current_step.fit import Fitted, Problem


class StepVariance:
    """The variance of a unit direction's component: that of white noise, of rounding, and of what is left in a smoothed voltage."""

    def __init__(self, step: Problem, fitted: Fitted) -> None:
        self._step, self._full = step, fitted.full
        # Codes are whole multiples of a step from one another, not from zero.
        self._current = fitted.current - step.record.current[0]
        self._other_axis = step.white.apply(other_axis_errors(step.record, fitted.full))

    def __call__(self, unit: FloatArray) -> FloatArray:
        """Return it for unit directions (m, n + priors)."""
        record = self._step.record
        shares = self._step.white.back(unit[:, : record.time.size])
        variance: FloatArray = 1.0 + np.sum((unit[:, : record.time.size] @ self._other_axis.T) ** 2, axis=1)
        rounding = undithered(record.current_noise, record.current_resolution)
        if rounding > 0.02 * record.current_noise:
            variance += rounding**2 * _of_runs(self._current / record.current_resolution, shares)
        if record.noise_left is None:
            return variance
        through = voltage_shares(record, self._full, shares)
        variance += record.voltage_noise**2 * np.sum(components(record.noise_left, through) ** 2, axis=1)
        rounding = undithered(record.voltage_noise, record.voltage_resolution)
        if rounding > 0.02 * record.voltage_noise:
            after = slice(record.edge, None)
            variance += rounding**2 * _of_runs(record.drive[after] / record.voltage_resolution, through[:, after])
        return variance


def _of_runs(codes: FloatArray, shares: FloatArray) -> FloatArray:
    """Return Σ (Σ of the shares of one run)², for a signal in codes (n,) and shares (m, n).

    What rounding without dither does goes with the signal's place between two codes: it is one error, not many, while the signal itself
    stays in one half of a code.
    """
    starts = np.flatnonzero(np.append(True, np.diff(np.floor(2.0 * codes)) != 0.0))
    return np.asarray(np.sum(np.add.reduceat(shares, starts, axis=1) ** 2, axis=1))
