"""Back-EMF constant and flux linkage from the driven motor's voltages (§3.4)."""

import math
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from enum import Enum
from typing import ClassVar

import numpy as np
from GTC.lib import UncertainReal
from pydantic import Field

from drivers.interfaces import Accuracy, ProbeKind
from drivers.interfaces.text import text
from procedures.core.actions import ALL_OPEN, CoupleDynamometer, Node, ReleaseRotor, VoltageProbe, phases_on
from procedures.core.bench import ProcedureError, Role
from procedures.core.demand import SPEED, Demand, Demands, Measurand
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.emf.agreement import Combined
from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.emf.integrated_flux import flux_by_integration
from procedures.estimation.emf.period import peak_amplitude
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.emf.speed_trend import OverSpeeds, over_records
from procedures.estimation.fitting.misfit import Misfit
from procedures.techniques.acquisition import ranged_record
from procedures.techniques.shaft.driven_shaft import check_turning, driving_speed_rad
from procedures.techniques.shaft.emf_at_speed import (
    SpeedPoint,
    first_periods,
    largest_gain,
    over_mechanical,
    trend_rows,
)
from procedures.techniques.shaft.plots import emf_plot
from procedures.techniques.temperature.correction import magnet_factor, winding_temperature
from procedures.techniques.temperature.settings import (
    MagnetCoefficient,
    MagnetCoefficientUncertainty,
    MagnetsTemperature,
    TemperatureUncertainty,
)
from procedures.verification.settings import TurnedWiringSettings

_POINTS = 20_000
_RPM = math.pi / 30.0
#: Periods of the waveform that go into the findings.
_SHOWN_PERIODS = 2.0
#: Relative drift over a record beyond which the flux is taken by integration.
_DRIFT = 1e-3


class Probing(Enum):
    """The points at which the voltages are taken."""

    THREE_PHASE = "three_phase"
    NEUTRAL = "neutral"
    LINE = "line"


class BackEmfConstantSettings(TurnedWiringSettings):
    """Settings of §3.4."""

    speeds_rpm: tuple[float, ...] = Field(
        default=(), description="speeds, rpm; shares of the rated speed when not given"
    )
    speed_shares: tuple[float, ...] = Field(
        default=(1.0, 0.625, 0.5), min_length=1, description="speeds, shares of the rated speed"
    )
    probing: Probing = Field(
        default=Probing.THREE_PHASE,
        description="three phases on an artificial star point, on the winding's own where it is there (neutral), or one line voltage",
    )
    record_time: float = Field(default=0.1, gt=0.0, le=10.0, description="length of the record, s")
    harmonics: tuple[int, ...] = Field(default=(1, 3, 5, 7), description="harmonics to fit")
    winding_temperature: MagnetsTemperature = None
    temperature_uncertainty: TemperatureUncertainty = 2.0
    magnet_coefficient: MagnetCoefficient = -0.001
    magnet_coefficient_uncertainty: MagnetCoefficientUncertainty = None


