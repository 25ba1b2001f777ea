"""The first time at which a sum of exponentials and sinusoids falls below zero, none missed."""

import math
from dataclasses import dataclass

import numpy as np

from sim_instruments.six_step.circuit import Complex

_GRID_INTERVALS = 16
_MOST_HALVINGS = 2000


@dataclass(frozen=True)
class _Curve:
    """f(t) = Re Σ c·exp(µ·t) in plain numbers: faster than arrays for one function at one time."""

    decays: tuple[tuple[float, float], ...]
    offset: float
    swings: tuple[tuple[float, float, float], ...]

    def value(self, t: float) -> float:
        total = self.offset
        for amplitude, rate in self.decays:
            total += amplitude * math.exp(-rate * t)
        for real, imaginary, speed in self.swings:
            total += real * math.cos(speed * t) - imaginary * math.sin(speed * t)
        return total

    def slope(self, t: float) -> float:
        total = 0.0
        for amplitude, rate in self.decays:
            total -= rate * amplitude * math.exp(-rate * t)
        for real, imaginary, speed in self.swings:
            total -= speed * (real * math.sin(speed * t) + imaginary * math.cos(speed * t))
        return total

    def bend(self, t: float) -> float:
        """Bound |f''| from t on."""
        total = 0.0
        for amplitude, rate in self.decays:
            total += abs(amplitude) * rate * rate * math.exp(-rate * t)
        for real, imaginary, speed in self.swings:
            total += math.hypot(real, imaginary) * speed * speed
        return total

    def noise(self) -> float:
        """Bound of the rounding error of a value."""
        total = abs(self.offset)
        for amplitude, _ in self.decays:
            total += abs(amplitude)
        for real, imaginary, _ in self.swings:
            total += abs(real) + abs(imaginary)
        return 1e-15 * total


def first_below_zero(
    coefficients: Complex, exponents: Complex, modes: int, duration: float
) -> tuple[float, int] | None:
    """Earliest time in (0, duration] at which one of the curves falls below 0, and that curve's index.

    Curves are Re(coefficients @ exp(exponents·t)), shape (m, modes + 1 + H): decays, constant, sinusoids. An interval
    counts as free of events only where the chord less the greatest possible sag, bound(|f''|)·width²/8, stays above 0;
    the others are halved. So no event is missed, however short, unless it is no deeper than rounding. Returns None when there is none.
    """
    edges = duration * np.linspace(0.0, 1.0, _GRID_INTERVALS + 1)
    width = duration / _GRID_INTERVALS
    waves = np.exp(exponents[:, None] * edges[None, :])
    values = (coefficients @ waves).real
    sizes = np.abs(coefficients * exponents**2)
    bend = sizes @ np.abs(waves[:, :-1])
    suspect = np.minimum(values[:, :-1], values[:, 1:]) <= bend * (width * width / 8)
    if not suspect.any():
        return None
    curves: dict[int, _Curve] = {}
    for interval in np.flatnonzero(suspect.any(axis=0)).tolist():
        first: tuple[float, int] | None = None
        for index in np.flatnonzero(suspect[:, interval]).tolist():
            curve = curves.setdefault(index, _curve(coefficients[index], exponents, modes))
            left, right = float(edges[interval]), float(edges[interval + 1])
            limit = first[0] if first else right
            time = _first_root(curve, left, limit, 1e-14 * duration)
            if time is not None and (first is None or time < first[0]):
                first = time, index
        if first is not None:
            return first
    return None


def _curve(coefficients: Complex, exponents: Complex, modes: int) -> _Curve:
    c, mu = coefficients.tolist(), exponents.tolist()
    return _Curve(
        tuple((c[k].real, -mu[k].real) for k in range(modes)),
        c[modes].real,
        tuple((c[k].real, c[k].imag, mu[k].imag) for k in range(modes + 1, len(mu))),
    )


def _first_root(curve: _Curve, left: float, right: float, resolution: float) -> float | None:
    """Find the first time in [left, right] at which the curve is below 0, by certified halving; None if there is none."""
    pending = [(left, curve.value(left), right, curve.value(right))]
    noise = curve.noise()
    halvings = 0
    while pending:
        a, fa, b, fb = pending.pop()
        if fa < -noise:
            return a
        width, bend = b - a, curve.bend(a)
        if min(fa, fb) >= bend * width * width / 8 - noise:
            continue
        halvings += 1
        if halvings == _MOST_HALVINGS:
            # A curve that lies on zero over a stretch: no dip can be told from it, so look at it coarsely.
            resolution = max(resolution, 1e-4 * (right - left))
        if width <= resolution:
            if fb < -noise:
                return b
            continue
        if fb < -noise and max(curve.slope(a), curve.slope(b)) + bend * width / 2 < 0:
            return _polish(curve, a, b, resolution)
        middle = 0.5 * (a + b)
        fm = curve.value(middle)
        pending.append((middle, fm, b, fb))
        pending.append((a, fa, middle, fm))
    return None


def _polish(curve: _Curve, a: float, b: float, resolution: float) -> float:
    """Find the root between a (above 0) and b (below 0) of a falling curve: Newton kept inside the bracket."""
    t = 0.5 * (a + b)
    for _ in range(60):
        value = curve.value(t)
        if value < 0:
            b = t
        else:
            a = t
        step = t - value / curve.slope(t)
        if not a < step < b:
            step = 0.5 * (a + b)
        if abs(step - t) <= resolution:
            return step
        t = step
    return b
