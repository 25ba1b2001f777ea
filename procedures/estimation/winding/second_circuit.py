"""Closed circuits beside a winding, from a bridge at several frequencies: inductance for slow changes, and what they add to R."""

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
#: Time constants (s) of circuits that may add to a resistance. A slower one adds the same at all frequencies.
_LOSSY = np.geomspace(1e-6, 0.03, 40)
#: Limit of error over the standard uncertainty.
_LIMIT = math.sqrt(3.0)
#: Share of the inductance that all circuits together take away at most.
_LARGEST_SHARE = 0.95


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
    plain = _fitted(constant, measured, spread)[0]
    time_constants = _PRODUCTS / omega[0]
    # Three columns: resistance, inductance, and what the circuit takes of it.
    designs = np.empty((time_constants.size, measured.size, 3))
    designs[:, :, :2] = constant
    designs[:, :, 2] = _effects(omega, time_constants)
    squares, values, u_slow = _fitted(designs, measured, spread)
    possible = values[:, 2] > 0.0
    if not possible.any():
        return None
    best = int(np.argmin(np.where(possible, squares, np.inf)))
    slow, coupled, least = float(values[best, 1]), float(values[best, 2]), float(squares[best])
    score = float(plain) - least
    if score < _SEEN:
        return None
    near = possible & (squares < least + _WITHIN)
    beyond = max(slow - readings[1].inductance, 0.0)
    half_width = max(beyond, float(np.max(np.abs(values[near, 1] - slow) + 2.0 * u_slow[near])))
    return SecondCircuit(float(time_constants[best]), coupled / slow, slow, half_width, math.sqrt(score))


def resistance_of_losses(readings: Sequence[SeriesReading]) -> tuple[float, float] | None:
    """Return between which bounds (Ω) closed circuits and losses add to the last reading's resistance; None where they explain none.

    The bounds hold for any number of circuits of time constants up to 30 ms and losses that grow with the frequency or its square,
    which leave each reading within its limits of error. That of the last resistance counts to the others. The lowest frequency is last.
    """
    from scipy.optimize import linprog

    last, higher = readings[-1], readings[:-1]
    omega = 2.0 * np.pi * np.array([r.frequency for r in readings])
    circuits = _effects(omega, _LOSSY).T
    times = omega / omega[-1]
    # Columns: the inductance for slow changes, losses that grow with the frequency and its square, what each circuit takes of it.
    added = np.column_stack(
        (np.zeros_like(times), times * last.resistance, times**2 * last.resistance, circuits[: times.size])
    )
    inductances = np.column_stack((np.ones_like(times), np.zeros((times.size, 2)), circuits[times.size :]))
    rows = np.concatenate((added[:-1] - added[-1], inductances))
    aim = np.array([*(r.resistance - last.resistance for r in higher), *(r.inductance for r in readings)])
    limits = _LIMIT * np.array(
        [*(r.u_resistance + last.u_resistance for r in higher), *(r.u_inductance for r in readings)]
    )
    # Circuits are counted in the inductance, so that all unknowns are of the size of one.
    rows[:, [0, *range(3, rows.shape[1])]] *= last.inductance
    lost = added[-1] / last.resistance
    lost[3:] *= last.inductance
    rows, aim = rows / limits[:, None], aim / limits
    share = np.concatenate(([-_LARGEST_SHARE, 0.0, 0.0], np.ones(_LOSSY.size)))
    bounds = np.concatenate((rows, -rows, share[None]))
    # An instrument beyond its limits, or iron that is no such circuits, is given more room.
    for room in (1.0, 2.0, 4.0):
        most = np.concatenate((aim + room, room - aim, [0.0]))
        least, largest = (linprog(sign * lost, A_ub=bounds, b_ub=most).fun for sign in (1.0, -1.0))
        if least is not None and largest is not None:
            return last.resistance * float(least), -last.resistance * float(largest)
    return None


def _effects(omega: FloatArray, time_constants: FloatArray) -> FloatArray:
    """Return the changes of resistances and inductances for every henry that a circuit takes away (time constants, readings)."""
    x = omega * time_constants[:, None]
    return np.concatenate((omega * x / (1.0 + x**2), -(x**2) / (1.0 + x**2)), axis=1)


def _fitted(designs: FloatArray, measured: FloatArray, spread: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return χ², the coefficients, and the second one's standard uncertainty, for a stack of designs (…, readings, coefficients)."""
    weighted, aim = designs / spread[:, None], measured / spread
    scale = np.sqrt(np.sum(weighted**2, axis=-2))
    weighted /= scale[..., None, :]
    inverse = np.linalg.pinv(weighted)
    values = inverse @ aim
    left = aim - (weighted @ values[..., None])[..., 0]
    return np.sum(left**2, axis=-1), values / scale, np.linalg.norm(inverse[..., 1, :], axis=-1) / scale[..., 1]
