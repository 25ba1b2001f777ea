"""Efficiency and loss of load points, with a budget that includes the correlations between the points and both powers."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from GTC.lib import UncertainReal

from drivers.interfaces import Accuracy
from drivers.interfaces.text import text
from procedures.core.procedure import Procedure
from procedures.estimation.fitting.fit import EstimationError, Fit
from procedures.estimation.flux.load_points import efficiency_of
from procedures.estimation.mechanics.drag import drag_at
from procedures.estimation.winding.resistance import at_temperature
from procedures.maps.load_run import DrivenPoint
from procedures.maps.turned_points import torque_gain
from procedures.techniques.shaft.torque_zero import ZeroLine
from procedures.techniques.temperature.settings import COLD

_RPM = math.pi / 30.0
#: A shaft power below this (W) has no efficiency worth a figure.
_LEAST = 1e-3


@dataclass(frozen=True)
class LoadGrid:
    """All points; `ratio` is all phases' power over three times that of A with its half-width, `drags` the motor's and dynamometer's drag
    without a current, `tare` the dynamometer's alone; temperatures (°C) are the winding's before and right after, None
    where nobody read it.
    """

    points: tuple[DrivenPoint, ...]
    ratio: tuple[float, float]
    drags: Fit
    tare: Fit | None
    zero: ZeroLine
    cold: UncertainReal
    hot: UncertainReal | None


@dataclass(frozen=True)
class PointPowers:
    """One point's powers (W), uncertain: electrical, shaft, their difference, and what it is made of; parts that are not known are None."""

    electrical: UncertainReal
    shaft: UncertainReal
    torque: UncertainReal
    loss: UncertainReal
    efficiency: UncertainReal | None
    copper: UncertainReal | None
    without_current: UncertainReal
    rest: UncertainReal | None


