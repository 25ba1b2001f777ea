"""Armature equivalent resistance of a six-step drive at several loads (the paper)."""

import math
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from functools import reduce
from typing import ClassVar

from drivers.interfaces import ProbeKind
from drivers.interfaces.text import text
from procedures.core.actions import DRIVE, CoupleDynamometer, CurrentProbe, ReleaseRotor, Terminal
from procedures.core.bench import ProcedureError, Role
from procedures.core.demand import SHAFT, SPEED, Demand, Demands, Measurand
from procedures.core.nameplate import Nameplate
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.fitting.misfit import Misfit
from procedures.six_step.figures import SECTION, STATE_MEAN, SixStepFigures
from procedures.six_step.judged_loads import JudgedLoads
from procedures.six_step.load_points import LoadPoint, LoadPoints
from procedures.six_step.parts import Parts, WindingData
from procedures.six_step.point_reading import read_point
from procedures.six_step.settings import EquivalentResistanceSettings
from procedures.six_step.split import ResistanceSplit
from procedures.six_step.winding_data import UNKNOWN, winding_data
from procedures.techniques.temperature.correction import winding_temperature
from procedures.techniques.temperature.settings import COLD


class EquivalentResistance(Procedure[EquivalentResistanceSettings]):
    """Armature equivalent resistance of a six-step drive, its parts, and what is loss of it and what is not (the paper)."""

    name: ClassVar[str] = "equivalent-resistance"
    title: ClassVar[str] = "Armature equivalent resistance of a six-step drive"
    section: ClassVar[str] = SECTION
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
        figures = self._figures(winding)
        loads = figures.judged(points)
        parts = figures.parts(loads, settings.magnet_coefficient)
        flux, pairs = self.known_value("flux_linkage"), self.known_value("pole_pairs")
        if flux is not None and pairs is not None:
            warm = 1.0 + settings.magnet_coefficient * (float(points.before.x) - COLD)
            figures.compare_emf(parts.emf_constant, STATE_MEAN * math.sqrt(3.0) * pairs * flux * warm)
        return loads, parts

    @step("paper/3", "Equivalent resistance at each point, and its parts")
    def equivalent_resistance(self, loads: JudgedLoads, parts: Parts) -> list[ResistanceSplit]:
        """Form R_eq = (V_bus − k_e·ω)/I_s, and from the waveform R_11r and R_11L of the conducting winding."""
        return self._figures(parts.winding).splits(loads, parts)

    @step("paper/4", "Commutation resistance against speed; copper loss apart")
    def commutation(self, splits: Sequence[ResistanceSplit], parts: Parts, misfit: Misfit) -> None:
        """Fit R_c over speed, and compare how well the simple model and this one tell the speeds that they were fitted to."""
        self._figures(parts.winding).commutation(splits, parts, misfit)

    def _figures(self, winding: WindingData) -> SixStepFigures:
        return SixStepFigures(
            self, self.bench.uncertainties, winding, self.winding, self.settings.switch_resistance, self._pole_pairs()
        )

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
