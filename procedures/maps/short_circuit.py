"""Short circuit over speed: resistance from currents and from torque, the d axis's chord, the braking torque's peak."""

import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from drivers.interfaces import ProbeKind
from drivers.interfaces.text import Text, text
from procedures.core.actions import ALL_OPEN, CoupleDynamometer, CurrentProbe, ReleaseRotor, Terminal, phases_on
from procedures.core.bench import Role
from procedures.core.demand import Demand, Demands
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.winding.resistance import COPPER, COPPER_REFERENCE
from procedures.estimation.winding.short_circuit import current
from procedures.maps.settings import SpeedsSettings
from procedures.maps.short_points import OpenBefore, ShortSweep, fit_sweep
from procedures.maps.short_results import ShortResults
from procedures.maps.short_run import ShortRun
from procedures.maps.turned_points import fundamentals, geometric_speeds, held_torque, line, pole_pairs_of
from procedures.techniques.ended_early import tell_ended
from procedures.techniques.shaft.driven_shaft import driving_speed_rad
from procedures.techniques.shaft.torque_zero import ZeroLine, read_zero
from procedures.techniques.temperature.correction import winding_temperature
from procedures.techniques.temperature.settings import (
    CopperCoefficient,
    MagnetCoefficient,
    MagnetCoefficientUncertainty,
    ReferenceTemperature,
    TemperatureUncertainty,
    WindingTemperature,
)

_RPM = math.pi / 30.0
#: Speeds over R/√(L_d·L_q), where both are known: the rise, the peak of the torque, and well up the asymptote.
_COURSE = (0.15, 0.3, 0.55, 0.8, 1.1, 1.6, 2.4, 4.0, 7.0, 12.0)
#: The slowest speed that a dynamometer holds evenly, share of the highest, and in rad/s.
_SLOWEST, _STEADY = 0.004, 20.0 * _RPM
#: Of the largest current this share is planned for, by R and L as they are known; so few speeds are the fewest, over such a span.
_FORESEEN, _FEWEST, _SPAN = 0.85, 6, 15.0


class ShortCircuitSettings(SpeedsSettings):
    """Settings of the short circuit over speed."""

    lowest: float = Field(
        default=0.02, gt=0.0, le=1.0, description="lowest speed if R and L are not known, share of the rated speed"
    )
    highest: float = Field(default=1.0, gt=0.0, le=2.0, description="highest speed, share of the rated speed")
    speeds: int = Field(
        default=9, ge=5, le=100, description="speeds if R and L are not known, evenly spaced by their ratio"
    )
    current_share: float = Field(
        default=1.0, gt=0.0, le=1.0, description="largest current to be reached, share of the motor's largest"
    )
    phases: bool = Field(
        default=True, description="at the slowest and the fastest speed, move the current probe to B and C too"
    )
    unbalance: float = Field(
        default=0.01,
        ge=0.0,
        le=0.2,
        description="half-width of a phase's deviation in current where the probe is not moved, relative",
    )
    warming_time: float = Field(
        default=0.0,
        ge=0.0,
        le=7200.0,
        description="time for which the short-circuit current warms the motor for a second temperature, s; 0 for one temperature",
    )
    winding_temperature: WindingTemperature = None
    temperature_uncertainty: TemperatureUncertainty = 2.0
    coefficient: CopperCoefficient = COPPER
    coefficient_reference: ReferenceTemperature = COPPER_REFERENCE
    magnet_coefficient: MagnetCoefficient = -0.001
    magnet_coefficient_uncertainty: MagnetCoefficientUncertainty = None