class BackEmfConstant(Procedure[BackEmfConstantSettings]):
    """Flux linkage and back-EMF constant from one line voltage or three phases on an artificial star point (§3.4)."""

    name: ClassVar[str] = "back-emf-constant"
    title: ClassVar[str] = "Back-EMF constant"
    section: ClassVar[str] = "3.4"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DYNAMOMETER, Role.OSCILLOSCOPE, Role.TACHOMETER})
    gives: ClassVar[tuple[str, ...]] = (
        "flux_linkage",
        "back_emf_constant_mechanical",
        "back_emf_constant_v_per_krpm",
        "back_emf_constant_v_per_rpm",
    )
    needs: ClassVar[Demands] = {
        Role.OSCILLOSCOPE: Demand(screen=(Measurand.AMPLITUDE,), probes={ProbeKind.VOLTAGE: 1}),
        Role.TACHOMETER: SPEED,
    }

    def measure(self) -> None:
        """Drive at several speeds, record the voltages, and form both constants."""
        speeds = self.drive()
        points = self.record(speeds)
        cold = self._to_cold()
        self.per_krpm(points, cold)
        self.per_radian(points, cold)

    @step("3.4.2/1", "The drive motor turns it at constant speed, as fast as possible, at several speeds", by_hand=True)
    def drive(self) -> list[float]:
        """Open the terminals, couple the drive motor, and return the speeds (rad/s) to take, the highest first."""
        self.bench.perform(ALL_OPEN, ReleaseRotor(), CoupleDynamometer())
        if self.settings.speeds_rpm:
            return sorted((rpm * _RPM for rpm in self.settings.speeds_rpm), reverse=True)
        shares = sorted(set(self.settings.speed_shares), reverse=True)
        return [driving_speed_rad(self.bench, self.nameplate, share) for share in shares]

    @step(
        "3.4.2/2", "Probe one line voltage, or three phases against an artificial star point, and record", by_hand=True
    )
    def record(self, speeds: Sequence[float]) -> list[SpeedPoint]:
        """Return the EMF at each speed; probes are fitted while the shaft stands."""
        channels = self._fit_probes()
        points = []
        with ExitStack() as driven:
            driven.enter_context(self.bench.dynamometer.driving_speed(speeds[0]))
            for index, speed in enumerate(speeds):
                if index:
                    self.bench.dynamometer.set_speed(speed)
                points.append(self._point(channels, speed))
        self.findings["points"] = [
            {
                "speed_rpm": point.mechanical_speed.value / _RPM,
                "electrical_speed": point.electrical_speed,
                "amplitude": point.amplitude,
                "flux_linkage": point.flux.value,
                "back_emf_constant_mechanical": point.amplitude / point.mechanical_speed.value,
                "note_amplitude": point.note_amplitude,
                **point.details,
            }
            for point in points
        ]
        return points

    @step("3.4.2/3", "Constant in volts per 1000 rpm, phase: E / n · 1000")
    def per_krpm(self, points: Sequence[SpeedPoint], cold: UncertainReal) -> None:
        """Report peak phase volts per 1000 rpm and per rpm."""
        over = over_records(
            [p.electrical_speed / math.tau for p in points],
            [over_mechanical(p) for p in points],
            gain_limit=largest_gain(points),
        )
        mean = self._mean("EMF over mechanical speed", over, points)
        misfit = Misfit.together((*(p.misfit for p in points), over.misfit))
        constant = cold * self._by_tachometer(mean, points)
        note = float(np.mean([p.note_amplitude / p.mechanical_speed.value for p in points]))
        for name, factor in (
            ("back_emf_constant_v_per_krpm", 1000.0 * _RPM),
            ("back_emf_constant_v_per_rpm", _RPM),
        ):
            self.report(
                name,
                factor * constant,
                section="3.4.2",
                estimator="fundamental of all channels and harmonics fitted together",
                note_value=factor * note,
                misfit=misfit.of("flux_linkage", name),
            )
        self.report(
            "back_emf_constant_mechanical",
            constant,
            section="3.4.2",
            estimator="fundamental of all channels and harmonics fitted together",
            note_value=note,
            misfit=misfit.of("flux_linkage", "back_emf_constant_mechanical"),
        )

    @step("3.4.2/4", "Constant in volt-seconds per radian: phase amplitude over electrical speed")
    def per_radian(self, points: Sequence[SpeedPoint], cold: UncertainReal) -> None:
        """Report the flux linkage (V·s per electrical radian)."""
        over = over_records(
            [p.electrical_speed / math.tau for p in points], [p.flux for p in points], gain_limit=largest_gain(points)
        )
        self.findings["speed_trend"] = trend_rows(over)
        flux = cold * self._mean("EMF over electrical speed", over, points)
        note = float(np.mean([p.note_amplitude / p.electrical_speed for p in points]))
        winding = math.sqrt(3.0) * float(flux.x) if self.is_delta else None
        self.report(
            "flux_linkage",
            flux,
            section="3.4.2",
            estimator="fundamental of all channels and harmonics fitted together",
            note_value=note,
            winding=winding,
            misfit=Misfit.together((*(p.misfit for p in points), over.misfit)).of("flux_linkage"),
        )
        self.notice(
            "E4",
            text(
                "{flux:.4g} V·s per electrical radian is the flux linkage that a controller needs; the note's table divides by the "
                "mechanical speed instead, {mechanical:.4g} V·s/rad, which is larger by the number of pole pairs",
                flux=float(flux.x),
                mechanical=float(np.mean([p.amplitude / p.mechanical_speed.value for p in points])),
            ),
        )

    def _to_cold(self) -> UncertainReal:
        """Return what refers the constants to 25 °C; the magnets are taken to be as warm as the winding."""
        temperature = winding_temperature(
            self, self.settings.winding_temperature, self.settings.temperature_uncertainty
        )
        self.findings["winding_temperature"] = float(temperature.x)
        return magnet_factor(
            self.bench.uncertainties,
            temperature,
            self.settings.magnet_coefficient,
            self.settings.magnet_coefficient_uncertainty,
        )

    def _fit_probes(self) -> list[int]:
        channels = list(self.bench.oscilloscope.channels(ProbeKind.VOLTAGE))
        probes: tuple[VoltageProbe, ...]
        if self.settings.probing is Probing.LINE:
            channels = channels[:1]
            probes = (VoltageProbe(channels[0], Node.A, Node.B),)
        else:
            channels = channels[:3]
            if len(channels) < 3:
                raise ProcedureError(
                    text(
                        "three phases need three voltage probes, the station has {n}; set probing=line", n=len(channels)
                    )
                )
            neutral = self.settings.probing is Probing.NEUTRAL
            if neutral and self.is_delta:
                raise ProcedureError(
                    text("a delta has no star point to probe against; set probing=three_phase or probing=line")
                )
            probes = phases_on(channels, reference=Node.STAR_POINT if neutral else Node.ARTIFICIAL_STAR)
        self.wiring.shaft.connect_probes(probes)
        return channels

    def _point(self, channels: Sequence[int], speed: float) -> SpeedPoint:
        if not self.bench.oscilloscope.gives_waveforms:
            return self._read_off_screen(channels, speed)
        scope = self.bench.oscilloscope
        scope.configure_acquisition(self.settings.record_time, _POINTS, 0.0)
        start = 4.0 * (self.nameplate.rated_voltage or 50.0)
        waves = ranged_record(self.bench, dict.fromkeys(channels, start), 10.0 + self.settings.record_time)
        mechanical = self.bench.tachometer.measure_speed()
        check_turning(self.bench, mechanical, speed)
        samples = np.vstack([waves[channel].values for channel in channels])
        time = waves[channels[0]].time
        told = [
            DigitizedChannel(str(c), waves[c].resolution, waves[c].clipped, waves[c].accuracy.gain) for c in channels
        ]
        fit = fit_back_emf(time, samples, harmonics=self.settings.harmonics, digitized=told)
        wave = first_periods(time, samples, fit, _SHOWN_PERIODS)
        harmonics = {str(h): float(np.mean(np.abs(fit.amplitudes[:, k]))) for k, h in enumerate(fit.harmonics)}
        harmonics |= {str(order): float(np.mean(sizes)) for order, sizes in fit.further.items()}
        self.bench.show(lambda: emf_plot(mechanical.value, wave, harmonics))
        to_phase = 1.0 / math.sqrt(3.0) if self.settings.probing is Probing.LINE else 1.0
        fundamentals = [fit.fundamental(k) for k in range(len(channels))]
        flux, misfit = fit.flux_linkage, fit.misfit
        if fit.ripples or (fit.drift_significant and abs(fit.drift) > _DRIFT):
            integrated = flux_by_integration(time, samples, harmonics=self.settings.harmonics, digitized=told)
            flux, misfit = integrated.flux_linkage, integrated.misfit
            self.notice(
                "speed-drift",
                text(
                    "the speed changed between {slowest:.1f} and {fastest:.1f} rpm during the record; the flux linkage is taken by "
                    "integrating the voltage, which needs no constant speed",
                    slowest=mechanical.value / _RPM * float(np.min(integrated.period_frequencies)) / fit.frequency,
                    fastest=mechanical.value / _RPM * float(np.max(integrated.period_frequencies)) / fit.frequency,
                ),
            )
        return SpeedPoint(
            amplitude=to_phase * sum(f[0] for f in fundamentals) / len(fundamentals),
            flux=replace(
                flux,
                value=to_phase * flux.value,
                uncertainty=to_phase * flux.uncertainty,
                scatter=to_phase * flux.scatter,
            ),
            misfit=misfit,
            accuracies={channel: waves[channel].accuracy for channel in channels},
            electrical_speed=fit.electrical_speed,
            mechanical_speed=mechanical,
            note_amplitude=to_phase * float(np.mean([peak_amplitude(row) for row in samples])),
            details={
                "speed_commanded": speed,
                "frequency": fit.frequency,
                "phase_amplitudes": [to_phase * f[0] for f in fundamentals],
                "phase_angles": fit.phases.tolist(),
                "harmonics": harmonics,
                "drift": fit.drift,
                "residual": fit.residual_rms.tolist(),
                "waveform": wave,
            },
        )

    def _read_off_screen(self, channels: Sequence[int], speed: float) -> SpeedPoint:
        screen = self.bench.oscilloscope
        to_phase = 1.0 / math.sqrt(3.0) if self.settings.probing is Probing.LINE else 1.0
        reading = screen.measure_amplitude(channels[0])
        mechanical = self.bench.tachometer.measure_speed()
        check_turning(self.bench, mechanical, speed)
        pairs = self.known_value("pole_pairs") or self.nameplate.pole_pairs
        electrical = pairs * mechanical.value if pairs else 2.0 * math.pi * screen.measure_frequency(channels[0]).value
        amplitude = reading.value * to_phase
        uncertainty = to_phase * math.hypot(0.5 * reading.accuracy.resolution, reading.accuracy.offset) / math.sqrt(3.0)
        return SpeedPoint(
            amplitude=amplitude,
            flux=Combined(amplitude / electrical, uncertainty / electrical, math.inf),
            accuracies={channels[0]: reading.accuracy},
            electrical_speed=electrical,
            mechanical_speed=mechanical,
            note_amplitude=amplitude,
            details={"read": "off the screen"},
        )

    def _by_tachometer(self, constant: UncertainReal, points: Sequence[SpeedPoint]) -> UncertainReal:
        """Put on the tachometer's gain, and its offset by its mean share of the speeds."""
        accuracy = points[0].mechanical_speed.accuracy
        unc, share = self.bench.uncertainties, float(np.mean([1.0 / p.mechanical_speed.value for p in points]))
        gain = unc.instrument("tachometer", 1.0, Accuracy(gain=accuracy.gain, source=accuracy.source))
        offset = unc.instrument("tachometer", 0.0, Accuracy(offset=accuracy.offset * share, source=accuracy.source))
        return constant / (gain + offset)

    def _mean(self, source: str, over: OverSpeeds, points: Sequence[SpeedPoint]) -> UncertainReal:
        mean = self.bench.uncertainties.statistical(source, over.value, over.uncertainty, over.degrees_of_freedom)
        # Channels of one oscilloscope share a reference: their mean is no better than one of them.
        gains = [
            self.bench.uncertainties.instrument(
                "oscilloscope, all channels", 1.0, Accuracy(gain=accuracy.gain, source=accuracy.source)
            )
            for accuracy in points[0].accuracies.values()
        ]
        return mean * sum(gains[1:], gains[0]) / len(gains)
