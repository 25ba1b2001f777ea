"""Torque constant from flux linkage, and measured on the dynamometer (§2.4)."""

import math
from contextlib import ExitStack
from typing import ClassVar, NamedTuple

import numpy as np
from GTC.lib import UncertainReal
from pydantic import Field

from drivers.interfaces import Accuracy, InverterAbility
from drivers.interfaces.text import text
from procedures.core.actions import INVERTER, CoupleDynamometer, ReleaseRotor
from procedures.core.bench import Role
from procedures.core.demand import SHAFT, Demand, Demands, Measurand
from procedures.core.nameplate import Nameplate
from procedures.core.parameter_set import DISAGREEMENT
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit
from procedures.techniques.shaft.driven_shaft import driving_speed_rad
from procedures.techniques.shaft.shaft_readings import ShaftReadings
from procedures.techniques.shaft.torque_levels import MovedZero, TorqueLevels, torque_at_levels
from procedures.techniques.temperature.correction import magnet_factor, winding_temperature
from procedures.techniques.temperature.settings import (
    MagnetCoefficient,
    MagnetCoefficientUncertainty,
    MagnetsTemperature,
    TemperatureUncertainty,
)
from procedures.verification.resolved_current import below_resolution
from procedures.verification.settings import DrivenWiringSettings

#: Estimator of the figure that is not measured on the shaft.
DERIVED = "1.5 · pole pairs · flux linkage"
#: Of the dynamometer's largest torque this share is used.
_TORQUE_SHARE = 0.8
#: Where the two differ by more than this (of the logarithm), neither is given: one of them is wrong.
_MOST_APART = 0.1
#: So much of what they differ by beyond chance is a standard uncertainty of either: which is off is not known, and chance may hide a part.
_BEYOND = 1.25


class TorqueConstantSettings(DrivenWiringSettings):
    """Settings of §2.4."""

    measured: bool = Field(
        default=True, description="measure on the dynamometer, where dynamometer and inverter are there"
    )
    speed_share: float = Field(
        default=0.3, gt=0.0, le=1.0, description="speed held by the dynamometer, share of the rated speed"
    )
    current_share: float = Field(default=0.5, gt=0.0, le=1.0, description="largest current, share of the rated current")
    levels: int = Field(default=4, ge=2, le=50, description="current levels in each direction")
    readings: int = Field(default=10, ge=1, le=1000, description="torque readings at each level")
    interval: float = Field(default=0.05, gt=0.0, le=10.0, description="time between readings, s")
    settling: float = Field(
        default=0.1,
        gt=0.0,
        le=60.0,
        description="time from a change of current to its readings, s; up to 16 times as long where the torque is seen to lag",
    )
    winding_temperature: MagnetsTemperature = None
    temperature_uncertainty: TemperatureUncertainty = 2.0
    magnet_coefficient: MagnetCoefficient = -0.001
    magnet_coefficient_uncertainty: MagnetCoefficientUncertainty = None


def torque_currents(settings: TorqueConstantSettings, nameplate: Nameplate, most: float) -> FloatArray:
    """Return the q-axis currents (A, peak) at which the torque is read: none, and levels in either direction up to `most` or less."""
    largest = min(settings.current_share * nameplate.rated_current, nameplate.current_bound, most)
    return np.linspace(-largest, largest, 2 * settings.levels + 1)


class TorqueConstantFigure(NamedTuple):
    """A torque constant (N·m/A), what the document's simple formula gives for it, and over that of the inverter's voltages where known."""

    quantity: UncertainReal
    note_value: float
    over_induced: UncertainReal | None = None


def contradiction(ratio: UncertainReal, record: str = "torque-constant") -> tuple[float, Misfit]:
    """Return the standard uncertainty (relative) that the measured constant and another have beside their own, and what is said of them.

    `ratio` is one over the other, 1.5·p·λ or, for the record "torque-constant-alone", 1.5·|v|/ω. It is as much as the two differ by more
    than their uncertainties let expect: no third quantity tells a current, or a torque, that is read wrong from a flux linkage that is.
    """
    off, own = float(ratio.x) - 1.0, float(ratio.u)
    excess = _BEYOND * math.sqrt(max(off**2 - own**2, 0.0))
    if abs(off) <= DISAGREEMENT * own:
        return excess, NO_MISFIT
    answer = Answer.WITHHELD if abs(math.log(max(float(ratio.x), 1e-9))) > _MOST_APART else Answer.WIDENED
    figures: dict[str, float | str] = {"record": record, "ratio": float(ratio.x), "off": off}
    return excess, Misfit((Finding(Cause.CHANNELS_DIFFER, answer, ("torque_constant",), off / own, figures),))


