"""Plots of inductance over the rotor's angle and of recorded current steps while they are measured."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from drivers.interfaces import ImpedanceReading
from drivers.interfaces.text import Text, text
from procedures.core.axes import Axes, CurveStyle, FloatArray, PlotCurve
from procedures.core.live_plot import ComingReadings, Gauge, LivePlot
from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.winding.current_step.first_look import course_at_sight
from procedures.estimation.winding.sweep.timed_sweep import look_at_sweep

#: A course that explains less of the readings than this is no second harmonic yet.
_EXPLAINED = 0.5
#: The hand turns evenly enough within these shares of the speed that it was asked for.
_PACE = (0.5, 1.5)
_READ, _FIT, _RESIDUAL, _RECORDED = text("readings"), text("fit"), text("residual"), text("recorded")
_INDUCTANCE, _CURRENT = text("Line inductance"), text("Current")
_ANGLE = text("Rotor angle, if turned evenly")
_HARMONIC = text("second harmonic")


class SweepPlot:
    """A sweep by a hand that is to turn at `speed` (rad/s) from a bench time `since` (s) on, `readings` in all, each `reading_time` (s).

    `pole_pairs` is None where they are not known: then the readings do not tell how fast the hand is.
    """

    def __init__(
        self, since: float, speed: float, readings: int, reading_time: float, pole_pairs: float | None
    ) -> None:
        self._since = since
        self._speed = speed
        self._readings = readings
        self._reading_time = reading_time
        self._pole_pairs = pole_pairs

    @property
    def every(self) -> int:
        """After how many readings the plot is worth making anew."""
        return max(self._readings // 16, 6)

    def made(self, taken: Sequence[ImpedanceReading]) -> LivePlot:
        """Return the plot with the curve of the readings so far, as soon as they have one."""
        rate = math.degrees(self._speed)
        left, each = self._readings - len(taken), self._reading_time
        now = self._since
        if len(taken) > 1:
            now, each = taken[-1].time, (taken[-1].time - taken[0].time) / (len(taken) - 1)
        coming = ComingReadings(
            "lcr_meter", "inductance", self._since, rate, until_x=rate * (now + left * each - self._since)
        )
        time, inductance = np.array([r.time for r in taken]), np.array([r.inductance for r in taken])
        curves, said, gauge = [], [text("The fit appears when the readings have risen and fallen.")], self._gauge(None)
        try:
            look = look_at_sweep(time, inductance)
        except EstimationError:
            look = None
        if look is not None and look.explained > _EXPLAINED:
            curves = [PlotCurve(_HARMONIC, rate * (time - self._since), look.fitted, CurveStyle.FIT)]
            said = [
                text(
                    "By the readings {turns:.2f} electrical turns so far; largest minus smallest {swing:.3g} % of the mean",
                    turns=look.periods / 2.0,
                    swing=100.0 * float(np.ptp(look.fitted) / np.mean(look.fitted)),
                )
            ]
            gauge = self._gauge(look.periods * math.tau / float(np.ptp(time)))
        axes = Axes(_ANGLE, "°", _INDUCTANCE, "H", curves, x_from_zero=True)
        return LivePlot(text("Inductance over the rotor's angle"), axes, None, said, coming, gauge)

    def fitted(self, time: FloatArray, inductance: FloatArray, residuals: FloatArray) -> LivePlot:
        """Return the plot of the whole sweep with its fit and what that leaves."""
        angle = math.degrees(self._speed) * (time - self._since)
        upper = (
            PlotCurve(_READ, angle, inductance, CurveStyle.READING),
            PlotCurve(_HARMONIC, angle, inductance - residuals, CurveStyle.FIT),
        )
        return LivePlot(
            text("Inductance over the rotor's angle"),
            Axes(_ANGLE, "°", _INDUCTANCE, "H", upper, x_from_zero=True),
            Axes(_ANGLE, "°", _RESIDUAL, "H", (PlotCurve(_RESIDUAL, angle, residuals, CurveStyle.READING),)),
            [_left(residuals, inductance - residuals)],
        )

    def _gauge(self, rate: float | None) -> Gauge | None:
        """Return how fast the hand has been so far, by the `rate` (rad/s) of the inductance's phase."""
        if self._pole_pairs is None:
            return None
        value = None if rate is None else 50.0 * rate / (self._pole_pairs * self._speed)
        low, high = (100.0 * share for share in _PACE)
        return Gauge(text("Speed of the hand, of the speed asked for"), "%", low, high, value)


