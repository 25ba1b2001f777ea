"""Flux linkages over both currents at standstill, from strokes of current: no dynamometer."""

import math
from typing import ClassVar

from pydantic import Field

from drivers.interfaces import InverterAbility, ProbeKind
from drivers.interfaces.errors import LimitError, ReportedError
from drivers.interfaces.text import Text, text
from procedures.core.actions import INVERTER, ConnectProbes, LockRotor, ReleaseRotor, phases_on
from procedures.core.bench import ProcedureError, Role
from procedures.core.demand import Demand, Demands
from procedures.core.events import StrokesKept
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.flux.plan import grid_locations
from procedures.estimation.flux.standstill import StandstillGains, fit_standstill
from procedures.estimation.winding.resistance import COPPER, COPPER_REFERENCE
from procedures.maps.standstill_run import StrokePace, TakenStrokes, take_strokes
from procedures.techniques.maps.current_check import known_resistance, tell_current
from procedures.techniques.maps.plots import stroke_plot
from procedures.techniques.maps.results import (
    MAP_FILE,
    MapBudget,
    conserving_of,
    grid_of,
    report_mtpa,
    saturation_of,
    table_of,
)
from procedures.techniques.maps.stroke_records import StrokeRecorder
from procedures.techniques.shaft.pole_pair_count import known_pole_pairs
from procedures.techniques.temperature.settings import CopperCoefficient, ReferenceTemperature, TemperatureUncertainty
from procedures.verification.settings import WiringSettings

#: Largest phase voltage against a star point, as a share of the bus voltage.
_STAR = 2.0 / 3.0
#: A flux linkage that the motor file expects is within this share, as a standard deviation.
_EXPECTED = 0.03
_BUDGET = MapBudget(
    text("scatter of the map's strokes"),
    {
        "voltage": text("oscilloscope, voltage: gain of the strokes' records"),
        "current": text("inverter, current: gain of the strokes' samples"),
        "magnet": text("flux linkage of the magnets, which no stroke shows"),
        "angle": text("inverter: zero of the rotor's angle"),
        "course": text("inverter: course of the current within a stroke"),
    },
    section="M2",
    estimator="strokes at standstill, a smooth surface through them",
)


class StandstillFluxMapSettings(WiringSettings):
    """Settings of the map at standstill."""

    locations: int = Field(default=32, ge=12, le=200, description="currents of the map, at most, counted at i_q ≥ 0")
    current_share: float = Field(
        default=1.0, gt=0.0, le=20.0, description="largest current of the map, share of the rated current"
    )
    strokes: int = Field(default=3, ge=3, le=21, description="strokes at each current, an odd number")
    shortest: float = Field(
        default=0.003,
        ge=0.001,
        le=0.1,
        description="shortest stroke, s; they are made as long as the currents take to settle",
    )
    longest: float = Field(default=0.05, ge=0.001, le=0.5, description="longest stroke, s")
    quiet: float = Field(
        default=5.0, gt=0.0, le=20.0, description="largest swing of the rotor between strokes, electrical degrees"
    )
    rest: float = Field(default=0.2, ge=0.0, le=60.0, description="rest after the strokes at each current, s")
    lock: bool = Field(default=False, description="lock the rotor instead of leaving it free")
    winding_temperature: float | None = Field(
        default=None,
        ge=-60.0,
        le=250.0,
        description="winding temperature, °C; asked for when not given, where the winding's resistance was measured before",
    )
    temperature_uncertainty: TemperatureUncertainty = 2.0
    coefficient: CopperCoefficient = COPPER
    coefficient_reference: ReferenceTemperature = COPPER_REFERENCE


