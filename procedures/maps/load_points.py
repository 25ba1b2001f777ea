"""Efficiency on a grid of torque and speed: electrical power at the terminals against shaft power, and what the loss is made of."""

import math
from typing import ClassVar

import numpy as np
from GTC.lib import UncertainReal
from pydantic import Field

from drivers.interfaces import ProbeKind
from drivers.interfaces.text import Text, text
from procedures.core.actions import (
    ALL_OPEN,
    INVERTER,
    ConnectProbes,
    CoupleDynamometer,
    CurrentProbe,
    ReleaseRotor,
    Terminal,
    UncoupleDynamometer,
    phases_on,
)
from procedures.core.bench import Role
from procedures.core.demand import Demand, Demands, Measurand
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.fitting.fit import Fit
from procedures.estimation.mechanics.drag import fit_drag
from procedures.estimation.winding.resistance import COPPER, COPPER_REFERENCE
from procedures.maps.load_results import LoadGrid, LoadResults
from procedures.maps.load_run import DrivenPoint, LoadRun
from procedures.maps.settings import SpeedsSettings
from procedures.maps.turned_points import held_torque, line
from procedures.techniques.ended_early import tell_ended
from procedures.techniques.shaft.driven_shaft import driving_speed_rad
from procedures.techniques.shaft.torque_zero import OpenZeroLine, ZeroLine, read_zero
from procedures.techniques.temperature.correction import winding_temperature
from procedures.techniques.temperature.settings import (
    CopperCoefficient,
    ReferenceTemperature,
    TemperatureUncertainty,
    WindingTemperature,
)
from procedures.verification.settings import FedWiringSettings

#: Of the dynamometer's largest torque this share is used.
_TORQUE_SHARE = 0.8


class EfficiencyAtLoadSettings(SpeedsSettings, FedWiringSettings):
    """Settings of the load points."""

    speed_shares: tuple[float, ...] = Field(
        default=(0.25, 0.5, 0.75, 1.0), min_length=1, description="speeds, shares of the rated speed"
    )
    current_shares: tuple[float, ...] = Field(
        default=(0.25, 0.5, 0.75, 1.0),
        min_length=1,
        description="q-axis currents, shares of the rated current; negative ones brake",
    )
    tare: bool = Field(
        default=True, description="measure the dynamometer's own drag; false where the torque is read at the coupling"
    )
    phases: bool = Field(
        default=True,
        description="at the largest power, move the current probe to B and C too, so that all three powers are known",
    )
    unbalance: float = Field(
        default=0.02,
        ge=0.0,
        le=0.2,
        description="half-width of a phase's deviation in power where the probe is not moved, relative",
    )
    skew: float = Field(
        default=2e-7,
        ge=0.0,
        le=1e-3,
        description="half-width of the delay between voltage and current channels, probes included, s",
    )
    winding_temperature: WindingTemperature = None
    hot_temperature: float | None = Field(
        default=None,
        ge=-60.0,
        le=250.0,
        description="winding temperature right after the last point, °C; asked for when not given",
    )
    temperature_uncertainty: TemperatureUncertainty = 2.0
    coefficient: CopperCoefficient = COPPER
    coefficient_reference: ReferenceTemperature = COPPER_REFERENCE


