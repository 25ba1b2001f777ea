"""Plots of back-EMF waves and of speed ramps while they are measured."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from drivers.interfaces.text import Text, text
from procedures.core.axes import Axes, CurveStyle, FloatArray, PlotCurve
from procedures.core.live_plot import ComingReadings, LivePlot
from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.mechanics.coast_look import courses_at_sight

_RPM = math.pi / 30.0
_TIME, _SPEED, _READ, _RESIDUAL = text("Time"), text("Speed"), text("readings"), text("residual")
_MANNERS = (CurveStyle.FIT, CurveStyle.SECOND, CurveStyle.THIRD)
_LINEAR, _QUADRATIC = text("without ω²"), text("with ω²")


def emf_plot(speed: float, wave: Mapping[str, Sequence[float]], harmonics: Mapping[str, float]) -> LivePlot:
    """Return the plot of the first periods of a capture at a speed (rad/s), as recorded and fitted, over its harmonics (V, by order)."""
    time = np.asarray(wave["time"], dtype=np.float64)
    recorded, fitted = [], []
    for channel, manner in enumerate(_MANNERS, 1):
        if f"channel_{channel}" in wave:
            name = text("channel {number}", number=channel)
            recorded.append(PlotCurve(Text(""), time, np.asarray(wave[f"channel_{channel}"]), CurveStyle.RECORD))
            fitted.append(PlotCurve(name, time, np.asarray(wave[f"fitted_{channel}"]), manner))
    fundamental, *others = [(float(order), volts) for order, volts in harmonics.items()]
    shares = np.array([100.0 * volts / fundamental[1] for _, volts in others])
    orders = np.array([order for order, _ in others])
    bars = Axes(
        text("Harmonic"),
        "",
        text("of the fundamental"),
        "%",
        (PlotCurve(Text(""), orders, shares, CurveStyle.BARS),),
        y_from_zero=True,
    )
    sentences = [
        text("{order:.0f}: {share:.2g} %", order=order, share=share)
        for order, share in zip(orders, shares, strict=True)
    ]
    messages = [text("Fundamental {amplitude:.4g} V peak", amplitude=fundamental[1])]
    if sentences:
        messages.append(text("Harmonics of it: {told}", told=sentences))
    return LivePlot(
        text("Back-EMF at {speed:.0f} rpm, recorded (grey) and fitted", speed=speed / _RPM),
        Axes(_TIME, "s", text("Voltage"), "V", (*recorded, *fitted)),
        bars if others else None,
        messages,
    )


def ramp_plot(title: Text, since: float, until: float) -> LivePlot:
    """Return the plot of a ramp from a bench time (s) on, until a speed (rad/s) is reached: its readings come."""
    coming = ComingReadings("dynamometer", "speed", since, scale=_RPM, until_y=until / _RPM)
    messages = [text("Followed until {speed:.0f} rpm", speed=until / _RPM)]
    return LivePlot(title, _over_time(()), None, messages, coming)


def coast_plot(title: Text, time: FloatArray, speed: FloatArray) -> LivePlot:
    """Return the plot of a coast-down (s, rad/s) by both models, and what either leaves."""
    rpm = speed / _RPM
    read = PlotCurve(_READ, time, rpm, CurveStyle.RECORD)
    try:
        courses = courses_at_sight(time, speed)
    except EstimationError:
        return LivePlot(title, _over_time((read,)))
    fits, left = [], []
    for name, course, manner in (
        (_LINEAR, courses.linear, CurveStyle.SECOND),
        (_QUADRATIC, courses.quadratic, CurveStyle.FIT),
    ):
        fits.append(PlotCurve(name, time, course.fitted / _RPM, manner))
        left.append(PlotCurve(name, time, (speed - course.fitted) / _RPM, manner))
    return LivePlot(
        title,
        _over_time((read, *fits)),
        Axes(_TIME, "s", _RESIDUAL, "rpm", left),
        [
            text(
                "Residual: {linear:.2g} rpm rms by viscous and Coulomb friction, {quadratic:.2g} rpm with a term over ω² besides",
                linear=courses.linear.residual_rms / _RPM,
                quadratic=courses.quadratic.residual_rms / _RPM,
            )
        ],
    )


def _over_time(curves: Sequence[PlotCurve]) -> Axes:
    return Axes(_TIME, "s", _SPEED, "rpm", curves, x_from_zero=True, y_from_zero=True)
