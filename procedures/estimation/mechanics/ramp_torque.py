"""The torque that drives a ramp, from readings that scatter, vary, or turn with the shaft."""

import math
from dataclasses import dataclass

import numpy as np

from procedures.estimation.fitting.checks import series
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.noise import white_noise
from procedures.estimation.fitting.smoothing import smooth

#: A torque that varies by more than so many times its scatter is no level.
_LEVEL = 1.3
#: Smallest singular value of the design, per root of readings, by which what turns can be told from the level.
_APART = 0.05


@dataclass(frozen=True)
class RampTorque:
    """The torque (N·m) at a ramp's readings (n,), its level's standard uncertainty, and whether it is more than a level."""

    values: FloatArray
    noise: float
    varies: bool


@dataclass(frozen=True)
class TorqueRunout:
    """A torque's level (N·m), its standard uncertainty, and the `amplitude` (N·m) of what comes once a turn beside it, with what scatter
    alone makes of that, both root mean square times √2.
    """

    level: float
    uncertainty: float
    amplitude: float
    of_scatter: float

    @property
    def likely(self) -> float:
        """The amplitude (N·m) without what scatter makes of it, 0 where that is all."""
        return math.sqrt(max(self.amplitude**2 - self.of_scatter**2, 0.0))

    @property
    def score(self) -> float:
        """How many times what scatter makes it is."""
        return self.amplitude / self.of_scatter if self.of_scatter > 0.0 else 0.0


def ramp_torque(given: float | FloatArray, time: FloatArray, speed: FloatArray, number: int) -> RampTorque:
    """Return the torque of ramp `number` from one value or readings (n,) at times (s), the shaft turning at speeds (rad/s).

    What comes once or twice a turn and leaves a level beside it is the transducer's, or moves the shaft back as far as forth; its mean
    over a ramp that gains speed is none, though. Raises EstimationError for what is no number.
    """
    torque = np.asarray(given, dtype=np.float64)
    if not torque.ndim:
        if not np.isfinite(torque):
            raise EstimationError(f"the torque of ramp {number} is not a number; enter it, or 0 for a coast-down")
        return RampTorque(np.full(time.size, float(torque)), 0.0, False)
    torque = series(f"torque of ramp {number}", torque)
    scatter = white_noise(torque)
    noise = float(scatter / np.sqrt(torque.size))
    if np.std(torque) <= _LEVEL * scatter:
        return RampTorque(np.full_like(torque, np.mean(torque)), noise, False)
    if (turning := torque_runout(torque, time, speed)) is not None:
        return RampTorque(np.full_like(torque, turning.level), turning.uncertainty, False)
    smoothed = smooth(torque, scatter) if scatter > 0.0 else None
    return RampTorque(torque if smoothed is None else smoothed.values, noise, True)


def torque_runout(torque: FloatArray, time: FloatArray, speed: FloatArray) -> TorqueRunout | None:
    """Return the level of a ramp's torques (N·m, (n,)) and what comes once a turn beside it, from times (s) and speeds (rad/s).

    None where what is left is no level, or the turns are not told from it.
    """
    angle = np.append(0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time)))
    once, twice, pace = np.exp(1j * angle), np.exp(2j * angle), np.abs(speed) / float(np.max(np.abs(speed)))
    # A reading that is late turns on, and fades, as the shaft is faster.
    turns = np.column_stack((once.real, once.imag, pace * once.real, pace * once.imag))
    design = np.column_stack((np.ones_like(angle), turns, twice.real, twice.imag))
    freedom = torque.size - design.shape[1]
    if freedom < 1 or np.linalg.svd(design, compute_uv=False)[-1] < _APART * math.sqrt(torque.size):
        return None
    found, *_ = np.linalg.lstsq(design, torque, rcond=None)
    left = torque - design @ found
    # What a wave hides from one reading to the next is none of the scatter.
    if np.std(left) > _LEVEL * white_noise(left):
        return None
    variance = float(left @ left) / freedom
    wave = turns @ found[1:5]
    return TorqueRunout(
        float(found[0]),
        math.sqrt(variance * float(np.linalg.inv(design.T @ design)[0, 0])),
        math.sqrt(2.0 * float(np.mean(wave**2))),
        math.sqrt(2.0 * variance * turns.shape[1] / torque.size),
    )
