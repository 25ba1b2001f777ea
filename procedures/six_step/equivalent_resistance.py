"""Armature equivalent resistance of a six-step drive at several loads (the paper)."""

import math
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from functools import reduce
from typing import ClassVar

from GTC.lib import UncertainReal

from drivers.interfaces import ProbeKind
from drivers.interfaces.text import text
from procedures.core.actions import DRIVE, CoupleDynamometer, CurrentProbe, ReleaseRotor, Terminal
from procedures.core.bench import ProcedureError, Role
from procedures.core.demand import SHAFT, SPEED, Demand, Demands, Measurand
from procedures.core.nameplate import Nameplate
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.fitting.misfit import Misfit
from procedures.six_step.commutation_line import commutation_line
from procedures.six_step.emf_fit import fit_emf
from procedures.six_step.judged_loads import JudgedLoads, judge_loads
from procedures.six_step.load_points import LoadPoint, LoadPoints
from procedures.six_step.parts import Parts
from procedures.six_step.point_reading import read_point
from procedures.six_step.settings import EquivalentResistanceSettings
from procedures.six_step.split import ResistanceSplit, split_point
from procedures.six_step.winding_data import UNKNOWN, winding_data
from procedures.techniques.temperature.correction import magnet_factor, winding_temperature
from procedures.techniques.temperature.settings import COLD

_SECTION = "paper"
#: Mean line EMF of a conducting state over the line EMF's peak.
_STATE_MEAN = 3.0 / math.pi


