"""The results at one speed of a driven motor, and the figures that follow from several speeds."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import Accuracy, Reading
from procedures.core.curves import curve
from procedures.estimation.emf.agreement import Combined
from procedures.estimation.emf.back_emf import BackEmfFit
from procedures.estimation.emf.speed_trend import OverSpeeds
from procedures.estimation.fitting.misfit import NO_MISFIT, Misfit


@dataclass(frozen=True)
class SpeedPoint:
    """The results at one speed, with Type A uncertainties.

    Phase EMF `amplitude` (V, fundamental, peak) and `flux` linkage (V·s/rad), both speeds (rad/s), the note's peak reading, the
    accuracies of the channels that the EMF is the mean of, and what the record shows beyond the model.
    """

    amplitude: float
    flux: Combined
    accuracies: Mapping[int, Accuracy]
    electrical_speed: float
    mechanical_speed: Reading
    note_amplitude: float
    details: dict[str, Any]
    misfit: Misfit = NO_MISFIT


def over_mechanical(point: SpeedPoint) -> Combined:
    """Return the EMF over the mechanical speed (V·s/rad)."""
    speed, ratio = point.mechanical_speed, point.electrical_speed / point.mechanical_speed.value
    value = point.amplitude / speed.value
    # Each reading's last digit is its own; gain and offset are the tachometer's at all speeds.
    digit = speed.accuracy.resolution / speed.value / math.sqrt(12.0)
    return replace(
        point.flux,
        value=value,
        uncertainty=math.hypot(ratio * point.flux.uncertainty, value * digit),
        scatter=ratio * point.flux.scatter,
    )


def largest_gain(points: Sequence[SpeedPoint]) -> float:
    """Return the largest limit of gain that the channels' accuracies state, relative."""
    return max(accuracy.gain for point in points for accuracy in point.accuracies.values())


def first_periods(
    time: NDArray[np.float64], samples: NDArray[np.float64], fit: BackEmfFit, periods: float
) -> dict[str, list[float]]:
    """Return the first periods of every channel (V) as recorded and as fitted, for whoever draws them."""
    shown = time <= time[0] + periods / fit.frequency
    columns = {"time": time[shown] - time[0]}
    for number, (recorded, left) in enumerate(zip(samples, fit.residuals, strict=True), 1):
        columns |= {f"channel_{number}": recorded[shown], f"fitted_{number}": (recorded - left)[shown]}
    return curve(**columns)


def trend_rows(over: OverSpeeds) -> dict[str, Any]:
    """Return what was tried on the speeds' trend, for the findings."""
    return {
        "p_value": over.p_value,
        "law": over.law,
        "laws": [{"law": each.name, "intercept": each.value, "p_value": each.p_value} for each in over.laws],
    }
