"""Flux maps that are known, for studies: a measured one, and made-up ones of different character.

They share nothing with the estimators: splines are scipy's tensor products, made-up maps are gradients of a coenergy.
"""

import csv
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import NdBSpline, make_interp_spline

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class TrueMotor:
    """A motor whose `flux` (V·s, peak, complex) over complex current (A, peak) is known, `d_range` (A) of it, and what its bench needs."""

    flux: Callable[[Complex], Complex]
    largest_current: float
    pole_pairs: int
    resistance: float
    electrical_speed: float
    symmetric: bool = True
    magnet: bool = True
    d_range: tuple[float, float] | None = None


def table(path: Path) -> tuple[Array, Array, Array, Array]:
    """Return the axes (A) and the flux linkages (V·s) of a file of id_A, iq_A, psi_d_Vs, psi_q_Vs on a full grid."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = np.array([[float(cell) for cell in row] for row in list(csv.reader(file))[1:]])
    i_d, i_q = np.unique(rows[:, 0]), np.unique(rows[:, 1])
    order = np.lexsort((rows[:, 1], rows[:, 0]))
    shape = (i_d.size, i_q.size)
    return i_d, i_q, rows[order, 2].reshape(shape), rows[order, 3].reshape(shape)


def of_table(i_d: Array, i_q: Array, psi_d: Array, psi_q: Array) -> Callable[[Complex], Complex]:
    """Return a bicubic spline through a table, which goes on beyond its edges as it ends."""

    def spline(values: Array) -> NdBSpline:
        along_d = make_interp_spline(i_d, values, 3, axis=0)
        along_q = make_interp_spline(i_q, along_d.c, 3, axis=1)
        return NdBSpline((along_d.t, along_q.t), along_q.c.T, 3)

    d, q = spline(psi_d), spline(psi_q)

    def flux(current: Complex) -> Complex:
        at = np.column_stack((current.real, current.imag))
        return np.asarray(d(at) + 1j * q(at))

    return flux


def of_coenergy(coenergy: Callable[[Complex, Complex], Complex]) -> Callable[[Complex], Complex]:
    """Return the flux linkages whose coenergy (J, an analytic function) is given, by complex steps."""

    def flux(current: Complex) -> Complex:
        d, q, step = current.real.astype(complex), current.imag.astype(complex), 1e-20
        return np.asarray(coenergy(d + 1j * step, q).imag / step + 1j * coenergy(d, q + 1j * step).imag / step)

    return flux


def _saturating(x: Complex, width: float) -> Complex:
    """Return the integral of tanh(x/width)."""
    return np.asarray(width * np.log(np.cosh(x / width)))


def _bridged_ipm(d: Complex, q: Complex) -> Complex:
    """An 85 kW traction motor's like: bridges that saturate at a few amperes, strong saturation of q, each axis by the other."""
    main = 0.055 * d + 0.5 * 0.12e-3 * (d**2 + q**2) + 0.045 * _saturating(d - 60.0, 240.0)
    bridges = 0.006 * _saturating(q, 14.0)
    iron = 0.085 * _saturating(q, 170.0)
    cross = -2.2e-9 * q**2 * d / (1.0 + (d**2 + q**2) / 300.0**2) - 0.012 * _saturating(q, 90.0) * np.tanh(d / 260.0)
    return np.asarray(main + bridges + iron + cross)


def _surface_magnets(d: Complex, q: Complex) -> Complex:
    """A servo motor with surface magnets: inductances all but constant."""
    return np.asarray(0.05 * d + 0.5 * 2.0e-3 * d**2 + 0.5 * 2.05e-3 * q**2 - 2e-7 * q**4 - 2e-6 * d * q**2)


def _reluctance(d: Complex, q: Complex) -> Complex:
    """A reluctance motor without magnets: q is its way of high inductance."""
    main = 0.5 * 18e-3 * d**2 + 0.5 * 6e-3 * q**2 + 0.75 * _saturating(q, 9.0)
    return np.asarray(main - 0.02 * _saturating(q, 8.0) * (d / 20.0) ** 2 / (1.0 + (d / 20.0) ** 2))


def _little_magnet(d: Complex, q: Complex) -> Complex:
    return np.asarray(_reluctance(d, q) + 0.06 * d)


