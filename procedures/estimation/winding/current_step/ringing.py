"""Ringing of a step's edge on probes and leads: found in the residuals, and as a term of the model."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.fft import next_fast_len

from procedures.estimation.fitting.first_order import decays
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import ALARM, Cause
from procedures.estimation.winding.current_step.fit import Fitted, Problem
from procedures.estimation.winding.current_step.term import StepScale, Term
from procedures.estimation.winding.current_step.variance import StepVariance

#: Decays looked for: so many time constants of the winding and each a third of the one before, as long as that is so many samples.
_LONGEST, _SHORTER, _SHORTEST = 2.0, 3, 4.0
#: A ringing turns by so much (rad) within its decay, and within the winding's time constant: what is slower is the circuit's own.
_TURNS, _FASTER = 1.5, 3.0
#: What is fitted turns by so much at least within its decay.
_SWINGS = 1.0
#: A line of the spectrum counts where noise alone has one as high once in so many records.
_CHANCE = 1e-4
#: So many instants at most are tried for its beginning.
_TRIALS = 64


@dataclass(frozen=True)
class RingingEdge(Term):
    """A sine that decays from the step on: its two parts (steps), and logarithms of its turning and its decay over those here.

    `turning` is in rad and `decay` in 1 for each time constant of the winding; it begins at the time `begin` (s).
    """

    cause: ClassVar[Cause] = Cause.RINGING
    family: ClassVar[str] = "ringing"
    #: It has three figures more than others, which follow noise further.
    price: ClassVar[float] = 9.0
    turning: float = 10.0
    decay: float = 1.0
    begin: float = 0.0
    start: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    known: tuple[float, ...] = (np.inf, np.inf, 0.5, 1.0)

    def beside(self, time: FloatArray, scale: StepScale, figures: FloatArray) -> FloatArray | float:
        """Return what is read beside the current (A)."""
        since = (time - self.begin) / scale.time_constant
        parts = _swing(since, self.turning * math.exp(figures[2]), self.decay * math.exp(figures[3]))
        return np.asarray(scale.current * (figures[:2] @ parts))

    def beside_slopes(self, time: FloatArray, scale: StepScale, figures: FloatArray) -> FloatArray:
        """Return the derivatives (4, n) of what is read beside the current by the figures."""
        since = np.maximum((time - self.begin) / scale.time_constant, 0.0)
        turning, decay = self.turning * math.exp(figures[2]), self.decay * math.exp(figures[3])
        sine, cosine = scale.current * _swing((time - self.begin) / scale.time_constant, turning, decay)
        first, second = figures[:2]
        turned = turning * since * (first * cosine - second * sine)
        return np.array((sine, cosine, turned, -decay * since * (first * sine + second * cosine)))

    def within(self, figures: FloatArray) -> bool:
        """Tell whether a fit may go to these figures."""
        return bool(abs(figures[2]) < 1.0 and abs(figures[3]) < 3.0)

    def possible(self, figures: FloatArray) -> bool:
        """Tell whether it swings as a ringing does: what creeps instead is the circuit's own, as saturation."""
        found = self.fitted(figures)
        return found.turning > max(_FASTER, _SWINGS * found.decay)

    def fitted(self, figures: FloatArray) -> "RingingEdge":
        """Return the same with the turning and the decay of these figures."""
        return replace(self, turning=self.turning * math.exp(figures[2]), decay=self.decay * math.exp(figures[3]))

    @property
    def of_channel(self) -> "Resonance":
        """The same as what a channel of second order makes."""
        natural = math.hypot(self.turning, self.decay)
        return Resonance(natural, self.decay / natural)

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        """Return what was found, in SI."""
        return {
            "frequency": self.turning * math.exp(figures[2]) / (2.0 * math.pi * scale.time_constant),
            "amplitude": abs(scale.current) * float(np.hypot(*figures[:2])),
            "half": math.log(2.0) * scale.time_constant / (self.decay * math.exp(figures[3])),
        }


