"""The torque that drives a ramp, from readings that scatter, vary, or turn with the shaft."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from procedures.estimation.fitting.checks import series
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.noise import white_noise
from procedures.estimation.fitting.smoothing import smooth

#: A torque that varies by more than so many times its scatter is no level.
_LEVEL = 1.3
#: Smallest singular value of the design, per root of readings, by which what turns can be told from the level.
_APART = 0.05
#: Degree of a course, least share of the scatter that is a swing about it, and the share of a shaft's answer to a swing below which, so
#: many standard deviations allowed for, it does not follow.
_COURSE, _SWINGS, _FOLLOWS, _SURE = 5, 0.7, 0.5, 4.0
#: Share of a torque's variance that may be left of what turns with a shaft that does not follow it.
_LEFT = 0.1
#: Share of a swing's variance that its second half has at least, and by how many times its variance exceeds the scatter's.
_LASTS, _CLEAR = 0.2, 3.0


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
    if (beside := _beside_the_shaft(torque, time, speed)) is not None:
        return RampTorque(np.full_like(torque, np.mean(torque)), beside, False)
    smoothed = smooth(torque, scatter) if scatter > 0.0 else None
    return RampTorque(torque if smoothed is None else smoothed.values, noise, True)


def _beside_the_shaft(torque: FloatArray, time: FloatArray, speed: FloatArray) -> float | None:
    """Return what the mean (N·m) of torques (n,) that swing may be off by where the speeds (n,) do not follow the swing: a vibration of the
    transducer. None where they do, and where the torque has a course rather than a swing.
    """
    smooth_part = _course(time)
    swing = torque - smooth_part @ (smooth_part.T @ torque)
    if (
        np.std(swing) < _SWINGS * np.std(torque)
        or not _lasts(swing, white_noise(torque))
        or _is_followed(torque, time, speed)
    ):
        return None
    turns = np.flatnonzero(np.diff(np.sign(swing))) + 1
    longest = float(np.max(np.diff(time[np.concatenate(([0], turns, [-1]))])))
    return math.sqrt(2.0) * float(np.std(swing)) * longest / float(time[-1] - time[0])


def _is_followed(torque: FloatArray, time: FloatArray, speed: FloatArray) -> bool:
    """Return whether the speeds (n,) may be those of a shaft that what swings in the torques (n,) acts on."""
    smooth_part = _course(time)
    swing = torque - smooth_part @ (smooth_part.T @ torque)
    pushed = np.append(0.0, np.cumsum(0.5 * (swing[1:] + swing[:-1]) * np.diff(time)))
    pushed -= smooth_part @ (smooth_part.T @ pushed)
    left = speed - smooth_part @ (smooth_part.T @ speed)
    size = float(pushed @ pushed)
    followed = float(pushed @ left) / size
    scatter = float(np.std(left - followed * pushed)) / math.sqrt(size)
    # Friction leaves less of the torque to the inertia than all of it.
    as_shaft = abs(float(speed[-1] - speed[0])) / (float(time[-1] - time[0]) * abs(float(np.mean(torque))))
    return abs(followed) + _SURE * scatter > _FOLLOWS * as_shaft


def _lasts(swing: FloatArray, scatter: float) -> bool:
    """Return whether a swing (n,) is well above the scatter and goes on in the second half of a ramp: what a filter leaves at its beginning
    does not.
    """
    whole, second = float(np.var(swing)) - scatter**2, float(np.var(swing[swing.size // 2 :])) - scatter**2
    return whole > _CLEAR * scatter**2 and second > _LASTS * whole


def _course(time: FloatArray) -> FloatArray:
    """Return directions (n, k) that speeds of a shaft with friction are along, and torques behind a filter."""
    x = 2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0
    return np.asarray(np.linalg.qr(chebyshev.chebvander(x, _COURSE))[0], dtype=np.float64)


def torque_runout(torque: FloatArray, time: FloatArray, speed: FloatArray) -> TorqueRunout | None:
    """Return the level of a ramp's torques (N·m, (n,)) and what comes once a turn beside it, from times (s) and speeds (rad/s).

    None where what is left is no level, or the turns are not told from it.
    """
    angle = np.append(0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time)))
    once, twice, pace = np.exp(1j * angle), np.exp(2j * angle), np.abs(speed) / float(np.max(np.abs(speed)))
    # A reading that is late turns on, and fades, as the shaft is faster.
    turns = np.column_stack([part for k in range(2) for part in (pace**k * once.real, pace**k * once.imag)])
    design = np.column_stack((np.ones_like(angle), turns, twice.real, twice.imag))
    freedom = torque.size - design.shape[1]
    if freedom < 5 or np.linalg.svd(design, compute_uv=False)[-1] < _APART * math.sqrt(torque.size):
        return None
    found, *_ = np.linalg.lstsq(design, torque, rcond=None)
    left = torque - design @ found
    variance = float(left @ left) / freedom
    # What a wave hides from one reading to the next is none of the scatter.
    if np.std(left) > _LEVEL * white_noise(left):
        # A mean over many readings fades further, and not by as much for each turn.
        turns = np.column_stack([part for k in range(4) for part in (pace**k * once.real, pace**k * once.imag)])
        design = np.column_stack((np.ones_like(angle), turns, twice.real, twice.imag))
        found, *_ = np.linalg.lstsq(design, torque, rcond=None)
        left = torque - design @ found
        if np.var(left) > _LEFT * np.var(torque) or not _lasts(turns @ found[1 : 1 + turns.shape[1]], 0.0):
            return None
        if _is_followed(torque, time, speed):
            return None
        # What is left comes in waves of about a turn.
        variance = float(left @ left) / max(float(angle[-1]) / (2.0 * math.pi), 1.0)
    wave = turns @ found[1 : 1 + turns.shape[1]]
    return TorqueRunout(
        float(found[0]),
        math.sqrt(variance * float(np.linalg.pinv(design.T @ design)[0, 0])),
        math.sqrt(2.0 * float(np.mean(wave**2))),
        math.sqrt(2.0 * variance * turns.shape[1] / torque.size),
    )
