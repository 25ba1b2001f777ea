"""Voltage errors of a transistor bridge: dead time and the devices' drops."""

from dataclasses import dataclass

import numpy as np

from sim_instruments.physics.circuits.windings import FloatArray


@dataclass(frozen=True)
class BridgeError:
    """A leg's mean voltage error over a switching period, by its current: against the current, whichever way it flows.

    `step` (V) in full above `knee` (A), in proportion to the current below it, where the ripple crosses zero within a period;
    `resistance` (Ω) of the conducting device on top.
    """

    step: float = 0.0
    knee: float = 0.0
    resistance: float = 0.0

    @property
    def none(self) -> bool:
        """True if the bridge puts out the commanded voltage."""
        return self.step == 0.0 and self.resistance == 0.0

    def of_legs(self, currents: FloatArray) -> FloatArray:
        """Return what the legs lose (V, shape of `currents`) at their momentary currents (A)."""
        share = np.sign(currents) if self.knee == 0.0 else np.clip(currents / self.knee, -1.0, 1.0)
        return self.step * share + self.resistance * currents

    def fundamental(self, amplitude: FloatArray) -> FloatArray:
        """Return the amplitude (V) of the fundamental that legs with sinusoidal currents lose, at their amplitudes (A).

        It is in phase with the current: the describing function of the limiter that `of_legs` is.
        """
        above = amplitude > self.knee
        ratio = self.knee / np.where(above, amplitude, 1.0)
        small = ratio < 1e-9
        # arcsin(r)/r + √(1 − r²) is 2 for no knee at all.
        inside = np.where(small, 1.0, np.arcsin(np.minimum(ratio, 1.0)) / np.where(small, 1.0, ratio))
        inside = inside + np.sqrt(np.maximum(1.0 - ratio**2, 0.0))
        below = np.minimum(amplitude, self.knee) / (self.knee or 1.0)
        result: FloatArray = self.step * np.where(above, 2.0 / np.pi * inside, below)
        return result + self.resistance * amplitude
