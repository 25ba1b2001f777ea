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
#: Speeds and rates of decay that no fit needs.
_FAR, _STIFF = 30.0, 300.0

#: Gives for speeds (n,) what the shaft is accelerated by (rad/s²), and how fast a change of speed decays (1/s).
Accelerating = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


class TooFarError(Exception):
    """Parameters at which there is no motion to speak of."""


class Trajectory(NamedTuple):
    """One ramp at some parameters: `speed` (n,), `acceleration` (n,), how what is small is `passed` on, and the speed as `read`."""

    speed: FloatArray
    acceleration: FloatArray
    passed: Decay
    rate: FloatArray
    read: FloatArray

    def caused(self, drive: FloatArray, start: FloatArray | float = 0.0) -> FloatArray:
        """Return what small accelerations (…, n) (rad/s²) and changes of the first speed do to the speed."""
        return self.passed.respond(drive, start)


class RampMotion:
    """The motion of one ramp's shaft, found again and again at parameters nearby; `top` (rad/s) is the fastest of all ramps."""

    def __init__(self, run: Run, top: float, near: FloatArray | None = None) -> None:
        self._steps = np.diff(run.time)
        self._halves, self._bends = 0.5 * self._steps, self._steps**2 / 12.0
        self._length, self._top, self._measured = float(run.time[-1]), top, run.speed
        #: The speed where it was found last, or was measured.
        self.near = run.speed if near is None else near

    def trajectory(
        self, accelerating: Accelerating, first: float, extra: FloatArray | float, change: FloatArray | None = None
    ) -> Trajectory:
        """Return the motion from a `first` speed, with what is `extra` in the integral of the acceleration; a `change` (n,) from where it
        was found last may be foreseen.

        By Newton's method on the integral equation, which takes a few rounds for all times at once. Raises TooFarError.
        """
        speed, gone = self.near.copy(), np.zeros(self.near.size)
        if change is not None and np.max(np.abs(change)) < self._top:
            speed += change
        speed[0] = first
        before = _LEFT * self._top
        for _ in range(_ROUNDS):
            acceleration, rate = accelerating(speed)
            if not (np.max(np.abs(speed)) < _FAR * self._top and np.max(np.abs(rate)) * self._length < _STIFF):
                self.near = self._measured
                raise TooFarError
            bend = rate * acceleration
            gained = self._halves * (acceleration[1:] + acceleration[:-1])
            gained += self._bends * (bend[1:] - bend[:-1])
            np.cumsum(gained, out=gone[1:])
            left = first + gone + extra - speed
            passed = Decay(self._steps, self._halves * (rate[1:] + rate[:-1]))
            left += passed.respond(-rate * left)
            speed += left
            size = float(np.max(np.abs(left)))
            # As much less as this correction is than the one before, the next one is less than this.
            if size * max(size / before, size / self._top) < _SETTLED * self._top:
                break
            before = max(size, 1e-300)
        self.near = speed
        return Trajectory(speed, acceleration, passed, rate, speed)
