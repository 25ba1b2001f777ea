"""Closed circuits beside a winding, from a bridge at several frequencies: inductance for slow changes, and what they add to R."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.intervals import Interval

#: Time constants that are tried for one circuit, over that of the highest test frequency, 1/ω.
_PRODUCTS = np.geomspace(0.02, 300.0, 400)
#: A second circuit is seen where it takes so much off χ²: errors anywhere within a bridge's limits do so once in two hundred times.
_SEEN = 8.0
#: Time constants within so much of the best χ² may be the true one.
_WITHIN = 4.0
#: Limit of error over the standard uncertainty.
_LIMIT = math.sqrt(3.0)
#: Shortest time constant (s) of circuits in a mixture, how many there are, and what share of the inductance they take at most.
_SHORTEST, _CIRCUITS, _LARGEST_SHARE = 1e-6, 80, 0.95
#: Circuits may be so much slower than the one that comes nearest, or where losses in the wire alone would explain the readings.
_BEYOND, _BEYOND_WIRE = 2.0, 10.0
#: Time constants (s) up to which slower circuits are tried where faster ones do not explain the readings.
_SLOWER = (0.01, 0.03)
#: Room for an instrument beyond its limits of error, or iron that is no such circuits, over these limits.
_ROOM = (2.0, 4.0)


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
    """Closed circuits coupled to a winding: `time_constant` (s) and `coupling` k², the share of the inductance that it removes at high
    frequency, of the one circuit that comes nearest; `score`, how far beyond chance it is seen; `inductance` for slow changes (H) and
    `resistance` without losses (Ω), None where no mixture of circuits explains the readings.
    """

    time_constant: float
    coupling: float
    score: float
    inductance: Interval | None
    resistance: Interval | None


def second_circuit(readings: Sequence[SeriesReading], slowest: float) -> SecondCircuit | None:
    """Return what readings at three frequencies or more show of closed circuits, the highest first; None where they show none.

    One circuit, with x = ωτ: R(ω) = R₀ + k²·L₀·ω·x/(1 + x²), L(ω) = L₀ − k²·L₀·x²/(1 + x²). For every τ the rest is linear. The rise of
    the resistance alone is no witness: a skin effect in the wire, of a small τ, leaves the inductance as it is. Iron is no single circuit:
    the intervals hold any mixture of circuits with time constants up to `slowest` (s) and losses that grow with the frequency or its
    square. Slower circuits are assumed where the one that comes nearest may be slower than half of that, or the readings need them;
    faster ones where losses in the wire, as the square of the frequency, would explain the readings as well.
    """
    omega, measured, spread = _columns(readings)
    constant = np.repeat(np.eye(2), len(readings), axis=0)
    plain = _fitted(constant, measured, spread)[0]
    time_constants = _PRODUCTS / omega[0]
    # Three columns: resistance, inductance, and what the circuit takes of it.
    designs = np.empty((time_constants.size, measured.size, 3))
    designs[:, :, :2] = constant
    designs[:, :, 2] = _effects(omega, time_constants)
    squares, values = _fitted(designs, measured, spread)
    possible = values[:, 2] > 0.0
    if not possible.any():
        return None
    best = int(np.argmin(np.where(possible, squares, np.inf)))
    least = float(squares[best])
    score = float(plain) - least
    if score < _SEEN:
        return None
    near = time_constants[possible & (squares < least + _WITHIN)]
    in_wire = np.column_stack((constant, np.concatenate((omega**2, np.zeros_like(omega)))))
    wire_alone = _fitted(in_wire, measured, spread)[0] < least + _WITHIN
    beyond = (_BEYOND_WIRE if wire_alone else _BEYOND) * float(near.max())
    first = min(beyond if wire_alone else max(slowest, beyond), _SLOWER[-1])
    tries = [
        (first, 1.0),
        *((slower, 1.0) for slower in _SLOWER if slower > first),
        *((_SLOWER[-1], room) for room in _ROOM),
    ]
    mixtures = (_mixtures(omega, measured, _LIMIT * spread, slower, room) for slower, room in tries)
    resistance, inductance = next((held for held in mixtures if held), (None, None))
    slow, coupled = float(values[best, 1]), float(values[best, 2])
    return SecondCircuit(float(time_constants[best]), coupled / slow, math.sqrt(score), inductance, resistance)


def hidden_share(readings: Sequence[SeriesReading], slowest: float, least: float = 0.0) -> float:
    """Return the share by which the inductance for slow changes may exceed that at the highest frequency (the first reading's) for
    circuits that readings leave unseen: any mixture of time constants up to `slowest` (s), with losses that grow with the frequency or its
    square, whose χ² is within two standard deviations of the least.

    Direct current has shown that the resistance without losses is no less than `least` (Ω), so that less is left for circuits. That is
    not used where the bridge contradicts it.
    """
    from scipy.optimize import brentq, nnls

    omega, measured, spread = _columns(readings)
    rows, aim = _mixed(omega, measured, slowest) / spread[:, None], measured / spread
    held = aim - rows[:, 0] * least / float(measured[omega.size - 1])
    values, left = nnls(rows, held)
    if left**2 > nnls(rows, aim)[1] ** 2 + _WITHIN:
        held = aim
        values, left = nnls(rows, held)
    others, most = np.delete(rows, 1, axis=1), 1.0 / (1.0 - _LARGEST_SHARE)

    def beyond(inductance: float) -> float:
        return float(nnls(others, held - inductance * rows[:, 1])[1] ** 2 - left**2 - _WITHIN)

    first = max(float(values[1]), 1.0)
    if beyond(first) >= 0.0:
        return 0.0
    return (float(brentq(beyond, first, most, rtol=1e-4)) if beyond(most) > 0.0 else most) - 1.0


def _mixtures(
    omega: FloatArray, measured: FloatArray, limits: FloatArray, slowest: float, room: float
) -> tuple[Interval, Interval] | None:
    """Return the resistances and inductances that leave every reading within `room` times its limit of error; None where none do."""
    from scipy.optimize import linprog

    count = omega.size
    resistance, inductance = float(measured[count - 1]), float(measured[count])
    rows, aim = _mixed(omega, measured, slowest) / limits[:, None], measured / limits
    share = np.array([0.0, -_LARGEST_SHARE, 0.0, 0.0, *np.ones(_CIRCUITS)])
    bounded, most = np.concatenate((rows, -rows, share[None])), np.concatenate((aim + room, room - aim, [0.0]))
    ends = [
        linprog(sign * np.eye(rows.shape[1])[which], A_ub=bounded, b_ub=most).fun
        for which in (0, 1)
        for sign in (1.0, -1.0)
    ]
    low_r, high_r, low_l, high_l = (math.nan if end is None else abs(float(end)) for end in ends)
    if math.isnan(low_r + high_r + low_l + high_l):
        return None
    return Interval(resistance * low_r, resistance * high_r), Interval(inductance * low_l, inductance * high_l)


def _columns(readings: Sequence[SeriesReading]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return angular frequencies (rad/s), and resistances with inductances below them: as measured, and their standard uncertainties."""
    omega = 2.0 * np.pi * np.array([r.frequency for r in readings])
    measured = np.array([*(r.resistance for r in readings), *(r.inductance for r in readings)])
    spread = np.array([*(r.u_resistance for r in readings), *(r.u_inductance for r in readings)])
    return omega, measured, spread


def _mixed(omega: FloatArray, measured: FloatArray, slowest: float) -> FloatArray:
    """Return what a mixture makes of the readings: both figures, losses that grow with the frequency and its square, every circuit.

    In sizes of the resistance at the lowest frequency and the inductance at the highest, which are known best.
    """
    count = omega.size
    resistance, inductance = float(measured[count - 1]), float(measured[count])
    times = omega / omega[-1]
    rows = np.zeros((2 * count, 4 + _CIRCUITS))
    rows[:count, 0], rows[count:, 1] = resistance, inductance
    rows[:count, 2:4] = resistance * np.stack((times, times**2), axis=1)
    rows[:, 4:] = inductance * _effects(omega, np.geomspace(_SHORTEST, slowest, _CIRCUITS)).T
    return rows


def _effects(omega: FloatArray, time_constants: FloatArray) -> FloatArray:
    """Return the changes of resistances and inductances for every henry that a circuit takes away (time constants, readings)."""
    x = omega * time_constants[:, None]
    return np.concatenate((omega * x / (1.0 + x**2), -(x**2) / (1.0 + x**2)), axis=1)


def _fitted(designs: FloatArray, measured: FloatArray, spread: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return χ² and the coefficients, for a stack of designs (…, readings, coefficients)."""
    weighted, aim = designs / spread[:, None], measured / spread
    scale = np.sqrt(np.sum(weighted**2, axis=-2))
    weighted /= scale[..., None, :]
    values = np.linalg.pinv(weighted) @ aim
    left = aim - (weighted @ values[..., None])[..., 0]
    return np.sum(left**2, axis=-1), values / scale
