"""The response of a probe, its lead and the channel's input to a signal, before the converter."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_instruments.disturbances.first_order import lagged, memory

FloatArray = NDArray[np.float64]
#: Instants that a mean over time is taken of.
_PLACES = 8
#: A signal (V or A at the probe's tip) at times (s).
Signal = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class ChannelPath:
    """One channel's probe, lead and input; the default passes everything as it is.

    In the order of the signal's way, amplitudes in V or A at the probe's tip:
    `factor`: shown over true, 0.1 for a ×1 probe on a channel set for ×10; `limit`: where the probe's amplifier saturates;
    `bow` (1/V or 1/A): distortion of second order, bow·x²;
    `compensation`: how much more (relative) a divider passes above the frequency of its `compensation_time` (s) than at DC;
    `pole` (Hz): bandwidth of probe and channel, of first order;
    `resonance` (Hz) with its `damping` (share of the critical one): the inductance of leads or coupling with the probe's or input's
    capacitance, on which edges ring; `average` (s): over which a converter or an isolating amplifier takes the mean; `skew` (s): delay
    against the other channels;
    `offset`, and on it `wander` (amplitude) with `wander_period` (s) and `wander_phase` (rad);
    `hum` (amplitude), `hum_frequency` (Hz), `hum_phase` (rad): what the lead picks up;
    `coupling_corner` (Hz): AC coupling, 0 where it is DC;
    `warm_up` (relative): how much the gain rises while the input warms up with `warm_up_time` (s);
    `jitter` (s): standard deviation of the sampling instants.
    """

    factor: float = 1.0
    limit: float = math.inf
    bow: float = 0.0
    compensation: float = 0.0
    compensation_time: float = 1.0e-3
    pole: float = math.inf
    resonance: float = math.inf
    damping: float = 0.1
    average: float = 0.0
    skew: float = 0.0
    offset: float = 0.0
    wander: float = 0.0
    wander_period: float = 10.0
    wander_phase: float = 0.0
    hum: float = 0.0
    hum_frequency: float = 50.0
    hum_phase: float = 0.0
    coupling_corner: float = 0.0
    warm_up: float = 0.0
    warm_up_time: float = 300.0
    jitter: float = 0.0

    def __post_init__(self) -> None:
        for name in (
            "limit",
            "compensation_time",
            "pole",
            "resonance",
            "wander_period",
            "hum_frequency",
            "warm_up_time",
        ):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"channel: {name} is {getattr(self, name)}; it must be positive")
        for name in ("coupling_corner", "jitter", "hum", "wander", "average"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"channel: {name} is {getattr(self, name)}; it must be finite and not negative")

        if not 0.0 < self.damping < 1.0:
            raise ValueError(f"channel: damping is {self.damping}; it must be between 0 and 1, where nothing rings")

    @property
    def clear(self) -> bool:
        """True if it passes every signal unchanged."""
        return self == CLEAR

    @property
    def memory(self) -> float:
        """The length of the past (s) that the displayed signal depends on."""
        corner = memory(1.0 / (2.0 * math.pi * self.coupling_corner)) if self.coupling_corner else 0.0
        pole = memory(1.0 / (2.0 * math.pi * self.pole)) if math.isfinite(self.pole) else 0.0
        slow = memory(self.compensation_time) if self.compensation else 0.0
        rings = memory(1.0 / (2.0 * math.pi * self.resonance * self.damping)) if math.isfinite(self.resonance) else 0.0
        return abs(self.skew) + corner + pole + rings + slow + self.average

    def shown(self, signal: Signal, times: FloatArray) -> FloatArray:
        """Return what it shows at evenly spaced times (s)."""
        stages: list[Signal] = [lambda at: self.probed(signal(at - self.skew))]
        if self.compensation:
            stages.append(self._compensated(stages[-1]))
        if math.isfinite(self.pole):
            stages.append(_low_pass(stages[-1], 1.0 / (2.0 * math.pi * self.pole)))
        if math.isfinite(self.resonance):
            stages.append(_resonant(stages[-1], 2.0 * math.pi * self.resonance, self.damping))
        if self.average:
            stages.append(_averaged(stages[-1], self.average))
        stages.append(self._picked_up(stages[-1]))
        if self.coupling_corner:
            stages.append(_high_pass(stages[-1], 1.0 / (2.0 * math.pi * self.coupling_corner)))
        shown = stages[-1](times) * self._gain(times)
        if self.jitter and len(times) > 1:
            # Of a record that is asked for again, the instants are the same again.
            generator = np.random.default_rng(abs(hash((self.jitter, float(times[0])))))
            shown = shown + np.gradient(shown, times) * generator.normal(0.0, self.jitter, len(times))
        return shown

    def triggering(self, signal: FloatArray, times: FloatArray) -> FloatArray:
        """Return what the trigger sees of a signal at times (s) in any order: all but what takes a memory."""
        return self._picked_up(lambda _: self.probed(signal))(times) * self._gain(times)

    def probed(self, signal: FloatArray) -> FloatArray:
        """Return what the probe makes of a signal at its tip."""
        seen = np.clip(signal, -self.limit, self.limit)
        return self.factor * (seen + self.bow * seen**2 if self.bow else seen)

    def _compensated(self, signal: Signal) -> Signal:
        def through(times: FloatArray) -> FloatArray:
            whole = signal(times)
            return whole + self.compensation * (whole - lagged(signal, times, self.compensation_time))

        return through

    def _picked_up(self, signal: Signal) -> Signal:
        def through(times: FloatArray) -> FloatArray:
            shown = signal(times) + self.offset
            if self.wander:
                shown = shown + self.wander * np.sin(2.0 * math.pi / self.wander_period * times + self.wander_phase)
            if self.hum:
                shown = shown + self.hum * np.sin(2.0 * math.pi * self.hum_frequency * times + self.hum_phase)
            return shown

        return through

    def _gain(self, times: FloatArray) -> FloatArray | float:
        return 1.0 + self.warm_up * -np.expm1(-times / self.warm_up_time) if self.warm_up else 1.0


def _low_pass(signal: Signal, time_constant: float) -> Signal:
    return lambda times: lagged(signal, times, time_constant)


def _high_pass(signal: Signal, time_constant: float) -> Signal:
    return lambda times: signal(times) - lagged(signal, times, time_constant)


def _resonant(signal: Signal, natural: float, damping: float) -> Signal:
    """Return a signal behind ω₀²/(s² + 2ζω₀s + ω₀²): the real part of one first-order lag of a complex time constant."""
    turning = natural * math.sqrt(1.0 - damping**2)
    pole = complex(damping * natural, -turning)
    weight = natural**2 / (1j * turning * pole)
    return lambda times: np.asarray(np.real(weight * lagged(signal, times, 1.0 / pole)))


def _averaged(signal: Signal, duration: float) -> Signal:
    """Return a signal's mean over what has passed of it, by Gauss's rule."""
    places, weights = np.polynomial.legendre.leggauss(_PLACES)

    def through(times: FloatArray) -> FloatArray:
        parts = [
            0.5 * float(weight) * signal(times - 0.5 * duration * (1.0 - float(place)))
            for place, weight in zip(places, weights, strict=True)
        ]
        return np.asarray(np.sum(parts, axis=0))

    return through


#: A channel that passes everything as it is.
CLEAR = ChannelPath()
