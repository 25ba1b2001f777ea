"""Zero of a dynamometer's torque, read at rest before and after what it is needed for."""

import math
from dataclasses import dataclass

import numpy as np
from GTC.lib import UncertainReal
from numpy.typing import NDArray

from drivers.interfaces.text import text
from procedures.core.bench import Bench
from procedures.core.budget import Uncertainties
from procedures.estimation.fitting.misfit import ALARM, NO_MISFIT, Answer, Cause, Finding, Misfit
from procedures.estimation.fitting.noise import undithered, white_noise
from procedures.estimation.mechanics.ramp_torque import TorqueRunout

#: Readings of one zero.
_READINGS = 25
#: What turns with the shaft is told where it is so many times what scatter makes: chance has that in one of 10⁷ records (χ² of 4 degrees).
_TURNS = 3.1
#: Share of the change between two zeros by which a course that bends may leave the straight line between them.
_BEND = 0.25


@dataclass(frozen=True)
class TorqueZero:
    """The zero (N·m) at bench time `time` (s), its standard `uncertainty` from the scatter."""

    time: float
    value: float
    uncertainty: float


@dataclass(frozen=True)
class ZeroLine:
    """The zero between two times, taken to go straight from one to the other.

    `runout` is what turns with the shaft in the torque's readings, where it is known: a zero has as much of it as the angle makes at which
    the shaft happens to rest.
    """

    before: TorqueZero
    after: TorqueZero
    runout: TorqueRunout | None = None

    def at(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the zero (N·m) at bench times (s)."""
        begin, end = self.before, self.after
        return np.asarray(begin.value + (time - begin.time) * (end.value - begin.value) / (end.time - begin.time))

    @property
    def closed(self) -> bool:
        """True if the zero was read at both ends."""
        return self.after.time > self.before.time

    @property
    def _drift(self) -> float:
        return self.after.value - self.before.value

    @property
    def _score(self) -> float:
        spread = math.hypot(self.before.uncertainty, self.after.uncertainty)
        return self._drift / spread if spread else 0.0

    def left(self, unc: Uncertainties) -> UncertainReal:
        """Return what is left of the zero (N·m): the readings' scatter, and a bend where it moved beyond that."""
        scatter = max(self.before.uncertainty, self.after.uncertainty)
        zero = unc.statistical("zeroing the torque", 0.0, scatter, float(_READINGS - 1))
        if abs(self._score) > ALARM:
            zero = zero + unc.limit("drift of the torque's zero", 0.0, _BEND * abs(self._drift))
        if self.runout is not None:
            # A sine at any angle; both zeros may have been read at the same one.
            angle = text("torque's zero: angle of the shaft at rest")
            zero = zero + unc.standard(angle, 0.0, self.runout.likely / math.sqrt(2.0))
        return zero

    def misfit(self, torque: float) -> Misfit:
        """Return what is to be told of a zero that moved, and of a torque that turns with the shaft, of a ramp's torque (N·m)."""
        turning = self.runout
        if turning is not None and turning.score > _TURNS:
            # The zeros differ as the angles at rest do.
            order: dict[str, float | str] = {"order": 1.0}
            return Misfit((Finding(Cause.ECCENTRICITY, Answer.WIDENED, score=turning.score, figures=order),))
        if abs(self._score) <= ALARM or not torque:
            return NO_MISFIT
        figures: dict[str, float | str] = {
            "drift": self._drift,
            "share": abs(self._drift / torque),
            "time": self.after.time - self.before.time,
        }
        return Misfit((Finding(Cause.TORQUE_ZERO, Answer.MODELLED, score=self._score, figures=figures),))


@dataclass(frozen=True)
class OpenZeroLine(ZeroLine):
    """The zero after its last reading, where nobody read it again: it stays, within what it moved by until then and what its readings
    leave open, longer as time (s) goes on until `end`.
    """

    end: float = 0.0

    def at(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the zero (N·m) at bench times (s)."""
        return np.full_like(time, self.after.value)

    def left(self, unc: Uncertainties) -> UncertainReal:
        """Return what is left of the zero (N·m): the readings' scatter, and what it may have moved by since."""
        scatter = max(self.before.uncertainty, self.after.uncertainty)
        longer = max(1.0, (self.end - self.after.time) / max(self.after.time - self.before.time, 1e-9))
        moved = (abs(self._drift) + 2.0 * scatter) * longer
        zero = unc.statistical("zeroing the torque", 0.0, scatter, float(_READINGS - 1))
        return zero + unc.limit(text("torque's zero, not read again"), 0.0, moved)


def read_zero(bench: Bench, interval: float, rest: float) -> TorqueZero:
    """Return the torque's zero, of a shaft that nothing drives and that has been at `rest` (s), from readings `interval` (s) apart."""
    bench.clock.sleep(rest)
    taken = []
    for _ in range(_READINGS):
        taken.append(bench.dynamometer.measure())
        bench.clock.sleep(interval)
    torque, resolution = np.array([r.torque for r in taken]), taken[-1].torque_accuracy.resolution
    scatter = white_noise(torque, resolution)
    uncertainty = math.hypot(scatter / math.sqrt(torque.size), undithered(scatter, resolution))
    return TorqueZero(float(np.mean([r.time for r in taken])), float(np.mean(torque)), uncertainty)