@dataclass(frozen=True)
class Resonance(Term):
    """The current's channel rings as a whole, a low pass of second order: logarithms of its natural frequency and its damping over
    those here.

    `natural` is in rad for each time constant of the winding, `damping` a share of the critical one.
    """

    cause: ClassVar[Cause] = Cause.RINGING
    family: ClassVar[str] = "skew"
    natural: float = 10.0
    damping: float = 0.5
    start: tuple[float, ...] = (0.0, 0.0)
    known: tuple[float, ...] = (2.0, 1.0)

    def channel(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray:
        """Return what the channel makes of currents (A, shape (…, n))."""
        natural, damping = self._shape(figures)
        size = current.shape[-1]
        length = next_fast_len(2 * size, real=True)
        # The real part of a first-order lag of a complex rate, exact for what runs straight from sample to sample.
        rate = natural * complex(damping, -math.sqrt(1.0 - damping**2))
        fall = rate * step / scale.time_constant
        kept = decays(fall, size)
        end = 1.0 + (kept[1] - 1.0) / fall
        weight = natural**2 / (-1j * rate.imag * rate)
        answer = np.real(weight * end * kept)
        answer[1:] += np.real(weight * (1.0 - kept[1] - end) * kept[:-1])
        spectrum = np.fft.rfft(current, length, axis=-1) * np.fft.rfft(answer, length)
        return np.asarray(np.fft.irfft(spectrum, length, axis=-1)[..., :size])

    def within(self, figures: FloatArray) -> bool:
        """Tell whether a fit may go to these figures."""
        return bool(abs(figures[0]) < 4.0 and -4.0 < figures[1] < 4.0 and self._shape(figures)[1] < 0.98)

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        """Return what was found, in SI."""
        natural, damping = self._shape(figures)
        turning = natural * math.sqrt(1.0 - damping**2)
        return {
            "frequency": turning / (2.0 * math.pi * scale.time_constant),
            # What rises at once by a slope swings by it over the frequency.
            "amplitude": abs(scale.current) / turning,
            "half": math.log(2.0) * scale.time_constant / (natural * damping),
        }

    def _shape(self, figures: FloatArray) -> tuple[float, float]:
        return self.natural * math.exp(figures[0]), self.damping * math.exp(figures[1])


def ringing_in(step: Problem, fitted: Fitted, scale: StepScale, *, alarm: float) -> RingingEdge | None:
    """Return the ringing that stands out of the residuals, where one does."""
    record = step.record
    first, size = max(record.edge, 0), record.time.size
    left = fitted.residuals[first:size]
    since = (record.time[first:] - record.time[first]) / scale.time_constant
    apart, length = record.step / scale.time_constant, 1 << left.size.bit_length()
    per_line = 2.0 * math.pi / (length * apart)
    last = int(0.4 * length)
    seen: list[tuple[float, float, float]] = []
    lines, decay = 0, 1.0 / _LONGEST
    falling = np.exp(-decay * since)
    while decay * apart < 1.0 / _SHORTEST:
        spectrum = np.fft.rfft(left * falling, length)[math.ceil(max(_FASTER, _TURNS * decay) / per_line) : last]
        power = spectrum.real**2 + spectrum.imag**2
        place, lines = int(np.argmax(power)), lines + left.size // 2
        seen.append((float(power[place]) / float(falling @ falling), (last - power.size + place) * per_line, decay))
        # Cubed by products: a power takes ten times as long.
        decay, falling = _SHORTER * decay, falling * falling * falling
    # Of white noise of variance 1 each is exponential, of mean 1.
    limit = math.log(lines / _CHANCE) * (alarm / ALARM) ** 2 if lines else math.inf
    standing = [
        (height / _coloured(step, fitted, turning, decay, since), turning, decay)
        for height, turning, decay in seen
        if height >= limit
    ]
    best, turning, decay = max(standing, default=(0.0, 0.0, 0.0))
    if best < limit:
        return None
    begin, start = _beginning(step, fitted, scale, turning, decay)
    return RingingEdge(turning, decay, begin, start=(*start, 0.0, 0.0))


def _coloured(step: Problem, fitted: Fitted, turning: float, decay: float, since: FloatArray) -> float:
    """Return the variance of a line of the residuals' spectrum, in that of white noise: what is left in a smoothed voltage is none."""
    rows = np.zeros((2, fitted.residuals.size))
    size = step.record.time.size
    falling = np.exp(-decay * since)
    rows[:, size - since.size : size] = falling * np.cos(turning * since), falling * np.sin(turning * since)
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    return float(np.max(StepVariance(step, fitted)(rows)))


def _beginning(
    step: Problem, fitted: Fitted, scale: StepScale, turning: float, decay: float
) -> tuple[float, tuple[float, float]]:
    """Return when (s) a ringing begins that takes most off the residuals, and its two parts: somewhere on the voltage's way up."""
    record, size = step.record, step.record.time.size
    half = int(np.argmax(np.abs(record.drive) > 0.5 * abs(float(np.median(record.drive[record.edge :])))))
    best, chosen = -1.0, (scale.begin, (0.0, 0.0))
    for place in range(record.edge, max(half, record.edge) + 2, 1 + (half - record.edge) // _TRIALS):
        begin = float(record.time[min(place, size - 1)])
        rows = np.zeros((2, fitted.residuals.size))
        swing = scale.current * _swing((record.time - begin) / scale.time_constant, turning, decay)
        rows[:, :size] = step.white.apply(swing)
        across = rows - (rows @ fitted.gain.T) @ fitted.slopes
        parts, *_ = np.linalg.lstsq(across @ across.T, across @ fitted.residuals, rcond=None)
        fall = float(parts @ across @ fitted.residuals)
        if fall > best:
            best, chosen = fall, (begin, (float(parts[0]), float(parts[1])))
    return chosen


def _swing(since: FloatArray, turning: float, decay: float) -> FloatArray:
    """Return sine and cosine (2, n) that begin at 0 and decay."""
    at = np.maximum(since, 0.0)
    falling = np.where(since >= 0.0, np.exp(-decay * at), 0.0)
    return np.vstack((falling * np.sin(turning * at), falling * np.cos(turning * at)))
