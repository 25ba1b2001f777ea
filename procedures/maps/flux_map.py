"""Flux linkages over both currents, from voltages at constant speed."""

import math
from collections.abc import Callable, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import InverterAbility
from drivers.interfaces.text import Text, text
from procedures.core.actions import INVERTER, CoupleDynamometer, ReleaseRotor
from procedures.core.bench import ProcedureError, Role
from procedures.core.curves import curve
from procedures.core.demand import SHAFT, Demand, Demands
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.flux.estimator import FluxMapEstimate
from procedures.estimation.flux.flux_map import MeasuredFluxMap
from procedures.estimation.flux.mtpa_locations import about_mtpa, held_back
from procedures.estimation.flux.plan import (
    PlannedReading,
    further_readings,
    grid_locations,
    other_sides,
    reading_order,
    remaining,
    within_voltage,
)
from procedures.estimation.flux.session_ties import BrokenTie
from procedures.maps.flux_map_settings import FluxMapSettings
from procedures.techniques.maps.earlier import earlier_readings
from procedures.techniques.maps.ended import (
    LEFT_OUT,
    READ_AGAIN,
    broken_words,
    session_row,
    tell_left_out,
    unheld_words,
)
from procedures.techniques.maps.estimates import joined
from procedures.techniques.maps.plots import map_plot
from procedures.techniques.maps.readings import MapReadings, Pace, read_points
from procedures.techniques.maps.results import (
    MAP_FILE,
    MapBudget,
    capability_of,
    conserving_of,
    grid_of,
    report_figure,
    report_mtpa,
    saturation_of,
    table_of,
    tell_resistance,
)
from procedures.techniques.maps.shaft_torque import TORQUE_DIFFERS, shaft_torque
from procedures.techniques.shaft.driven_shaft import driving_speed_rad
from procedures.techniques.shaft.pole_pair_count import known_pole_pairs

#: The order of the readings is drawn once for all: the same plan is the same order.
_ORDER = 20
#: Share of the bus voltage's largest phase voltage that a current may take.
_MODULATED = 0.95
_BUDGET = MapBudget(
    text("scatter of the map's readings"),
    {
        "voltage": text("inverter, voltage: gain of the map's readings"),
        "current": text("inverter, current: gain of the map's readings"),
        "speed": text("speed: gain of the map's readings"),
        "delay": text("inverter: delay between voltage and current"),
    },
    section="M1",
    estimator="largest torque on the smooth surface through the map's points",
)