class LoadResults:
    """Reports for a procedure what its load points tell."""

    def __init__(self, procedure: Procedure[Any], grid: LoadGrid) -> None:
        self._procedure, self._grid = procedure, grid
        self._unc, self._settings = procedure.bench.uncertainties, procedure.settings
        largest = max(abs(point.torque.torque) for point in grid.points)
        self._torque = torque_gain(self._unc, grid.points[0].torque.torque_accuracy, largest)
        self._zero = grid.zero.left(self._unc)
        self._phases = self._unc.limit("all phases' power over three times that of A", *grid.ratio)
        self._between: UncertainReal | None = None
        self._delay = self._unc.limit("delay between voltage and current channels", 0.0, self._settings.skew)

    def report(self) -> None:
        """Report the largest efficiency and the loss at the largest power, and keep all points."""
        procedure, grid = self._procedure, self._grid
        powers = [self._powers(point) for point in grid.points]
        procedure.findings |= {
            "points": [self._row(point, each) for point, each in zip(grid.points, powers, strict=True)],
            "winding_temperature": {
                "before": float(grid.cold.x),
                "after": None if grid.hot is None else float(grid.hot.x),
            },
            "phases": {"ratio": grid.ratio[0], "half_width": grid.ratio[1]},
            "drag": dict(zip(grid.drags.names, grid.drags.values.tolist(), strict=True)),
            "tare": None if grid.tare is None else dict(zip(grid.tare.names, grid.tare.values.tolist(), strict=True)),
        }
        self._contradictions(powers)
        with_figure = [each for each in powers if each.efficiency is not None]
        shares = [each.efficiency for each in with_figure if each.efficiency is not None]
        # Where more comes out than goes in at every point there is no efficiency; the power balance says so.
        if shares:
            procedure.report(
                "efficiency",
                100.0 * max(shares, key=lambda each: float(each.x)),
                section=procedure.section,
                estimator="shaft power over electrical power at the terminals (input-output)",
            )
        strongest = max(powers, key=lambda each: abs(float(each.electrical.x)))
        procedure.report(
            "total_loss",
            strongest.loss,
            section=procedure.section,
            estimator="electrical power at the terminals minus shaft power",
        )

    def _powers(self, point: DrivenPoint) -> PointPowers:
        unc, grid, speed = self._unc, self._grid, point.torque.speed
        phase = unc.statistical(
            "power of a phase, period by period",
            point.phase.power,
            point.phase.uncertainty,
            point.phase.degrees_of_freedom,
        )
        # Gains of one oscilloscope may go together: their product is then the worse for it, and so it is taken.
        volts, amperes = (
            unc.instrument("oscilloscope, all channels", 1.0, Accuracy(gain=each.gain, source=each.source))
            for each in (point.voltage_accuracy, point.current_accuracy)
        )
        turned = math.tau * point.frequency * point.phase.reactive * self._delay
        electrical = 3.0 * self._phases * (phase * volts * amperes + turned)
        own = unc.statistical(
            "torque of a point", -point.torque.torque, point.torque.uncertainty, float(self._settings.readings - 1)
        )
        zero = float(grid.zero.at(np.array([point.torque.time]))[0])
        torque = (own + zero + self._zero + self._drag(grid.tare, speed, "the dynamometer's own drag")) * self._torque
        read = point.torque.speed_accuracy
        turning = unc.instrument("dynamometer, speed", speed, Accuracy(gain=read.gain, source=read.source))
        shaft = torque * turning
        loss = electrical - shaft
        efficiency = self._efficiency(torque, turning, electrical)
        idle = self._drag(grid.drags, speed, "drag without a current") - self._drag(
            grid.tare, speed, "the dynamometer's own drag"
        )
        without, resistance = idle * self._torque * turning, self._resistance()
        if resistance is None:
            return PointPowers(electrical, shaft, torque, loss, efficiency, None, without, None)
        copper = 1.5 * resistance * (point.phase.current * amperes) ** 2
        return PointPowers(electrical, shaft, torque, loss, efficiency, copper, without, loss - copper - without)

    @staticmethod
    def _efficiency(torque: UncertainReal, speed: UncertainReal, electrical: UncertainReal) -> UncertainReal | None:
        """Return the efficiency, None where no power goes through, or more comes out than goes in."""
        if min(abs(float(torque.x) * float(speed.x)), abs(float(electrical.x))) < _LEAST:
            return None
        try:
            return efficiency_of(torque, speed, electrical).efficiency
        except EstimationError:
            # The balance of all points says what is wrong with it.
            return None

    def _drag(self, fit: Fit | None, speed: float, name: str) -> UncertainReal:
        if fit is None:
            return self._unc.limit(name, 0.0, 0.0)
        value, uncertainty = drag_at(fit, speed)
        return self._unc.statistical(name, float(value[0]), float(uncertainty[0]), fit.degrees_of_freedom)

    def _resistance(self) -> UncertainReal | None:
        """Return the winding's resistance (Ω) as warm as it was, None where it is not known."""
        known, grid = self._procedure.known.get("stator_resistance"), self._grid
        if known is None or grid.hot is None:
            return None
        settings = self._settings
        return at_temperature(
            self._unc.of_parameter(known),
            COLD,
            self._warmth(grid.cold, grid.hot),
            settings.coefficient,
            settings.coefficient_reference,
        )

    def _warmth(self, cold: UncertainReal, hot: UncertainReal) -> UncertainReal:
        """Return how warm (°C) the winding was at a point: the first were as cold as the beginning, the last as warm as the end."""
        if self._between is None:
            rise = float(hot.x) - float(cold.x)
            self._between = self._unc.limit("warmth of a point between begin and end", 0.0, 0.5 * abs(rise))
        return 0.5 * (cold + hot) + self._between

    def _contradictions(self, powers: list[PointPowers]) -> None:
        """Alarm powers that no motor has: a loss below none, or below what copper and drag alone take."""
        negative = [each for each in powers if self._unc.interval(each.loss)[1] < 0.0]
        if negative:
            self._procedure.notice(
                "power-balance",
                text(
                    "at {count} of {points} points the shaft gives more than the terminals take: look at the probes' factors, the "
                    "torque's zero and sign, and the phase that the current probe is on",
                    count=len(negative),
                    points=len(powers),
                ),
            )
        short = [each for each in powers if each.rest is not None and self._unc.interval(each.rest)[1] < 0.0]
        if short and not negative:
            self._procedure.notice(
                "power-balance",
                text(
                    "at {count} of {points} points the loss is less than copper and drag together: a gain, a delay between the channels "
                    "(skew), or the winding's temperature is not as stated",
                    count=len(short),
                    points=len(powers),
                ),
            )
        if all(each.copper is None for each in powers) and self._grid.hot is not None:
            self._procedure.notice(
                "loss-parts",
                text(
                    "the winding's resistance is not known, so the loss is not separated into parts; measure the "
                    "stator resistance first"
                ),
            )

    def _row(self, point: DrivenPoint, powers: PointPowers) -> dict[str, Any]:
        row: dict[str, Any] = {
            "speed_rpm": point.torque.speed / _RPM,
            "commanded_current": point.commanded,
            "reported_current": point.reported.value,
            "current": point.phase.current,
            "voltage": point.phase.voltage,
            "power_factor": math.cos(point.phase.angle),
            "frequency": point.frequency,
        }
        for name in ("torque", "electrical", "shaft", "loss", "efficiency", "copper", "without_current", "rest"):
            quantity = getattr(powers, name)
            row[name] = None if quantity is None else float(quantity.x)
            row[f"{name}_uncertainty"] = None if quantity is None else float(quantity.u)
        if powers.efficiency is not None:
            row["efficiency_interval"] = list(self._unc.interval(powers.efficiency))
        row["loss_interval"] = list(self._unc.interval(powers.loss))
        return row
