"""A motor that an inverter drives and a dynamometer holds at a speed, read at one current after another."""

import math
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivers.interfaces import Accuracy, MeasurementError, Reading, Role
from drivers.interfaces.text import text
from procedures.core.actions import ConnectProbes, CurrentProbe, Terminal, phases_on
from procedures.core.axes import Axes, CurveStyle, PlotCurve
from procedures.core.bench import ProcedureError
from procedures.core.live_plot import LivePlot
from procedures.core.procedure import Procedure
from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.winding.phase_power import PhasePower, phase_power
from procedures.maps.turned_points import HeldTorque, held_torque
from procedures.techniques.acquisition import ranged_record

_RPM = math.pi / 30.0
_POINTS, _SHORTEST, _LONGEST = 20_000, 0.02, 2.0


@dataclass(frozen=True)
class DrivenPoint:
    """One point: commanded q-axis current (A) and what the inverter reports, torque and speed, a phase's power, its accuracies."""

    commanded: float
    reported: Reading
    torque: HeldTorque
    phase: PhasePower
    frequency: float
    voltage_accuracy: Accuracy
    current_accuracy: Accuracy


class LoadRun:
    """Reads load points for a procedure; `voltages` are the channels on A, B and C, `probe` gives the current probe on a terminal."""

    def __init__(
        self, procedure: Procedure[Any], voltages: Sequence[int], probe: Callable[[Terminal], CurrentProbe]
    ) -> None:
        self._procedure = procedure
        self._bench, self._settings, self._plate = procedure.bench, procedure.settings, procedure.nameplate
        self._voltages, self._probe = tuple(voltages), probe
        self._pairs = float(procedure.known_value("pole_pairs") or procedure.nameplate.pole_pairs or 1.0)
        self._rated = self._plate.rated_current
        self._done: list[DrivenPoint] = []

    @property
    def points(self) -> Sequence[DrivenPoint]:
        """The points read so far."""
        return tuple(self._done)

    def grid(self, speeds: Sequence[float], levels: Sequence[float]) -> list[DrivenPoint]:
        """Return the points at every speed (rad/s) and current (A), the smallest first; after each the motor rests as its warmth asks for.

        Beyond a current that the inverter's voltage does not drive at a speed no larger one is tried. Raises ProcedureError for no point.
        """
        self._done, beyond = [], []
        for speed in speeds:
            for way in (1.0, -1.0):
                for level in (each for each in levels if each * way > 0.0):
                    try:
                        self._done.append(self._point(speed, level, Terminal.A))
                    except MeasurementError as error:
                        if error.instrument != Role.INVERTER.value:
                            raise
                        self._bench.dynamometer.stop()
                        beyond.append((speed, level))
                        break
                    self._show()
        if beyond:
            self._tell(beyond)
        if not self._done:
            raise ProcedureError(
                text("the inverter can drive none of the currents at any of the speeds; choose smaller ones")
            )
        return self._done

    def ratio_of_phases(self, points: Sequence[DrivenPoint]) -> tuple[float, float]:
        """Return the power of all phases over three times that of A, and its half-width; read where the power is largest."""
        if not self._settings.phases:
            return 1.0, self._settings.unbalance
        largest = max(points, key=lambda point: abs(point.phase.power))
        powers = [largest.phase.power]
        for terminal in (Terminal.B, Terminal.C):
            self._fit(terminal)
            powers.append(self._point(largest.torque.speed, largest.commanded, terminal).phase.power)
        self._fit(Terminal.A)
        mean = sum(powers) / 3.0
        # How the phases differ changes with the load: half of what they differ by here is allowed for elsewhere.
        return mean / powers[0], 0.5 * abs(mean / powers[0] - 1.0)

    def _tell(self, beyond: Sequence[tuple[float, float]]) -> None:
        self._procedure.notice(
            "load-reach",
            text(
                "the inverter's voltage is too low for these: {points}; they and larger currents are left out",
                points=[f"{speed / _RPM:.0f} rpm {level:.3g} A" for speed, level in beyond],
            ),
        )

    def _fit(self, terminal: Terminal) -> None:
        self._bench.perform(ConnectProbes((*phases_on(self._voltages), self._probe(terminal))))

    def _point(self, speed: float, level: float, terminal: Terminal) -> DrivenPoint:
        bench, settings = self._bench, self._settings
        begun = bench.clock.now()
        with ExitStack() as running:
            running.enter_context(bench.dynamometer.driving_speed(speed))
            running.enter_context(bench.inverter.driving_current(0.0))
            bench.inverter.set_current(level)
            torque = held_torque(bench, settings, speed)
            reported = bench.inverter.measure_current()
            taken = self._power(speed, level, terminal)
        bench.dynamometer.stop()
        # On the whole no warmer than by the rated current.
        dwell = bench.clock.now() - begun
        rest = dwell * ((taken[0].current / self._rated) ** 2 - 1.0)
        if rest > 0.0:
            bench.clock.sleep(rest)
        phase, frequency, voltage, current = taken
        return DrivenPoint(level, reported, torque, phase, frequency, voltage, current)

    def _power(self, speed: float, level: float, terminal: Terminal) -> tuple[PhasePower, float, Accuracy, Accuracy]:
        bench, settings = self._bench, self._settings
        at, through = self._voltages[tuple(Terminal).index(terminal)], self._probe(terminal).channel
        record_time = min(max(settings.periods * math.tau / (self._pairs * speed), _SHORTEST), _LONGEST)
        bench.oscilloscope.configure_acquisition(record_time, _POINTS, 0.0)
        ranges = {at: 4.0 * (self._plate.rated_voltage or 50.0), through: 3.0 * abs(level)}
        waves = ranged_record(bench, ranges, 10.0 + record_time)
        time, voltage, current = waves[at].time, waves[at].values, waves[through].values
        told = DigitizedChannel(str(at), waves[at].resolution, waves[at].clipped, waves[at].accuracy.gain)
        frequency = fit_back_emf(time, voltage[np.newaxis, :], harmonics=(1, 5, 7), digitized=[told]).frequency
        return phase_power(time, voltage, current, frequency), frequency, waves[at].accuracy, waves[through].accuracy

    def _show(self) -> None:
        speed = np.array([each.torque.speed / _RPM for each in self._done])
        power = PlotCurve(
            text("readings"), speed, np.array([3.0 * each.phase.power for each in self._done]), CurveStyle.READING
        )
        torque = PlotCurve(
            text("readings"), speed, np.array([-each.torque.torque for each in self._done]), CurveStyle.READING
        )
        self._bench.show(
            lambda: LivePlot(
                text("Electrical power and torque of the load points"),
                Axes(text("Speed"), "rpm", text("Power"), "W", (power,), True, True),
                Axes(text("Speed"), "rpm", text("Torque"), "N·m", (torque,), True),
            )
        )
