"""Data of a short circuit over speed, and their fits."""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from GTC.lib import UncertainReal

from procedures.estimation.fitting.fit import EstimationError, Fit, FloatArray
from procedures.estimation.flux.short_circuit import ShortCircuitFit, fit_short_circuit
from procedures.estimation.flux.short_limits import ShortLimits
from procedures.estimation.winding.short_circuit import (
    BrakingTorque,
    fit_currents,
    fit_torque,
    with_peak,
)
from procedures.maps.turned_points import Fundamentals, HeldTorque
from procedures.techniques.shaft.torque_zero import ZeroLine

#: What L_q/L_d at no current may differ by where the axes saturate, as a standard deviation of its logarithm.
_SATURATED = 0.25


@dataclass(frozen=True)
class OpenBefore:
    """The motor with open terminals: EMF at the highest speed, drags from the slowest to the fastest of the `speeds` (rad/s)."""

    emf: Fundamentals
    drags: tuple[HeldTorque, ...]
    zero: ZeroLine
    pole_pairs: int
    speeds: tuple[float, ...]
    temperature: UncertainReal

    def torques(self) -> FloatArray:
        """Return the drags (N·m), the transducer's zero off."""
        return _less_zero(self.drags, self.zero)

    def drag_at(self, speed: float) -> tuple[float, float]:
        """Return the drag (N·m) at a speed (rad/s) between those that were read, and its standard uncertainty."""
        speeds = [each.speed for each in self.drags]
        return (
            float(np.interp(speed, speeds, self.torques())),
            float(np.interp(speed, speeds, [each.uncertainty for each in self.drags])),
        )


@dataclass(frozen=True)
class ShortPoint:
    """One speed: the current in A, and the torque."""

    current: Fundamentals
    torque: HeldTorque


@dataclass(frozen=True)
class ShortSweep:
    """All speeds, the slowest first (some may have been read later), and the slowest `again` last of all; `temperature` (°C) was the
    winding's before.

    `shares` are mean phase current over that of A at the slowest and the fastest speed, None where nobody looked; `stopped` says what
    kept it from the highest speed: "current", "torque", or nothing.
    """

    points: tuple[ShortPoint, ...]
    again: ShortPoint
    zero: ZeroLine
    temperature: UncertainReal
    shares: tuple[float, float] | None = None
    stopped: str = ""

    @property
    def electrical(self) -> FloatArray:
        """Electrical speeds (rad/s)."""
        return np.array([each.current.electrical_speed for each in self.points])

    @property
    def amplitudes(self) -> FloatArray:
        """Amplitudes (A, peak) of the phases' mean current."""
        size = np.array([each.current.mean for each in self.points])
        if self.shares is None:
            return size
        course = np.log(self.electrical / self.electrical[0]) / math.log(self.electrical[-1] / self.electrical[0])
        result: FloatArray = size * (self.shares[0] + (self.shares[1] - self.shares[0]) * course)
        return result

    @property
    def rise(self) -> float:
        """By how much (relative) the resistance rose from the slowest point to the same again: there the current is λω/R."""
        return (
            self.points[0].current.mean
            / self.again.current.mean
            * (self.again.current.electrical_speed / self.points[0].current.electrical_speed)
            - 1.0
        )

    @property
    def warmings(self) -> FloatArray:
        """Return by how much (relative) the resistance had risen at each point: as the heat by then, of what it rose by in all."""
        heat = self.amplitudes**2
        order = np.argsort([each.torque.time for each in self.points])
        before = np.empty_like(heat)
        before[order] = np.cumsum(heat[order])
        result: FloatArray = max(self.rise, 0.0) * (before - 0.5 * heat) / float(np.sum(heat))
        return result

    def torques(self) -> FloatArray:
        """Return the torques (N·m) that the dynamometer gave, the transducer's zero off."""
        return _less_zero([each.torque for each in self.points], self.zero)


@dataclass(frozen=True)
class FittedSweep:
    """The fits of one sweep: what the currents tell with the open circuit's flux linkage, what the torques tell without it.

    `braking` (N·m) is the short circuit's own torque at each point, `hidden` (N·m) how much of the drag may have been iron loss that the
    short circuit's smaller flux has not; `floor` what of the resistance (Ω) that would be; `together` fits both at once, with saturation
    and a drop that no current changes, None where they do not tell these apart.
    """

    currents: Fit
    torque: BrakingTorque
    together: ShortCircuitFit | None
    braking: FloatArray
    hidden: FloatArray
    floor: float


def fit_sweep(before: OpenBefore, sweep: ShortSweep, saliency: float | None, unbalance: float) -> FittedSweep:
    """Fit one sweep; `saliency` is L_q/L_d as measured at no current, None where it was not, `unbalance` the half-width of a phase's
    deviation in current where only one was probed (relative).
    """
    omega, size = sweep.electrical, sweep.amplitudes
    own = np.array([each.current.uncertainty for each in sweep.points])
    flux = before.emf.flux.value
    known = (saliency, _SATURATED) if saliency is not None else None
    currents = fit_currents(
        omega,
        size,
        np.hypot(own, 2e-4 * size),
        flux,
        ranges=[each.current.ranges[0] for each in sweep.points],
        gain=max(each.current.accuracies[0].gain for each in sweep.points) / 3.0,
        warmings=sweep.warmings,
        **({} if known is None else {"saliency": known}),
    )
    drags = np.array([before.drag_at(each.torque.speed) for each in sweep.points])
    braking = sweep.torques() - drags[:, 0]
    relative = own / size
    scatter = np.sqrt(
        np.array([each.torque.uncertainty for each in sweep.points]) ** 2
        + drags[:, 1] ** 2
        + (2.0 * relative * braking) ** 2
    )
    fit = fit_torque(omega, size, braking, scatter, before.pole_pairs)
    # What of the drag grows with the speed may be iron, which the short circuit's smaller flux heats less.
    hidden = np.maximum(drags[:, 0] - float(drags[:, 0].min()), 0.0)
    design = 1.5 * before.pole_pairs * size**2 / omega
    weight = 1.0 / scatter**2
    floor = float(np.sum(weight * design * hidden) / np.sum(weight * design**2))
    peaked = with_peak(fit, currents, omega, braking, flux, before.pole_pairs)
    together = None
    with suppress(EstimationError):
        together = fit_short_circuit(
            omega,
            size,
            braking,
            pole_pairs=before.pole_pairs,
            flux_linkage=flux,
            u_flux_linkage=math.hypot(
                before.emf.flux.uncertainty, flux * max(each.gain for each in before.emf.accuracies) / math.sqrt(3.0)
            ),
            # The drag is off already.
            friction=np.zeros(omega.size),
            limits=ShortLimits(
                current=max(each.current.accuracies[0].gain for each in sweep.points),
                unequal=unbalance if sweep.shares is None else 0.0,
                torque=sweep.points[0].torque.torque_accuracy.gain,
                saturation=_SATURATED,
            ),
        )
    return FittedSweep(currents, peaked, together, braking, hidden, floor)


def _less_zero(taken: Sequence[HeldTorque], zero: ZeroLine) -> FloatArray:
    times = np.array([each.time for each in taken])
    result: FloatArray = np.array([each.torque for each in taken]) - zero.at(times)
    return result
