"""Armature equivalent resistance of a six-step drive at several loads (the paper)."""

import math
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from GTC.lib import UncertainReal
from pydantic import Field

from drivers.interfaces import Accuracy, ProbeKind, Reading
from drivers.interfaces.text import text
from procedures.core.actions import DRIVE, CoupleDynamometer, CurrentProbe, ReleaseRotor, Terminal
from procedures.core.bench import ProcedureError, Role
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.fitting.fit import EstimationError, Fit
from procedures.estimation.fitting.linear import least_squares
from procedures.estimation.six_step import currents as six_step
from procedures.techniques.acquisition import ranged_record
from procedures.verification.settings import WiringSettings

_POINTS = 50_000
_SECTION = "paper"
#: Mean line EMF of a conducting state over the line EMF's peak.
_STATE_MEAN = 3.0 / math.pi


class EquivalentResistanceSettings(WiringSettings):
    """Settings of the paper's measurement."""

    load_shares: tuple[float, ...] = Field(
        default=(0.1, 0.2, 0.4, 0.6, 0.8), min_length=3, description="load torques, shares of the rated torque"
    )
    loads: tuple[float, ...] = Field(default=(), description="load torques, N·m; instead of the shares")
    settle: float = Field(default=3.0, gt=0.0, le=600.0, description="time at each load before reading, s")
    readings: int = Field(default=10, ge=2, le=1000, description="readings of bus voltage and current at each load")
    periods: int = Field(default=40, ge=5, le=1000, description="electrical periods in the current's record")
    winding_resistance: float | None = Field(
        default=None, gt=0.0, description="R_11, Ω; from the resistance procedure when not given"
    )
    winding_inductance: float | None = Field(
        default=None, gt=0.0, description="L11 − L12, H; from the inductance procedures when not given"
    )
    winding_temperature: float | None = Field(
        default=None, ge=-60.0, le=250.0, description="winding temperature, °C; 25 when not given"
    )
    switch_resistance: float | None = Field(
        default=None, ge=0.0, description="on-resistance of one switch R_t, Ω; fitted when not given"
    )


@dataclass(frozen=True)
class LoadPoint:
    """Readings at one load: torque (N·m), speed (rad/s), bus voltage (V), bus current (A), and one line's current folded."""

    torque: float
    speed: Reading
    bus_voltage: Reading
    bus_current: Reading
    electrical_frequency: float
    line: six_step.LineCurrent | None
    current_accuracy: Accuracy

    @property
    def state_time(self) -> float:
        """Length of one state (s)."""
        return 1.0 / (6.0 * self.electrical_frequency)