def aligned_plot(d: float, q: float | None) -> LivePlot:
    """Return the plot of the inductances (H) read on d, and on q of an aligned rotor, with the second harmonic once both are there."""
    read = [d] if q is None else [d, q]
    curves = [PlotCurve(_READ, np.linspace(0.0, 90.0, 2)[: len(read)], np.array(read), CurveStyle.READING)]
    messages = [text("Next: the rotor on q, 90° electrical from d")]
    if q is not None:
        angle = np.linspace(0.0, 180.0, 91)
        harmonic = 0.5 * (d + q) + 0.5 * (d - q) * np.cos(np.radians(2.0 * angle))
        curves.append(PlotCurve(_HARMONIC, angle, harmonic, CurveStyle.FIT))
        messages = [text("On q {ratio:.3g} times the inductance on d", ratio=q / d)]
    axes = Axes(text("Electrical angle from d"), "°", text("Inductance A–(B+C)"), "H", curves, x_from_zero=True)
    return LivePlot(text("Inductance on d and on q"), axes, None, messages)


def step_plot(time: FloatArray, voltage: FloatArray, current: FloatArray) -> LivePlot:
    """Return the plot of one step (s, V, A) right after its capture, with one resistance and one inductance fitted to it."""
    recorded = PlotCurve(_RECORDED, time, current, CurveStyle.RECORD)
    try:
        course = course_at_sight(time, voltage, current)
    except EstimationError:
        message = text(
            "No resistance and inductance fit this record: check the probes, or wait for the next, longer one."
        )
        return LivePlot(_STEP, Axes(_TIME, "s", _CURRENT, "A", (recorded,)), None, [message])
    loop = text(
        "First fit of this record: {resistance:.3g} Ω, {inductance:.3g} mH, time constant {tau:.3g} ms",
        resistance=course.resistance,
        inductance=1e3 * course.inductance,
        tau=1e3 * course.inductance / course.resistance,
    )
    return _with_fit(time, current, current - course.fitted, [loop])


def fitted_step_plot(fit: Mapping[str, Sequence[float]], count: int, resistance: float, inductance: float) -> LivePlot:
    """Return the plot of the last of `count` steps with the fit (Ω, H) that counts: `time`, `fitted` and `residual` of the findings."""
    time, fitted, residual = (np.asarray(fit[name], dtype=np.float64) for name in ("time", "fitted", "residual"))
    message = text(
        "Fit of {count} records: {resistance:.4g} Ω, {inductance:.4g} mH, time constant {tau:.4g} ms",
        count=count,
        resistance=resistance,
        inductance=1e3 * inductance,
        tau=1e3 * inductance / resistance,
    )
    return _with_fit(time, fitted + residual, residual, [message])


_STEP, _TIME = text("Current after the voltage step"), text("Time")


def _with_fit(time: FloatArray, current: FloatArray, residuals: FloatArray, said: Sequence[Text]) -> LivePlot:
    curves = (
        PlotCurve(_RECORDED, time, current, CurveStyle.RECORD),
        PlotCurve(_FIT, time, current - residuals, CurveStyle.FIT),
    )
    left = PlotCurve(_RESIDUAL, time, residuals, CurveStyle.RESIDUAL)
    return LivePlot(
        _STEP,
        Axes(_TIME, "s", _CURRENT, "A", curves),
        Axes(_TIME, "s", _RESIDUAL, "A", (left,)),
        [*said, _left(residuals, current - residuals)],
    )


def _left(residuals: FloatArray, fitted: FloatArray) -> Text:
    share = 100.0 * float(np.std(residuals) / max(float(np.ptp(fitted)), 1e-300))
    return text("Residual {share:.2g} % rms of the curve's height", share=share)
