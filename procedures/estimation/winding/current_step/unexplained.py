"""Misfit in the residuals of a step that no term of its model explains."""

import numpy as np
from scipy import special

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import score_test
from procedures.estimation.winding.current_step.fit import Fitted, Problem
from procedures.estimation.winding.current_step.term import StepScale
from procedures.estimation.winding.current_step.variance import StepVariance

#: An expanded uncertainty above this share of the value is no figure.
_NO_FIGURE = 0.2
_BLOCKS, _BY_CHANCE = 32, 1e-6
#: Parts of a record after the step, in time constants: what is explained gives the same on all.
_PARTS = ((0.0, 1.0), (0.0, 2.0), (0.5, np.inf), (1.0, np.inf), (0.5, 2.0))
#: How much of the parts' excess is added.
_EXCESS = 1.5


def no_figure(fitted: Fitted, values: FloatArray, growth: FloatArray, apart: FloatArray) -> FloatArray:
    """Tell of resistance and inductance (2,) whether so little is known of them that there is no figure.

    `values`, `growth` and `apart` are those of a `StepJudgement`.
    """
    uncertainty = apart + np.sqrt(growth * np.diag(fitted.covariance)[: apart.size])
    return np.asarray(2.0 * uncertainty[:2] / np.abs(values[:2]) > _NO_FIGURE)


def structured(step: Problem, fitted: Fitted) -> bool:
    """Return whether sums over blocks of the residuals are larger than noise and rounding make them."""
    size = step.record.time.size
    length = max(size // _BLOCKS, 2)
    starts = np.arange(0, size - length + 1, length)
    sums = np.add.reduceat(fitted.residuals[:size], starts)
    limit = float(special.chdtri(starts.size, _BY_CHANCE))
    if float(sums @ sums) / length <= limit:
        return False
    rows = np.zeros((starts.size, fitted.residuals.size))
    for row, begin in zip(rows, starts, strict=True):
        row[begin : begin + length] = 1.0
    z = score_test(fitted.residuals, fitted.slopes, rows, StepVariance(step, fitted)).z
    return bool(z @ z > limit)


def of_parts(step: Problem, fitted: Fitted, scale: StepScale) -> FloatArray:
    """Return a standard uncertainty (k,) from how far fits of parts of the record lie apart beyond their own uncertainties."""
    record, count = step.record, len(step.names)
    since = (record.time - scale.begin) / scale.time_constant
    size = record.time.size
    worst = np.zeros(count)
    sizes = np.sqrt(np.diag(fitted.covariance))
    for begin, end in _PARTS:
        chosen = np.append(
            (since < 0.0) | ((since >= begin) & (since <= end)), np.ones(fitted.residuals.size - size, bool)
        )
        rows = (fitted.slopes * sizes[:, None])[:, chosen]
        inverse = np.linalg.pinv(rows @ rows.T, hermitian=True)
        change = np.abs(inverse @ (rows @ fitted.residuals[chosen]))[:count]
        chance = 2.0 * np.sqrt(np.maximum(np.diag(inverse)[:count] - 1.0, 0.0))
        worst = np.maximum(worst, np.maximum(change - chance, 0.0))
    return np.asarray(0.5 * _EXCESS * worst * sizes[:count])
