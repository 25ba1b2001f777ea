"""Shaft torque at levels of the inverter's current, read once no filter of the transducer lags behind them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import Accuracy
from drivers.interfaces.text import text
from procedures.core.bench import Bench, ProcedureError
from procedures.estimation.fitting.fit import Fit
from procedures.estimation.fitting.noise import undithered
from procedures.estimation.mechanics.torque_constant import drift_within_levels, fit_torque_constant

#: Waits before the readings of a level that are tried one after the other, in units of the first.
_LONGER = (1.0, 4.0, 16.0)
#: The first level is waited for so many times longer: the shaft has just been run up, and the current comes from nothing.
_AT_FIRST = 10.0
#: Where the torque still moves by less than this share of a step, the level before it has been forgotten.
_LEFT = 0.02


@dataclass(frozen=True)
class TorqueLevels:
    """Current (A, peak) and the motor's torque on the shaft (N·m), both of shape (levels, readings), and their accuracies.

    `settling` (s) is how long each level was waited for.
    """

    currents: NDArray[np.float64]
    torques: NDArray[np.float64]
    current_accuracy: Accuracy
    torque_accuracy: Accuracy
    settling: float

    def fit(self) -> Fit:
        """Fit torque over current, a point a level: readings of one level share what rounding leaves of them."""
        steps = self.torque_accuracy.resolution, self.current_accuracy.resolution
        torque, current = (
            undithered(max(float(np.std(values - values.mean(axis=1)[:, None])), step / math.sqrt(12.0)), step)
            for values, step in zip((self.torques, self.currents), steps, strict=True)
        )
        levels = self.currents.mean(axis=1), self.torques.mean(axis=1)
        slope = fit_torque_constant(*levels).value("torque_constant")
        # A step of the current is one of the torque that it makes.
        return fit_torque_constant(*levels, torque_resolution=math.sqrt(12.0) * math.hypot(torque, slope * current))


def torque_at_levels(
    bench: Bench, levels: Sequence[float], readings: int, interval: float, settling: float
) -> TorqueLevels:
    """Return readings `interval` (s) apart at each current (A), `settling` (s) after it was set, or longer where the torque lags.

    Speed and current are driven already; levels follow one another in even steps. Where a little of a lag is left, the first is left out.
    Raises ProcedureError where the torque lags however long it is waited for.
    """
    for share in _LONGER:
        taken = _taken(bench, levels, readings, interval, share * settling)
        drift = drift_within_levels(taken.torques, taken.torque_accuracy.resolution)
        if not drift or bench.dynamometer.read_by_hand:
            return taken
    if abs(drift) < _LEFT * abs(float(np.mean(np.diff(taken.torques.mean(axis=1))))):
        # Alike at all levels but the first, it is an offset of the others.
        return replace(taken, currents=taken.currents[1:], torques=taken.torques[1:])
    raise ProcedureError(
        text(
            "the torque still changes {settling:g} s after a current was set, as behind a slow filter: shorten the torque transducer's "
            "filter, or set settling to more than five of its time constants",
            settling=taken.settling,
        )
    )


def _taken(bench: Bench, levels: Sequence[float], readings: int, interval: float, settling: float) -> TorqueLevels:
    currents, torques = np.empty((len(levels), readings)), np.empty((len(levels), readings))
    torque_accuracy = current_accuracy = Accuracy()
    for place, level in enumerate(levels):
        bench.inverter.set_current(float(level))
        bench.clock.sleep(settling if place else _AT_FIRST * settling)
        for number in range(readings):
            bench.clock.sleep(interval)
            reading = bench.dynamometer.measure()
            current = bench.inverter.measure_current()
            # What the dynamometer puts on the shaft, the motor takes off.
            torques[place, number], currents[place, number] = -reading.torque, current.value
            torque_accuracy, current_accuracy = reading.torque_accuracy, current.accuracy
    return TorqueLevels(currents, torques, current_accuracy, torque_accuracy, settling)
