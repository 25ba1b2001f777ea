"""The motion of a shaft over one ramp, from what accelerates it."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from procedures.estimation.fitting.first_order import Decay
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.mechanics.turning import Run

#: The speed is found to this share of the top one, in so many rounds.
_SETTLED, _ROUNDS = 1e-12, 12
#: What a first correction leaves is at most so much of it, where the next one does not tell.
_LEFT = 1e-3
#: Corrections below this share of the top speed change the rates of decay by nothing that counts.
_SMALL = 1e-6
#: Speeds and rates of decay that no fit needs.
_FAR, _STIFF = 30.0, 300.0

#: Gives for speeds (…, n) what the shaft is accelerated by (rad/s²), and how fast a change of speed decays (1/s).
Accelerating = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


class Trajectory(NamedTuple):
    """One ramp at some parameters: `speed` (…, n), `acceleration` (…, n), how what is small is `passed` on, and the speed as `read`.

    `far` (…) is where there is no motion to speak of.
    """

    speed: FloatArray
    acceleration: FloatArray
    passed: Decay
    rate: FloatArray
    read: FloatArray
    far: FloatArray

    def caused(self, drive: FloatArray, start: FloatArray | float = 0.0) -> FloatArray:
        """Return what small accelerations (…, n) (rad/s²) and changes of the first speed do to the speed."""
        return self.passed.respond(drive, start)


class RampMotion:
    """The motion of one ramp's shaft, found again and again at parameters nearby; `top` (rad/s) is the fastest of all ramps."""

    def __init__(self, run: Run, top: float) -> None:
        self._steps = np.diff(run.time)
        self._halves, self._bends = 0.5 * self._steps, self._steps**2 / 12.0
        self._length, self._top, self._measured = float(run.time[-1]), top, run.speed
        #: The speed (…, n) where it was found last, or was measured.
        self.near = run.speed

    def trajectory(
        self, accelerating: Accelerating, first: FloatArray, extra: FloatArray | float, change: FloatArray | None = None
    ) -> Trajectory:
        """Return the motion from a `first` speed (…), with what is `extra` in the integral of the acceleration; a `change` (…, n) from
        where it was found last may be foreseen.

        By Newton's method on the integral equation, which takes a few rounds for all times at once.
        """
        shape = (*first.shape, self._measured.size)
        speed, gone = np.empty(shape), np.zeros(shape)
        speed[...] = self.near
        if change is not None and np.max(np.abs(change)) < self._top:
            speed += change
        speed[..., 0] = first
        before, far = _LEFT * self._top, np.zeros(first.shape, dtype=bool)
        passed: Decay
        for number in range(_ROUNDS):
            acceleration, rate = accelerating(speed)
            fastest, stiffest = np.maximum(speed.max(axis=-1), -speed.min(axis=-1)), np.abs(rate).max(axis=-1)
            there = (fastest < _FAR * self._top) & (stiffest * self._length < _STIFF)
            if not there.all():
                far |= ~there
                speed[far], acceleration[far], rate[far] = self._measured, 0.0, 0.0
            bend = rate * acceleration
            gained = self._halves * (acceleration[..., 1:] + acceleration[..., :-1])
            gained += self._bends * (bend[..., 1:] - bend[..., :-1])
            gained.cumsum(axis=-1, out=gone[..., 1:])
            left = gone + first[..., None]
            left += extra
            left -= speed
            if far.any():
                left[far] = 0.0
            if number == 0 or before > _SMALL * self._top:
                passed = Decay(self._steps, self._halves * (rate[..., 1:] + rate[..., :-1]))
            left += passed.respond(-rate * left)
            speed += left
            size = float(np.abs(left).max())
            # As much less as this correction is than the one before, the next one is less than this.
            if size * max(size / before, size / self._top) < _SETTLED * self._top:
                break
            before = max(size, 1e-300)
        self.near = speed
        return Trajectory(speed, acceleration, passed, rate, speed, far)
