"""The inductance for slow changes of a winding beside a closed second circuit, from a bridge's readings at several frequencies."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.estimation.fitting.fit import FloatArray

#: Time constants that are tried, over that of the highest test frequency, 1/ω.
_PRODUCTS = np.geomspace(0.02, 300.0, 400)
#: A second circuit is seen where it takes so much off χ²: more than a bridge within its limits shows without one.
_SEEN = 25.0
#: Time constants within so much of the best χ² may be the true one.
_WITHIN = 4.0


@dataclass(frozen=True)
class SeriesReading:
    """Series resistance (Ω) and inductance (H) at one frequency (Hz), each with its standard uncertainty."""

    frequency: float
    resistance: float
    inductance: float
    u_resistance: float
    u_inductance: float


@dataclass(frozen=True)
class SecondCircuit:
    """A closed circuit coupled to a winding: its `time_constant` (s) and `coupling` k², the share of the inductance that it
    removes at high frequency; `inductance` for slow changes (H), known within ± `half_width`; `score`, how far beyond chance it
    is seen.
    """

    time_constant: float
    coupling: float
    inductance: float
    half_width: float
    score: float


def second_circuit(readings: Sequence[SeriesReading]) -> SecondCircuit | None:
    """Return the second circuit that readings at three frequencies or more show, the highest first; None where they show none.

    With x = ωτ: R(ω) = R₀ + k²·L₀·ω·x/(1 + x²), L(ω) = L₀ − k²·L₀·x²/(1 + x²). For every τ the rest is linear. The rise of the resistance
    alone is no witness: a skin effect in the wire, of a small τ, leaves the inductance as it is. Iron is no single circuit: the interval
    holds the reading at the second frequency, and as much above the estimate.
    """
    omega = 2.0 * np.pi * np.array([r.frequency for r in readings])
    measured = np.array([*(r.resistance for r in readings), *(r.inductance for r in readings)])
    spread = np.array([*(r.u_resistance for r in readings), *(r.u_inductance for r in readings)])
    constant = np.repeat(np.eye(2), len(readings), axis=0)
    plain = _fitted(constant, measured, spread)
    # Three columns: resistance, inductance, and what the circuit takes of it.
    tried = [
        _fitted(np.column_stack((constant, _effect(omega, product / omega[0]))), measured, spread)
        for product in _PRODUCTS
    ]
    possible = [(product / omega[0], *fit) for product, fit in zip(_PRODUCTS, tried, strict=True) if fit[1][2] > 0.0]
    if not possible:
        return None
    time_constant, least, values, _ = min(possible, key=lambda each: each[1])
    slow, score = float(values[1]), plain[0] - least
    if score < _SEEN:
        return None
    near = [(float(v[1]), 2.0 * u) for _, squares, v, u in possible if squares < least + _WITHIN]
    beyond = max(slow - readings[1].inductance, 0.0)
    half_width = max(beyond, *(abs(value - slow) + u for value, u in near))
    return SecondCircuit(float(time_constant), float(values[2]) / slow, slow, half_width, math.sqrt(score))


def _effect(omega: FloatArray, time_constant: float) -> FloatArray:
    """Return what a circuit does to resistances and inductances for every henry that it takes away."""
    x = omega * time_constant
    return np.concatenate((omega * x / (1.0 + x**2), -(x**2) / (1.0 + x**2)))


def _fitted(design: FloatArray, measured: FloatArray, spread: FloatArray) -> tuple[float, FloatArray, float]:
    """Return χ², the coefficients, and the second one's standard uncertainty."""
    weighted = design / spread[:, None]
    scale = np.sqrt(np.sum(weighted**2, axis=0))
    inverse = np.linalg.pinv(weighted / scale)
    values = inverse @ (measured / spread)
    left = measured / spread - (weighted / scale) @ values
    return float(left @ left), values / scale, float(np.linalg.norm(inverse[1])) / float(scale[1])
