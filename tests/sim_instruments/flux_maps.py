"""Flux maps for tests: made ones with a formula, and the measured one where it stands beside the repository."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import strategies as st
from numpy.typing import NDArray

from sim_instruments.physics.motor.flux_map import FluxMap

FloatArray = NDArray[np.float64]


def _beside(name: str) -> Path:
    """Return a file of data that stands beside the repository, or beside a folder that it is in."""
    places = [parent / "shared" / "data" / "flux_maps" / name for parent in Path(__file__).resolve().parents]
    return next((place for place in places if place.is_file()), places[-1])


BALDOR_FILE = _beside("baldor_400rpm.csv")
needs_baldor = pytest.mark.skipif(
    not BALDOR_FILE.is_file(), reason="the measured flux map is not beside the repository (shared/data/flux_maps)"
)


@dataclass(frozen=True)
class MadeMotor:
    """A saturating motor whose coenergy is ½·(Ld·x² + Lq·y²) + E·(√(1 + (x/a)² + (y/b)²) − 1), x = id + magnets, y = iq.

    Its matrix of differential inductances is the coenergy's second derivative: symmetric and positive definite everywhere.
    """

    d_leakage: float
    q_leakage: float
    energy: float
    d_knee: float
    q_knee: float
    magnets: float

    def flux(self, d: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ψd and ψq (V·s) at currents (A)."""
        x = d + self.magnets
        root = np.sqrt(1.0 + (x / self.d_knee) ** 2 + (q / self.q_knee) ** 2)
        share = self.energy / root
        return self.d_leakage * x + share * x / self.d_knee**2, self.q_leakage * q + share * q / self.q_knee**2

    def inductances(self, d: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return ∂ψd/∂id, the cross term and ∂ψq/∂iq (H) at currents (A)."""
        x, a, b = d + self.magnets, self.d_knee, self.q_knee
        root = np.sqrt(1.0 + (x / a) ** 2 + (q / b) ** 2)
        share, cube = self.energy / root, self.energy / root**3
        return (
            self.d_leakage + share / a**2 - cube * x**2 / a**4,
            -cube * x * q / (a * b) ** 2,
            self.q_leakage + share / b**2 - cube * q**2 / b**4,
        )

    def map(self, reach: float, points: int = 21) -> FluxMap:
        """Return its table up to a current (A) on both axes and both sides."""
        axis = np.linspace(-reach, reach, points)
        d, q = (each.ravel() for each in np.meshgrid(axis, axis, indexing="ij"))
        return FluxMap.from_points(d, q, *self.flux(d, q))


#: An interior magnet motor of 60 A, whose cross term is a quarter of the d axis' inductance.
MADE = MadeMotor(60e-6, 80e-6, 0.5, 60.0, 40.0, 80.0)


@st.composite
def made_motors(draw: st.DrawFn) -> MadeMotor:
    """Motors of one ampere to hundreds, from hardly saturating to hard, either axis the one of more inductance."""
    scale, flux = 10.0 ** draw(st.floats(0.0, 2.5)), 10.0 ** draw(st.floats(-3.0, 0.0))
    d_knee, q_knee = draw(st.floats(0.4, 3.0)) * scale, draw(st.floats(0.4, 3.0)) * scale
    leakage = flux / scale
    return MadeMotor(
        draw(st.floats(0.05, 1.0)) * leakage,
        draw(st.floats(0.05, 1.0)) * leakage,
        draw(st.floats(0.1, 1.0)) * flux * scale,
        d_knee,
        q_knee,
        draw(st.floats(0.2, 2.0)) * scale,
    )


def reach_of(motor: MadeMotor) -> float:
    """Return a current (A) well into the saturation of both axes."""
    return 2.0 * max(motor.d_knee, motor.q_knee)
