"""Equivalent resistance at each load from what the source gives, where the EMF constant is known and no waveform is there."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from GTC.lib import UncertainReal

from drivers.interfaces.text import text
from procedures.core.budget import Uncertainties
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.six_step.load_misfit import (
    CLOSE,
    LoadReadings,
    LoadVerdict,
    MeterLimits,
    VoltagePlane,
    judge_powers,
    judge_speeds,
    judge_voltages,
)
from procedures.six_step.judged_loads import meter_limits
from procedures.six_step.load_points import LoadPoint
from procedures.six_step.parts import covariance

#: How far R_eq may be from a straight line over the speed, in the middle of the loads: copper warms, and R_c bends.
_BENDS = 0.1
#: What contradicts is off by its whole size, beside all other errors: a root of squares does not hold both.
_AT_ITS_END = 1.3
#: The record that findings are about.
_RECORD = "six-step-supply"


@dataclass(frozen=True)
class SuppliedLoads:
    """Loads with the EMF constant (V·s/rad) at each, as the magnets are there and as the bridge commutates.

    `least_resistance` (Ω, shape (n,)) is what windings and switches have at least, 0 where it is not known; `frequencies` (Hz, shape (n,))
    are the EMF's, None where they were not read; `warmth` (n,) is by which share the copper has more than at 25 °C.
    """

    points: Sequence[LoadPoint]
    emf: Sequence[UncertainReal]
    least_resistance: FloatArray
    frequencies: FloatArray | None
    pole_pairs: int | None
    warmth: FloatArray

    def found(self, unc: Uncertainties) -> tuple[list[UncertainReal], LoadVerdict]:
        """Return R_eq = (V_bus − k_e·ω)/I_s (Ω) at each load, with what the loads show beyond the model, and which of them count."""
        voltages = [p.bus_voltage.with_errors(unc, "drive, bus voltage") for p in self.points]
        currents = [p.bus_current.with_errors(unc, "drive, bus current") for p in self.points]
        speeds = [unc.instrument("tachometer", p.speed.value, p.speed.accuracy) for p in self.points]
        judged = self._speeds()
        # What a speed is taken from where it is no reading of this shaft has the same limits.
        speeds = [
            s * float(taken / p.speed.value) for s, taken, p in zip(speeds, judged.speeds, self.points, strict=True)
        ]
        left = [v - k * s for v, k, s in zip(voltages, self.emf, speeds, strict=True)]
        above = self._emf_above(left)
        if above:
            judged = judged.also(above)
        judged = self._voltages(self._plane(left, judged.speeds), judged)
        judged = self._powers(left, judged)
        judged = judged.also(self._over_speed(left, currents, judged))
        told = tuple(_about_supply(each) for each in judged.misfit.findings)
        judged = replace(judged, misfit=Misfit(told))
        return [
            self._with_contradictions(volts / amperes, k, judged, unc)
            for k, (volts, amperes) in enumerate(zip(left, currents, strict=True))
        ], judged

    def _speeds(self) -> LoadVerdict:
        speeds = np.array([p.speed.value for p in self.points])
        if self.frequencies is None:
            return LoadVerdict(Misfit(), tuple(range(speeds.size)), speeds)
        limits = meter_limits([p.speed for p in self.points], [0.0] * speeds.size)
        return judge_speeds(self._readings(speeds), limits, self.pole_pairs)

    def _readings(self, speeds: FloatArray) -> LoadReadings:
        current = np.array([p.bus_current.value for p in self.points])
        frequency = self.frequencies
        if frequency is None:
            frequency = speeds * (self.pole_pairs or 1) / (2.0 * math.pi)
        return LoadReadings(
            speed=speeds,
            frequency=frequency,
            voltage=np.array([p.bus_voltage.value for p in self.points]),
            current=current,
            torque=np.array([p.shaft_torque.value for p in self.points]),
            supplied=current,
        )

    def _emf_above(self, left: Sequence[UncertainReal]) -> Misfit:
        """Return that the EMF is above the voltage that feeds it, which no motor that drives a load has."""
        worst = min(range(len(left)), key=lambda k: float(left[k].x) + 2.0 * float(left[k].u))
        voltage = self.points[worst].bus_voltage.value
        if float(left[worst].x) + 2.0 * float(left[worst].u) > 0.0:
            return Misfit()
        figures: dict[str, float | str] = {
            "torque": self.points[worst].shaft_torque.value,
            "emf": voltage - float(left[worst].x),
            "voltage": voltage,
            "record": "six-step-emf",
        }
        return Misfit((Finding(Cause.CHANNELS_DIFFER, Answer.WITHHELD, figures=figures),))

    def _over_speed(
        self, left: Sequence[UncertainReal], currents: Sequence[UncertainReal], judged: LoadVerdict
    ) -> Misfit:
        """Return that R_eq changes over the speed as no drive's does, which grows from what is there at standstill."""
        slow, fast = (pick(judged.kept, key=lambda k: judged.speeds[k]) for pick in (min, max))
        ratio = float(judged.speeds[fast] / judged.speeds[slow])
        heavy, light = left[slow] / currents[slow], left[fast] / currents[fast]
        at = self.points[slow], self.points[fast]
        warm = max(self.warmth[slow] - self.warmth[fast], 0.0)
        allowed = _BENDS * abs(float(heavy.x))
        beyond = (light - heavy * ratio, heavy * (1.0 - warm) - light)
        if all(float(b.x) <= allowed + 2.0 * float(b.u) for b in beyond):
            return Misfit()
        figures: dict[str, float | str] = {
            "heavy": float(heavy.x),
            "light": float(light.x),
            "more": at[0].bus_current.value,
            "less": at[1].bus_current.value,
            "record": "six-step-speed",
        }
        return Misfit((Finding(Cause.UNEXPLAINED, Answer.WITHHELD, figures=figures),))

    def _voltages(self, plane: VoltagePlane, judged: LoadVerdict) -> LoadVerdict:
        """Leave out a load that contradicts the others where no other EMF constant would explain it as well, and judge what is left."""
        readings, alone = self._readings(judged.speeds), replace(plane, further=plane.further[:0])
        first = judge_voltages(alone, readings, judged)
        if first.kept != judged.kept:
            other = replace(plane, design=np.column_stack((plane.design, plane.further[0])))
            if other.of(judged.kept).solved()[1] > alone.of(first.kept).solved()[1] + CLOSE:
                judged = first
        return judge_voltages(plane, readings, judged)

    def _plane(self, left: Sequence[UncertainReal], speeds: FloatArray) -> VoltagePlane:
        """Return the voltages that R_eq takes: it is nearly a straight line over the speed, and takes nothing without a current."""
        current = np.array([p.bus_current.value for p in self.points])
        volts = np.array([float(each.x) for each in left])
        share = np.array([p.bus_current.accuracy.noise for p in self.points]) / np.maximum(current, 1e-9)
        span = float(np.ptp(speeds)) or 1.0
        along = (speeds - speeds.min()) / span
        bend = _BENDS * float(np.median(volts / current)) * current * 4.0 * along * (1.0 - along)
        noise = np.diag((share * volts) ** 2 + (1e-7 * speeds * float(self.emf[-1].x)) ** 2)
        design = np.column_stack((current, current * (speeds / speeds[-1] - 1.0)))
        emf = np.array([float(k.x) for k in self.emf]) * speeds
        return VoltagePlane(design, volts, covariance(list(left)) + np.outer(bend, bend) + noise, emf[None, :])

    def _powers(self, left: Sequence[UncertainReal], judged: LoadVerdict) -> LoadVerdict:
        """Hold the torque against the powers: the loss lies between what windings and switches have, and R_eq, which is more than loss."""
        current = np.array([p.bus_current.value for p in self.points])
        most = np.maximum(np.array([float(each.x) for each in left]) / current, self.least_resistance)
        lost = 0.5 * (most + self.least_resistance) * current**2
        electrical = [
            meter_limits([a.reading for a in of], [a.scatter for a in of])
            for of in ([p.bus_current for p in self.points], [p.bus_voltage for p in self.points])
        ]
        speed = meter_limits([p.speed for p in self.points], [0.0] * current.size)
        torque = meter_limits([p.shaft_torque.reading for p in self.points], [0.0] * current.size)
        voltage = np.array([p.bus_voltage.value for p in self.points])
        between = 0.5 * (most - self.least_resistance) * current / np.maximum(voltage - lost / current, 1e-9)
        both = MeterLimits(
            electrical[0].limit + electrical[1].limit + speed.limit + between,
            np.hypot(electrical[0].chance, electrical[1].chance),
        )
        offset = max(p.shaft_torque.accuracy.offset for p in self.points)
        return judge_powers(self._readings(judged.speeds), lost, both, torque, offset, judged)

    def _with_contradictions(
        self, resistance: UncertainReal, at: int, judged: LoadVerdict, unc: Uncertainties
    ) -> UncertainReal:
        """Return R_eq at a load with limits of error that hold what contradicts."""
        point = self.points[at]
        voltage, current = point.bus_voltage.value, point.bus_current.value
        off = (judged.voltage * voltage + judged.speed * abs(float(self.emf[at].x)) * point.speed.value) / current
        found = resistance
        for each in (off, *(abs(float(shift[0])) for shift in judged.shifts)):
            if each:
                found = found + unc.limit("loads that contradict each other", 0.0, _AT_ITS_END * each)
        return found


def _about_supply(finding: Finding) -> Finding:
    """Return a finding that is told as one of loads without a waveform."""
    if finding.figures.get("record") != "six-step" or finding.cause not in (Cause.UNEXPLAINED, Cause.LOAD_POINT):
        return finding
    return replace(finding, figures={**finding.figures, "record": _RECORD})


#: Why nothing is given of loads alone.
NO_WAVEFORM = text(
    "without a waveform of a line's current the EMF constant and the resistance cannot be told apart: R_eq grows with the speed, and at "
    "one supply voltage the speed falls with the current. Give a capture of the current for each load, or the EMF constant of a back-EMF "
    "record with --line-emf-constant or --flux-linkage"
)
