"""Mains hum as large as a current step: found before any fit, which would take it for the circuit's."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, FloatArray, WithheldError
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.fitting.noise import MAINS
from procedures.estimation.winding.current_step.fit import Fitted, Problem, fit_plain, fit_with, problem, scale_of
from procedures.estimation.winding.current_step.hum import mains_waves
from procedures.estimation.winding.current_step.record import StepRecord
from procedures.estimation.winding.current_step.term import StepScale, Term

#: Hum is large from this share of the step on, where the current before the step shows it by so many standard deviations, and where it
#: leaves in the integral equation no more than this share of the squares that a circuit alone leaves.
_LARGE, _SEEN, _LEFT = 0.5, 6.0, 0.5
#: It hides a step where it swings before it by so much of what the current swings in all.
_HIDES = 0.3
#: Lines are looked for below this share of the sampling rate, with so many samples before the step.
_SAMPLED, _LEAST_BEFORE = 0.4, 20
#: A net's frequency is known to this share (standard deviation), which counts where the hum is large.
_STRAY = 0.002


@dataclass(frozen=True)
class LargeHum(Term):
    """Mains hum on the current's channel: sine and cosine, in steps, and by how many standard deviations its frequency strays."""

    cause: ClassVar[Cause] = Cause.HUM
    family: ClassVar[str] = "hum"
    frequency: float
    start: tuple[float, ...] = (0.0, 0.0, 0.0)
    known: tuple[float, ...] = (np.inf, np.inf, 1.0)

    def beside(self, time: FloatArray, scale: StepScale, figures: FloatArray) -> FloatArray | float:
        """Return the hum (A)."""
        frequency = self.frequency * (1.0 + _STRAY * float(figures[2]))
        return np.asarray(scale.current * (figures[:2] @ mains_waves(frequency, time, scale)))

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        """Return what was found, in SI."""
        return {"frequency": self.frequency, "amplitude": abs(scale.current) * float(np.hypot(*figures[:2]))}


@dataclass(frozen=True)
class _Sight:
    """What the integral equation has of a record: `full` parameters (5,), the hum's `sizes` (2,), A, sine and cosine from the step on, and
    the sum of the squares that are `left`.
    """

    full: FloatArray
    frequency: float
    sizes: FloatArray
    left: float

    def without(self, record: StepRecord) -> StepRecord:
        """Return a record without the hum."""
        return replace(record, current=record.current - self.sizes @ _sines(record, self.frequency))


def seen_before(record: StepRecord, frequency: float) -> float:
    """Return by how many standard deviations the current before the step shows hum of a frequency (Hz)."""
    return float(np.linalg.norm(_wave_before(record, frequency))) / record.current_noise


def hidden_by_hum(record: StepRecord) -> WithheldError | None:
    """Return what says that hum hides a step of which nothing else can be made; None where the current before it shows no such hum."""
    frequency = max(MAINS, key=lambda f: seen_before(record, f))
    swing = float(np.ptp(record.current))
    if seen_before(record, frequency) < _SEEN or np.ptp(_wave_before(record, frequency)) < _HIDES * swing:
        return None
    figures: dict[str, float | str] = {"record": "step", "frequency": frequency, "amplitude": 0.5 * swing}
    return WithheldError(
        f"mains hum of {frequency:.0f} Hz hides the step of the current: keep the leads short and twisted",
        Misfit((Finding(Cause.HUM, Answer.WITHHELD, figures=figures),)),
    )


def hums_at_sight(record: StepRecord) -> tuple[_Sight, ...]:
    """Return hum nearly as large as a record's step, or larger, by its frequencies, the likeliest first; none where there is none such."""
    seen = [f for f in MAINS if seen_before(record, f) > _SEEN]
    if not seen:
        return ()
    alone = _at_sight(record)
    level = abs(float(np.mean(record.drive[-max(3, record.time.size // 50) :])))
    found = [
        sight
        for sight in (_at_sight(record, f) for f in seen)
        if sight.left < _LEFT * alone.left
        and np.all(sight.full[:2] > 0.0)
        and float(np.hypot(*sight.sizes)) * sight.full[0] > _LARGE * level
    ]
    return tuple(sorted(found, key=lambda sight: sight.left))


def fit_beside_hum(record: StepRecord, sights: Sequence[_Sight]) -> tuple[Problem, Fitted]:
    """Return the fit of the circuit beside large hum, and its problem. Raises EstimationError where there is none."""
    found = []
    for sight in sights:
        with suppress(EstimationError):
            quiet = sight.without(record)
            step, plain = fit_plain(problem(quiet, *sight.full[:3]), sight.full)
            step = replace(step, record=record)
            found.append((step, fit_with(step, (LargeHum(sight.frequency),), plain, scale_of(record, plain))))
    if not found:
        raise EstimationError("beside its hum the current does not follow the voltage")
    step, fitted = min(found, key=lambda each: each[1].cost)
    return step, fitted


def _sines(record: StepRecord, frequency: float) -> FloatArray:
    angle = 2.0 * np.pi * frequency * (record.time - record.time[record.edge])
    return np.array((np.sin(angle), np.cos(angle)))


def _at_sight(record: StepRecord, frequency: float = 0.0) -> _Sight:
    """Return what ∫v dt = R·∫i dt + L·i has of a record, with hum of a frequency (Hz) beside the current that flows, if any.

    Such hum is a sine and a cosine in it, and an offset a straight line.
    """

    def integral(x: FloatArray) -> FloatArray:
        return np.append(0.0, np.cumsum(0.5 * (x[1:] + x[:-1]))) * record.step

    lines = _sines(record, frequency) if frequency else np.empty((0, record.time.size))
    straight = np.array((np.ones_like(record.time), record.time - record.time[record.edge]))
    design = np.concatenate(([integral(record.current), record.current], straight, lines))
    sizes = np.sqrt(np.mean(design**2, axis=1))
    design /= sizes[:, None]
    driven = integral(record.drive)
    solution = np.linalg.lstsq(design @ design.T, design @ driven, rcond=None)[0]
    left = driven - solution @ design
    resistance, inductance, _, _, *beside = solution / sizes
    hum = np.zeros(2)
    if frequency:
        turned = resistance / (2.0 * np.pi * frequency)
        hum = -np.linalg.solve([[inductance, turned], [-turned, inductance]], beside)
    before = slice(record.edge)
    offset = float(np.mean(record.current[before] - (hum @ lines[:, before] if frequency else 0.0)))
    return _Sight(np.array([resistance, inductance, offset, 0.0, 0.0]), frequency, hum, float(left @ left))


def _wave_before(record: StepRecord, frequency: float) -> FloatArray:
    """Return the part (A) of the current before the step that is hum of a frequency (Hz), less its mean."""
    before = slice(record.edge)
    if record.edge < _LEAST_BEFORE or frequency * record.step >= _SAMPLED:
        return np.zeros(record.edge)
    design = _sines(record, frequency)[:, before]
    design -= np.mean(design, axis=1)[:, None]
    current = record.current[before] - float(np.mean(record.current[before]))
    return np.asarray(np.linalg.lstsq(design.T, current, rcond=None)[0] @ design)
