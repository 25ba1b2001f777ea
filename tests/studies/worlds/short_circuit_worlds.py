"""Motors that are turned with their terminals shorted, for studies: of constants, of wide saliencies, and on flux maps.

They share nothing with the estimators: currents on a map solve R·i + jω·ψ(i) = 0 by Newton's method.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Protocol

import numpy as np

from tests.studies.worlds.flux_truths import Array, TrueMotor, true_motors

Random = np.random.Generator


class Shorted(Protocol):
    """A motor with shorted terminals; `flux` is its flux linkage without current (V·s, peak)."""

    flux: float

    def speeds(self, count: int) -> Array:
        """Return electrical speeds (rad/s) from well below the bend to well above it."""
        ...

    def turned(self, speed: Array, warmer: Array, weaker: Array, drop: float) -> tuple[Array, Array, Array]:
        """Return amplitudes (A), the heat (W), and ω·√(L_d·L_q)/R.

        `warmer` and `weaker` are R and flux linkage over those of the first row, `drop` is a voltage in shares of R·I(∞).
        """
        ...

    def truths(self, speed: Array) -> tuple[float, float, float]:
        """Return L_d as the chord to I(∞), L_q as that of the largest q-axis current, and R of the first row."""
        ...


@dataclass(frozen=True)
class Constant:
    """A motor of constants (Ω, H, V·s); `reach` is the highest speed over that of the bend."""

    resistance: float
    l_d: float
    l_q: float
    reach: float
    flux: float = 0.05

    def speeds(self, count: int) -> Array:
        return self.resistance / math.sqrt(self.l_d * self.l_q) * np.geomspace(0.15, self.reach, count)

    def turned(self, speed: Array, warmer: Array, weaker: Array, drop: float) -> tuple[Array, Array, Array]:
        volts = drop * self.resistance * self.flux / self.l_d
        size = np.full(speed.size, self.flux / self.l_d)
        for _ in range(200):
            r = self.resistance * warmer + volts / size
            size = self.flux * weaker * speed * np.hypot(r, speed * self.l_q) / (r**2 + speed**2 * self.l_d * self.l_q)
        return size, 1.5 * r * size**2, speed * math.sqrt(self.l_d * self.l_q) / r

    def truths(self, speed: Array) -> tuple[float, float, float]:
        return self.l_d, self.l_q, self.resistance


@dataclass(frozen=True)
class Mapped:
    """A motor on a flux map, whose resistance (Ω) is drawn; `reach` is the highest speed over that of the bend."""

    motor: TrueMotor
    resistance: float
    reach: float

    @property
    def flux(self) -> float:
        """Its flux linkage without current (V·s)."""
        return float(self.psi(np.zeros(1, dtype=complex))[0].real)

    def psi(self, i: "np.ndarray") -> "np.ndarray":
        """Return the flux linkages (V·s, complex) at complex currents (A)."""
        return np.asarray(self.motor.flux(i))

    @property
    def limit(self) -> float:
        """I(∞) (A): the current that takes all flux away from the d axis."""
        low, high = 0.0, 20.0 * self.motor.largest_current
        for _ in range(80):
            middle = 0.5 * (low + high)
            left = float(self.psi(np.array([complex(-middle)]))[0].real)
            low, high = (middle, high) if left > 0.0 else (low, middle)
        return 0.5 * (low + high)

    def speeds(self, count: int) -> Array:
        l_d = self.flux / self.limit
        l_q = float(self.psi(np.array([0.3j * self.limit]))[0].imag) / (0.3 * self.limit)
        return self.resistance / math.sqrt(l_d * l_q) * np.geomspace(0.15, self.reach, count)

    def currents(self, speed: Array, r: Array) -> "np.ndarray":
        """Return the complex currents (A) at electrical speeds (rad/s)."""
        return np.array(_settled(self, tuple(map(float, speed)), tuple(map(float, r))))

    def turned(self, speed: Array, warmer: Array, weaker: Array, drop: float) -> tuple[Array, Array, Array]:
        if drop or np.any(weaker != 1.0):
            raise ValueError("a map's magnets stay as they are, and its link has no drop")
        r = self.resistance * warmer
        i = self.currents(speed, r)
        l_d, l_q, _ = self.truths(speed)
        return np.abs(i), 1.5 * r * np.abs(i) ** 2, speed * math.sqrt(l_d * l_q) / r

    def truths(self, speed: Array) -> tuple[float, float, float]:
        i = self.currents(speed, np.full(speed.size, self.resistance))
        most = i[int(np.argmin(i.imag))]
        return (
            self.flux / self.limit,
            float(self.psi(np.array([most]))[0].imag) / most.imag,
            self.resistance,
        )


@lru_cache(maxsize=4096)
def _settled(motor: Mapped, speed: tuple[float, ...], r: tuple[float, ...]) -> tuple[complex, ...]:
    i = np.zeros(1, dtype=complex)
    found: list[complex] = []
    before = 0.0
    step = 1e-5 * motor.limit
    # Each speed starts from the one below, in short strides where the flux bends.
    for omega, ohms in zip(speed, r, strict=True):
        begin = before or 0.1 * omega
        for along in np.geomspace(begin, omega, 6):
            for _ in range(12):
                left = (ohms * i + 1j * along * motor.psi(i))[0]
                by_d = ((ohms * step + 1j * along * (motor.psi(i + step) - motor.psi(i))) / step)[0]
                by_q = ((1j * ohms * step + 1j * along * (motor.psi(i + 1j * step) - motor.psi(i))) / step)[0]
                slopes = np.array([[by_d.real, by_q.real], [by_d.imag, by_q.imag]])
                d, q = np.linalg.solve(slopes, [left.real, left.imag])
                i = i - complex(d, q)
                if math.hypot(d, q) < 1e-9 * motor.limit:
                    break
        before = omega
        found.append(complex(i[0]))
    return tuple(found)


def _log(random: Random, low: float, high: float) -> float:
    return math.exp(random.uniform(math.log(low), math.log(high)))


def constants(random: Random) -> Constant:
    """Return a motor of constants with L_q/L_d of 1 … 3."""
    resistance = _log(random, 0.01, 10.0)
    l_d = resistance * _log(random, 1e-4, 2e-2)
    return Constant(resistance, l_d, l_d * random.uniform(1.0, 3.0), _log(random, 4.0, 20.0))


def any_saliency(random: Random) -> Constant:
    """Return a motor of constants with L_q/L_d of 0.8 … 5."""
    drawn = constants(random)
    return Constant(drawn.resistance, drawn.l_d, drawn.l_d * _log(random, 0.8, 5.0), drawn.reach)


def reluctance(random: Random) -> Constant:
    """Return a PM-SyRM of constants: L_q/L_d of 3 … 8, little magnet."""
    drawn = constants(random)
    return Constant(drawn.resistance, drawn.l_d, drawn.l_d * random.uniform(3.0, 8.0), drawn.reach, 0.01)


def on_map(name: str, measured: Path | None = None) -> Callable[[Random], Mapped]:
    """Return what draws motors on one of the maps of `flux_truths`, R between a third and three times the motor's."""

    def drawn(random: Random) -> Mapped:
        motor = true_motors(measured)[name]
        return Mapped(motor, motor.resistance * _log(random, 0.33, 3.0), _log(random, 4.0, 20.0))

    return drawn


WORLDS: dict[str, Callable[[Random], Shorted]] = {
    "any saliency": any_saliency,
    "PM-SyRM": reluctance,
    **{
        f"on map: {name}": on_map(name)
        for name in ("bridged IPMSM", "cross-saturated", "surface magnets", "reluctance, little magnet")
    },
}