def _moved_zero(zero: MovedZero, torques: FloatArray) -> Misfit:
    """Return what is said of a torque's zero that moved while the torques (N·m) were read."""
    figures: dict[str, float | str] = {
        "record": "torque-constant",
        "drift": abs(zero.moved),
        "share": abs(zero.moved) / float(np.ptp(torques)),
        "time": zero.time,
    }
    score = abs(zero.moved) / zero.uncertainty
    return Misfit((Finding(Cause.TORQUE_ZERO, Answer.WIDENED, ("torque_constant",), score, figures),))


class TorqueConstant(Procedure[TorqueConstantSettings]):
    """Torque per ampere: 1.5·p·λ, and the slope of shaft torque over the inverter's current (§2.4)."""

    name: ClassVar[str] = "torque-constant"
    title: ClassVar[str] = "Torque constant"
    section: ClassVar[str] = "2.4"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DYNAMOMETER, Role.INVERTER})
    gives: ClassVar[tuple[str, ...]] = ("torque_constant",)
    needs: ClassVar[Demands] = {
        Role.DYNAMOMETER: SHAFT,
        Role.INVERTER: Demand((Measurand.CURRENT,), abilities=frozenset({InverterAbility.Q_CURRENT})),
    }

    @classmethod
    def needed(cls, settings: TorqueConstantSettings) -> Demands:
        """Return nothing where it is only derived."""
        return cls.needs if settings.measured else {}

    def measure(self) -> None:
        """Use both methods, in the single step that the document has."""
        self.torque_per_ampere()

    @step(
        "2.4/1",
        "Torque per ampere: from flux linkage, and on the dynamometer with the inverter's current",
        by_hand=True,
    )
    def torque_per_ampere(self) -> None:
        """Report what is available of both; where they contradict each other, neither is known better than the other."""
        derived = self._derived()
        measured = None
        if self.settings.measured and self.bench.has(Role.DYNAMOMETER) and self.bench.has(Role.INVERTER):
            measured = self._measured(derived)
        between: UncertainReal | float = 1.0
        misfit = NO_MISFIT
        if measured is not None and derived is not None:
            excess, misfit = contradiction(measured.quantity / derived.quantity)
            between = self.bench.uncertainties.limit(
                text("torque constant, measured against 1.5·p·λ"), 1.0, math.sqrt(3.0) * excess
            )
        elif measured is not None and measured.over_induced is not None:
            excess, misfit = contradiction(measured.over_induced, "torque-constant-alone")
            between = self.bench.uncertainties.limit(
                text("torque constant, measured against the inverter's voltages"), 1.0, math.sqrt(3.0) * excess
            )
        if derived is not None:
            self.report(
                "torque_constant",
                derived.quantity * between,
                section="2.4",
                estimator=DERIVED,
                note_value=derived.note_value,
                misfit=misfit,
            )
        if measured is not None:
            self.report(
                "torque_constant",
                measured.quantity * between,
                section="2.4",
                estimator="slope of shaft torque over the inverter's current, both directions",
                note_value=measured.note_value,
                misfit=misfit,
            )

    def _derived(self) -> TorqueConstantFigure | None:
        flux, pairs = self.known.get("flux_linkage"), self.known_value("pole_pairs")
        if flux is None or pairs is None:
            return None
        factor = 1.5 * pairs
        return TorqueConstantFigure(
            factor * self.bench.uncertainties.of_parameter(flux), factor * (flux.note_value or flux.value)
        )

    def _measured(self, derived: TorqueConstantFigure | None) -> TorqueConstantFigure:
        bench = self.bench
        bench.perform(INVERTER, ReleaseRotor(), CoupleDynamometer())
        self.wiring.inverter.direction(INVERTER)
        temperature = winding_temperature(
            self, self.settings.winding_temperature, self.settings.temperature_uncertainty
        )
        most = self._most_current(float(derived.quantity.x) if derived is not None else None)
        levels = torque_currents(self.settings, self.nameplate, most)
        speed = driving_speed_rad(bench, self.nameplate, self.settings.speed_share)
        bench.thermometer.warmed()
        shaft = ShaftReadings(bench)
        with ExitStack() as running:
            running.enter_context(bench.dynamometer.driving_speed(speed))
            running.enter_context(bench.inverter.driving_current(float(levels[0])))
            taken = torque_at_levels(
                shaft,
                levels.tolist(),
                self.settings.readings,
                self.settings.interval,
                self.settings.settling,
                speed=speed,
            )
        self.tell_misfit(shaft.misfit())
        currents, torques = taken.currents.ravel(), taken.torques.ravel()
        if not np.ptp(currents):
            limit = max(taken.current_accuracy.resolution, taken.current_accuracy.offset)
            raise below_resolution(self.nameplate.rated_current, limit, text("inverter"))
        fit = taken.fit()
        self.wiring.inverter.judge_slope(INVERTER, fit)
        self.findings |= {
            "currents": currents.tolist(),
            "torques": torques.tolist(),
            "settling": taken.settling,
            "friction_torque": -fit.value("offset"),
            "residuals": (torques - fit.value("offset") - fit.value("torque_constant") * currents).tolist(),
            "speed": speed,
            "winding_temperature": float(temperature.x),
        }
        slope = bench.uncertainties.statistical(
            "slope of torque over current",
            fit.value("torque_constant"),
            fit.uncertainty("torque_constant"),
            fit.degrees_of_freedom,
        )
        if taken.zero is not None:
            slope = slope + bench.uncertainties.limit(text("torque's zero that moved"), 0.0, taken.zero.left)
            self.tell_misfit(_moved_zero(taken.zero, torques))
        # The fit takes out an offset. Where only a share of full scale is stated, it may be a slope all the same: it then
        # tilts the line by as much at its ends.
        for name, accuracy, reach in (
            ("dynamometer, torque", taken.torque_accuracy, float(np.max(np.abs(torques)))),
            ("inverter, current", taken.current_accuracy, float(np.max(np.abs(currents)))),
        ):
            gain = Accuracy(gain=accuracy.gain or accuracy.offset / reach, source=accuracy.source)
            slope = bench.uncertainties.instrument(name, slope, gain)
        over_induced = self._over_induced(slope, taken)
        # Torque per ampere is flux, and falls with the magnets' temperature as flux does.
        slope = slope * magnet_factor(
            bench.uncertainties,
            temperature,
            self.settings.magnet_coefficient,
            self.settings.magnet_coefficient_uncertainty,
        )
        self.findings["measured"] = {"value": float(slope.x), "standard_uncertainty": float(slope.u)}
        simple = float((torques[-1] - torques[0]) / (currents[-1] - currents[0]))
        return TorqueConstantFigure(slope, simple, over_induced)

    def _over_induced(self, slope: UncertainReal, taken: TorqueLevels) -> UncertainReal | None:
        """Return the measured constant over the one that the inverter's voltages tell, None where it tells none."""
        induced = taken.induced()
        if induced is None or not induced.value > 0.0:
            return None
        unc = self.bench.uncertainties
        constant = unc.statistical(
            text("induced voltage over speed"), induced.value, induced.uncertainty, induced.degrees_of_freedom
        )
        for name, accuracy, reach in (
            ("inverter, voltage", taken.voltage_accuracy, induced.voltage),
            ("dynamometer, speed", taken.speed_accuracy, float(np.mean(np.abs(taken.speeds)))),
        ):
            share = (abs(accuracy.gain) * reach + accuracy.offset) / reach
            constant = constant * unc.limit(name, 1.0, share)
        self.findings["induced"] = {"value": float(constant.x), "standard_uncertainty": float(constant.u)}
        return slope / constant

    def _most_current(self, constant: float | None) -> float:
        """Return the current (A) that inverter and dynamometer take."""
        most = self.bench.inverter.maximum_current
        if constant is None:
            return most
        return min(most, _TORQUE_SHARE * self.bench.dynamometer.maximum_torque / constant)
