"""EMF constant and switch resistance of a six-step drive from the mean voltages at several loads together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from GTC.lib import UncertainReal

from drivers.interfaces import Accuracy
from drivers.interfaces.text import text
from procedures.core.budget import Uncertainties
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.linear import least_squares
from procedures.estimation.six_step import currents as six_step
from procedures.estimation.winding.connections import Connection
from procedures.six_step.load_points import LoadPoint
from procedures.six_step.parts import WindingData
from procedures.six_step.split import scope_gain

Seen = Sequence[tuple[LoadPoint, six_step.LineCurrent, UncertainReal]]


@dataclass(frozen=True)
class VoltageTerms:
    """The terms of the mean bus voltage at each load, of shape (n,): `bus` (V) = k_e·`speed` + R_t·`switched` + `drops` (V).

    `drops` is R_11 times `mean_current` (A) and L11 − L12 times `rate` (A/s).
    """

    bus: FloatArray
    speed: FloatArray
    switched: FloatArray
    mean_current: FloatArray
    rate: FloatArray
    drops: FloatArray

    @classmethod
    def of(cls, seen: Seen, winding: WindingData, connection: Connection) -> "VoltageTerms":
        """Return the terms of loads with the line's current and the winding's temperature (°C)."""
        # A drop is r·I_av + (L11 − L12)·Δi/τ: linear in both, so their errors reach the result by the same matrix.
        mean_current, rate = (
            np.array([six_step.average_drop(line, connection, *of, point.state_time) for point, line, _ in seen])
            for of in ((1.0, 0.0), (0.0, 1.0))
        )
        resistances = np.array([float(winding.resistance_at(temperature).x) for _, _, temperature in seen])
        magnets = np.array([float(winding.magnets_at(temperature).x) for _, _, temperature in seen])
        return cls(
            np.array([p.bus_voltage.value for p, _, _ in seen]),
            np.array([p.speed.value for p, _, _ in seen]) * magnets,
            np.array([six_step.switched_average(line) for _, line, _ in seen]),
            mean_current,
            rate,
            resistances * mean_current + float(winding.inductance.x) * rate,
        )

    def fitted(self, given: float | None) -> tuple[FloatArray, FloatArray]:
        """Return the design (n, k) of what is fitted and the voltages (n,) for it; R_t is where it is not `given` (Ω)."""
        left = self.bus - self.drops
        if given is None:
            return np.column_stack((self.speed, self.switched)), left
        return self.speed[:, None], left - given * self.switched


def fit_emf(
    seen: Seen,
    winding: WindingData,
    given: float | None,
    connection: Connection,
    unc: Uncertainties,
    shifts: Sequence[FloatArray] = (),
) -> tuple[UncertainReal, UncertainReal, float]:
    """Return k_e (V·s/rad) as the run began, R_t (Ω), and the fit's residual (V rms).

    `seen` are loads with the line's current and the winding's temperature (°C); R_t is fitted where it is not `given` (Ω). `shifts` are how
    far what is fitted may be off together, for what the loads show beyond the model. Raises EstimationError where the points do not
    determine them.
    """
    terms = VoltageTerms.of(seen, winding, connection)
    resistances = [winding.resistance_at(temperature) for _, _, temperature in seen]
    magnets = [winding.magnets_at(temperature) for _, _, temperature in seen]
    inductance = winding.inductance
    design, voltage = terms.fitted(given)
    fit = least_squares(("emf", "switch")[: design.shape[1]], design, voltage)
    ways = [(unc.limit("loads that contradict each other", 0.0, 1.0), shift) for shift in shifts]
    solve = np.linalg.pinv(design)
    read, k_e = seen[-1][0].bus_voltage.accuracy, fit.value("emf")
    gain = unc.instrument("drive, bus voltage", 1.0, Accuracy(gain=read.gain, source=read.source)) - 1.0
    offset = unc.instrument("drive, bus voltage", 0.0, Accuracy(offset=read.offset, source=read.source))
    scope = scope_gain(unc, seen[-1][0].current_accuracy)
    tachometer = _tachometer([point for point, _, _ in seen], unc)

    def figure(row: int, name: str) -> UncertainReal:
        on = solve[row]
        found = unc.statistical(
            text("{what} over loads", what=name), fit.value(name), fit.uncertainty(name), fit.degrees_of_freedom
        ) + gain * float(on @ terms.bus)
        found = found + offset * float(on.sum())
        for weight, current, r in zip(on, terms.mean_current, resistances, strict=True):
            found = found - (r - float(r.x)) * float(weight * current)
        for weight, (point, _, _), m in zip(on, seen, magnets, strict=True):
            found = found - (m - float(m.x)) * float(weight * k_e * point.speed.value)
        found = found - (inductance - float(inductance.x)) * float(on @ terms.rate)
        for way, shift in ways:
            found = found + way * float(shift[row])
        return found - scope * float(on @ terms.drops)

    constant = figure(0, "emf") * (1.0 + tachometer)
    switch = (
        figure(1, "switch") * (1.0 - scope)
        if given is None
        else unc.standard(text("{name} given", name="R_t"), given, 0.0)
    )
    return constant, switch, fit.residual_rms


def _tachometer(points: Sequence[LoadPoint], unc: Uncertainties) -> UncertainReal:
    """Return the tachometer's relative error at the mean speed, a quantity around zero."""
    speed = sum(p.speed.value for p in points) / len(points)
    return unc.instrument("tachometer", speed, points[-1].speed.accuracy) / speed - 1.0