class EfficiencyAtLoad(Procedure[EfficiencyAtLoadSettings]):
    """Torque, speed, currents, electrical power and efficiency on a grid: the inverter gives q current, the dynamometer holds the speed."""

    name: ClassVar[str] = "load-points"
    title: ClassVar[str] = "Efficiency at load points"
    section: ClassVar[str] = "M5"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DYNAMOMETER, Role.INVERTER, Role.OSCILLOSCOPE})
    gives: ClassVar[tuple[str, ...]] = ("efficiency", "total_loss")
    needs: ClassVar[Demands] = {
        Role.DYNAMOMETER: Demand(automatic=True),
        Role.INVERTER: Demand((Measurand.CURRENT,), automatic=True),
        Role.OSCILLOSCOPE: Demand(waveforms=True, probes={ProbeKind.VOLTAGE: 3, ProbeKind.CURRENT: 1}),
    }
    at_load: ClassVar[bool] = True
    _tare: Fit | None = None
    _turned: tuple[Fit, ZeroLine, UncertainReal] | None = None
    _run: LoadRun | None = None
    _ratio: tuple[float, float] | None = None

    def measure(self) -> None:
        """Take the tare, turn without a current, load, and conclude."""
        shares = sorted(set(self.settings.speed_shares))
        self._speeds = [driving_speed_rad(self.bench, self.nameplate, share) for share in shares]
        self._tare = self.tare()
        self.connect()
        self._turned = drags, zero, cold = self.turn()
        points, ratio = self.load()
        hot = self.temperature()
        after = read_zero(self.bench, self.settings.interval, self.settings.zero_rest)
        self.conclude(LoadGrid(tuple(points), ratio, drags, self._tare, ZeroLine(zero.before, after), cold, hot))

    def conclude_early(self, why: Text) -> bool:
        """Report the points that were read; phases, the winding's warmth and the torque's zero are as open as they were left."""
        points = self._run.points if self._run is not None else ()
        if self._turned is None or not points:
            return False
        tell_ended(
            self,
            why,
            text(
                "{count} load points were read; the torque's zero was not read again, and without the winding's "
                "last temperature the loss is not separated into parts",
                count=len(points),
            ),
        )
        drags, zero, cold = self._turned
        open_line = OpenZeroLine(zero.before, zero.after, end=points[-1].torque.time)
        ratio = self._ratio or (1.0, self.settings.unbalance)
        self.conclude(LoadGrid(tuple(points), ratio, drags, self._tare, open_line, cold, None))
        return True

    @step("M5/1", "The dynamometer alone at each speed: its own drag", by_hand=True)
    def tare(self) -> Fit | None:
        """Return the drag of the dynamometer alone over speed, None where the torque is read at the coupling."""
        if not self.settings.tare:
            return None
        self.bench.perform(ALL_OPEN, UncoupleDynamometer())
        torques, _ = self._without_current()
        self.findings["tare_torques"] = line(torques.values)
        return torques

    @step(
        "M5/2",
        "Couple the motor and connect it to the inverter; voltage probes on the phases, the current probe round A",
        by_hand=True,
    )
    def connect(self) -> None:
        """Leave the motor ready to be driven from both sides, the order of its phases verified."""
        self.bench.perform(ALL_OPEN, ReleaseRotor(), CoupleDynamometer())
        probes = phases_on(self._voltages)
        self.wiring.shaft.connect_probes(probes, report_order=False)
        self.bench.perform(INVERTER, ConnectProbes((*probes, self._probe(Terminal.A))))
        self.wiring.inverter.direction(INVERTER)

    @step("M5/3", "At each speed, the inverter off: the drag of the motor without a current")
    def turn(self) -> tuple[Fit, ZeroLine, UncertainReal]:
        """Return the drag over speed, the torque's zero before and after it, and the winding's temperature."""
        temperature = winding_temperature(
            self, self.settings.winding_temperature, self.settings.temperature_uncertainty
        )
        drags, zero = self._without_current()
        return drags, zero, temperature

    @step("M5/4", "At each speed and current: torque, speed, and the electrical power at the terminals")
    def load(self) -> tuple[list[DrivenPoint], tuple[float, float]]:
        """Return the points, and all phases' power over three times that of A with what it is not known by."""
        self.bench.thermometer.warmed()
        self._run = run = LoadRun(self, self._voltages, self._probe)
        points = run.grid(self._speeds, self._levels())
        self._ratio = run.ratio_of_phases(points)
        return points, self._ratio

    @step("M5/5", "Right after the last point: the winding's temperature", by_hand=True)
    def temperature(self) -> UncertainReal:
        """Return the winding's temperature (°C) at the end."""
        return winding_temperature(self, self.settings.hot_temperature, self.settings.temperature_uncertainty)

    @step("M5/6", "Efficiency and loss at each point, and its parts: copper, loss without a current, the rest")
    def conclude(self, grid: LoadGrid) -> None:
        """Report the largest efficiency and the loss at the largest power; keep all points."""
        LoadResults(self, grid).report()

    def _without_current(self) -> tuple[Fit, ZeroLine]:
        """Return the drag over speed with the transducer's zero off, and that zero."""
        bench, settings = self.bench, self.settings
        before = read_zero(bench, settings.interval, settings.zero_rest)
        taken = []
        for speed in self._speeds:
            with bench.dynamometer.driving_speed(speed):
                taken.append(held_torque(bench, settings, speed))
        bench.dynamometer.stop()
        zero = ZeroLine(before, read_zero(bench, settings.interval, settings.zero_rest))
        torques = np.array([each.torque for each in taken]) - zero.at(np.array([each.time for each in taken]))
        fit = fit_drag([each.speed for each in taken], torques, [each.uncertainty for each in taken])
        return fit, zero

    def _levels(self) -> list[float]:
        """Return the q-axis currents (A, peak), the smallest first, as far as inverter, motor and dynamometer take them."""
        bound = min(self.bench.inverter.maximum_current, self.nameplate.current_bound)
        flux, pairs = self.known_value("flux_linkage"), self.known_value("pole_pairs") or self.nameplate.pole_pairs
        if flux is not None and pairs is not None:
            bound = min(bound, _TORQUE_SHARE * self.bench.dynamometer.maximum_torque / (1.5 * pairs * flux))
        levels = {
            math.copysign(min(abs(share) * self.nameplate.rated_current, bound), share)
            for share in self.settings.current_shares
            if share
        }
        if max(abs(share) for share in self.settings.current_shares) * self.nameplate.rated_current > bound:
            self.notice(
                "load-bound",
                text(
                    "the largest current is {bound:.3g} A, by the motor's, the inverter's or the dynamometer's limit",
                    bound=bound,
                ),
            )
        return sorted(levels, key=abs)

    @property
    def _voltages(self) -> list[int]:
        return list(self.bench.oscilloscope.channels(ProbeKind.VOLTAGE))[:3]

    def _probe(self, terminal: Terminal) -> CurrentProbe:
        return CurrentProbe(self.bench.oscilloscope.channels(ProbeKind.CURRENT)[0], terminal)
