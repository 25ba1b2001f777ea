"""Ld and Lq from the smallest and largest line inductance while the shaft is turned slowly (§3.3.2)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from GTC.lib import UncertainReal
from numpy.typing import NDArray
from pydantic import Field

from drivers.interfaces import Accuracy, Aperture, ImpedanceReading, Wanted
from drivers.interfaces.text import text
from procedures.core.actions import (
    EnterReading,
    ReleaseRotor,
    StartTurning,
    StopTurning,
    Terminal,
    UncoupleDynamometer,
    meter_across,
)
from procedures.core.bench import Bench, Role
from procedures.core.curves import curve
from procedures.core.demand import Demand, Demands, Measurand
from procedures.core.nameplate import Nameplate
from procedures.core.procedure import Procedure
from procedures.core.result import Notice
from procedures.core.steps import step
from procedures.estimation.fitting.misfit import NO_MISFIT, Misfit
from procedures.estimation.winding.connections import ReadingConnection, phase_factor
from procedures.estimation.winding.sweep import rotor_sweep
from procedures.estimation.winding.sweep.resistances import against_direct_current, allowed_for_jump
from procedures.estimation.winding.sweep.timed_sweep import LEAST_PERIODS, fit_timed_sweep
from procedures.plausibility.capability import relative_uncertainty
from procedures.plausibility.inductance_capability import REQUESTED, check_inductance_capability
from procedures.techniques.instrument_choice import InstrumentChoice, choose_for_inductance
from procedures.techniques.winding.dq_axes import connection_of
from procedures.techniques.winding.plots import SweepPlot
from procedures.techniques.winding.short_correction import short_correct
from procedures.techniques.winding.slow_inductance import UNCHANGED, Slow, slow_inductance, tell_meant
from procedures.verification.settings import WiringSettings

#: Pole pairs assumed for the turning speed where they are not known yet: many, so that the shaft turns slowly enough.
_CAUTIOUS_POLE_PAIRS = 10
#: The sweep is then this much longer: a motor of fewer pole pairs is to go round far enough all the same.
_CAUTION = 2.0
_WARM_UP = 3
#: Speed (rad/s) at which a person can follow the display while turning.
_WATCHING_SPEED = 0.1
#: A sweep that scatters by more than this share of its amplitude is repeated this much more slowly.
_ROUGH, _SLOWER = 0.02, 4
#: Scatter of this share of an amplitude worth knowing may hide one that large.
_HIDING = 0.2
#: Saliency below this share of the inductance changes no controller.
_NOTEWORTHY = 0.005
_NAMES = (("d_axis_inductance", "d"), ("q_axis_inductance", "q"))


class DqInductanceExtremesSettings(WiringSettings):
    """Settings of §3.3.2."""

    frequency: float = Field(default=1000.0, gt=0.0, le=1e6, description="test frequency, Hz")
    level: float = Field(default=1.0, gt=0.0, le=20.0, description="test level, V rms")
    aperture: Aperture = Field(default=Aperture.MEDIUM, description="measurement time")
    at_frequency: bool = Field(
        default=True,
        description="the inductance at the test frequency is meant; false: that for slow changes, whose interval reaches as far as closed "
        "circuits (in magnets, solid iron) may be hidden from the bridge",
    )
    short_correction: bool = Field(default=True, description="measure and subtract the leads first")
    electrical_turns: float = Field(default=2.0, ge=1.0, le=100.0, description="electrical turns of the sweep")
    readings_per_period: int = Field(default=40, ge=8, le=1000, description="readings a period of the inductance")
    turning_speed: float | None = Field(
        default=None, gt=0.0, le=10.0, description="speed of the hand, rad/s; chosen when not given"
    )
    requested_uncertainty: float = Field(
        default=REQUESTED,
        gt=0.0,
        lt=1.0,
        description="required relative standard uncertainty; if a bridge cannot reach it, this is reported beforehand",
    )
    class_threshold: float = Field(
        default=0.10, gt=0.0, lt=1.0, description="difference below which the note calls it an SPMSM"
    )


@dataclass(frozen=True)
class Sweep:
    """Inductance between two lines (H, shape (n,)) over bench time (s), the bridge's accuracy at its mean, and the curve fitted.

    Without a fit a person watched the meter, and these are the smallest and the largest value seen.
    """

    time: NDArray[np.float64]
    inductance: NDArray[np.float64]
    accuracy: Accuracy
    fit: rotor_sweep.SweepFit | None = None
    slow: Slow = UNCHANGED


class DqInductanceExtremes(Procedure[DqInductanceExtremesSettings]):
    """Ld and Lq from a slow sweep of the rotor between two lines (§3.3.2)."""

    name: ClassVar[str] = "dq-inductance-extremes"
    title: ClassVar[str] = "dq inductance, smallest and largest"
    section: ClassVar[str] = "3.3.2"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.LCR_METER})
    gives: ClassVar[tuple[str, ...]] = ("d_axis_inductance", "q_axis_inductance")
    needs: ClassVar[Demands] = {Role.LCR_METER: Demand((Measurand.INDUCTANCE,))}

    @classmethod
    def check_capability(
        cls, bench: Bench, nameplate: Nameplate, settings: DqInductanceExtremesSettings
    ) -> Sequence[Notice]:
        """Compare the bridge's accuracy at the type value with the requested uncertainty."""
        return check_inductance_capability(cls.name, bench, nameplate, settings, 2.0)

    def measure(self) -> None:
        """Sweep, classify, conclude."""
        reading_time = self.connect_bridge()
        sweep = self.sweep(reading_time)
        motor_class = self.classify(sweep)
        self.conclude(sweep, motor_class)

    @step("3.3.2/1", "Connect the bridge between A and B, C open, and set {frequency:g} Hz", by_hand=True)
    def connect_bridge(self) -> float:
        """Return how long one reading takes (s)."""
        bridge = self.bench.lcr_meter
        expected = self.nameplate.expected.get("d_axis_inductance")
        self._choose(None if expected is None else 2.0 * expected)
        bridge.configure(self.settings.frequency, self.settings.level, self.settings.aperture)
        if self.settings.short_correction:
            short_correct(self.bench, bridge)
        self.wiring.bridge.connect(
            meter_across(Terminal.A, Terminal.B),
            self.settings.frequency,
            self.settings.level,
            self.settings.aperture,
            UncoupleDynamometer(),
            ReleaseRotor(),
        )
        if bridge.read_by_hand:
            return 0.0
        started = self.bench.clock.now()
        for _ in range(_WARM_UP):
            bridge.measure(Wanted.INDUCTANCE)
        return (self.bench.clock.now() - started) / _WARM_UP

    @step(
        "3.3.2/2",
        "Turn the shaft very slowly through {electrical_turns:g} electrical turns, recording the inductance",
        by_hand=True,
    )
    def sweep(self, reading_time: float) -> Sweep:
        """Return the sweep; the shaft is turned by hand, so its angle is not known."""
        bridge = self.bench.lcr_meter
        if bridge.read_by_hand:
            return self._watched()
        turns, pairs = self.settings.electrical_turns, self.known_value("pole_pairs") or self.nameplate.pole_pairs
        if pairs is None:
            turns, pairs = _CAUTION * turns, _CAUTIOUS_POLE_PAIRS
        # The inductance has two periods an electrical turn.
        readings = math.ceil(2.0 * turns * self.settings.readings_per_period)
        speed = self.settings.turning_speed
        if speed is None:
            speed = 2.0 * math.pi * turns / (pairs * readings * max(reading_time, 1e-3))
        sweep = self._turned(speed, readings, reading_time)
        if self.settings.turning_speed is None and _rough(sweep):
            # The induced voltage spoils a reading by the square of the speed.
            sweep = self._turned(speed / _SLOWER, _SLOWER * readings, reading_time)
        # Where the shaft stands now is any angle: what is held back there is that share of both.
        settings, connected = self.settings, meter_across(Terminal.A, Terminal.B)
        slow = slow_inductance(self, connected, settings.frequency, settings.level, settings.aperture, self.gives)
        return replace(sweep, slow=slow.at_frequency() if settings.at_frequency else slow)

    @step("3.3.2/3", "Class: less than {class_threshold:.0%} between smallest and largest is a surface-magnet machine")
    def classify(self, sweep: Sweep) -> str:
        """Return the class by the note's rule."""
        low, high = rotor_sweep.extremes(sweep.inductance)
        motor_class = str(rotor_sweep.motor_class(low, high, self.settings.class_threshold))
        self.findings |= {"smallest": low, "largest": high, "motor_class": motor_class}
        choice = self._choose(0.5 * (low + high), sweep.accuracy)
        if choice.unstated:
            self.notice("instrument-choice", choice.sentence())
        return motor_class

    def _choose(self, reading: float | None, accuracy: Accuracy | None = None) -> InstrumentChoice:
        """Choose for a line inductance (H), None where it is not known yet; with the accuracy of a reading where there is one."""
        share = None if reading is None or accuracy is None else relative_uncertainty(accuracy, reading) or None
        choice = choose_for_inductance(self.bench, reading, share, self.settings.requested_uncertainty)
        self.findings["instrument_choice"] = choice.as_finding()
        return choice

    @step("3.3.2/4", "From line to phase: wye 0.5, delta 1.5 of the smallest (Ld) and the largest (Lq)")
    def conclude(self, sweep: Sweep, motor_class: str) -> None:
        """Fit the whole sweep; also report the extremes, and whether the saliency is more than noise."""
        fit = sweep.fit
        if fit is None:
            self._report(
                sweep,
                motor_class,
                self._from_extremes(sweep, motor_class),
                estimator="smallest and largest reading at the test frequency, by the note's rule",
            )
            return
        beyond_chance, p_value = rotor_sweep.saliency_significant(fit)
        significant = beyond_chance and fit.periods >= LEAST_PERIODS
        mean, amplitude = fit.value("mean"), fit.value("amplitude") if significant else 0.0
        self.findings |= {
            "saliency_significant": significant,
            "saliency_p_value": p_value,
            "residual": fit.residual_rms,
        }
        self.findings["sweep"] |= curve(
            sweep.inductance.size, angle=0.5 * fit.course, fitted=sweep.inductance - fit.residuals
        )
        if significant and motor_class == "SPMSM" and 2.0 * amplitude > _NOTEWORTHY * mean:
            self.notice(
                "E3",
                text(
                    "by the note's rule this is a surface-magnet machine with one inductance, but Lq and Ld differ by "
                    "{share:.1%}, which is more than noise: both are given",
                    share=2.0 * amplitude / (mean - amplitude),
                ),
            )
        if significant and fit.residual_rms > 0.25 * amplitude:
            self.notice(
                "rough-sweep",
                text(
                    "the readings scatter by {scatter:.2g} µH about the sweep's curve of amplitude {amplitude:.2g} µH: the shaft was "
                    "turned too fast or unevenly (the induced voltage spoils a reading). Turn more slowly",
                    scatter=1e6 * fit.residual_rms,
                    amplitude=1e6 * amplitude,
                ),
            )
        found = self._fitted(fit, significant=significant)
        # A reading is a mean over some part of the time to the next, while the shaft turns on: less of the amplitude is seen.
        advance = 2.0 * math.pi * fit.periods / (sweep.inductance.size - 1)
        whole = advance**2 / 24.0
        # Of the time from reading to reading at least half is the aperture, and the loss goes with its square.
        lost = self.bench.uncertainties.limit("turning during a reading", 0.625 * whole, 0.375 * whole)
        found["d"] = found["d"] - amplitude * lost
        found["q"] = found["q"] + amplitude * lost
        self._report(
            sweep,
            motor_class,
            found,
            estimator="fit of mean and second harmonic to the whole sweep, at the test frequency"
            if self.settings.at_frequency
            else "fit of mean and second harmonic to the whole sweep, for slow changes",
        )

    def _fitted(self, fit: rotor_sweep.SweepFit, *, significant: bool) -> dict[str, UncertainReal]:
        """Return the fitted line values (H), one mean and one amplitude behind both: their difference is known better than they."""
        unc, freedom = self.bench.uncertainties, fit.degrees_of_freedom
        mean = unc.statistical("sweep fit: mean", fit.value("mean"), fit.uncertainty("mean"), freedom)
        if not significant:
            hidden = fit.value("amplitude") + 2.0 * fit.uncertainty("amplitude")
            one = mean + unc.limit("saliency that the scatter may hide", 0.0, hidden)
            return {"d": one, "q": one}
        # What the two share goes with the mean, the rest is the amplitude's own.
        shared = fit.correlation("mean", "amplitude")
        lean = shared * fit.uncertainty("amplitude") / fit.uncertainty("mean") if shared else 0.0
        own = fit.uncertainty("amplitude") * math.sqrt(1.0 - shared**2)
        amplitude = unc.statistical("sweep fit: amplitude", fit.value("amplitude"), own, freedom)
        amplitude = amplitude + lean * (mean - float(mean.x))
        return {"d": mean - amplitude, "q": mean + amplitude}

    def _turned(self, speed: float, readings: int, reading_time: float) -> Sweep:
        """Take so many readings, each of about `reading_time` (s), while the shaft is turned at this speed (rad/s)."""
        bench, pairs = self.bench, self.known_value("pole_pairs") or self.nameplate.pole_pairs
        bench.perform(StartTurning(speed))
        plot = SweepPlot(bench.clock.now(), speed, readings, reading_time, pairs)
        taken: list[ImpedanceReading] = []
        while len(taken) < readings:
            if len(taken) % plot.every == 0:
                bench.show(lambda: plot.made(taken))
            taken.append(bench.lcr_meter.measure(Wanted.INDUCTANCE))
        bench.show(lambda: plot.made(taken))
        bench.perform(StopTurning())
        time, inductance = np.array([r.time for r in taken]), np.array([r.inductance for r in taken])
        middle = taken[int(np.argsort(inductance)[inductance.size // 2])]
        # The inductance has two periods an electrical turn.
        way = None if pairs is None else speed * float(time[-1] - time[0]) * pairs / math.pi
        fit = fit_timed_sweep(time, inductance, expected_periods=way)
        resistance = np.array([r.resistance for r in taken])
        fit = self._with_resistances(fit, np.delete(resistance, fit.left_out), middle)
        time, inductance = np.delete(time, fit.left_out), np.delete(inductance, fit.left_out)
        self.findings["sweep"] = {"time": time.tolist(), "inductance": inductance.tolist()}
        bench.show(lambda: plot.fitted(time, inductance, fit.residuals))
        return Sweep(time, inductance, middle.inductance_accuracy, fit)

    def _with_resistances(
        self, fit: rotor_sweep.SweepFit, resistance: NDArray[np.float64], reading: ImpedanceReading
    ) -> rotor_sweep.SweepFit:
        """Return the fit with what the resistance (Ω, shape (n,)) read beside the inductance says against it."""
        fit = allowed_for_jump(fit, resistance)
        known = self.known_value("stator_resistance")
        if known is None:
            return fit
        line = known / phase_factor(self.winding, ReadingConnection.LINE_TO_LINE).y_equivalent
        accuracy = reading.resistance_accuracy
        limit = accuracy.gain * abs(reading.resistance) + accuracy.offset
        against = against_direct_current(resistance, limit, line, self.settings.frequency)
        return replace(fit, misfit=Misfit((*against.findings, *fit.misfit.findings)))

    def _watched(self) -> Sweep:
        """Ask for the extremes that a person sees on the meter while turning."""
        bridge = self.bench.lcr_meter
        self.bench.perform(StartTurning(self.settings.turning_speed or _WATCHING_SPEED))
        seen = []
        for key, quantity in (
            ("smallest_inductance", text("the smallest inductance seen while turning")),
            ("largest_inductance", text("the largest inductance seen while turning")),
        ):
            seen.append(1e-6 * self.bench.reading(EnterReading(key, quantity, "µH", 1e-3, 1e7)))
        self.bench.perform(StopTurning())
        self.findings["sweep"] = {"smallest": seen[0], "largest": seen[1], "read": "by eye"}
        _, accuracy = bridge.accuracy_at(0.0, seen[1], self.settings.frequency)
        return Sweep(np.full(2, self.bench.clock.now()), np.array(seen), accuracy)

    def _from_extremes(self, sweep: Sweep, motor_class: str) -> dict[str, UncertainReal]:
        """By eye there is no fit; what two values hide is half their distance where the note takes the mean."""
        low, high = rotor_sweep.extremes(sweep.inductance)
        if motor_class == "SPMSM":
            self.notice(
                "E3",
                text(
                    "by the note's rule this is a surface-magnet machine with one inductance; the extremes differ by {share:.1%}, so the "
                    "smallest is given as Ld and the largest as Lq. A recorded sweep would show whether that is more than noise",
                    share=(high - low) / low,
                ),
            )
        return {
            axis: self.bench.uncertainties.statistical(text("extreme for {axis}", axis=axis), value, 0.0)
            for axis, value in (("d", low), ("q", high))
        }

    def _report(self, sweep: Sweep, motor_class: str, found: dict[str, UncertainReal], estimator: str) -> None:
        low, high = rotor_sweep.extremes(sweep.inductance)
        one = 0.5 * (low + high)
        notes = {"d": one, "q": one} if motor_class == "SPMSM" else {"d": low, "q": high}
        factors = phase_factor(self.winding, connection_of(meter_across(Terminal.A, Terminal.B)))
        if self.is_delta:
            self.notice(
                "E8",
                text(
                    "delta: 1.5 times the reading is the inductance of one winding; a controller wants the Y-equivalent, "
                    "half the reading. Both are given"
                ),
            )
        tell_meant(self, (sweep.slow,), self.settings.frequency, at_frequency=self.settings.at_frequency)
        # What is held back was seen at one angle; a circuit may hold back more on the one axis, in proportion to it or so.
        smallest, largest = sorted(float(one.x) for one in found.values())
        unlike = self.bench.uncertainties.limit(
            text("a second circuit, on one axis and the other"),
            1.0,
            (float(sweep.slow.ratio.x) - 1.0) * (largest / smallest - 1.0),
        )
        for name, axis in _NAMES:
            reading = (
                self.bench.uncertainties.instrument("LCR meter", found[axis], sweep.accuracy)
                * sweep.slow.ratio
                * unlike
            )
            self.report(
                name,
                factors.y_equivalent * reading,
                section="3.3.2",
                estimator=estimator,
                note_value=factors.winding * notes[axis],
                winding=float((factors.winding * reading).x) if self.is_delta else None,
                misfit=Misfit.together(
                    (sweep.fit.misfit.of(name) if sweep.fit else NO_MISFIT, sweep.slow.misfit.of(name))
                ),
            )


def _rough(sweep: Sweep) -> bool:
    """Return whether the readings scatter about their curve as they should not, or enough to hide a saliency worth knowing."""
    fit = sweep.fit
    if fit is None:
        return False
    amplitude, noteworthy = fit.value("amplitude"), 0.5 * _NOTEWORTHY * fit.value("mean")
    if not rotor_sweep.saliency_significant(fit)[0]:
        return fit.residual_rms > _HIDING * noteworthy
    return amplitude > noteworthy and fit.residual_rms > _ROUGH * amplitude