class EquivalentResistance(Procedure[EquivalentResistanceSettings]):
    """Armature equivalent resistance of a six-step drive, its parts, and what is loss of it and what is not (the paper)."""

    name: ClassVar[str] = "equivalent-resistance"
    title: ClassVar[str] = "Armature equivalent resistance of a six-step drive"
    section: ClassVar[str] = _SECTION
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DRIVE, Role.DYNAMOMETER, Role.OSCILLOSCOPE, Role.TACHOMETER})
    gives: ClassVar[tuple[str, ...]] = (
        "line_emf_constant",
        "switch_resistance",
        "equivalent_resistance",
        "commutation_resistance",
        "commutation_resistance_slope",
        "commutation_resistance_offset",
        "copper_resistance",
    )
    needs: ClassVar[Demands] = {
        Role.DRIVE: Demand((Measurand.VOLTAGE, Measurand.CURRENT, Measurand.FREQUENCY)),
        Role.DYNAMOMETER: SHAFT,
        Role.OSCILLOSCOPE: Demand(waveforms=True, probes={ProbeKind.CURRENT: 1}),
        Role.TACHOMETER: SPEED,
    }

    @classmethod
    def wanted_before(cls, settings: EquivalentResistanceSettings, nameplate: Nameplate) -> Mapping[str, str]:
        """Return what loads are chosen by, and the winding's figures, as far as the settings do not give them."""
        wanted = {} if settings.loads else {"torque_constant": "loads"}
        if settings.winding_resistance is None:
            wanted["stator_resistance"] = "winding_resistance"
        if settings.winding_inductance is None:
            wanted |= dict.fromkeys(("d_axis_inductance", "q_axis_inductance"), "winding_inductance")
        return wanted

    def measure(self) -> None:
        """Load the running motor, and split what the bus sees."""
        points = self.load_points()
        loads, parts = self.emf(points)
        splits = self.equivalent_resistance(loads, parts)
        self.commutation(splits, parts, loads.misfit)

    @step(
        "paper/1",
        "Load the running motor at several torques: bus voltage and current, speed, one line's current; the winding's temperature "
        "before and after",
        by_hand=True,
    )
    def load_points(self) -> LoadPoints:
        """Return the readings at each load, the smallest first."""
        bench, settings = self.bench, self.settings
        self._refuse_unknown()
        bench.perform(ReleaseRotor(), CoupleDynamometer())
        torques = self._torques()
        bench.dynamometer.stop()
        bench.dynamometer.zero_torque()
        before = winding_temperature(self, settings.winding_temperature, settings.temperature_uncertainty)
        probe = CurrentProbe(bench.oscilloscope.channels(ProbeKind.CURRENT)[0], Terminal.A)
        points: list[LoadPoint] = []
        bench.thermometer.warmed()
        with ExitStack() as running:
            self.wiring.inverter.full_voltage(DRIVE, probe, lambda: running.enter_context(bench.drive.running()))
            for torque in torques:
                with bench.dynamometer.driving_torque(-torque):
                    begun = bench.clock.now()
                    bench.clock.sleep(settings.settle)
                    pairs = self._pole_pairs()
                    points.append(read_point(self, torque, probe, begun, first=not points, pole_pairs=pairs))
            end = bench.clock.now()
        after = winding_temperature(self, settings.winding_temperature_after, settings.temperature_uncertainty)
        self.findings["winding_temperature"] = {"before": float(before.x), "after": float(after.x)}
        return LoadPoints.between(points, before, after, end, bench.uncertainties)

    @step("paper/2", "EMF constant, and the EMF at each point")
    def emf(self, points: LoadPoints) -> tuple[JudgedLoads, Parts]:
        """Return the loads that count, and k_e and R_t, where that is not given, from the mean voltages of all of them together."""
        unc, settings = self.bench.uncertainties, self.settings
        winding = winding_data(settings, self.known, unc, points.before, delta=self.is_delta, tell=self.notice)
        separated = len(points.separated())
        if separated < 3:
            raise ProcedureError(
                text(
                    "the winding's current could be separated at {n} loads, three are needed: at the others the line is never "
                    "without current. Choose higher loads",
                    n=separated,
                )
            )
        given = settings.switch_resistance
        loads = judge_loads(points, winding, given, self.winding, self._pole_pairs())
        seen = loads.points.separated()
        constant, switch, residual = fit_emf(seen, winding, given, self.winding, unc, loads.shifts)
        self.findings["emf_residual"] = residual
        self.tell_misfit(Misfit(tuple(each for each in loads.misfit.findings if each.estimates)))
        self._report_emf(constant, points.before, loads.misfit)
        self.report(
            "switch_resistance",
            switch,
            section=_SECTION,
            estimator="least squares of mean state voltages over all loads" if given is None else "as given",
            misfit=loads.misfit.of("switch_resistance"),
        )
        parts = Parts(winding, switch, constant)
        self.findings["parts"] = parts.as_finding(loads.points.temperatures[-1])
        return loads, parts

    @step("paper/3", "Equivalent resistance at each point, and its parts")
    def equivalent_resistance(self, loads: JudgedLoads, parts: Parts) -> list[ResistanceSplit]:
        """Form R_eq = (V_bus − k_e·ω)/I_s, and from the waveform R_11r and R_11L of the conducting winding."""
        points = loads.points
        splits = [
            split_point(point, temperature, parts, self.winding, self.bench.uncertainties)
            for point, temperature in zip(points.points, points.temperatures, strict=True)
        ]
        self.findings["points"] = [split.row for split in splits]
        if self.is_delta:
            self.notice(
                "delta-from-outside",
                text(
                    "the winding currents of a delta are calculated from the line currents; a current that circulates "
                    "inside the delta cannot be seen from outside and is taken as zero. With a third harmonic of the EMF "
                    "the copper loss is larger than given here"
                ),
            )
        self._report_at_largest_load(splits[-1], parts, points.temperatures[-1], loads.misfit)
        return splits

    @step("paper/4", "Commutation resistance against speed; copper loss apart")
    def commutation(self, splits: Sequence[ResistanceSplit], parts: Parts, misfit: Misfit) -> None:
        """Fit R_c over speed, and compare how well the simple model and this one tell the speeds that they were fitted to."""
        known = [s for s in splits if s.commutation is not None and s.copper is not None]
        slope, offset, line, bent = commutation_line(
            [s.point.speed.value for s in known],
            [s.commutation for s in known if s.commutation is not None],
            self.bench.uncertainties,
        )
        for name, figure in (("commutation_resistance_slope", slope), ("commutation_resistance_offset", offset)):
            found = Misfit.together((misfit, bent)).of(name)
            self.report(name, figure, section=_SECTION, estimator="straight line of R_c over speed", misfit=found)
        simple = self._simple_resistance(parts, COLD)
        self.findings |= {
            "simple_model_resistance": simple,
            "commutation_over_speed": line,
            "predicted_speeds": [self._predicted(s, simple, float(slope.x), float(offset.x)) for s in known],
        }
        if misfit.withholding("commutation_resistance") is not None:
            return
        self.notice(
            "E14",
            text(
                "R_c = {value:.3g} Ω at the largest load is energy that the inductance takes and returns, not "
                "loss; the copper loss is {loss:.3g} W, calculated from the rms current",
                value=float(known[-1].row["commutation_resistance"] or 0.0),
                loss=float(known[-1].row["copper_loss"] or 0.0),
            ),
        )

    @staticmethod
    def _predicted(split: ResistanceSplit, simple: float, slope: float, offset: float) -> dict[str, float]:
        """Return a point's speed by the simple model and by the line, from its own voltage and current (in-sample)."""
        point, row = split.point, split.row
        current, voltage = point.bus_current.value, point.bus_voltage.value
        k_e = float(row["emf"] or 0.0) / point.speed.value
        full = (
            float(row["switches"] or 0.0) + float(row["copper_resistance"] or 0.0) + offset + slope * point.speed.value
        )
        rpm = 30.0 / math.pi
        return {
            "speed_rpm": point.speed.value * rpm,
            "simple_model_rpm": (voltage - simple * current) / k_e * rpm,
            "with_commutation_rpm": (voltage - full * current) / k_e * rpm,
        }

    def _simple_resistance(self, parts: Parts, temperature: UncertainReal | float) -> float:
        """Return the simple model's resistance (Ω): two switches and the winding between the terminals."""
        share = 2.0 / 3.0 if self.is_delta else 2.0
        return 2.0 * float(parts.switch_resistance.x) + share * float(parts.winding.resistance_at(temperature).x)

    def _refuse_unknown(self) -> None:
        """Refuse a run without the earlier results that it needs, all of them at once and before anything is connected."""
        missing = [each for each in self.wanted_before(self.settings, self.nameplate) if each not in self.known]
        reasons = {str(each): each for each in (self.why_unknown(name, UNKNOWN[name]) for name in missing)}
        if reasons:
            both = reduce(
                lambda first, then: text("{needed}; {withheld}", needed=first, withheld=then), reasons.values()
            )
            raise ProcedureError(both)

    def _torques(self) -> list[float]:
        bound = self.bench.dynamometer.maximum_torque
        if self.settings.loads:
            wanted = sorted(self.settings.loads)
        else:
            constant = self.known["torque_constant"].value
            wanted = sorted(share * constant * self.nameplate.rated_current for share in self.settings.load_shares)
        if wanted[-1] > bound or wanted[0] <= 0.0:
            raise ProcedureError(
                text(
                    "the loads {low:.3g} … {high:.3g} N·m must lie above 0 and up to the dynamometer's {bound:.3g} N·m",
                    low=wanted[0],
                    high=wanted[-1],
                    bound=bound,
                )
            )
        return wanted

    def _pole_pairs(self) -> int | None:
        """Return the pole pairs as they were measured, else as the plate says, None where neither tells."""
        pairs = self.known_value("pole_pairs") or self.nameplate.pole_pairs
        return round(pairs) if pairs else None

    def _report_emf(self, constant: UncertainReal, temperature: UncertainReal, misfit: Misfit) -> None:
        self.report(
            "line_emf_constant",
            constant * magnet_factor(self.bench.uncertainties, temperature, self.settings.magnet_coefficient),
            section=_SECTION,
            estimator="least squares of mean state voltages over all loads, referred to 25 °C",
            misfit=misfit.of("line_emf_constant"),
        )
        flux, pairs = self.known_value("flux_linkage"), self.known_value("pole_pairs")
        if flux is not None and pairs is not None:
            warm = 1.0 + self.settings.magnet_coefficient * (float(temperature.x) - COLD)
            expected = _STATE_MEAN * math.sqrt(3.0) * pairs * flux * warm
            self.findings["line_emf_constant_from_back_emf"] = expected
            if abs(float(constant.x) / expected - 1.0) > 0.03:
                self.notice(
                    "emf-constant",
                    text(
                        "the drive's points give k_e = {fitted:.4g}, the back-EMF gives {expected:.4g} V·s/rad: the Hall signals may "
                        "lead or lag, or R_11 and L are not this motor's",
                        fitted=float(constant.x),
                        expected=expected,
                    ),
                )

    def _report_at_largest_load(
        self, split: ResistanceSplit, parts: Parts, temperature: UncertainReal, misfit: Misfit
    ) -> None:
        self.report(
            "equivalent_resistance",
            split.equivalent,
            section=_SECTION,
            estimator="bus voltage less EMF over bus current",
            note_value=self._simple_resistance(parts, temperature),
            misfit=misfit.of("equivalent_resistance"),
        )
        if split.copper is not None and split.commutation is not None:
            self.report(
                "copper_resistance",
                split.copper,
                section=_SECTION,
                estimator="three times R_11·I_eff² over I_s², at the winding's temperature",
                misfit=misfit.of("copper_resistance"),
            )
            self.report(
                "commutation_resistance",
                split.commutation,
                section=_SECTION,
                estimator="equivalent resistance less switches and copper",
                misfit=misfit.of("commutation_resistance"),
            )
