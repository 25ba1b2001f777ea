"""Power of one phase from its voltage and current over whole periods."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import same_length, series, uniform_step
from procedures.estimation.fitting.fit import EstimationError


@dataclass(frozen=True)
class PhasePower:
    """Mean `power` (W) with its standard uncertainty and degrees of freedom; `voltage` (V) and `current` (A) are fundamentals, peak.

    `angle` (rad) is that by which the current lags.
    """

    power: float
    uncertainty: float
    degrees_of_freedom: float
    voltage: float
    current: float
    angle: float

    @property
    def reactive(self) -> float:
        """Reactive power (W) of the fundamentals: what the power changes by for each radian between the channels."""
        return 0.5 * self.voltage * self.current * math.sin(self.angle)


def phase_power(time: ArrayLike, voltage: ArrayLike, current: ArrayLike, frequency: float) -> PhasePower:
    """Return the mean of u·i (V, A, n samples each) over whole periods of a frequency (Hz).

    Means of both are taken off, for a winding behind an inverter carries no direct current and a channel's offset is none of it. The
    uncertainty is the scatter of the periods' own powers. Raises EstimationError for less than two whole periods.
    """
    t, u, i = (series(name, each) for name, each in (("time", time), ("voltage", voltage), ("current", current)))
    same_length(time=t, voltage=u, current=i)
    step = uniform_step(t)
    periods = int((float(t[-1] - t[0]) + step) * frequency + 1e-6)
    if periods < 2:
        raise EstimationError(
            f"the record holds {periods} whole periods of {frequency:.4g} Hz, two are needed; record longer"
        )
    # A sample belongs to the period that it lies in: each stands for its step.
    number = np.minimum(((t - t[0]) * frequency).astype(int), periods)
    whole = number < periods
    turn = np.exp(-2j * math.pi * frequency * (t - t[0]))
    u, i = u - float(np.mean(u[whole])), i - float(np.mean(i[whole]))
    powers = np.array([float(np.mean((u * i)[number == k])) for k in range(periods)])
    first, second = (2.0 * complex(np.mean((values * turn)[whole])) for values in (u, i))
    return PhasePower(
        float(np.mean(powers)),
        float(np.std(powers, ddof=1)) / math.sqrt(periods),
        float(periods - 1),
        abs(first),
        abs(second),
        float(np.angle(first / second)) if second else 0.0,
    )