@dataclass(frozen=True)
class Parts:
    """The winding's figures, the switch's on-resistance, and the line EMF constant with their uncertainties."""

    winding_resistance: UncertainReal
    winding_inductance: UncertainReal
    switch_resistance: UncertainReal
    emf_constant: UncertainReal


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
        "copper_resistance",
    )

    def measure(self) -> None:
        """Load the running motor, and split what the bus sees."""
        points = self.load_points()
        parts = self.emf(points)
        rows = self.equivalent_resistance(points, parts)
        self.commutation(points, parts, rows)

    @step(
        "paper/1",
        "Load the running motor at several torques: bus voltage and current, speed, one line's current",
        by_hand=True,
    )
    def load_points(self) -> list[LoadPoint]:
        """Return the readings at each load, the smallest first."""
        bench = self.bench
        bench.perform(ReleaseRotor())
        bench.perform(CoupleDynamometer())
        probe = CurrentProbe(bench.oscilloscope.channels(ProbeKind.CURRENT)[0], Terminal.A)
        points: list[LoadPoint] = []
        bench.thermometer.warmed()
        with ExitStack() as running:
            self.wiring.inverter.full_voltage(DRIVE, probe, lambda: running.enter_context(bench.drive.running()))
            for torque in self._torques():
                with bench.dynamometer.driving_torque(-torque):
                    bench.clock.sleep(self.settings.settle)
                    points.append(self._point(torque, probe, first=not points))
        return points

    @step("paper/2", "EMF constant, and the EMF at each point")
    def emf(self, points: Sequence[LoadPoint]) -> Parts:
        """Find k_e, and R_t where it is not given, from the mean voltages of all points together."""
        resistance, inductance = self._winding()
        r, ell = float(resistance.x), float(inductance.x)
        seen = [p for p in points if p.line is not None]
        if len(seen) < 3:
            raise ProcedureError(
                text(
                    "the winding's current could be separated at {n} loads, three are needed: at the others the line is never "
                    "without current. Choose higher loads",
                    n=len(seen),
                )
            )
        given = self.settings.switch_resistance
        lines = [p.line for p in seen if p.line is not None]
        times = [p.state_time for p in seen]
        # A drop is r·I_av + (L11 − L12)·Δi/τ: linear in both, so their errors reach the result by the same matrix.
        mean_current = np.array(
            [six_step.average_drop(n, self.winding, 1.0, 0.0, t) for n, t in zip(lines, times, strict=True)]
        )
        rate = np.array(
            [six_step.average_drop(n, self.winding, 0.0, 1.0, t) for n, t in zip(lines, times, strict=True)]
        )
        switched = np.array([six_step.switched_average(line) for line in lines])
        speed = np.array([p.speed.value for p in seen])
        bus = np.array([p.bus_voltage.value for p in seen])
        drops = r * mean_current + ell * rate
        design = np.column_stack((speed, switched)) if given is None else speed[:, None]
        left = bus - drops - (0.0 if given is None else given * switched)
        fit = least_squares(("emf", "switch")[: design.shape[1]], design, left)
        solve = np.linalg.pinv(design)
        unc, reading, current = self.bench.uncertainties, seen[-1].bus_voltage, seen[-1].current_accuracy
        gain = (
            unc.instrument(
                "drive, bus voltage", 1.0, Accuracy(gain=reading.accuracy.gain, source=reading.accuracy.source)
            )
            - 1.0
        )
        offset = unc.instrument(
            "drive, bus voltage", 0.0, Accuracy(offset=reading.accuracy.offset, source=reading.accuracy.source)
        )
        scope = (
            unc.instrument("oscilloscope, current channel", 1.0, Accuracy(gain=current.gain, source=current.source))
            - 1.0
        )

        def figure(row: int, name: str) -> UncertainReal:
            own = unc.statistical(f"{name} over loads", fit.value(name), fit.uncertainty(name), fit.degrees_of_freedom)
            on = solve[row]
            return (
                own
                + gain * float(on @ bus)
                + offset * float(on.sum())
                - (resistance - r) * float(on @ mean_current)
                - (inductance - ell) * float(on @ rate)
                - scope * float(on @ drops)
            )

        constant = figure(0, "emf") * (1.0 + self._speed_error(seen))
        switch = figure(1, "switch") * (1.0 - scope) if given is None else unc.standard("R_t given", given, 0.0)
        self._report_emf(constant, fit)
        self.report(
            "switch_resistance",
            switch,
            section=_SECTION,
            estimator="least squares of mean state voltages over all loads" if given is None else "as given",
        )
        return Parts(resistance, inductance, switch, constant)

    @step("paper/3", "Equivalent resistance at each point, and its parts")
    def equivalent_resistance(self, points: Sequence[LoadPoint], parts: Parts) -> list[dict[str, float | None]]:
        """Form R_eq = (V_bus − k_e·ω)/I_s, and from the waveform R_11r and R_11L of the conducting winding."""
        r, ell, r_t, k_e = (
            float(q.x)
            for q in (parts.winding_resistance, parts.winding_inductance, parts.switch_resistance, parts.emf_constant)
        )
        rows: list[dict[str, float | None]] = []
        for point in points:
            current = point.bus_current.value
            equivalent = (point.bus_voltage.value - k_e * point.speed.value) / current
            row: dict[str, float | None] = {
                "load_torque": point.torque,
                "speed_rpm": point.speed.value * 30.0 / math.pi,
                "bus_voltage": point.bus_voltage.value,
                "bus_current": current,
                "emf": k_e * point.speed.value,
                "equivalent_resistance": equivalent,
                "switches": 2.0 * r_t,
                "R_11r": None,
                "R_11L": None,
                "copper_loss": None,
                "copper_resistance": None,
                "commutation_resistance": None,
            }
            if point.line is not None:
                state = six_step.conducting_state(point.line, self.winding)
                copper = 3.0 * r * state.period_rms**2
                row |= {
                    "R_11r": state.resistive(r),
                    "R_11L": state.inductive(ell, point.state_time),
                    "winding_average": state.average,
                    "winding_rms": state.period_rms,
                    "winding_start": state.start,
                    "winding_end": state.end,
                    "copper_loss": copper,
                    "copper_resistance": copper / current**2,
                    "commutation_resistance": equivalent - 2.0 * r_t - copper / current**2,
                }
            rows.append(row)
        self.findings["points"] = rows
        if self.is_delta:
            self.notice(
                "delta-from-outside",
                text(
                    "the winding currents of a delta are calculated from the line currents; a current that circulates "
                    "inside the delta cannot be seen from outside and is taken as zero. With a third harmonic of the EMF "
                    "the copper loss is larger than given here"
                ),
            )
        self._report_at_largest_load(points[-1], rows[-1], parts)
        return rows

    @step("paper/4", "Commutation resistance against speed; copper loss apart")
    def commutation(self, points: Sequence[LoadPoint], parts: Parts, rows: Sequence[dict[str, float | None]]) -> None:
        """Fit R_c over speed, and compare how well the simple model and this one predict the speed."""
        simple = 2.0 * float(parts.switch_resistance.x) + (2.0 / 3.0 if self.is_delta else 2.0) * float(
            parts.winding_resistance.x
        )
        k_e = float(parts.emf_constant.x)
        known = [(p, row) for p, row in zip(points, rows, strict=True) if row["commutation_resistance"] is not None]
        speeds = np.array([p.speed.value for p, _ in known])
        commutation = np.array([row["commutation_resistance"] for _, row in known], dtype=float)
        slope, offset = np.polyfit(speeds, commutation, 1)
        predictions = []
        for point, row in known:
            current = point.bus_current.value
            apart = 2.0 * float(parts.switch_resistance.x) + float(row["copper_resistance"] or 0.0)
            full = apart + offset + slope * point.speed.value
            predictions.append(
                {
                    "speed_rpm": point.speed.value * 30.0 / math.pi,
                    "simple_model_rpm": (point.bus_voltage.value - simple * current) / k_e * 30.0 / math.pi,
                    "with_commutation_rpm": (point.bus_voltage.value - full * current) / k_e * 30.0 / math.pi,
                }
            )
        self.findings |= {
            "simple_model_resistance": simple,
            "commutation_over_speed": {"slope": float(slope), "offset": float(offset)},
            "predicted_speeds": predictions,
        }
        self.notice(
            "E14",
            text(
                "R_c = {value:.3g} Ω at the largest load is energy that the inductance takes and returns, not loss; the copper loss is "
                "{loss:.3g} W, formed with the rms current",
                value=float(commutation[-1]),
                loss=float(known[-1][1]["copper_loss"] or 0.0),
            ),
        )

    def _torques(self) -> list[float]:
        bound = self.bench.dynamometer.maximum_torque
        if self.settings.loads:
            wanted = sorted(self.settings.loads)
        else:
            constant = self.known_value("torque_constant")
            if constant is None:
                raise ProcedureError(
                    text(
                        "no torque constant is known, so no load can be chosen; run torque-constant first, or set loads=[…]"
                    )
                )
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

    def _point(self, torque: float, probe: CurrentProbe, *, first: bool) -> LoadPoint:
        bench, channel = self.bench, probe.channel
        frequency = bench.drive.measure_frequency().value
        if frequency <= 0.0:
            raise ProcedureError(text("the motor does not turn at {torque:.3g} N·m; lower the load", torque=torque))
        record_time = self.settings.periods / frequency
        bench.oscilloscope.configure_acquisition(record_time, _POINTS, 0.0)
        wave = ranged_record(bench, {channel: 4.0 * self.nameplate.current_bound}, 10.0 + record_time)[channel]
        bus_current = _averaged([bench.drive.measure_bus_current() for _ in range(self.settings.readings)])
        if first:
            self.wiring.inverter.running(DRIVE, probe, wave, bus_current.value)
        fit = fit_back_emf(wave.time, np.atleast_2d(wave.values), harmonics=(1, 5, 7, 11, 13), frequency=frequency)
        try:
            line = six_step.fold(wave.time, wave.values, fit.frequency)
        except EstimationError as problem:
            line = None
            self.notice(
                "not-separated",
                text(
                    "at {torque:.3g} N·m the parts cannot be separated: {problem}", torque=torque, problem=str(problem)
                ),
            )
        return LoadPoint(
            torque=torque,
            speed=bench.tachometer.measure_speed(),
            bus_voltage=_averaged([bench.drive.measure_bus_voltage() for _ in range(self.settings.readings)]),
            bus_current=bus_current,
            electrical_frequency=fit.frequency,
            line=line,
            current_accuracy=wave.accuracy,
        )

    def _winding(self) -> tuple[UncertainReal, UncertainReal]:
        """Return R_11 at the winding's temperature, and L11 − L12."""
        unc = self.bench.uncertainties
        whole = 3.0 if self.is_delta else 1.0
        resistance = self.settings.winding_resistance
        if resistance is not None:
            r = unc.standard("R_11 given", resistance, 0.0)
        elif "stator_resistance" in self.known:
            warm = 1.0 + 0.00385 * ((self.settings.winding_temperature or 25.0) - 25.0)
            r = whole * warm * unc.of_parameter(self.known["stator_resistance"])
        else:
            raise ProcedureError(text("R_11 is not known; run stator-resistance first, or set winding_resistance=…"))
        inductance = self.settings.winding_inductance
        if inductance is not None:
            return r, unc.standard("L11 - L12 given", inductance, 0.0)
        if not {"d_axis_inductance", "q_axis_inductance"} <= set(self.known):
            raise ProcedureError(
                text("L11 − L12 is not known; run an inductance procedure first, or set winding_inductance=…")
            )
        d, q = (unc.of_parameter(self.known[f"{axis}_axis_inductance"]) for axis in "dq")
        return r, whole * 0.5 * (d + q)

    def _typical(self, points: Sequence[LoadPoint], name: str) -> Accuracy:
        """Return the relative limit of error of a reading over its offset and gain, as one gain."""
        reading: Reading = getattr(points[-1], name)
        relative = reading.accuracy.gain + reading.accuracy.offset / abs(reading.value)
        return Accuracy(gain=relative, source=reading.accuracy.source)

    def _speed_error(self, points: Sequence[LoadPoint]) -> UncertainReal:
        """Return the tachometer's relative error at the mean speed, as a quantity around zero."""
        speed = sum(p.speed.value for p in points) / len(points)
        return self.bench.uncertainties.instrument("tachometer", speed, points[-1].speed.accuracy) / speed - 1.0

    def _report_emf(self, constant: UncertainReal, fit: Fit) -> None:
        self.report(
            "line_emf_constant",
            constant,
            section=_SECTION,
            estimator="least squares of mean state voltages over all loads",
        )
        flux, pairs = self.known_value("flux_linkage"), self.known_value("pole_pairs")
        self.findings["emf_residual"] = fit.residual_rms
        if flux is not None and pairs is not None:
            expected = _STATE_MEAN * math.sqrt(3.0) * pairs * flux
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

    def _report_at_largest_load(self, point: LoadPoint, row: dict[str, float | None], parts: Parts) -> None:
        unc = self.bench.uncertainties
        voltage = unc.instrument("drive, bus voltage", point.bus_voltage.value, self._typical([point], "bus_voltage"))
        current = unc.instrument("drive, bus current", point.bus_current.value, self._typical([point], "bus_current"))
        speed = unc.instrument("tachometer", point.speed.value, point.speed.accuracy)
        equivalent = (voltage - parts.emf_constant * speed) / current
        self.report(
            "equivalent_resistance",
            equivalent,
            section=_SECTION,
            estimator="bus voltage less EMF over bus current",
            note_value=2.0 * float(parts.switch_resistance.x)
            + (2.0 / 3.0 if self.is_delta else 2.0) * float(parts.winding_resistance.x),
        )
        if point.line is None:
            return
        copper = 3.0 * parts.winding_resistance * float(row["winding_rms"] or 0.0) ** 2 / current**2
        self.report(
            "copper_resistance",
            copper,
            section=_SECTION,
            estimator="three times R_11·I_eff² over I_s²",
        )
        self.report(
            "commutation_resistance",
            equivalent - 2.0 * parts.switch_resistance - copper,
            section=_SECTION,
            estimator="equivalent resistance less switches and copper",
        )


def _averaged(readings: Sequence[Reading]) -> Reading:
    """Return the mean of readings taken under one condition, as one reading."""
    last = readings[-1]
    return Reading(sum(r.value for r in readings) / len(readings), last.unit, last.accuracy, last.time)
