"""Flux linkages of a winding over its currents at one strength of the magnets, and what iron loss takes of the currents.

Frame of the rotor, d along the magnets, peak, amplitude-invariant; all currents (A) and fluxes (V·s) are a winding's own.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim_instruments.physics.motor.flux_map import FluxMap
from sim_instruments.physics.motor.saturation import Current

FloatArray = NDArray[np.float64]

#: Newton's steps that any current takes, and the step (relative) after which there are enough: the next is its square.
_STEPS, _ENOUGH = 30, 1e-9

#: ψd, ψq and ∂ψd/∂id, ∂ψd/∂iq, ∂ψq/∂id, ∂ψq/∂iq.
FluxAndSlopes = tuple[float, float, float, float, float, float]


class WindingFlux(Protocol):
    """Flux linkages (V·s) and differential inductances (H) of a winding."""

    def at(self, d_current: float, q_current: float) -> FluxAndSlopes:
        """Return both fluxes and the four differential inductances at one pair of currents (A)."""

    def at_each(self, d_currents: FloatArray, q_currents: FloatArray) -> FloatArray:
        """Return the same (6, n) at n pairs of currents (A)."""

    @property
    def largest(self) -> tuple[float, float]:
        """Largest ∂ψd/∂id and ∂ψq/∂iq (H)."""


@dataclass(frozen=True)
class LinearFlux:
    """ψd = λ + Ld·id, ψq = Lq·iq."""

    flux_linkage: float
    d_axis_inductance: float
    q_axis_inductance: float

    def at(self, d_current: float, q_current: float) -> FluxAndSlopes:
        """Return both fluxes and the four differential inductances at one pair of currents (A)."""
        d, q = self.d_axis_inductance, self.q_axis_inductance
        return self.flux_linkage + d * d_current, q * q_current, d, 0.0, 0.0, q

    def at_each(self, d_currents: FloatArray, q_currents: FloatArray) -> FloatArray:
        """Return the same (6, n) at n pairs of currents (A)."""
        one = np.ones_like(d_currents)
        d, q = self.d_axis_inductance, self.q_axis_inductance
        return np.array([self.flux_linkage + d * d_currents, q * q_currents, d * one, 0.0 * one, 0.0 * one, q * one])

    @property
    def largest(self) -> tuple[float, float]:
        """Ld and Lq (H)."""
        return self.d_axis_inductance, self.q_axis_inductance


class MappedFlux:
    """The flux map of a motor, seen from a winding; weaker magnets are a shift of the d current.

    A delta's winding carries 1/√3 of the map's currents and links √3 times its fluxes. The magnets are as strong as gives
    ψd = `flux_linkage` (V·s, the winding's) at no current.
    """

    def __init__(self, flux_map: FluxMap, flux_linkage: float, *, delta: bool) -> None:
        self._map = flux_map
        self._scale = math.sqrt(3.0) if delta else 1.0
        self._shift = _d_current(flux_map, flux_linkage / self._scale)

    def at(self, d_current: float, q_current: float) -> FluxAndSlopes:
        """Return both fluxes and the four differential inductances at one pair of currents (A)."""
        scale = self._scale
        if scale == 1.0:
            return self._map.at(d_current + self._shift, q_current)
        d_flux, q_flux, dd, dq, qd, qq = self._map.at(scale * d_current + self._shift, scale * q_current)
        square = scale * scale
        return scale * d_flux, scale * q_flux, square * dd, square * dq, square * qd, square * qq

    def at_each(self, d_currents: FloatArray, q_currents: FloatArray) -> FloatArray:
        """Return the same (6, n) at n pairs of currents (A)."""
        scale = self._scale
        result = self._map.at_each(scale * d_currents + self._shift, scale * q_currents)
        result[:2] *= scale
        result[2:] *= scale * scale
        return result

    @property
    def largest(self) -> tuple[float, float]:
        """Largest ∂ψd/∂id and ∂ψq/∂iq (H) in the map."""
        d, q = self._map.largest_inductances
        return self._scale**2 * d, self._scale**2 * q


@dataclass(frozen=True)
class CrossSaturation:
    """The differential inductances of a winding's law with the terms between the axes."""

    law: WindingFlux

    def differential_inductances(self, d_current: Current, q_current: Current) -> tuple[Current, ...]:
        """Return ∂ψd/∂id, ∂ψd/∂iq, ∂ψq/∂id and ∂ψq/∂iq (H) at currents (A, peak)."""
        if isinstance(d_current, np.ndarray) and isinstance(q_current, np.ndarray):
            return tuple(self.law.at_each(d_current, q_current)[2:])
        return self.law.at(d_current, q_current)[2:]

    @property
    def largest(self) -> tuple[float, ...]:
        """Largest ∂ψd/∂id and ∂ψq/∂iq (H), nothing between them."""
        direct, quadrature = self.law.largest
        return direct, 0.0, 0.0, quadrature


def magnetising(
    law: WindingFlux, d_current: FloatArray, q_current: FloatArray, lost: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the currents m (A, (2, n)) of i = m + g·jψ(m) and what the law gives there (6, n).

    `lost` g (A/(V·s), (n,)) is the share of the flux that iron loss makes a current of, signed as the speed is.
    """
    m_d, m_q = d_current.copy(), q_current.copy()
    found = law.at_each(m_d, m_q)
    if not lost.any():
        return np.array([m_d, m_q]), found
    scale = _ENOUGH * (np.hypot(d_current, q_current) + np.abs(lost) * np.hypot(found[0], found[1]) + 1e-300)
    for _ in range(_STEPS):
        d_flux, q_flux, dd, dq, qd, qq = found
        d_error, q_error = d_current - m_d + lost * q_flux, q_current - m_q - lost * d_flux
        a, b, c, d = 1.0 - lost * qd, -lost * qq, lost * dd, 1.0 + lost * dq
        determinant = a * d - b * c
        d_step, q_step = (d_error * d - b * q_error) / determinant, (a * q_error - c * d_error) / determinant
        m_d, m_q = m_d + d_step, m_q + q_step
        found = law.at_each(m_d, m_q)
        if (np.hypot(d_step, q_step) <= scale).all():
            break
    return np.array([m_d, m_q]), found


def magnetising_flux(law: WindingFlux, current: complex, lost: float) -> complex:
    """Return the flux (V·s, d + j·q) at one current i = m + g·jψ(m) (A, d + j·q), in plain numbers."""
    m_d, m_q = current.real, current.imag
    d_flux, q_flux, dd, dq, qd, qq = law.at(m_d, m_q)
    if lost == 0.0:
        return complex(d_flux, q_flux)
    scale = _ENOUGH * (abs(current) + abs(lost) * math.hypot(d_flux, q_flux) + 1e-300)
    for _ in range(_STEPS):
        d_error, q_error = current.real - m_d + lost * q_flux, current.imag - m_q - lost * d_flux
        a, b, c, d = 1.0 - lost * qd, -lost * qq, lost * dd, 1.0 + lost * dq
        determinant = a * d - b * c
        d_step, q_step = (d_error * d - b * q_error) / determinant, (a * q_error - c * d_error) / determinant
        m_d, m_q = m_d + d_step, m_q + q_step
        d_flux, q_flux, dd, dq, qd, qq = law.at(m_d, m_q)
        if math.hypot(d_step, q_step) <= scale:
            break
    return complex(d_flux, q_flux)


def _d_current(flux_map: FluxMap, flux_linkage: float) -> float:
    """Return the d current (A) at which ψd of the map is a flux linkage (V·s), the q current being none."""
    current = 0.0
    for _ in range(_STEPS):
        d_flux, _, inductance, *_ = flux_map.at(current, 0.0)
        step = (flux_linkage - d_flux) / inductance
        if abs(flux_linkage - d_flux) <= 1e-14 * abs(flux_linkage):
            break
        current += step
    return current
