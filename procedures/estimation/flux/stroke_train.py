"""Current strokes at standstill: the integral of each stroke's voltage, and the part of it that is flux, in the stator's frame."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.fit import EstimationError, FloatArray

ComplexArray = NDArray[np.complex128]
#: Flux linkages (V·s, d + j·q) at currents (A, d + j·q).
FluxOf = Callable[[ComplexArray], ComplexArray]

#: A jump of voltage is where it changes by more than so many standard deviations of its noise, and by this share of the largest.
_CLEAR, _SHARE = 8.0, 0.1
#: Each jump is looked for within this share of a stroke about where the drive's answer says it is.
_ABOUT = 0.3
#: Share of a record at its end in which no current flows.
_TAIL = 0.1
#: A stroke's plateau is so much of its end; what its two halves differ by is not settled. Its mean is known to this share of a step.
_PLATEAU, _STEP = 0.3, 0.3
#: A locked rotor turns by no more than this (rad, electrical).
_LOCKED = 0.02
#: Rounds in which the course of the current between its measured ends is found.
_ROUNDS = 3
_EVENLY = np.linspace(0.0, 1.0, 33)


@dataclass(frozen=True)
class StrokeTrain:
    """Voltages `voltage` (V, α + j·β, shape (n,)) at times `time` (s) of a record, and what the drive said at each switching.

    `current` (A, d + j·q, shape (k,)), `angle` and `speed` (rad and rad/s, electrical) are those just before each of k switchings, the
    last of them after the strokes, without current; `places` (k,) are the switchings among the samples. `resolution` (V) is the
    oscilloscope's step; `locked` says that the rotor was held.
    """

    time: FloatArray
    voltage: ComplexArray
    places: NDArray[np.intp]
    current: ComplexArray
    angle: FloatArray
    speed: FloatArray
    resolution: float = 0.0
    locked: bool = False

    @cached_property
    def still(self) -> bool:
        """True if the rotor stood still, so that a settled current needs no voltage but that of the resistance."""
        return self.locked and self.swing < _LOCKED

    def resisted(self, resistance: float) -> float:
        """Return what `charge` is multiplied with to be what the resistance (Ω) takes.

        Where the rotor stands, that is seen at the strokes' ends. The drive's samples of current would have their noise multiplied by a
        resistance and by strokes that last for many time constants, and phases' resistances differ.
        """
        return 1.0 if self.still else resistance

    @cached_property
    def plateaus(self) -> ComplexArray:
        """The voltage (V, α + j·β, shape (k,)) that each stroke ended with."""
        return np.array([complex(np.mean(self.voltage[part])) for part in self._ends()])

    @cached_property
    def plateau_uncertainty(self) -> FloatArray:
        """Standard uncertainty (V, shape (k,)) of either component of `plateaus`: noise, the oscilloscope's step, what has not settled."""
        return np.array([self._plateau(part)[0] for part in self._ends()])

    @property
    def moving(self) -> float:
        """Unsettled part at the strokes' ends, beyond the record's noise: share of the largest change of flux."""
        change = float(np.max(np.abs(self.integral[self.places[2]] - self.integral[self.places[1]])))
        lasting = np.diff(self.time[self.places], prepend=self.time[0])
        left = [self._plateau(part)[1] * duration for part, duration in zip(self._ends()[1:], lasting[1:], strict=True)]
        return float(max(left)) / max(change, 1e-300)

    def _ends(self) -> list[slice]:
        """Return which samples are the ends of the strokes, that before the first of them first."""
        before = [max(2 * int(self.places[0]) - int(self.places[1]), 0), *self.places[:-1].tolist()]
        return [
            slice(min(round(end - _PLATEAU * (end - begin)), end - 2), end)
            for begin, end in zip(before, self.places.tolist(), strict=True)
        ]

    def _plateau(self, part: slice) -> tuple[float, float]:
        """Return the standard uncertainty (V) of a plateau's mean, and by how much it is not flat beyond its noise."""
        values = self.voltage[part]
        half = values.size // 2
        noise = float(np.std(np.diff(values))) / 2.0 / math.sqrt(values.size)
        slope = abs(complex(np.mean(values[:half]) - np.mean(values[half:])))
        known = math.hypot(noise, _STEP * self.resolution)
        return math.hypot(known, slope), max(slope - 6.0 * known, 0.0)

    @cached_property
    def integral(self) -> ComplexArray:
        """∫u dt (V·s, α + j·β) from the first switching on, at every sample."""
        return _integral(self.voltage, self.time, int(self.places[0]))

    def mirrored(self) -> "StrokeTrain":
        """Return it as a stator sees it whose phases follow each other the other way."""
        return replace(self, voltage=np.conj(self.voltage))

    def turned(self, by: float) -> "StrokeTrain":
        """Return it with the drive's frame turned by an angle (rad, electrical) from the stator's."""
        return replace(self, angle=self.angle + by)

    def charge(self, resistance: float, flux_of: FluxOf | None = None) -> ComplexArray:
        """Return ∫i dt (A·s, α + j·β) at the switchings, ∫R·i dt (V·s) where the rotor stands: see `resisted`.

        The current goes from one measured end to the other as the flux does; `flux_of` gives flux linkages (V·s) at currents (A) as they
        are known so far; without it they grow evenly with the current.
        """
        first, last = int(self.places[0]), int(self.places[-1])
        t, angle = self.time[first : last + 1], self._angles()
        places = self.places - first
        ends = self.plateaus * np.exp(-1j * self.angle) if self.still else self.current
        taking = self.resisted(resistance)
        # Most of a stroke's time its current is that of its end.
        which = np.clip(np.searchsorted(places, np.arange(t.size), side="left"), 0, places.size - 1)
        taken = ends[which] * np.exp(1j * angle)
        flux = self.integral[first : last + 1] - taking * _integral(taken, t, 0)
        shares = [_course(flux_of, *self.current[k : k + 2].tolist()) for k in range(places.size - 1)]
        for _ in range(_ROUNDS):
            for k in range(places.size - 1):
                part = slice(places[k], places[k + 1] + 1)
                change = flux[places[k + 1]] - flux[places[k]]
                way = np.real((flux[part] - flux[places[k]]) * np.conj(change)) / max(abs(change) ** 2, 1e-300)
                share = np.interp(way, shares[k], _EVENLY)
                rotor = ends[k] + share * (ends[k + 1] - ends[k])
                taken[part] = rotor * np.exp(1j * angle[part])
            total = _integral(taken, t, 0)
            flux = self.integral[first : last + 1] - taking * total
        return np.asarray(total[places])

    @property
    def swing(self) -> float:
        """Largest angle (rad, electrical) by which the rotor had turned at a switching from where it stood."""
        return float(np.max(np.abs(self.angle - self.angle[0])))

    def _angles(self) -> FloatArray:
        """Return the angle (rad) at each sample from the first switching to the last: a cubic through angles and speeds."""
        first, last = int(self.places[0]), int(self.places[-1])
        t, made = self.time[first : last + 1], np.empty(last - first + 1)
        for k in range(self.places.size - 1):
            part = slice(self.places[k] - first, self.places[k + 1] - first + 1)
            width = self.time[self.places[k + 1]] - self.time[self.places[k]]
            s = (t[part] - self.time[self.places[k]]) / width
            made[part] = (
                self.angle[k] * (1.0 + 2.0 * s) * (1.0 - s) ** 2
                + self.angle[k + 1] * s**2 * (3.0 - 2.0 * s)
                + width * (self.speed[k] * s * (1.0 - s) ** 2 - self.speed[k + 1] * s**2 * (1.0 - s))
            )
        return made


