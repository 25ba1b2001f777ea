"""Figures of a six-step drive from the readings at its loads, whether a run took them or a table holds them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from GTC.lib import UncertainReal

from drivers.interfaces.text import Text, text
from procedures.core.bench import ProcedureError
from procedures.core.budget import Uncertainties
from procedures.estimation.fitting.misfit import NO_MISFIT, Misfit
from procedures.estimation.winding.connections import Connection
from procedures.six_step.commutation_line import commutation_line
from procedures.six_step.emf_fit import fit_emf
from procedures.six_step.judged_loads import JudgedLoads, judge_loads
from procedures.six_step.load_points import LoadPoints
from procedures.six_step.parts import Parts, WindingData
from procedures.six_step.split import ResistanceSplit, split_point
from procedures.techniques.temperature.correction import magnet_factor
from procedures.techniques.temperature.settings import COLD

SECTION = "paper"
#: Mean line EMF of a conducting state over the line EMF's peak.
STATE_MEAN = 3.0 / math.pi


class FigureTeller(Protocol):
    """What takes the figures and what is said of them: a procedure, or an analysis."""

    findings: dict[str, Any]

    def report(
        self,
        name: str,
        quantity: UncertainReal,
        *,
        section: str,
        estimator: str,
        note_value: float | None = None,
        misfit: Misfit = NO_MISFIT,
    ) -> object:
        """Add a parameter, or why it is withheld."""

    def notice(self, identifier: str, message: Text) -> None:
        """Add a warning."""

    def tell_misfit(self, misfit: Misfit) -> None:
        """Add what the loads show beyond the model."""


@dataclass(frozen=True)
class SixStepFigures:
    """Tells the figures of a drive with one winding; R_t is fitted where it is not `switch_resistance` (Ω), and pole pairs are told
    from the readings where unknown.
    """

    teller: FigureTeller
    uncertainties: Uncertainties
    winding: WindingData
    connection: Connection
    switch_resistance: float | None
    pole_pairs: int | None

    def judged(self, points: LoadPoints) -> JudgedLoads:
        """Return the loads that count. Raises ProcedureError where the current could be separated at too few of them."""
        separated = len(points.separated())
        if separated < 3:
            raise ProcedureError(
                text(
                    "the winding's current could be separated at {n} loads, three are needed: at the others the line is never "
                    "without current. Choose higher loads",
                    n=separated,
                )
            )
        return judge_loads(points, self.winding, self.switch_resistance, self.connection, self.pole_pairs)

    def parts(self, loads: JudgedLoads, magnet_coefficient: float) -> Parts:
        """Tell k_e, at 25 °C by the magnets' coefficient (1/K), and R_t, from the mean voltages of all loads; return both."""
        given = self.switch_resistance
        seen = loads.points.separated()
        constant, switch, residual = fit_emf(
            seen, self.winding, given, self.connection, self.uncertainties, loads.shifts
        )
        self.teller.findings["emf_residual"] = residual
        self.teller.tell_misfit(Misfit(tuple(each for each in loads.misfit.findings if each.estimates)))
        self.teller.report(
            "line_emf_constant",
            constant * magnet_factor(self.uncertainties, loads.points.before, magnet_coefficient),
            section=SECTION,
            estimator="least squares of mean state voltages over all loads, referred to 25 °C",
            misfit=loads.misfit.of("line_emf_constant"),
        )
        self.teller.report(
            "switch_resistance",
            switch,
            section=SECTION,
            estimator="least squares of mean state voltages over all loads" if given is None else "as given",
            misfit=loads.misfit.of("switch_resistance"),
        )
        parts = Parts(self.winding, switch, constant)
        self.teller.findings["parts"] = parts.as_finding(loads.points.temperatures[-1])
        return parts

    def splits(self, loads: JudgedLoads, parts: Parts) -> list[ResistanceSplit]:
        """Tell R_eq = (V_bus − k_e·ω)/I_s at the largest load with its parts, and return those of every load."""
        points = loads.points
        splits = [
            split_point(point, temperature, parts, self.connection, self.uncertainties)
            for point, temperature in zip(points.points, points.temperatures, strict=True)
        ]
        self.teller.findings["points"] = [split.row for split in splits]
        if self.connection == "delta":
            self.teller.notice(
                "delta-from-outside",
                text(
                    "the winding currents of a delta are calculated from the line currents; a current that circulates "
                    "inside the delta cannot be seen from outside and is taken as zero. With a third harmonic of the EMF "
                    "the copper loss is larger than given here"
                ),
            )
        self._at_largest_load(splits[-1], parts, points.temperatures[-1], loads.misfit)
        return splits

    def commutation(self, splits: Sequence[ResistanceSplit], parts: Parts, misfit: Misfit) -> None:
        """Tell R_c over speed, and compare how well the simple model and this one tell the speeds that they were fitted to."""
        known = [s for s in splits if s.commutation is not None and s.copper is not None]
        slope, offset, line, bent = commutation_line(
            [s.point.speed.value for s in known],
            [s.commutation for s in known if s.commutation is not None],
            self.uncertainties,
        )
        for name, figure in (("commutation_resistance_slope", slope), ("commutation_resistance_offset", offset)):
            found = Misfit.together((misfit, bent)).of(name)
            self.teller.report(name, figure, section=SECTION, estimator="straight line of R_c over speed", misfit=found)
        simple = self._simple_resistance(parts, COLD)
        self.teller.findings |= {
            "simple_model_resistance": simple,
            "commutation_over_speed": line,
            "predicted_speeds": [_predicted(s, simple, float(slope.x), float(offset.x)) for s in known],
        }
        if misfit.withholding("commutation_resistance") is not None:
            return
        self.teller.notice(
            "E14",
            text(
                "R_c = {value:.3g} Ω at the largest load is energy that the inductance takes and returns, not "
                "loss; the copper loss is {loss:.3g} W, calculated from the rms current",
                value=float(known[-1].row["commutation_resistance"] or 0.0),
                loss=float(known[-1].row["copper_loss"] or 0.0),
            ),
        )

    def compare_emf(self, constant: UncertainReal, expected: float) -> None:
        """Say where the drive's k_e is not the `expected` one (V·s/rad) of the back-EMF at the same temperature."""
        self.teller.findings["line_emf_constant_from_back_emf"] = expected
        if abs(float(constant.x) / expected - 1.0) > 0.03:
            self.teller.notice(
                "emf-constant",
                text(
                    "the drive's points give k_e = {fitted:.4g}, the back-EMF gives {expected:.4g} V·s/rad: the Hall signals may "
                    "lead or lag, or R_11 and L are not this motor's",
                    fitted=float(constant.x),
                    expected=expected,
                ),
            )

    def _simple_resistance(self, parts: Parts, temperature: UncertainReal | float) -> float:
        """Return the simple model's resistance (Ω): two switches and the winding between the terminals."""
        share = 2.0 / 3.0 if self.connection == "delta" else 2.0
        return 2.0 * float(parts.switch_resistance.x) + share * float(self.winding.resistance_at(temperature).x)

    def _at_largest_load(
        self, split: ResistanceSplit, parts: Parts, temperature: UncertainReal, misfit: Misfit
    ) -> None:
        self.teller.report(
            "equivalent_resistance",
            split.equivalent,
            section=SECTION,
            estimator="bus voltage less EMF over bus current",
            note_value=self._simple_resistance(parts, temperature),
            misfit=misfit.of("equivalent_resistance"),
        )
        if split.copper is not None and split.commutation is not None:
            self.teller.report(
                "copper_resistance",
                split.copper,
                section=SECTION,
                estimator="three times R_11·I_eff² over I_s², at the winding's temperature",
                misfit=misfit.of("copper_resistance"),
            )
            self.teller.report(
                "commutation_resistance",
                split.commutation,
                section=SECTION,
                estimator="equivalent resistance less switches and copper",
                misfit=misfit.of("commutation_resistance"),
            )


def _predicted(split: ResistanceSplit, simple: float, slope: float, offset: float) -> dict[str, float]:
    """Return a point's speed by the simple model and by the line, from its own voltage and current (in-sample)."""
    point, row = split.point, split.row
    current, voltage = point.bus_current.value, point.bus_voltage.value
    k_e = float(row["emf"] or 0.0) / point.speed.value
    full = float(row["switches"] or 0.0) + float(row["copper_resistance"] or 0.0) + offset + slope * point.speed.value
    rpm = 30.0 / math.pi
    return {
        "speed_rpm": point.speed.value * rpm,
        "simple_model_rpm": (voltage - simple * current) / k_e * rpm,
        "with_commutation_rpm": (voltage - full * current) / k_e * rpm,
    }
