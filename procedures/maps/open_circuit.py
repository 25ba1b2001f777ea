"""Open circuit over speed: the EMF, the drag, and from two temperatures the temperature coefficient of the magnets."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from GTC.lib import UncertainReal
from pydantic import Field

from drivers.interfaces import ProbeKind
from drivers.interfaces.text import Text, text
from procedures.core.actions import (
    ALL_OPEN,
    ConnectProbes,
    CoupleDynamometer,
    ReleaseRotor,
    UncoupleDynamometer,
    phases_on,
)
from procedures.core.axes import Axes, CurveStyle, PlotCurve
from procedures.core.bench import ProcedureError, Role
from procedures.core.demand import Demand, Demands
from procedures.core.live_plot import LivePlot
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.emf.speed_trend import OverSpeeds, over_records
from procedures.estimation.fitting.fit import Fit
from procedures.estimation.fitting.misfit import Misfit
from procedures.estimation.mechanics.drag import drag_at, fit_drag
from procedures.estimation.winding.short_circuit import current
from procedures.maps.magnets import coefficient_between
from procedures.maps.settings import SpeedsSettings
from procedures.maps.turned_points import (
    Fundamentals,
    HeldTorque,
    channels_gain,
    fundamentals,
    geometric_speeds,
    held_torque,
    line,
    pole_pairs_of,
    torque_gain,
)
from procedures.techniques.ended_early import tell_ended
from procedures.techniques.shaft.emf_at_speed import trend_rows
from procedures.techniques.shaft.torque_zero import ZeroLine, read_zero
from procedures.techniques.temperature.correction import magnet_factor, winding_temperature
from procedures.techniques.temperature.settings import (
    COLD,
    MagnetCoefficient,
    MagnetCoefficientUncertainty,
    MagnetsTemperature,
    TemperatureUncertainty,
)

_RPM = math.pi / 30.0
#: So few speeds make a flux linkage.
_FEWEST = 3
#: Warming goes on in stretches of this length (s).
_STRETCH = 10.0


class OpenCircuitSettings(SpeedsSettings):
    """Settings of the open circuit over speed."""

    lowest: float = Field(default=0.1, gt=0.0, le=1.0, description="lowest speed, share of the rated speed")
    highest: float = Field(default=1.0, gt=0.0, le=2.0, description="highest speed, share of the rated speed")
    speeds: int = Field(default=6, ge=3, le=100, description="speeds, evenly spaced by their ratio")
    tare: bool = Field(default=True, description="measure the dynamometer's own drag, the motor off it")
    warming_time: float = Field(
        default=0.0,
        ge=0.0,
        le=7200.0,
        description="time for which the motor is warmed by its short-circuit current for a second temperature, s; 0 for one temperature",
    )
    winding_temperature: MagnetsTemperature = None
    temperature_uncertainty: TemperatureUncertainty = 2.0
    magnet_coefficient: MagnetCoefficient = -0.001
    magnet_coefficient_uncertainty: MagnetCoefficientUncertainty = None


@dataclass(frozen=True)
class OpenPass:
    """EMF and torque at each speed, at one temperature (°C)."""

    emf: tuple[Fundamentals, ...]
    torque: tuple[HeldTorque, ...]
    zero: ZeroLine
    temperature: UncertainReal

    @property
    def speeds(self) -> list[float]:
        """Mechanical speeds (rad/s)."""
        return [each.speed for each in self.torque]

    def drags(self) -> list[float]:
        """Return the torques (N·m) that turning took, the transducer's zero off."""
        zeros = self.zero.at(np.array([each.time for each in self.torque]))
        return [each.torque - float(zero) for each, zero in zip(self.torque, zeros, strict=True)]


