"""Mains hum on the voltage channel of a step: detected before the step, and a term of the model beside the hum on the current."""

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from procedures.estimation.fitting.first_order import respond_evenly
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.fitting.noise import MAINS, undithered
from procedures.estimation.winding.current_step.fit import Fitted, Problem
from procedures.estimation.winding.current_step.record import StepRecord
from procedures.estimation.winding.current_step.term import StepScale, Term

#: Hum is in the model where it lowers χ² of the voltage before the step by so much; another frequency is as likely within so much.
_SEEN, _AS_LIKELY = 20.0, 12.0
#: The circuit that the voltage's hum would have driven is known to this share.
_ALIKE = 3e-4
#: No lead picks up more than this share of the step.
_MOST = 0.3


@dataclass(frozen=True)
class HumOfBoth(Term):
    """Mains hum on both channels: sine and cosine on the current's, in steps, and two parts on the voltage's.

    The latter are in standard deviations from what the voltage before the step shows of them: sine and cosine (V) are
    `shown` + `spread`·parts. The circuit has `rate` (1/s) and `inductance` (H), and is driven from `edge` (s) on by what is read beyond the
    mean of before, of which sine and cosine have `means`.
    """

    cause: ClassVar[Cause] = Cause.HUM
    family: ClassVar[str] = "hum"
    straight: ClassVar[bool] = True
    #: It has two figures more than hum on the current alone.
    price: ClassVar[float] = 4.0
    frequency: float
    shown: tuple[float, ...] = field(compare=False)
    spread: tuple[tuple[float, ...], ...] = field(compare=False)
    means: tuple[float, ...] = field(compare=False)
    edge: float = field(compare=False)
    rate: float = field(compare=False)
    inductance: float = field(compare=False)
    start: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    known: tuple[float, ...] = (np.inf, np.inf, 1.0, 1.0)
    evidence: float = field(default=0.0, compare=False)

    def beside(self, time: FloatArray, scale: StepScale, figures: FloatArray) -> FloatArray | float:
        """Return what is read beside the current (A): its own hum, and what the voltage's would have driven and did not."""
        waves = mains_waves(self.frequency, time, scale)
        read = self._volts(figures) @ (waves - np.array(self.means)[:, None])
        read = np.where(time > self.edge, read, 0.0)
        step = float(time[1] - time[0])
        return np.asarray(
            scale.current * (figures[:2] @ waves) + respond_evenly(step, -read / self.inductance, self.rate)
        )

    def renewed(self, resistance: float, inductance: float) -> "HumOfBoth":
        """Return the same for a circuit of so many Ω and H."""
        return replace(self, rate=resistance / inductance, inductance=inductance)

    def fits(self, resistance: float, inductance: float) -> bool:
        """Tell whether the circuit of the term is that of so many Ω and H, as closely as counts."""
        apart = (self.rate * inductance / resistance - 1.0, self.inductance / inductance - 1.0)
        return max(map(abs, apart)) < _ALIKE

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        """Return what was found, in SI."""
        return {
            "record": "step-both",
            "frequency": self.frequency,
            "amplitude": float(abs(scale.current) * np.hypot(*figures[:2])),
            "voltage": float(np.hypot(*self._volts(figures))),
        }

    def _volts(self, figures: FloatArray) -> FloatArray:
        return np.asarray(np.array(self.shown) + np.array(self.spread) @ figures[2:])


def mains_waves(frequency: float, time: FloatArray, scale: StepScale) -> FloatArray:
    """Return sine and cosine (2, n) of a frequency (Hz), from the step on."""
    angle = 2.0 * np.pi * frequency * (time - scale.begin)
    return np.array((np.sin(angle), np.cos(angle)))


@dataclass(frozen=True)
class HumOfVoltage:
    """Terms of hum on both channels, one for each frequency that is as likely, and by how many standard deviations the voltage shows
    it before the step.
    """

    terms: tuple[HumOfBoth, ...]
    score: float

    @property
    def certain(self) -> bool:
        """True if the voltage before the step alone shows the hum."""
        return self.score**2 >= _SEEN


def _noise(record: StepRecord, voltage: FloatArray) -> float:
    """Return the noise (V) of readings at rest, with what rounding adds: the samples of one code err alike."""
    noise, code = record.voltage_noise, record.voltage_resolution
    alike = voltage.size / (1.0 + (float(np.ptp(voltage)) / code if code else voltage.size))
    return float(np.hypot(noise, undithered(noise, code) * np.sqrt(alike)))


def hum_of_voltage(step: Problem, fitted: Fitted, scale: StepScale) -> HumOfVoltage:
    """Return what the voltage before the step shows of hum."""
    record = step.record
    before, level = slice(0, record.edge), float(np.ptp(record.drive))
    voltage = record.voltage[before] - record.baseline
    noise = _noise(record, voltage)
    found = []
    for frequency in MAINS:
        if frequency * record.step >= 0.4:
            continue
        waves = mains_waves(frequency, record.time[before], scale)
        means = np.mean(waves, axis=1)
        # The voltage's offset is free.
        axes, sizes, shapes = np.linalg.svd((waves - means[:, None]) / noise, full_matrices=False)
        along = shapes @ voltage / noise
        # A short baseline leaves the arc's bend open, which has bounds all the same.
        known = sizes**2 + 1.0 / (_MOST * level) ** 2
        found.append(
            (
                float(along @ along),
                HumOfBoth(
                    frequency,
                    tuple(axes @ (sizes * along / known)),
                    tuple(map(tuple, axes / np.sqrt(known))),
                    tuple(means),
                    float(record.time[record.edge] - 0.5 * record.step),
                    float(fitted.full[0] / fitted.full[1]),
                    float(fitted.full[1]),
                    evidence=float(along @ along),
                ),
            )
        )
    fall = max((f for f, _ in found), default=0.0)
    return HumOfVoltage(tuple(term for f, term in found if f > fall - _AS_LIKELY), float(np.sqrt(fall)))
