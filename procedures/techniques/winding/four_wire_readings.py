"""The largest difference of four-wire readings of one line by the stated accuracies of both meters."""

from collections.abc import Sequence

import numpy as np

from drivers.interfaces import Accuracy, Reading
from procedures.estimation.fitting.fit import Fit, FloatArray
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit

#: Readings that scatter by more than this share of the largest voltage give no figure.
_MOST_SCATTER = 0.05


def ratio_limit(read: Sequence[tuple[Reading, Reading]]) -> float:
    """Return by how much V over I (Ω) at the smallest current may be off for the offsets of both meters."""
    current, voltage = min(read, key=lambda each: each[0].value)
    share = current.accuracy.offset / current.value
    return (voltage.accuracy.offset + share * abs(voltage.value)) / current.value


def scattered(fit: Fit, currents: FloatArray, accuracies: tuple[Accuracy, Accuracy]) -> Misfit:
    """Return that a line's readings scatter more than the limits of error of both meters, current's and voltage's, explain."""
    largest, ohms = float(np.max(np.abs(currents))), fit.value("resistance")
    current, voltage = (
        each.gain * scale + each.offset + each.resolution
        for each, scale in zip(accuracies, (largest, largest * ohms), strict=True)
    )
    if fit.residual_rms <= voltage + ohms * current:
        return NO_MISFIT
    share = fit.residual_rms / (largest * ohms)
    figures: dict[str, float | str] = {"count": float(currents.size), "scatter": share, "record": "four-wire-scatter"}
    answer = Answer.WITHHELD if share > _MOST_SCATTER else Answer.WIDENED
    return Misfit((Finding(Cause.REPEATS_DIFFER, answer, figures=figures),))