class ShortCircuit(Procedure[ShortCircuitSettings]):
    """Currents and braking torque over speed, all three terminals joined; the friction is that of the open terminals at the same speeds."""

    name: ClassVar[str] = "short-circuit"
    title: ClassVar[str] = "Short circuit over speed"
    section: ClassVar[str] = "M4"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DYNAMOMETER, Role.OSCILLOSCOPE})
    gives: ClassVar[tuple[str, ...]] = (
        "d_axis_chord_inductance",
        "short_circuit_current",
        "short_circuit_resistance",
        "peak_braking_torque",
        "peak_braking_speed",
        "flux_temperature_coefficient",
    )
    needs: ClassVar[Demands] = {
        Role.DYNAMOMETER: Demand(automatic=True),
        Role.OSCILLOSCOPE: Demand(waveforms=True, probes={ProbeKind.VOLTAGE: 3, ProbeKind.CURRENT: 1}),
    }
    at_load: ClassVar[bool] = True
    _before: OpenBefore | None = None
    _sweeps: tuple[ShortSweep, ...] = ()
    _turning: ShortRun | None = None

    def measure(self) -> None:
        """Turn with open terminals, join them, turn again, and conclude."""
        self._before = before = self.turn_open()
        self.join(before)
        self._sweeps = (self.sweep(before),)
        if (warm := self.sweep_warm(before, self._sweeps[0])) is not None:
            self._sweeps = (*self._sweeps, warm)
        self.conclude(before, self._sweeps)

    def conclude_early(self, why: Text) -> bool:
        """Report the results of complete sweeps; the readings of an incomplete one are kept, without final temperature and zero."""
        if self._before is not None and self._sweeps:
            tell_ended(self, why, text("figures are of the {count} whole sweeps", count=len(self._sweeps)))
            self.conclude(self._before, self._sweeps)
            return True
        taken = self._turning.points if self._turning is not None else ()
        if not taken:
            return False
        tell_ended(
            self,
            why,
            text(
                "{count} currents of the short circuit are kept among the findings, but give no figure: the "
                "winding's temperature at the end, and the torque's zero, were not read again",
                count=len(taken),
            ),
        )
        self.findings["left"] = {
            "electrical_speed": line([each.current.electrical_speed for each in taken]),
            "current": line([each.current.mean for each in taken]),
            "current_uncertainty": line([each.current.uncertainty for each in taken]),
            "torque_with_zero": line([each.torque.torque for each in taken]),
        }
        return True

    @step("M4/1", "Terminals open: the EMF at the highest speed, and at each speed the drag", by_hand=True)
    def turn_open(self) -> OpenBefore:
        """Return EMF and drag, from which the short circuit's own torque follows."""
        bench, settings = self.bench, self.settings
        bench.perform(ALL_OPEN, ReleaseRotor(), CoupleDynamometer())
        self.wiring.shaft.connect_probes(phases_on(self._voltages), report_order=False)
        known = self.known_value("pole_pairs") or self.nameplate.pole_pairs
        top = driving_speed_rad(bench, self.nameplate, settings.highest)
        zero = read_zero(bench, settings.interval, settings.zero_rest)
        ranges = dict.fromkeys(self._voltages, 4.0 * (self.nameplate.rated_voltage or 50.0))
        with bench.dynamometer.driving_speed(top):
            emf = fundamentals(bench, ranges, float(known or 1) * top / math.tau, settings.periods)
            drags = [held_torque(bench, settings, top)]
        pairs = pole_pairs_of(emf.electrical_speed, drags[0].speed, self.known_value("pole_pairs"))
        speeds = self._planned(pairs, top, emf.flux.value)
        for speed in reversed([each for each in speeds if each < 0.999 * top]):
            with bench.dynamometer.driving_speed(speed):
                drags.append(held_torque(bench, settings, speed))
        bench.dynamometer.stop()
        zeros = ZeroLine(zero, read_zero(bench, settings.interval, settings.zero_rest))
        temperature = winding_temperature(self, settings.winding_temperature, settings.temperature_uncertainty)
        return OpenBefore(emf, tuple(reversed(drags)), zeros, pairs, tuple(speeds), temperature)

    @step(
        "M4/2",
        "Join all three terminals by the link; the slowly turned motor then shows a current and no voltage",
        by_hand=True,
    )
    def join(self, before: OpenBefore) -> None:
        """Leave the terminals joined, with voltage probes on them and the current probe round A."""
        self.wiring.short.joined(
            phases_on(self._voltages),
            self._probe(Terminal.A),
            before.pole_pairs,
            before.emf.flux.value,
            self._bound,
            before.speeds[1],
        )

    @step(
        "M4/3",
        "At each speed, up to the largest current: the current's fundamental and the torque, rests between",
        by_hand=True,
    )
    def sweep(self, before: OpenBefore) -> ShortSweep:
        """Return currents and torques, the slowest speed's once more at the end."""
        self.bench.thermometer.warmed()
        return self._run(before).sweep(self._phases() if self.settings.phases else ())

    @step(
        "M4/4",
        "Where a second temperature is asked for: continue at about the rated current for a while, and measure "
        "all speeds again",
        by_hand=True,
    )
    def sweep_warm(self, before: OpenBefore, cold: ShortSweep) -> ShortSweep | None:
        """Return the same for the warm motor, None where one temperature will do."""
        if not self.settings.warming_time:
            return None
        run = self._run(before)
        run.warm(cold, self.settings.warming_time)
        temperature = winding_temperature(self, None, self.settings.temperature_uncertainty)
        return run.sweep((), temperature)

    @step("M4/5", "Resistance, inductance and the torque's peak from currents and torques, compared with each other")
    def conclude(self, before: OpenBefore, sweeps: Sequence[ShortSweep]) -> None:
        """Report the results of the sweeps, and their contradictions."""
        saliency = None
        ld, lq = self.known.get("d_axis_inductance"), self.known.get("q_axis_inductance")
        if ld is not None and lq is not None:
            saliency = lq.value / ld.value
        fitted = [fit_sweep(before, sweep, saliency, self.settings.unbalance) for sweep in sweeps]
        ShortResults(self, before, sweeps, fitted).report()

    def _run(self, before: OpenBefore) -> ShortRun:
        self._turning = ShortRun(self, before, self._probe(Terminal.A), self._bound)
        return self._turning

    def _planned(self, pairs: int, top: float, flux: float) -> list[float]:
        """Return the mechanical speeds (rad/s), the slowest first: by R and L where they are known, else by their ratio."""
        resistance, ld = self.known_value("stator_resistance"), self.known_value("d_axis_inductance")
        lq = self.known_value("q_axis_inductance") or ld
        if resistance is None or ld is None or lq is None:
            return geometric_speeds(
                self.bench, self.nameplate, self.settings.lowest, self.settings.highest, self.settings.speeds
            )
        # A drive commands whole revolutions a minute or so: slower than this it holds another speed than the one asked for.
        slowest = max(_SLOWEST * top, _STEADY)
        omega = np.linspace(slowest, top, 2000)
        foreseen = current(pairs * omega, resistance, ld, lq, flux)
        beyond = np.flatnonzero(foreseen > _FORESEEN * self._bound)
        highest = float(omega[max(int(beyond[0]) - 1, 0)]) if beyond.size else top
        corner = resistance / math.sqrt(ld * lq) / pairs
        speeds = [share * corner for share in _COURSE if slowest <= share * corner < 0.95 * highest]
        if len(speeds) < _FEWEST:
            # The bend lies beyond what current or speed allow: the rise below it tells R all the same.
            speeds = np.geomspace(max(slowest, highest / _SPAN), highest, _FEWEST + 1)[:-1].tolist()
        return [*speeds, highest]

    @property
    def _bound(self) -> float:
        """The largest current (A, peak) that is gone up to."""
        return self.settings.current_share * self.nameplate.current_bound

    @property
    def _voltages(self) -> list[int]:
        return list(self.bench.oscilloscope.channels(ProbeKind.VOLTAGE))[:3]

    def _probe(self, terminal: Terminal) -> CurrentProbe:
        return CurrentProbe(self.bench.oscilloscope.channels(ProbeKind.CURRENT)[0], terminal)

    def _phases(self) -> tuple[CurrentProbe, ...]:
        return self._probe(Terminal.B), self._probe(Terminal.C)
