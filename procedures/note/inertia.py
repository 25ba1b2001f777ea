"""Inertia and friction from a driven ramp and a coast-down (§3.5)."""

import math
from collections.abc import Sequence
from enum import Enum
from typing import Any, ClassVar

import numpy as np
from GTC.lib import UncertainReal
from pydantic import Field

from drivers.interfaces import Accuracy
from drivers.interfaces.text import text, word
from procedures.core.actions import CoupleDynamometer, ReleaseRotor, UncoupleDynamometer
from procedures.core.bench import ProcedureError, Role
from procedures.core.curves import curve
from procedures.core.demand import SHAFT, Demands
from procedures.core.parameters import PARAMETERS
from procedures.core.procedure import Procedure
from procedures.core.procedure_error import OnlyBoundedError
from procedures.core.steps import step
from procedures.estimation.fitting.fit import Fit, coverage_interval
from procedures.estimation.fitting.misfit import Misfit
from procedures.estimation.mechanics import inertia as estimation
from procedures.estimation.mechanics.drag_bound import ONE_SIDED, OwnDrag, least_drag
from procedures.estimation.mechanics.turning import SpeedRamp, turning
from procedures.techniques.shaft.speed_ramps import (
    Curve,
    RampRecorder,
    Ramps,
    RampSettings,
    ShortCoastError,
    TorqueSource,
    ramp_top,
)

NAMES = estimation.SHARED


class Tare(Enum):
    """The source of the dynamometer's own inertia and friction."""

    MEASURED = "measured"
    GIVEN = "given"


class InertiaSettings(RampSettings):
    """Settings of §3.5."""

    tare: Tare = Field(
        default=Tare.MEASURED, description="measure the dynamometer alone first, or take the three figures below"
    )
    tare_inertia: float = Field(default=0.0, ge=0.0, description="inertia of dynamometer and coupling, kg·m²")
    tare_inertia_uncertainty: float = Field(default=0.0, ge=0.0, description="its standard uncertainty, kg·m²")
    tare_coulomb_friction: float = Field(default=0.0, ge=0.0, description="Coulomb friction of the dynamometer, N·m")
    tare_viscous_friction: float = Field(
        default=0.0, ge=0.0, description="viscous friction of the dynamometer, N·m·s/rad"
    )
    load_inertia: float | None = Field(
        default=None,
        ge=0.0,
        description="inertia of the load that the motor will drive, at its shaft, kg·m²; the dynamometer's when not given",
    )
    load_inertia_uncertainty: float = Field(default=0.0, ge=0.0, description="its standard uncertainty, kg·m²")