def stroke_train(
    time: FloatArray,
    voltage: ComplexArray,
    told: Sequence[float],
    current: Sequence[complex],
    angle: Sequence[float],
    speed: Sequence[float],
    *,
    resolution: float = 0.0,
    locked: bool = False,
) -> StrokeTrain:
    """Find the strokes in a record: `told` (s) are the drive's times, of another clock than the record's; no current at the end.

    What the record shows without current is taken off it. Raises EstimationError where the voltage shows no strokes, or not all of them.
    """
    tail = max(int(_TAIL * time.size), 2)
    offset = complex(np.mean(voltage[-tail:]))
    clean = voltage - offset
    noise = float(np.std(np.abs(clean[-tail:])))
    size = np.abs(clean)
    clear = size > max(_CLEAR * noise, _SHARE * float(np.max(size)))
    if not np.any(clear) or clear[0]:
        raise EstimationError(
            "the record shows no beginning of the strokes: check probes, ranges and the record's length"
        )
    first = int(np.argmax(clear))
    step = float(time[1] - time[0])
    jump = np.abs(np.diff(clean))
    places = [first - 1]
    at = np.asarray(told) - told[0]
    for k in range(1, len(told) - 1):
        expected = places[-1] + round((at[k] - at[k - 1]) / step)
        near = max(round(_ABOUT * (at[k] - at[k - 1]) / step), 2)
        low, high = max(expected - near, places[-1] + 1), expected + near
        if high >= time.size - tail:
            raise EstimationError("the record ends before the strokes do: record for longer")
        places.append(low + int(np.argmax(jump[low:high])))
    # Nothing jumps at the end; there is no current, and none matters.
    places.append(min(places[-1] + round((at[-1] - at[-2]) / step), time.size - 1))
    return StrokeTrain(
        np.asarray(time),
        np.asarray(clean),
        np.array(places, dtype=np.intp),
        np.asarray(current, dtype=np.complex128),
        np.asarray(angle, dtype=np.float64),
        np.asarray(speed, dtype=np.float64),
        resolution,
        locked,
    )


def _course(flux_of: FluxOf | None, begin: complex, end: complex) -> FloatArray:
    """Return the share of a stroke's change of flux that is made at even shares of its change of current."""
    if flux_of is None or begin == end:
        return _EVENLY
    flux = flux_of(np.asarray(begin + _EVENLY * (end - begin), dtype=np.complex128))
    change = flux[-1] - flux[0]
    result = np.real((flux - flux[0]) * np.conj(change)) / abs(change) ** 2
    return np.maximum.accumulate(result)


def _integral(values: ComplexArray, time: FloatArray, first: int) -> ComplexArray:
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(time)
    total = np.concatenate((np.zeros(1, dtype=np.complex128), np.cumsum(steps)))
    return np.asarray(total - total[first])
