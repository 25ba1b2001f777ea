"""A shaft under a torque that is known over time: integrated, and read between its points."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_instruments.physics.circuits.windings import FloatArray
from sim_instruments.physics.integration.swing_equations import Shaft


@dataclass(frozen=True)
class Traced:
    """Angle (rad), speed (rad/s) and acceleration (rad/s²) at `times` (s, rising); `reversed` says that the shaft stands at the last."""

    times: FloatArray
    angles: FloatArray
    speeds: FloatArray
    accelerations: FloatArray
    reversed: bool

    @classmethod
    def under(
        cls, torque: Callable[[FloatArray], FloatArray], shaft: Shaft, times: FloatArray, angle: float, speed: float
    ) -> "Traced":
        """Integrate from an angle and a speed on, as far as the shaft turns one way; at rest it goes where the torque pulls it.

        `torque` (N·m, without friction) is asked at all times at once, and half-way between them.
        """
        step = np.diff(times)
        pull, between = torque(times), torque(times[:-1] + 0.5 * step)
        way = float(np.sign(speed)) or float(np.sign(pull[np.argmax(np.abs(pull) > shaft.static_friction)]))

        def rate(torque_now: float, now: float) -> float:
            # Static friction is what a shaft stops by: it takes no part in the sign of what slides.
            sliding = way * shaft.coulomb_friction + shaft.viscous_friction * now + shaft.bearing.drag(now)
            return (torque_now - sliding) / shaft.inertia

        angles, speeds, rates = [angle], [speed], [rate(float(pull[0]), speed)]
        for k, h in enumerate(step):
            # Runge-Kutta's third order: the torque depends on the time alone, the friction hardly on the speed.
            middle = rate(float(between[k]), speeds[-1] + 0.5 * h * rates[-1])
            last = rate(float(pull[k + 1]), speeds[-1] + h * (2.0 * middle - rates[-1]))
            gained = h * (rates[-1] + 4.0 * middle + last) / 6.0
            after = speeds[-1] + gained
            if way * after < 0.0:
                # It turns back within this step: there it stands.
                share = speeds[-1] / (speeds[-1] - after) if speeds[-1] != after else 0.0
                share = min(max(share, 1e-9), 1.0)
                angles.append(angles[-1] + share * h * (0.5 * speeds[-1]))
                speeds.append(0.0)
                rates.append(rates[-1])
                reached = np.append(times[: k + 1], times[k] + share * h)
                return cls(reached, np.array(angles), np.array(speeds), np.array(rates), True)
            angles.append(angles[-1] + h * speeds[-1] + h * h * (rates[-1] + 2.0 * middle) / 6.0)
            speeds.append(after)
            rates.append(rate(float(pull[k + 1]), after))
        return cls(times, np.array(angles), np.array(speeds), np.array(rates), False)

    def angle(self, times: FloatArray) -> FloatArray:
        """Return the angle at the times."""
        k, passed, width, rise = self._at(times)
        jerk = rise / width
        return np.asarray(
            self.angles[k]
            + passed * (self.speeds[k] + passed * (0.5 * self._start_rate(k, width, rise) + passed * jerk / 6.0))
        )

    def speed(self, times: FloatArray) -> FloatArray:
        """Return the speed at the times."""
        k, passed, width, rise = self._at(times)
        return np.asarray(self.speeds[k] + passed * (self._start_rate(k, width, rise) + 0.5 * passed * rise / width))

    def acceleration(self, times: FloatArray) -> FloatArray:
        """Return the acceleration at the times."""
        k, passed, width, rise = self._at(times)
        return np.asarray(self._start_rate(k, width, rise) + passed * rise / width)

    def _at(self, times: FloatArray) -> tuple[NDArray[np.intp], FloatArray, FloatArray, FloatArray]:
        """Return the piece that each time lies in, the time in it, its width, and by how much the acceleration changes along it."""
        found = np.searchsorted(self.times, times, side="right") - 1
        k = np.clip(found, 0, len(self.times) - 2).astype(np.intp)
        return k, times - self.times[k], np.diff(self.times)[k], np.diff(self.accelerations)[k]

    def _start_rate(self, k: NDArray[np.intp], width: FloatArray, rise: FloatArray) -> FloatArray:
        """Return the acceleration at each piece's beginning that brings it to the speed of its end."""
        return np.asarray(np.diff(self.speeds)[k] / width - 0.5 * rise)
