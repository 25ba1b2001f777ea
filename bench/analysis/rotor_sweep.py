"""Rotor-sweep captures: inductance over angle, or over time while the shaft was turned by hand (§3.3.2)."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from bench.analysis.applied import AppliedAccuracy
from bench.analysis.bridge_readings import at_one_frequency, in_series
from bench.analysis.outcome import AnalysisOutcome, estimated, named, open_unit, pick, refuse_over_range
from bench.analysis.reading_points import reading_factor
from bench.analysis.statements import Statement
from bench.captures import WHOLE, Capture, CaptureChannel, CaptureError, CapturePart, ProbeFactor, read_capture
from drivers.interfaces.text import Translate, english, text
from procedures.estimation.winding.connections import Connection
from procedures.estimation.winding.sweep.resistances import allowed_for_jump
from procedures.estimation.winding.sweep.rotor_sweep import (
    axis_inductances,
    extremes,
    fit_rotor_sweep,
    motor_class,
    saliency_significant,
)
from procedures.estimation.winding.sweep.timed_sweep import fit_timed_sweep

#: Motors with more pole pairs are rare: angles that show so many settle that there is no saliency.
_USUAL_POLE_PAIRS = 16
#: Where the meter may have been. A single phase against the star point shows its own inductance, whose extremes are not those of the axes.
_READINGS = ("line", "series-parallel")
#: Readings that differ by less than this share are one.
_ROUNDING = 1e-9


def analyze_rotor_sweep(
    file: str | Path,
    *,
    connection: Connection = "wye",
    reading: Literal["line", "series-parallel"] = "line",
    pole_pairs: int | None = None,
    electrical: bool = False,
    column: str | None = None,
    frequency: float | None = None,
    threshold: float = 0.10,
    scale: Mapping[str, float | ProbeFactor] | None = None,
    accuracy: Sequence[Statement] = (),
    selection: CapturePart = WHOLE,
    translate: Translate = english,
) -> dict[str, Any]:
    """Return Ld and Lq (leg of the equivalent wye) from inductance readings over angle, or over time.

    The first column is the angle (rad, or degrees by its heading; mechanical unless the heading or `electrical` says otherwise), or
    time, while the shaft was turned slowly one way. `reading` says where the meter was: between two lines, or from one line to the
    other two joined.
    `pole_pairs` are searched where not given. `threshold` is the note's limit between the classes.
    `accuracy` states the errors of the meter. `column` names the inductance's column where several may be it, `frequency` (Hz) the bridge's
    test frequency. Inductances of a parallel circuit (Lp) are converted, or refused.
    `selection` is the part of the record to take. `translate` gives sentences in the reader's language. Raises
    CaptureError naming file and line.
    """
    if connection not in ("wye", "delta"):
        raise CaptureError(
            "connection",
            text("connection '{connection}' is not known; allowed are 'wye' and 'delta'", connection=connection),
        )
    if reading not in _READINGS:
        raise CaptureError(
            "reading",
            text(
                "'{reading}' is not known here; allowed are 'line' (between two lines) and 'series-parallel' (one line to the other two "
                "joined)",
                reading=reading,
            ),
        )
    capture = read_capture(file, abscissa="angle", selection=selection).scaled(named(scale))
    capture, frequency = at_one_frequency(capture, frequency)
    rest = [c for c in capture.channels if c.unit not in ("rad", "Ω") and column in (None, c.name)]
    if capture.time is None:
        angle = pick(capture, None, ("rad",), "angle", ("angle", "theta", "winkel", "position"))
        if not angle.unit:
            raise open_unit(capture, angle.name, "angle", ("deg", "rad"))
        rest = [c for c in rest if c.name != angle.name]
    stated = [c for c in rest if c.unit == "H"]
    inductance = (
        (stated or rest)[0]
        if len(rest) == 1 or len(stated) == 1
        else pick(capture, column, ("H", ""), "inductance", ("induct", "ls", "l"), "--inductance")
    )
    refuse_over_range(capture, inductance)
    if inductance.unit not in ("H", ""):
        raise CaptureError(
            capture.source,
            text("column {name} is in {unit}; inductances in H are needed", name=inductance.name, unit=inductance.unit),
        )
    if not inductance.unit:
        raise open_unit(capture, inductance.name, "inductance", ("uH", "mH", "H"))
    inductance, parallel, converted = in_series(capture, inductance, frequency)
    _check_readings(capture, inductance)
    applied = AppliedAccuracy(accuracy, {"inductance": (inductance.name,)}, (capture,))
    outcome = AnalysisOutcome("dq_inductance_extremes", "3.3.2", capture, applied, translate)
    if converted is not None:
        outcome.assume(converted)
    if capture.time is not None:
        times = capture.time
        outcome.assume(text("shaft turned slowly one way, over at least one electrical turn"))
        fit = estimated(capture, lambda: fit_timed_sweep(times, inductance.values, resolution=inductance.resolution))
    else:
        electrical = electrical or "electrical" in angle.name.lower()
        known = 1 if electrical else pole_pairs
        outcome.assume(text("angle is electrical") if electrical else text("angle is mechanical"))
        fit = estimated(
            capture,
            lambda: fit_rotor_sweep(
                angle.values, inductance.values, pole_pairs=known, resolution=inductance.resolution
            ),
        )
    # A parallel resistance moves with the inductance, not with the clamps alone.
    beside = [c for c in capture.channels if c.unit == "Ω" and c is not parallel]
    if len(beside) == 1:
        fit = allowed_for_jump(fit, np.delete(beside[0].values, fit.left_out))
    factor = reading_factor(outcome, capture, connection, reading)
    significant, p_value = saliency_significant(fit)
    if capture.time is None and known is None and not significant and not fit.misfit:
        _judge_open_pole_pairs(outcome, angle)
    axes = estimated(capture, lambda: axis_inductances(fit))
    lost = None
    if capture.time is not None and significant:
        # A meter may take its reading over all of the time to the next, while the shaft turns on: less of the swing is seen.
        whole = (2.0 * math.pi * fit.periods / (fit.course.size - 1)) ** 2 / 24.0
        # A quick meter loses nothing, one that streams loses the whole: the two ends are likely, and the interval is to contain them.
        lost = outcome.uncertainties.limit("turning during a reading", 0.5 * whole, 0.75 * whole)
    for name, axis, sign in (("d_axis_inductance", "d", -1.0), ("q_axis_inductance", "q", 1.0)):
        found = outcome.estimate(text("sweep fit of {name}", name=f"L_{axis}"), axes, name)
        if lost is not None:
            found = found + sign * fit.value("amplitude") * lost
        found = outcome.with_errors(found, "inductance", inductance.name, gain=1.0, offset=1.0)
        outcome.parameter(
            name,
            factor.y_equivalent * found,
            estimator="fit of mean and second harmonic to the whole sweep",
            winding=factor.winding * float(found.x),
            convention="y_equivalent",
            misfit=fit.misfit.of(name),
        )
    low, high = extremes(np.delete(inductance.values, fit.left_out))
    by_note = estimated(capture, lambda: motor_class(low, high, threshold))
    if significant and by_note == "SPMSM":
        outcome.warn(
            text(
                "the extremes differ by {apart:.1f} %, so the note's rule takes their mean. But the saliency is "
                "significant (p = {p_value:.2g}), so Ld and Lq are reported separately",
                apart=100 * (high / low - 1),
                p_value=p_value,
            ),
            "E3",
        )
    if not significant and not fit.misfit:
        outcome.warn(
            text(
                "the saliency is not significant (p = {p_value:.2g}): Ld and Lq are the mean of all readings",
                p_value=p_value,
            ),
            "E3",
        )
    outcome.detail(
        motor_class=by_note,
        saliency_significant=significant,
        saliency_p_value=p_value,
        inductance_periods=fit.periods,
        extremes=[low, high],
        note_d_axis_inductance=factor.y_equivalent * low,
        note_q_axis_inductance=factor.y_equivalent * high,
        reading_mean=fit.value("mean"),
        reading_amplitude=fit.value("amplitude"),
        residual_rms=fit.residual_rms,
        left_out=[number + 1 for number in fit.left_out],
    )
    return outcome.as_dict()


def _check_readings(capture: Capture, inductance: CaptureChannel) -> None:
    """Raise CaptureError for readings that are no inductances, or are all one."""
    largest = float(np.max(inductance.values))
    if not largest > 0.0:
        raise CaptureError(
            capture.source,
            text("no reading of {name} is above zero; correct them, or name the unit", name=inductance.name),
        )
    if float(np.ptp(inductance.values)) <= _ROUNDING * largest:
        raise CaptureError(
            capture.source,
            text(
                "all {count} readings are {value:.4g} H: any change with the rotor's angle is smaller than the "
                "meter's step, which the file does not show. Read with more digits, or in a finer range",
                count=inductance.values.size,
                value=largest,
            ),
        )


def _judge_open_pole_pairs(outcome: AnalysisOutcome, angle: CaptureChannel) -> None:
    """Say what angles (rad) show no saliency of; give no figures where that includes usual motors."""
    steps = float(np.median(np.diff(np.unique(angle.values))))
    most = max(1.0, math.floor(0.45 * math.pi / steps))
    why = text(
        "the pole pairs were not given. Readings {steps:.3g}° apart can show a saliency of up to {most:.0f} pole pairs, but not of "
        "more; give --pole-pairs",
        steps=math.degrees(steps),
        most=most,
    )
    if most < _USUAL_POLE_PAIRS:
        outcome.withhold(("d_axis_inductance", "q_axis_inductance"), "pole-pairs-open", why)
    else:
        outcome.warn(why)
