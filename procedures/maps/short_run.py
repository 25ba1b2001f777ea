"""A short-circuited motor turned at one speed after another, within current, torque and warmth."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from GTC.lib import UncertainReal

from drivers.interfaces.text import text
from procedures.core.actions import ConnectProbes, CurrentProbe
from procedures.core.axes import Axes, CurveStyle, PlotCurve
from procedures.core.bench import ProcedureError
from procedures.core.live_plot import LivePlot
from procedures.core.procedure import Procedure
from procedures.maps.short_points import OpenBefore, ShortPoint, ShortSweep
from procedures.maps.turned_points import fundamentals, held_torque
from procedures.techniques.shaft.torque_zero import ZeroLine, read_zero

_RPM = math.pi / 30.0
#: Of the dynamometer's largest torque this share is used; a speed nearer than this to the last one teaches nothing.
_TORQUE_SHARE, _NEAREST = 0.9, 1.05
#: A current is foreseen no better than this.
_MARGIN = 1.1
#: So few speeds tell nothing apart.
_FEWEST = 5
#: Warming goes on in stretches of this length (s).
_STRETCH = 10.0


class ShortRun:
    """Turns the joined motor of a procedure; `bound` (A, peak) is the largest current that it goes up to."""

    def __init__(self, procedure: Procedure[Any], before: OpenBefore, probe: CurrentProbe, bound: float) -> None:
        self._procedure, self._before, self._probe, self._bound = procedure, before, probe, bound
        self._bench, self._settings = procedure.bench, procedure.settings
        self._points: list[ShortPoint] = []

    @property
    def points(self) -> Sequence[ShortPoint]:
        """The points read so far, the slowest speed first."""
        return tuple(self._points)

    def sweep(self, others: Sequence[CurrentProbe], temperature: UncertainReal | None = None) -> ShortSweep:
        """Return the points, from the slowest speed as far as current and torque allow; `others` are the other phases' probe places.

        `temperature` (°C) is the winding's now, as before the open circuit where it is not given. Raises ProcedureError for too few points.
        """
        bench, settings = self._bench, self._settings
        self._points = []
        zero = read_zero(bench, settings.interval, settings.zero_rest)
        stopped = ""
        for speed in self._before.speeds:
            allowed, reason = self._allowed(speed)
            if allowed < speed:
                stopped = reason
                if self._points and allowed < _NEAREST * self._points[-1].torque.speed:
                    break
            self._points.append(self._point(allowed, self._probe))
            self._show()
            if stopped:
                break
        if stopped:
            self._fill_in()
        if len(self._points) < _FEWEST:
            raise ProcedureError(
                text(
                    "after {points} speeds the short circuit reaches the {limit}: too few to separate R and L. "
                    "Start slower (lowest), or run stator-resistance and an inductance first, from which the "
                    "speeds are chosen",
                    points=len(self._points),
                    limit=text("motor's largest current") if stopped == "current" else text("dynamometer's torque"),
                )
            )
        again = self._point(self._points[0].torque.speed, self._probe)
        shares = self._shares(others) if others else None
        line = ZeroLine(zero, read_zero(bench, settings.interval, settings.zero_rest))
        return ShortSweep(tuple(self._points), again, line, temperature or self._before.temperature, shares, stopped)

    def _fill_in(self) -> None:
        """Read at speeds between those that were read, the widest step first, where current or torque ended it after too few."""
        while 1 < len(self._points) < _FEWEST:
            speeds = [each.torque.speed for each in self._points]
            steps = [after / before for before, after in pairwise(speeds)]
            widest = int(np.argmax(steps))
            self._points.append(self._point(math.sqrt(speeds[widest] * speeds[widest + 1]), self._probe))
            self._points.sort(key=lambda each: each.torque.speed)
            self._show()

    def warm(self, cold: ShortSweep, seconds: float) -> None:
        """Turn for a time (s) at the speed whose current is nearest to the rated one, and not above it."""
        rated = self._procedure.nameplate.rated_current
        fits = [point for point in cold.points if point.current.mean <= rated] or [cold.points[0]]
        with self._bench.dynamometer.driving_speed(max(point.torque.speed for point in fits)):
            left = seconds
            while left > 0.0:
                self._bench.clock.sleep(min(left, _STRETCH))
                left -= _STRETCH
        self._bench.dynamometer.stop()

    def _allowed(self, speed: float) -> tuple[float, str]:
        """Return the speed (rad/s) or what of it current and torque allow, and which of them it is."""
        if not self._points:
            return speed, ""
        last = self._points[-1]
        reached, at = last.current.mean, last.torque.speed
        by_current = at * self._bound / (_MARGIN * reached) if self._rising() else math.inf
        most = _TORQUE_SHARE * self._bench.dynamometer.maximum_torque
        by_torque = at * most / max(abs(last.torque.torque), 1e-9) if self._braking_more() else math.inf
        allowed = min(speed, by_current, by_torque)
        return allowed, "current" if by_current <= by_torque else "torque"

    def _rising(self) -> bool:
        """Tell whether the next current may be beyond the bound: it grows no faster than the speed, and ends by λ/L_d."""
        if len(self._points) < 3:
            return True
        speeds = np.log([each.torque.speed for each in self._points[-2:]])
        sizes = np.log([each.current.mean for each in self._points[-2:]])
        # On its way to the asymptote a current that grows by its logarithm's slope grows by less from there on.
        if speeds[1] <= speeds[0]:
            return True
        slope = max(float((sizes[1] - sizes[0]) / (speeds[1] - speeds[0])), 0.0)
        left = (self._before.speeds[-1] / self._points[-1].torque.speed) ** slope
        return bool(self._points[-1].current.mean * left * _MARGIN > self._bound)

    def _braking_more(self) -> bool:
        """Tell whether the torque may still grow."""
        if len(self._points) < 2:
            return True
        return abs(self._points[-1].torque.torque) >= abs(self._points[-2].torque.torque)

    def _point(self, speed: float, probe: CurrentProbe) -> ShortPoint:
        bench, settings = self._bench, self._settings
        begun = bench.clock.now()
        with bench.dynamometer.driving_speed(speed):
            frequency = self._before.pole_pairs * speed / math.tau
            first = {probe.channel: 2.5 * self._expected(speed)}
            current = fundamentals(bench, first, frequency, settings.periods)
            torque = held_torque(bench, settings, speed)
        bench.dynamometer.stop()
        # On the whole no warmer than by the rated current.
        dwell = bench.clock.now() - begun
        rest = dwell * ((current.mean / self._procedure.nameplate.rated_current) ** 2 - 1.0)
        if rest > 0.0:
            bench.clock.sleep(rest)
        return ShortPoint(current, torque)

    def _expected(self, speed: float) -> float:
        if not self._points:
            return 0.2 * self._bound
        last = self._points[-1]
        return min(last.current.mean * speed / last.torque.speed, 1.2 * self._bound)

    def _shares(self, others: Sequence[CurrentProbe]) -> tuple[float, float]:
        """Return the phases' mean current over that of A, at the slowest and the fastest speed."""
        ends = self._points[0], self._points[-1]
        sizes = [[end.current.mean / end.current.electrical_speed for end in ends]]
        for probe in others:
            self._bench.perform(ConnectProbes((probe,)))
            taken = [self._point(end.torque.speed, probe) for end in ends]
            sizes.append([each.current.mean / each.current.electrical_speed for each in taken])
        slow, fast = np.mean(sizes, axis=0) / np.array(sizes[0])
        self._bench.perform(ConnectProbes((self._probe,)))
        return float(slow), float(fast)

    def _show(self) -> None:
        speed = np.array([each.torque.speed / _RPM for each in self._points])
        upper = PlotCurve(
            text("readings"), speed, np.array([each.current.mean for each in self._points]), CurveStyle.READING
        )
        lower = PlotCurve(
            text("readings"), speed, np.array([each.torque.torque for each in self._points]), CurveStyle.READING
        )
        self._bench.show(
            lambda: LivePlot(
                text("Current and torque of the short circuit"),
                Axes(text("Speed"), "rpm", text("Amplitude"), "A", (upper,), True, True),
                Axes(text("Speed"), "rpm", text("Torque"), "N·m", (lower,), True, True),
            )
        )