class OpenCircuit(Procedure[OpenCircuitSettings]):
    """EMF and drag over speed with open terminals: flux linkage, its temperature coefficient, the loss of bearings and iron together."""

    name: ClassVar[str] = "open-circuit"
    title: ClassVar[str] = "Open circuit over speed"
    section: ClassVar[str] = "M3"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DYNAMOMETER, Role.OSCILLOSCOPE})
    gives: ClassVar[tuple[str, ...]] = ("flux_linkage", "flux_temperature_coefficient", "open_circuit_loss")
    needs: ClassVar[Demands] = {
        Role.DYNAMOMETER: Demand(automatic=True),
        Role.OSCILLOSCOPE: Demand(waveforms=True, probes={ProbeKind.VOLTAGE: 3}),
    }
    at_load: ClassVar[bool] = True
    _passes: tuple[OpenPass, ...] = ()
    _tare: Fit | None = None
    _left: OpenPass | None = None

    def measure(self) -> None:
        """Take the tare, turn with open terminals at every speed, again when warm, and conclude."""
        self._speeds = geometric_speeds(
            self.bench, self.nameplate, self.settings.lowest, self.settings.highest, self.settings.speeds
        )
        self._tare = self.tare()
        self.connect()
        self._passes = (self.turn(),)
        if (warm := self.warm()) is not None:
            self._passes = (*self._passes, warm)
        self.conclude_emf(self._passes)
        self.conclude_drag(self._passes[0], self._tare)

    def conclude_early(self, why: Text) -> bool:
        """Report the results of complete passes, and of an incomplete one only the flux linkage, because torques need their zero again."""
        if self._passes:
            tell_ended(self, why, text("figures are of the {count} whole passes", count=len(self._passes)))
            self.conclude_emf(self._passes)
            self.conclude_drag(self._passes[0], self._tare)
            return True
        if self._left is None or len(self._left.emf) < _FEWEST:
            return False
        tell_ended(
            self,
            why,
            text(
                "the flux linkage is of {count} of {planned} speeds; the torques are left out, because their zero "
                "was not read again",
                count=len(self._left.emf),
                planned=len(self._speeds),
            ),
        )
        self.conclude_emf([self._left])
        return True

    @step("M3/1", "The dynamometer alone at each speed: its own drag", by_hand=True)
    def tare(self) -> Fit | None:
        """Return the drag of the dynamometer alone over speed, None where it is not asked for."""
        if not self.settings.tare:
            return None
        self.bench.perform(ALL_OPEN, UncoupleDynamometer())
        before = read_zero(self.bench, self.settings.interval, self.settings.zero_rest)
        taken = []
        for speed in self._speeds:
            with self.bench.dynamometer.driving_speed(speed):
                taken.append(held_torque(self.bench, self.settings, speed))
        self.bench.dynamometer.stop()
        zero = ZeroLine(before, read_zero(self.bench, self.settings.interval, self.settings.zero_rest))
        zeros = zero.at(np.array([each.time for each in taken]))
        self.findings["tare_torques"] = line([t.torque - z for t, z in zip(taken, zeros, strict=True)])
        return fit_drag([t.speed for t in taken], self.findings["tare_torques"], [t.uncertainty for t in taken])

    @step("M3/2", "Couple the motor, its terminals open, three probes on an artificial star point", by_hand=True)
    def connect(self) -> None:
        """Leave the motor ready to be turned, its probes verified."""
        self.bench.perform(ALL_OPEN, ReleaseRotor(), CoupleDynamometer())
        self.wiring.shaft.connect_probes(phases_on(self._channels), report_order=False)

    @step("M3/3", "At each speed: the EMF's fundamental, and the torque that turning takes")
    def turn(self) -> OpenPass:
        """Return EMF and torque at each speed, and the temperature that was."""
        self._cold = self._pass(self.settings.winding_temperature)
        return self._cold

    @step(
        "M3/4",
        "Where a second temperature is asked for: warm the motor by its short-circuit current, open it, and turn it again",
        by_hand=True,
    )
    def warm(self) -> OpenPass | None:
        """Return the same for the warm motor, None where one temperature will do."""
        if not self.settings.warming_time:
            return None
        speed, level = self._warming_speed()
        self.findings["warming"] = {"speed_rpm": speed / _RPM, "current": level, "time": self.settings.warming_time}
        first = self._cold.emf[0]
        self.wiring.short.joined(
            phases_on(self._channels),
            None,
            first.electrical_speed / self._cold.torque[0].speed,
            first.flux.value,
            level,
            min(self._speeds[0], 0.3 * speed),
        )
        self.bench.thermometer.warmed()
        with self.bench.dynamometer.driving_speed(speed):
            left = self.settings.warming_time
            while left > 0.0:
                self.bench.clock.sleep(min(left, _STRETCH))
                left -= _STRETCH
        self.bench.dynamometer.stop()
        self.bench.perform(ALL_OPEN, ConnectProbes(phases_on(self._channels)))
        return self._pass(None)

    @step("M3/5", "Flux linkage, and its change with the temperature")
    def conclude_emf(self, passes: Sequence[OpenPass]) -> None:
        """Report flux linkage at 25 °C and its coefficient."""
        unc, over = self.bench.uncertainties, [self._over(each) for each in passes]
        gain = channels_gain(unc, passes[0].emf[0].accuracies)
        cold = magnet_factor(
            unc,
            passes[0].temperature,
            self.settings.magnet_coefficient,
            self.settings.magnet_coefficient_uncertainty,
        )
        first = unc.statistical(
            "EMF over electrical speed", over[0].value, over[0].uncertainty, over[0].degrees_of_freedom
        )
        self.findings["passes"] = [self._row(each, flux) for each, flux in zip(passes, over, strict=True)]
        misfit = Misfit.together([*(e.misfit for e in passes[0].emf), over[0].misfit])
        if len(passes) > 1:
            coefficient = self._coefficient(passes, over)
            if coefficient is not None:
                cold = 1.0 / (1.0 + coefficient * (passes[0].temperature - COLD))
        flux = gain * first * cold
        self.report(
            "flux_linkage",
            flux,
            section=self.section,
            estimator="fundamental of three phases with open terminals, over speed",
            winding=math.sqrt(3.0) * float(flux.x) if self.is_delta else None,
            misfit=misfit.of("flux_linkage"),
        )

    @step("M3/6", "The drag over speed, the dynamometer's own subtracted: the loss of bearings, air and iron together")
    def conclude_drag(self, cold: OpenPass, tare: Fit | None) -> None:
        """Report the loss at the highest speed and keep the drag's course."""
        unc, top = self.bench.uncertainties, max(cold.speeds)
        drag = fit_drag(cold.speeds, cold.drags(), [each.uncertainty for each in cold.torque])
        whole, u_whole = drag_at(drag, top)
        own, u_own = drag_at(tare, top) if tare is not None else (np.zeros(1), np.zeros(1))
        torque = unc.statistical(
            "drag with open terminals, fitted over speed", float(whole[0]), float(u_whole[0]), drag.degrees_of_freedom
        )
        if tare is not None:
            torque = torque - unc.statistical(
                "the dynamometer's own drag", float(own[0]), float(u_own[0]), tare.degrees_of_freedom
            )
        torque = torque * torque_gain(unc, cold.torque[0].torque_accuracy, float(whole[0])) + cold.zero.left(unc)
        self.findings["drag"] = {
            "speed": line(cold.speeds),
            "torque": line(cold.drags()),
            "terms": dict(zip(drag.names, line(drag.values), strict=True)),
            "tare": None if tare is None else dict(zip(tare.names, line(tare.values), strict=True)),
            "residual": line(drag.residuals),
        }
        self.notice(
            "open-circuit-loss",
            text(
                "{loss:.3g} W at {speed:.0f} rpm is the loss of bearings, air and iron together: open terminals "
                "do not separate them{tare}",
                loss=float(torque.x) * top,
                speed=top / _RPM,
                tare=""
                if tare is not None
                else text("; the dynamometer's own drag is in it, because no tare was measured"),
            ),
        )
        speed = unc.instrument("dynamometer, speed", top, cold.torque[-1].speed_accuracy)
        if tare is not None:
            self.report(
                "open_circuit_loss",
                torque * speed,
                section=self.section,
                estimator="constant, linear and quadratic drag fitted over speed, tare subtracted, times the speed",
                misfit=cold.zero.misfit(float(whole[0])).of("open_circuit_loss"),
            )

    @property
    def _channels(self) -> list[int]:
        return list(self.bench.oscilloscope.channels(ProbeKind.VOLTAGE))[:3]

    def _pass(self, given: float | None) -> OpenPass:
        bench, settings = self.bench, self.settings
        temperature = winding_temperature(self, given, settings.temperature_uncertainty)
        pairs = self.known_value("pole_pairs") or self.nameplate.pole_pairs
        before = read_zero(bench, settings.interval, settings.zero_rest)
        torque: list[HeldTorque] = []
        emf: list[Fundamentals] = []
        ranges = dict.fromkeys(self._channels, 4.0 * (self.nameplate.rated_voltage or 50.0))
        # Down from the fastest: what turns once is known well enough to guess the frequency of the slower ones.
        for speed in sorted(self._speeds, reverse=True):
            with bench.dynamometer.driving_speed(speed):
                frequency = (
                    (emf[-1].electrical_speed / torque[-1].speed if emf else float(pairs or 1)) * speed / math.tau
                )
                emf.append(fundamentals(bench, ranges, frequency, settings.periods))
                torque.append(held_torque(bench, settings, speed))
            ranges = dict(zip(ranges, emf[-1].ranges, strict=True))
            self._show(emf, torque)
            # Nobody has read the zero after it yet: only the EMF of it counts.
            self._left = OpenPass(tuple(reversed(emf)), tuple(reversed(torque)), ZeroLine(before, before), temperature)
        bench.dynamometer.stop()
        pole_pairs_of(emf[0].electrical_speed, torque[0].speed, self.known_value("pole_pairs"))
        zero = ZeroLine(before, read_zero(bench, settings.interval, settings.zero_rest))
        return OpenPass(tuple(reversed(emf)), tuple(reversed(torque)), zero, temperature)

    def _show(self, emf: Sequence[Fundamentals], torque: Sequence[HeldTorque]) -> None:
        speed = np.array([each.speed / _RPM for each in torque])
        upper = PlotCurve(text("readings"), speed, np.array([each.mean for each in emf]), CurveStyle.READING)
        lower = PlotCurve(text("readings"), speed, np.array([each.torque for each in torque]), CurveStyle.READING)
        self.bench.show(
            lambda: LivePlot(
                text("EMF and torque with open terminals"),
                Axes(text("Speed"), "rpm", text("Amplitude"), "V", (upper,), True, True),
                Axes(text("Speed"), "rpm", text("Torque"), "N·m", (lower,), True, True),
            )
        )

    def _over(self, taken: OpenPass) -> OverSpeeds:
        largest = max(accuracy.gain for each in taken.emf for accuracy in each.accuracies)
        return over_records(
            [each.electrical_speed / math.tau for each in taken.emf],
            [each.flux for each in taken.emf],
            gain_limit=largest,
        )

    def _coefficient(self, passes: Sequence[OpenPass], over: Sequence[OverSpeeds]) -> UncertainReal | None:
        """Report the coefficient (1/K, of the flux linkage at 25 °C); None where the temperatures are too near each other."""
        unc = self.bench.uncertainties
        # The channels' gains are the same in both and cancel.
        sizes = [
            unc.statistical(
                text("EMF at {temperature:.0f} °C", temperature=float(each.temperature.x)),
                flux.value,
                flux.uncertainty,
                flux.degrees_of_freedom,
            )
            for each, flux in zip(passes, over, strict=True)
        ]
        coefficient = coefficient_between(self, sizes, [each.temperature for each in passes], self.settings.magnet_lag)
        if coefficient is None:
            return None
        self.report(
            "flux_temperature_coefficient",
            coefficient,
            section=self.section,
            estimator="flux linkage at two temperatures of the winding",
            misfit=Misfit.together([each.misfit for each in over]).of("flux_linkage", "flux_temperature_coefficient"),
        )
        return coefficient

    def _warming_speed(self) -> tuple[float, float]:
        """Return the speed (rad/s) at which the short-circuit current is the rated one, or the highest, and the current (A) expected."""
        resistance, ld = self.known_value("stator_resistance"), self.known_value("d_axis_inductance")
        if resistance is None or ld is None:
            raise ProcedureError(
                text(
                    "the current that would warm the motor cannot be predicted: run stator-resistance and an "
                    "inductance first, or set warming_time=0"
                )
            )
        first = self._cold.emf[0]
        flux, pairs = first.flux.value, first.electrical_speed / self._cold.torque[0].speed
        lq = self.known_value("q_axis_inductance") or ld
        top = max(self._speeds)
        speeds = np.linspace(0.01 * top, top, 400)
        levels = current(speeds * pairs, resistance, ld, lq, flux)
        beyond = np.flatnonzero(levels > self.nameplate.rated_current)
        place = int(beyond[0]) - 1 if beyond.size else levels.size - 1
        if place < 0:
            raise ProcedureError(
                text(
                    "the short-circuit current is above the rated current already at {speed:.0f} rpm",
                    speed=speeds[0] / _RPM,
                )
            )
        return float(speeds[place]), float(levels[place])

    def _row(self, taken: OpenPass, over: OverSpeeds) -> dict[str, Any]:
        return {
            "winding_temperature": float(taken.temperature.x),
            "speed": line(taken.speeds),
            "electrical_speed": line([each.electrical_speed for each in taken.emf]),
            "amplitude": line([each.mean for each in taken.emf]),
            "amplitude_uncertainty": line([each.uncertainty for each in taken.emf]),
            # Without its zero once more a torque is none.
            "torque": line(taken.drags() if taken.zero.closed else []),
            "flux_linkage": over.value,
            "flux_uncertainty": over.uncertainty,
            "speed_trend": trend_rows(over),
        }