def _cross_saturated(d: Complex, q: Complex) -> Complex:
    """A PM-SyRM of 20 kW's like: one iron for both axes, so that i_q takes a third of the magnets' flux away at full current."""
    shared = np.sqrt(1.0 + ((d + 35.0) / 70.0) ** 2 + (q / 45.0) ** 2)
    return np.asarray(
        0.5 * 0.9e-3 * d**2 + 0.5 * 0.7e-3 * q**2 + 21.0 * (shared - np.sqrt(1.25)) + 0.10 * _saturating(q, 8.0)
    )


def _asymmetric(baldor: Callable[[Complex], Complex], most: float) -> Callable[[Complex], Complex]:
    """Turn a map by an angle that grows with the current: its zero stays, its symmetry goes."""

    def flux(current: Complex) -> Complex:
        turn = np.exp(1j * np.radians(4.0) * np.abs(current) / most)
        return np.asarray(baldor(current / turn) * turn)

    return flux


@dataclass(frozen=True)
class OtherTable:
    """A measured map that the project does not have: its file, and what its motor's bench needs to know (Ω, electrical rad/s)."""

    path: Path
    pole_pairs: int
    resistance: float
    electrical_speed: float

    def motor(self) -> TrueMotor:
        """Return the motor in the largest circle that the table holds, whose d axis is where the flux without current is.

        It is read as any motor is, one side of i_q, whether symmetric or not.
        """
        i_d, i_q, psi_d, psi_q = table(self.path)
        shown = of_table(i_d, i_q, psi_d, psi_q)
        turn = np.exp(1j * np.angle(shown(np.zeros(1, dtype=complex))))
        largest = 0.97 * min(-float(i_d[0]), float(i_q[-1]), -float(i_q[0]))
        return TrueMotor(
            lambda i: shown(i * turn) / turn, largest, self.pole_pairs, self.resistance, self.electrical_speed,
            d_range=(-largest, min(largest, float(i_d[-1]))),
        )  # fmt: skip


@cache
def true_motors(measured: Path | None, others: tuple[OtherTable, ...] = ()) -> Mapping[str, TrueMotor]:
    """Return the motors by name; `measured` is the table of a 5.6 kW PM-SyRM, without which there are only made-up ones and `others`."""
    made = {
        "bridged IPMSM": TrueMotor(of_coenergy(_bridged_ipm), 240.0, 4, 0.012, 2.0 * np.pi * 50.0),
        "cross-saturated": TrueMotor(of_coenergy(_cross_saturated), 120.0, 3, 0.05, 2.0 * np.pi * 40.0),
        "bridged IPMSM, turned with current": TrueMotor(
            _asymmetric(of_coenergy(_bridged_ipm), 480.0), 240.0, 4, 0.012, 2.0 * np.pi * 50.0, symmetric=False
        ),
        "surface magnets": TrueMotor(of_coenergy(_surface_magnets), 15.0, 4, 0.5, 2.0 * np.pi * 60.0),
        "reluctance": TrueMotor(of_coenergy(_reluctance), 20.0, 2, 0.63, 400.0 * np.pi / 15.0, magnet=False),
        "reluctance, little magnet": TrueMotor(of_coenergy(_little_magnet), 20.0, 2, 0.63, 400.0 * np.pi / 15.0),
    }
    made |= {other.path.stem: other.motor() for other in others}
    if measured is None:
        return made
    axes_and_flux = table(measured)
    baldor = of_table(*axes_and_flux)
    random = np.random.default_rng(20)
    i_d, i_q, psi_d, psi_q = axes_and_flux
    rough = 0.002 * 1.35
    even = random.normal(size=psi_d.shape)
    odd = random.normal(size=psi_q.shape)
    noisy = of_table(i_d, i_q, psi_d + rough * 0.5 * (even + even[:, ::-1]), psi_q + rough * 0.5 * (odd - odd[:, ::-1]))
    common = (19.5, 2, 0.63, 400.0 * np.pi / 15.0)
    return {
        "Baldor": TrueMotor(baldor, *common),
        **made,
        "Baldor, turned with current": TrueMotor(_asymmetric(baldor, 20.0), *common, symmetric=False),
        "Baldor, rough by 0.2 %": TrueMotor(noisy, *common),
    }