class Inertia(Procedure[InertiaSettings]):
    """Inertia, Coulomb and viscous friction of the motor, the dynamometer's own subtracted (§3.5)."""

    name: ClassVar[str] = "inertia"
    title: ClassVar[str] = "Inertia and friction"
    section: ClassVar[str] = "3.5"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DYNAMOMETER})
    gives: ClassVar[tuple[str, ...]] = (*NAMES, "inertia_with_load")
    needs: ClassVar[Demands] = {Role.DYNAMOMETER: SHAFT}

    def measure(self) -> None:
        """Take the tare, drive, coast, solve."""
        tare = self.open_terminals()
        top = ramp_top(self.bench, self.nameplate, self.settings.speed_share)
        driven = self.accelerate(top)
        try:
            coast = self.coast(top)
        except ShortCoastError as short:
            raise self._at_least(driven, short, tare) from short
        self.solve(Ramps.freed(driven, coast), tare)

    @step("3.5/1", "Leave the stator's terminals open", by_hand=True)
    def open_terminals(self) -> Ramps | None:
        """Open the terminals; return the dynamometer's own ramps where its tare is to be measured."""
        bench = self.bench
        self.wiring.shaft.open_terminals(ReleaseRotor())
        bench.dynamometer.stop()
        tare = None
        if self.settings.tare is Tare.MEASURED:
            bench.perform(UncoupleDynamometer())
            bench.dynamometer.zero_torque()
            top = ramp_top(bench, self.nameplate, self.settings.speed_share)
            alone = RampRecorder(bench, self.settings)
            tare = Ramps.freed(alone.accelerate(top), alone.coast(top))
        bench.perform(CoupleDynamometer())
        return tare

    @step("3.5/2", "The dynamometer accelerates the motor with constant torque: record speed over time")
    def accelerate(self, top: float) -> Curve:
        """Return the driven ramp, up to `top` (rad/s)."""
        return self._recorder.accelerate(top)

    @step("3.5/3", "Let it coast: record speed over time")
    def coast(self, top: float) -> Curve:
        """Return the coast, then stop the shaft."""
        return self._recorder.coast(top)

    @step("3.5/4", "Solve both equations for inertia and no-load torque")
    def solve(self, ramps: Ramps, tare: Ramps | None) -> None:
        """Fit J, Coulomb, viscous and quadratic friction to both whole curves; also report the two-point figures."""
        total = self._fit(ramps)
        own = self._fit(tare) if tare else None
        self.findings["ramps"] = _curves(ramps.to_fit(), total)
        if tare and own:
            self.findings["tare_ramps"] = _curves(tare.to_fit(), own)
        simple, no_load = self._two_points(ramps)
        simple_tare, tare_drag = (
            self._two_points(tare) if tare else (self.settings.tare_inertia, self.settings.tare_coulomb_friction)
        )
        self.findings |= {
            "with_dynamometer": {name: total.value(name) for name in NAMES},
            "dynamometer": {name: own.value(name) if own else getattr(self.settings, f"tare_{name}") for name in NAMES},
            "no_load_torque": no_load - tare_drag,
            "two_point_inertia": simple - simple_tare,
            "quadratic_friction": _quadratic(total, own),
        }
        parts = [(ramps, total), (tare, own)] if tare and own else [(ramps, total)]
        drifts = [each.zero.misfit(float(np.mean(each.driven.torque))) for each, _ in parts]
        misfit = Misfit.together([*(fit.misfit for _, fit in parts), *drifts])
        coupled = self._quantities("ramps", total, ramps)
        dynamometer = self._of_dynamometer(own, tare)
        alone = estimation.subtract_tare(coupled, dynamometer)
        for name, motor in alone.items():
            self.report(
                name,
                self._over_speed(name, motor, ramps.driven),
                section="3.5",
                estimator="fit of inertia, Coulomb, viscous and quadratic friction to both whole ramps, tare subtracted",
                note_value={"inertia": simple - simple_tare, "coulomb_friction": no_load - tare_drag}.get(name),
                misfit=misfit.of(name),
            )
        self._report_with_load(alone["inertia"], coupled["inertia"], ramps.driven)
        self._say_what_two_points_cost(
            simple - simple_tare, total.value("inertia") - (own.value("inertia") if own else 0.0)
        )

    def _at_least(self, driven: Curve, short: ShortCoastError, tare: Ramps | None) -> ProcedureError:
        """Return the error of a coast too short to be fitted: with the least that its drag can be, where that is anything."""
        dynamometer = self._of_dynamometer(self._fit(tare) if tare else None, tare)
        inertia, coulomb, viscous = (
            float(dynamometer[name].x) + way * ONE_SIDED * float(dynamometer[name].u)
            for name, way in zip(NAMES, (-1.0, 1.0, 1.0), strict=True)
        )
        last, accuracy = short.last, driven.speed_accuracy
        low = least_drag(
            OwnDrag(inertia, coulomb, viscous),
            driven.time,
            driven.speed,
            driven.torque - driven.zero.value,
            slow=last.speed,
            later=last.time - driven.begin - float(driven.time[-1]),
            error=accuracy.gain * float(driven.speed[-1]) + accuracy.offset + accuracy.resolution,
        )
        if low <= 0.0:
            return short
        return OnlyBoundedError(
            text(
                "{why}. The inertia is not found, but the deceleration shows a drag of {low:.2g} N·m at least",
                why=short.text,
                low=low,
            ),
            "coulomb_friction",
            low,
        )

    def _report_with_load(self, rotor: UncertainReal, coupled: UncertainReal, driven: Curve) -> None:
        """Report rotor and load together (§2.6), which the speed loop's gains follow from."""
        load, settings = self.settings.load_inertia, self.settings
        together = self._over_speed("inertia", coupled if load is None else rotor, driven)
        if load is not None:
            together = together + self.bench.uncertainties.standard(
                "load's inertia", load, settings.load_inertia_uncertainty
            )
        self.report(
            "inertia_with_load",
            together,
            section="2.6",
            estimator="rotor with the dynamometer as its load"
            if load is None
            else "rotor and the load that was stated",
        )

    @property
    def _recorder(self) -> RampRecorder:
        return RampRecorder(self.bench, self.settings, turned_alone=self.settings.tare is Tare.MEASURED)

    def _fit(self, ramps: Ramps) -> Fit:
        if self.settings.torque_source is TorqueSource.POWER:
            self.notice(
                "E5",
                text(
                    "the torque is shaft power over mechanical speed, P/ω; the note's formula P/(p·ω) gives a value too "
                    "small by the number of pole pairs"
                ),
            )
        return estimation.fit_ramps(ramps.to_fit())

    def _two_points(self, ramps: Ramps) -> tuple[float, float]:
        """Return the note's figures, from points near the ends of each ramp; a zero of the sensor's is none of them."""
        driven, coast = (turning(ramp, number) for number, ramp in enumerate(ramps.to_fit(), 1))
        first, last = driven.time.size // 10, -1 - driven.time.size // 10
        early, late = coast.time.size // 10, -1 - coast.time.size // 10
        return estimation.two_point(
            driven.time[first], driven.speed[first], driven.time[last], driven.speed[last], float(np.mean(driven.driven)),
            coast.time[early], coast.speed[early], coast.time[late], coast.speed[late],
        )  # fmt: skip

    def _quantities(self, what: str, fit: Fit, ramps: Ramps) -> dict[str, UncertainReal]:
        """Return the fitted inertia and friction with the errors of the torque that drove the ramp."""
        unc = self.bench.uncertainties
        scale = self._torque_scale(ramps.driven, ramps.zero.left(unc))
        return {
            name: scale
            * unc.statistical(
                text("fit of {what}: {name}", what=word(what), name=PARAMETERS[name].label),
                fit.value(name),
                fit.uncertainty(name),
                fit.degrees_of_freedom,
            )
            for name in NAMES
        }

    def _of_dynamometer(self, own: Fit | None, tare: Ramps | None) -> dict[str, UncertainReal]:
        measured = self._quantities("tare ramps", own, tare) if own and tare else {}
        return measured or {name: self._given_tare(name) for name in NAMES}

    def _given_tare(self, name: str) -> UncertainReal:
        uncertainty = self.settings.tare_inertia_uncertainty if name == "inertia" else 0.0
        return self.bench.uncertainties.standard(
            text("tare: {name}", name=PARAMETERS[name].label), getattr(self.settings, f"tare_{name}"), uncertainty
        )

    def _torque_scale(self, curve: Curve, zero: UncertainReal) -> UncertainReal:
        """Return one, uncertain as the ramp's torque is: all three figures grow with it."""
        accuracy = curve.torque_accuracy
        gain, mean = accuracy.gain, abs(float(np.mean(curve.torque)))
        if not gain and mean:
            # Only a share of full scale is stated: it may be a slope.
            gain = accuracy.offset / mean
        scale = self.bench.uncertainties.instrument(
            "dynamometer, torque", 1.0, Accuracy(gain=gain, source=accuracy.source)
        )
        return scale + zero / mean if mean else scale

    def _over_speed(self, name: str, quantity: UncertainReal, curve: Curve) -> UncertainReal:
        """Put on the speed's gain, which inertia and viscous friction are divided by."""
        if name == "coulomb_friction":
            return quantity
        gain = Accuracy(gain=curve.speed_accuracy.gain, source=curve.speed_accuracy.source)
        return quantity / self.bench.uncertainties.instrument("dynamometer, speed", 1.0, gain)

    def _say_what_two_points_cost(self, two_point: float, fitted: float) -> None:
        difference = two_point / fitted - 1.0
        if abs(difference) > 0.01:
            self.notice(
                "E6",
                text(
                    "two points on each ramp, the note's formula, give an inertia that is {difference:+.1%} off, because friction grows "
                    "with speed and the ramps cover different speeds; the fit of both whole curves is reported",
                    difference=difference,
                ),
            )


def _quadratic(coupled: Fit, own: Fit | None) -> dict[str, float]:
    """Return the motor's friction over the square of speed (N·m·s²), where the tare is known, with the interval from the scatter."""
    name = estimation.QUADRATIC
    value = coupled.value(name) - (own.value(name) if own else 0.0)
    uncertainty = math.hypot(coupled.uncertainty(name), own.uncertainty(name) if own else 0.0)
    freedom = min(coupled.degrees_of_freedom, own.degrees_of_freedom if own else math.inf)
    low, high = coverage_interval(value, uncertainty, freedom)
    return {"value": value, "standard_uncertainty": uncertainty, "low": low, "high": high}


def _curves(ramps: Sequence[SpeedRamp], fit: Fit) -> dict[str, Any]:
    """Return what was read and what was fitted on both ramps, for whoever draws them."""
    result: dict[str, Any] = {}
    fitted = estimation.fitted_speeds(ramps, fit)
    for name, ramp, (time, speed) in zip(("driven", "coast"), ramps, fitted, strict=True):
        result[name] = {
            **curve(time=ramp.time, speed=ramp.speed),
            "fit": curve(time=time, fitted=speed),
        }
    return result