class StandstillFluxMap(Procedure[StandstillFluxMapSettings]):
    """Flux linkages ψ_d, ψ_q over i_d, i_q at standstill: the voltage of strokes between two currents, integrated.

    The first stroke and the last have half the impulse of the others, so that a free rotor stands where it was when they end.
    """

    name: ClassVar[str] = "flux-map-standstill"
    title: ClassVar[str] = "Flux map at standstill"
    section: ClassVar[str] = "M2"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.INVERTER, Role.OSCILLOSCOPE})
    gives: ClassVar[tuple[str, ...]] = ("mtpa_angle", "mtpa_torque")
    needs: ClassVar[Demands] = {
        Role.INVERTER: Demand(
            automatic=True, abilities=frozenset({InverterAbility.DQ_CURRENT, InverterAbility.DQ_STROKES})
        ),
        Role.OSCILLOSCOPE: Demand(waveforms=True, probes={ProbeKind.VOLTAGE: 3}),
    }
    at_load: ClassVar[bool] = True

    def measure(self) -> None:
        """Connect, choose the currents, take strokes at each, and make the map."""
        self.prepare()
        locations = self.choose()
        taken = self.take(locations)
        self.conclude(taken)

    @step("M2/1", "Connect the inverter and three voltage probes; nothing turns the shaft", by_hand=True)
    def prepare(self) -> None:
        """Know what no stroke shows before anything is connected."""
        self._pairs = known_pole_pairs(self)
        known, expected = self.known.get("flux_linkage"), self.nameplate.expected.get("flux_linkage")
        if known is None and not expected:
            raise ProcedureError(
                self.why_unknown(
                    "flux_linkage",
                    text(
                        "at standstill the flux linkage of the magnets cannot be measured: run back-emf-constant "
                        "before, or give flux_linkage in the motor file's [expected]"
                    ),
                )
            )
        self._magnet = float(expected or 0.0) if known is None else known.value
        self._u_magnet = _EXPECTED * self._magnet if known is None else known.standard_uncertainty
        self._winding = known_resistance(self)
        channels = self.bench.oscilloscope.channels(ProbeKind.VOLTAGE)[:3]
        self._channels = tuple(channels)
        holding = LockRotor() if self.settings.lock else ReleaseRotor()
        self.bench.perform(INVERTER, ConnectProbes(phases_on(self._channels)), holding)

    @step("M2/2", "Choose up to {locations} currents within the limits of motor and inverter, the smallest first")
    def choose(self) -> list[complex]:
        """Return the currents (A, d + j·q) at which strokes are taken, those along the d axis once for both signs."""
        settings = self.settings
        largest = min(
            settings.current_share * self.nameplate.rated_current,
            self.nameplate.current_bound,
            self.bench.inverter.maximum_current,
        )
        points = grid_locations(largest, settings.locations)
        chosen = [complex(d, q) for d, q in points.tolist() if q > 0.0 or d > 0.0]
        self.findings |= {"locations": len(points), "largest_current": largest}
        return sorted(chosen, key=abs)

    @step(
        "M2/3",
        "At each current: strokes to its mirror image and back, voltages recorded, the rotor's angle and currents read",
    )
    def take(self, locations: list[complex]) -> TakenStrokes:
        """Return the strokes; what a light rotor does not carry is left out and said."""
        settings = self.settings
        pace = StrokePace(
            settings.strokes + 1 - settings.strokes % 2,
            settings.shortest,
            settings.longest,
            math.radians(settings.quiet),
            settings.rest,
            self.nameplate.rated_current,
        )
        self._taken = taken = TakenStrokes()
        try:
            with self.bench.inverter.driving_dq_current(0.0, 0.0):
                idle = self.bench.inverter.measure_dq()
                self._current_gain = idle.current_accuracy.gain
                bus = idle.bus_voltage if idle.bus_voltage > 0.0 else self.nameplate.voltage_bound
                if not bus or not math.isfinite(bus):
                    raise ProcedureError(text("the bus voltage is not known: give rated_voltage in the motor file"))
                self._recorder = StrokeRecorder(self.bench, self._channels, _STAR * bus, self.settings.lock)
                take_strokes(
                    self.bench,
                    self._recorder,
                    locations,
                    pace,
                    lambda so_far, left: self.bench.show(lambda: stroke_plot(locations, so_far.trains, left)),
                    self._keep,
                    taken,
                )
        except (LimitError, ReportedError) as stopped:
            if not taken.trains:
                raise
            # Everything is off by now; what was taken before stays true.
            taken.ended = stopped.text
        self._tell_left_out(taken)
        return taken

    def conclude_early(self, why: Text) -> bool:
        """Make the map of the strokes that were taken before an error or an abort."""
        taken: TakenStrokes | None = getattr(self, "_taken", None)
        if taken is None or not taken.trains:
            return False
        taken.ended = why
        self._tell_left_out(taken)
        self.conclude(taken)
        return True

    @step("M2/4", "Flux linkages at the currents, with their uncertainty; largest torque per ampere")
    def conclude(self, taken: TakenStrokes) -> None:
        """Report the map."""
        gains = StandstillGains(taken.voltage_gain, self._current_gain, self._u_magnet)
        try:
            fit = fit_standstill(taken.trains, self._magnet, gains, self._winding)
        except EstimationError as error:
            self.notice("no-map", text("there is no map: {why}", why=error))
            return
        flux_map = fit.map
        tell_current(self, fit.beside_known, self._current_gain)
        self.findings |= {
            "tables": {MAP_FILE: table_of(flux_map)},
            "full_scale": flux_map.full_scale,
            "symmetric": True,
            "symmetry_tested": False,
            "resistance": fit.resistance,
            "angle": {"value": fit.angle, "standard_uncertainty": fit.angle_uncertainty},
            "phases_exchanged": fit.mirrored,
            "residual": fit.residual,
            "asymmetry": fit.asymmetry,
            "swing": taken.swing,
            "stroke": taken.duration,
            "pole_pairs": self._pairs,
            "grid": grid_of(flux_map),
            "conserving": conserving_of(flux_map),
            **saturation_of(flux_map),
        }
        report_mtpa(self, _BUDGET, flux_map, self._pairs)

    def _keep(self) -> None:
        """Put beside a train's record what the map takes from the bench besides: of a run that was killed, only the journal tells it."""
        self.bench.recorder.record(
            StrokesKept(
                channel_gains=self._recorder.channel_gains,
                voltage_gain=self._recorder.accuracy,
                current_gain=self._current_gain,
                flux_linkage=self._magnet,
                u_flux_linkage=self._u_magnet,
                locked=self.settings.lock,
                resistance=self._winding.value if self._winding else 0.0,
                u_resistance=self._winding.standard_uncertainty if self._winding else 0.0,
            )
        )

    def _tell_left_out(self, taken: TakenStrokes) -> None:
        if taken.ended is not None:
            self.notice(
                "ended-early",
                text(
                    "{taken} trains of strokes were taken: {why}. The map is of these",
                    taken=len(taken.trains),
                    why=taken.ended,
                ),
            )
        if taken.too_light:
            self.notice(
                "rotor-moves",
                text(
                    "{count} of the currents were left out: their torque swings the rotor by more than {quiet:g} electrical degrees "
                    "within a stroke, the smallest of them {current:.3g} A. Couple a mass, lock the rotor (lock), or raise the bandwidth "
                    "of the drive's current loop",
                    count=len(taken.too_light),
                    quiet=self.settings.quiet,
                    current=min(map(abs, taken.too_light)),
                ),
            )
        if taken.too_slow:
            self.notice(
                "strokes-too-short",
                text(
                    "{count} of the currents were left out: they do not settle within a stroke of {longest:g} s; raise longest, or the bus "
                    "voltage",
                    count=len(taken.too_slow),
                    longest=self.settings.longest,
                ),
            )