class ConstantSpeedFluxMap(Procedure[FluxMapSettings]):
    """Flux linkages ψ_d, ψ_q over i_d, i_q: the voltages of regulated currents while the dynamometer holds the speed.

    Currents are read at both signs of i_q and of the speed, so that resistance, switches, dead time, iron and the angle's zero fall out.
    """

    name: ClassVar[str] = "flux-map"
    title: ClassVar[str] = "Flux map at constant speed"
    section: ClassVar[str] = "M1"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DYNAMOMETER, Role.INVERTER})
    gives: ClassVar[tuple[str, ...]] = ("map_flux_linkage", "mtpa_angle", "mtpa_torque")
    needs: ClassVar[Demands] = {
        Role.DYNAMOMETER: SHAFT,
        Role.INVERTER: Demand(
            automatic=True, abilities=frozenset({InverterAbility.DQ_CURRENT, InverterAbility.VOLTAGES})
        ),
    }
    at_load: ClassVar[bool] = True
    goes_on: ClassVar[bool] = True
    _estimated: tuple[int, MapReadings, BrokenTie | None, FluxMapEstimate] | None = None
    _taken: MapReadings | None = None

    def measure(self) -> None:
        """Connect, choose the currents, read them, and make the map."""
        self.prepare()
        plan = self.choose()
        taken = self.read(plan)
        self.conclude(taken)

    @step("M1/1", "Connect the inverter, couple the dynamometer", by_hand=True)
    def prepare(self) -> None:
        """Know how many pole pairs and which way the phases turn before anything depends on it."""
        self._pairs = known_pole_pairs(self)
        self.bench.perform(INVERTER, ReleaseRotor(), CoupleDynamometer())
        self.wiring.inverter.direction(INVERTER)

    @step(
        "M1/2",
        "Choose up to {locations} currents within the limits of motor, inverter and voltage, and their order",
    )
    def choose(self) -> list[PlannedReading]:
        """Return the readings to take at the speed that is to be held."""
        bench, settings = self.bench, self.settings
        self._speed = driving_speed_rad(bench, self.nameplate, settings.speed_share)
        wanted = settings.current_share * self.nameplate.rated_current
        largest = min(wanted, self.nameplate.current_bound, bench.inverter.maximum_current)
        points = grid_locations(
            largest,
            settings.locations - held_back(settings.locations),
            i_d_range=(settings.d_from * largest, settings.d_to * largest),
            both_sides=settings.symmetric is False,
            allowed=self._allowed(),
        )
        plan = list(reading_order(points, np.random.default_rng(_ORDER)))
        self.findings |= {"locations": len(points), "readings": len(plan), "largest_current": largest}
        self.findings["speed"] = self._speed
        return plan

    @step("M1/3", "At each current, the speed held: voltages and currents, a mean of whole turns, and the torque")
    def read(self, plan: list[PlannedReading]) -> MapReadings:
        """Return what was read; a plan that ends early leaves a smaller map. The last currents lie about the largest torque per ampere."""
        settings = self.settings
        pace = Pace(settings.settling, settings.turns, settings.longest, self.nameplate.rated_current)

        def progress(taken: MapReadings, left: float) -> None:
            self.bench.show(lambda: map_plot(plan, taken, self._pairs, left))

        def take(points: Sequence[PlannedReading], *, again: bool = False) -> None:
            left = points if again else self._left(points, taken)
            self._planned = len(taken.points) + len(left)
            if left and taken.ended is None:
                read_points(self.bench, self.nameplate, left, self._speed, pace, progress, taken)

        self._taken = taken = earlier_readings(self.earlier)
        take(plan)
        if self._contradicts(taken):
            taken.points = taken.of_session(taken.session).points
            take(plan)
        for chosen in (self._other_sides, self._about_mtpa):
            more = chosen(plan, taken) if taken.ended is None else []
            if more:
                plan = [*plan, *more]
                take(more)
        once = len(taken.points)
        for doubted in (FluxMapEstimate.least_foreseen, lambda made: made.doubtful):
            more = self._again(taken, doubted) if taken.ended is None else []
            if more:
                take(more, again=True)
        self.findings |= {"readings": max(self._planned, len(taken.points)), "read_again": len(taken.points) - once}
        self.bench.dynamometer.stop()
        tell_left_out(self, taken, self._planned, self._speed)
        return taken

    def _left(self, points: Sequence[PlannedReading], taken: MapReadings) -> Sequence[PlannedReading]:
        """Return what is left to read of planned points where earlier sessions read a part, with what ties this one to them."""
        if not taken.session:
            return points
        tied = any(point.session == taken.session for point in taken.points)
        read = [point.planned for point in taken.points]
        return remaining(points, read, np.random.default_rng(_ORDER), tie=not tied)

    def _contradicts(self, taken: MapReadings) -> bool:
        """Tell whether earlier sessions contradict this one, and say that all is then read in this one."""
        if taken.ended is not None or np.unique(taken.sessions).size < 2:
            return False
        try:
            _, _, broken = joined(taken, symmetric=self.settings.symmetric)
        except EstimationError:
            # What is wrong is told where the map is made.
            return False
        if broken is not None:
            self.notice("sessions-contradict", broken_words(broken, READ_AGAIN))
        return broken is not None

    def conclude_early(self, why: Text) -> bool:
        """Make the map of what was read before an error or an abort."""
        taken = self._taken
        if taken is None or not taken.points:
            if taken is not None and taken.unheld:
                self.notice("dynamometer-limit", unheld_words(taken, self._speed))
            return False
        taken.ended = why
        tell_left_out(self, taken, self._planned, self._speed)
        self.conclude(taken)
        return True

    @step("M1/4", "Flux linkages at the currents, with their uncertainty; largest torque per ampere")
    def conclude(self, taken: MapReadings) -> None:
        """Report the map."""
        try:
            found = self._estimate(taken)
        except EstimationError as error:
            if not taken.unheld:
                raise
            # Too few are left because of the dynamometer, not because of the motor.
            said = unheld_words(taken, self._speed)
            raise ProcedureError(
                said if taken.ended is None else text("{ended}: {said}", ended=taken.ended, said=said)
            ) from error
        if self._estimated is not None:
            _, taken, broken, _ = self._estimated
            if broken is not None:
                self.notice("sessions-contradict", broken_words(broken, LEFT_OUT))
        self.tell_misfit(found.misfit)
        fit, flux_map = found.fit, self._compare_torque(found, taken)
        self.findings |= {
            "tables": {MAP_FILE: table_of(flux_map)},
            "full_scale": flux_map.full_scale,
            "symmetric": bool(found.symmetric),
            "symmetry_tested": bool(found.symmetry_tested),
            "angle": vars(fit.angle),
            "delay": vars(fit.delay),
            "resistance": curve(time=taken.column("time"), resistance=fit.resistance),
            "magnet_change": curve(time=taken.column("time"), flux=fit.magnet_change),
            **({"sessions": [session_row(session) for session in fit.sessions]} if fit.sessions else {}),
            "variance_ratio": fit.variance_ratio,
            "pole_pairs": self._pairs,
            "grid": grid_of(flux_map),
            "conserving": conserving_of(flux_map),
            **saturation_of(flux_map),
        }
        resistance = max(float(np.mean(fit.resistance)), 0.0)
        tell_resistance(self, flux_map, resistance, self._pairs * self._speed)
        bus = float(np.mean(taken.column("bus_voltage")))
        speed = self.nameplate.speed_bound_rpm
        if bus > 0.0 and speed is not None:
            self.findings |= {
                "bus_voltage": bus,
                "largest_torque": capability_of(
                    flux_map,
                    bus_voltage=bus,
                    resistance=resistance,
                    pole_pairs=self._pairs,
                    speed=speed * math.pi / 30.0,
                ),
            }
        self._report_figures(flux_map)

    def _allowed(self) -> Callable[[FloatArray], NDArray[np.bool_]] | None:
        """Return which currents the voltage has room for, by what is known of the motor; None where that is too little."""
        names = ("flux_linkage", "d_axis_inductance", "q_axis_inductance", "stator_resistance")
        known = [self.known_value(name) or self.nameplate.expected.get(name) for name in names]
        voltage = self.nameplate.rated_voltage
        if voltage is None or any(value is None for value in known):
            return None
        flux, ld, lq, resistance = (float(value or 0.0) for value in known)

        def linear(points: FloatArray) -> FloatArray:
            return np.column_stack((flux + ld * points[:, 0], lq * points[:, 1]))

        omega, most = self._pairs * self._speed, _MODULATED * voltage / math.sqrt(3.0)
        return lambda points: within_voltage(points, linear, omega, resistance, most)

    def _other_sides(self, plan: list[PlannedReading], taken: MapReadings) -> Sequence[PlannedReading]:
        """Return what is read besides where the readings contradict the symmetry, so that one side of i_q does not stand for the other."""
        if self.settings.symmetric is not None:
            return []
        try:
            fit = self._estimate(taken)
        except EstimationError:
            # What is wrong with them is told where the map is made.
            return []
        return [] if fit.symmetric else other_sides(plan, np.random.default_rng(_ORDER))

    def _about_mtpa(self, plan: list[PlannedReading], taken: MapReadings) -> Sequence[PlannedReading]:
        """Return the readings about the largest torque per ampere, which those before tell."""
        later = held_back(self.settings.locations)
        if self.settings.symmetric is False:
            # The asked number is that of both sides.
            later //= 2
        try:
            fit = self._estimate(taken)
            points = about_mtpa(fit.map, later)
        except EstimationError:
            return []
        if (allowed := self._allowed()) is not None:
            points = points[allowed(points)]
        self.findings["locations"] += len(points)
        return further_readings(points, np.random.default_rng(_ORDER), both_sides=not fit.symmetric)

    def _again(
        self, taken: MapReadings, doubted: Callable[[FluxMapEstimate], Sequence[int]]
    ) -> Sequence[PlannedReading]:
        """Return what is read once more: a repeat says what no other location can, whether a reading is right."""
        try:
            made = self._estimate(taken)
        except EstimationError:
            return []
        kept = taken if self._estimated is None else self._estimated[1]
        return sorted((kept.points[k].planned for k in doubted(made)), key=lambda each: each.direction)

    def _estimate(self, taken: MapReadings) -> FluxMapEstimate:
        """Return the map of what was read, made once of the same readings."""
        if self._estimated is None or self._estimated[0] != len(taken.points):
            kept, made, broken = joined(taken, symmetric=self.settings.symmetric)
            self._estimated = len(taken.points), kept, broken, made
        return self._estimated[3]

    def _report_figures(self, flux_map: MeasuredFluxMap) -> None:
        """Report the flux linkage at no current, and the largest torque at the largest current with its angle."""
        place = int(np.argmin(np.hypot(*flux_map.points.T)))
        alone = np.zeros(flux_map.flux.size)
        alone[2 * place] = 1.0
        zero = flux_map.figure(float(flux_map.flux[place, 0]), alone)
        name = "map_flux_linkage"
        report_figure(
            self, _BUDGET, name, zero, flux_map, estimator="ψ_d at no current, read at both signs of the speed"
        )
        report_mtpa(self, _BUDGET, flux_map, self._pairs)

    def _compare_torque(self, found: FluxMapEstimate, taken: MapReadings) -> MeasuredFluxMap:
        """Hold the map's torque against the shaft's, without what turns at no current too; return the map, wider where they differ."""
        compared = shaft_torque(found, taken, self._pairs)
        if compared is None:
            return found.map
        self.findings["torque"] = compared.as_dict()
        if compared.contradiction is not None:
            self.notice(TORQUE_DIFFERS, compared.contradiction)
        return compared.held_by(found.map)
