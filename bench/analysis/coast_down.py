"""Coast-down captures: friction against inertia, or both with a torque (§3.5)."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from GTC.lib import UncertainReal

from bench.analysis.applied import AppliedAccuracy, ErrorInput
from bench.analysis.decelerations import detail_decelerations
from bench.analysis.outcome import (
    AnalysisOutcome,
    estimated,
    paths_of,
    refuse_copies,
)
from bench.analysis.ramp_record import RampRecord, coasting, read_of_pulses, split, with_each_tooth
from bench.analysis.sensitivity import half_differences
from bench.analysis.shaft_columns import SpeedColumn, is_torque, torque_in_units
from bench.analysis.statements import Statement
from bench.analysis.time_base import judge_open_time, warn_of_coast
from bench.captures import WHOLE, CaptureError, CapturePart, read_capture
from bench.captures.written_digits import FloatArray
from drivers.interfaces.text import Translate, english, text
from procedures.estimation.fitting.fit import Fit
from procedures.estimation.mechanics.inertia import QUADRATIC, SHARED, fit_coast_downs, fit_ramps
from reports.labels import ParameterLabels

#: Readings at an end that are looked at together.
_AT_ENDS = 5
#: A coast-down that ends above this share of its top speed does not show what low speeds do.
_LOW_ENOUGH = 0.1
_FRICTIONS = ("coulomb_friction", "viscous_friction")
_RATES = ("coulomb_deceleration", "viscous_rate")
#: No sensor's filter is slower (s).
_LONGEST_FILTER = 5.0


def analyze_coast_down(
    file: str | Path | Sequence[str | Path],
    *,
    inertia: float | None = None,
    inertia_uncertainty: float = 0.0,
    torque: float | None = None,
    at_speed: Sequence[float] = (),
    speed: str | None = None,
    speed_in_rpm: bool | None = None,
    electrical: bool = False,
    pole_pairs: int | None = None,
    speed_filter: float = 0.0,
    torque_filter: float = 0.0,
    accuracy: Sequence[Statement] = (),
    selection: CapturePart = WHOLE,
    translate: Translate = english,
) -> dict[str, Any]:
    """Return friction over inertia from a coast-down's time and speed; with more to go on, inertia and friction.

    With `inertia` (kg·m²) the frictions follow. A coast-down alone gives its deceleration too, without any law of friction, `at_speed`
    (rpm) or at 25, 50 and 75 % of its top speed. With several files, or a torque column (N·m), all ramps are fitted together:
    a file without a torque column is a coast-down, unless it comes first and `torque` (N·m) is given for it. `speed` names the
    column, `speed_in_rpm` whether one without unit is in rpm or in rad/s; without it such a speed is refused. A speed that is electrical,
    by its name or by `electrical`, is divided by the `pole_pairs`. `speed_filter` and `torque_filter` are the time constants (s) of
    first-order filters that the readings went through. `accuracy` states the errors of speed, torque and time base. `selection` is the
    part of the record to take. `translate` gives sentences in the reader's language. Raises CaptureError naming file and line.
    """
    captures = [read_capture(path, selection=selection).thinned() for path in paths_of(file)]
    if not captures:
        raise CaptureError("capture", text("no file given"))
    refuse_copies([(capture.source, np.vstack([c.values for c in capture.channels])) for capture in captures])
    for name, constant in (("speed filter", speed_filter), ("torque filter", torque_filter)):
        if not 0.0 <= constant <= _LONGEST_FILTER:
            raise CaptureError(
                name,
                text("{constant:g} s is not within 0 … {longest:g} s", constant=constant, longest=_LONGEST_FILTER),
            )
    if inertia is not None and (inertia <= 0 or not np.isfinite(inertia)):
        raise CaptureError("inertia", text("{inertia:g} kg·m² is not above zero", inertia=inertia))
    if not 0.0 <= inertia_uncertainty < np.inf:
        raise CaptureError(
            "inertia_uncertainty", text("{uncertainty:g} kg·m² is not zero or more", uncertainty=inertia_uncertainty)
        )
    records, assumed = [], []
    column = SpeedColumn(speed, speed_in_rpm, electrical=electrical, pole_pairs=pole_pairs)
    for k, capture in enumerate(captures):
        channel, note = column.of_shaft(capture, [c for c in capture.channels if not is_torque(c)])
        assumed += note
        shaft = [torque_in_units(capture, c) for c in capture.channels if is_torque(c)]
        level = torque if torque is not None and k == 0 and len(captures) > 1 else 0.0
        filters = speed_filter, torque_filter
        record = RampRecord(capture.times(), channel, shaft[0] if shaft else level, filters)
        if not record.torque_name:
            for taken in (with_each_tooth, coasting, read_of_pulses):
                record, notes = estimated(capture, partial(taken, record))
                assumed += notes
        records.append(record)
    applied = AppliedAccuracy(accuracy, _uses(records), captures)
    outcome = AnalysisOutcome("inertia", "3.5", captures[0], applied, translate)
    outcome.assume(*assumed)
    parts = [part for record in records for part in split(record.ramp())]
    driven, alone = any(np.any(part.torque) for part in parts), len(parts) == 1
    if at_speed and not alone:
        raise CaptureError("--at-speed", text("decelerations are given of a single coast-down; give it alone"))
    fit = estimated(captures[0], lambda: _fit(records, driven=driven))
    names = SHARED if driven else _RATES
    found = {
        name: outcome.estimate(text("ramp fit of {name}", name=ParameterLabels({})[name]), fit, name) for name in names
    }
    for error in applied.inputs():
        moved = half_differences(fit, names, partial(_fit, records, error, driven=driven), str(error))
        found = {n: applied.change(outcome.uncertainties, q, error, moved[n]) for n, q in found.items()}
    seconds = max(float(np.ptp(part.time)) for part in parts)
    judged = (*names, *(_FRICTIONS if inertia is not None and not driven else ()))
    open_time = [capture for capture in captures if judge_open_time(outcome, capture, "coast", seconds, judged)]
    estimator = "fit of whole ramps together" if driven else "fit of the whole coast-down"
    for name, quantity in found.items():
        outcome.parameter(name, quantity, estimator=estimator, misfit=fit.misfit.of(name))
    square = QUADRATIC if driven else "quadratic_rate"
    low, high = fit.interval(square)
    outcome.detail(**{square: {"value": fit.value(square), "low": low, "high": high}})
    warn_of_coast(outcome, seconds, None if driven else inertia)
    if driven:
        outcome.assume(
            text("a record without a torque column is taken as free of shaft torque"),
            text("torque is the torque on the shaft, positive if it drives the shaft"),
        )
        outcome.warn(
            text("inertia and friction include everything that turned; subtract those of dynamometer and coupling"),
            "E6",
        )
        outcome.detail(ramps=len(parts), residual_rms=fit.residual_rms)
        return outcome.as_dict()
    outcome.assume(
        text(
            "no torque on the shaft but its own friction, which depends on the speed alone",
        )
    )
    if alone:
        outcome.warn(
            text(
                "friction that changes along a single coast-down, as where grease becomes thinner or a bearing load changes, looks like "
                "other friction, and the intervals do not include it. Let the shaft turn until it is warm, and give two records, one "
                "made after the other"
            ),
            "friction-drift-unseen",
        )
    reached = min(_reached(np.abs(part.speed)) for part in parts)
    if reached > _LOW_ENOUGH and fit.misfit.withholding(_RATES[0]) is None:
        outcome.warn(
            text(
                "the coast-down ends at {reached:.0%} of its top speed. Friction that rises again at low speed "
                "(Stribeck effect) hardly shows in this range, and the intervals are wide enough to include it. "
                "For narrower intervals, record down to 5 % of the top speed",
                reached=reached,
            ),
            "coast-lower",
        )
    if alone and not open_time:
        detail_decelerations(outcome, records[0], applied, fit.misfit, at_speed, inertia, inertia_uncertainty)
    firsts = {name: fit.value(name) for name in fit.names if name.startswith("initial_speed")}
    outcome.detail(**firsts, residual_rms=fit.residual_rms)
    if inertia is None:
        outcome.warn(
            text(
                "a coast-down alone gives only the ratio of friction to inertia; give the inertia, or a driven "
                "ramp with its torque"
            )
        )
    else:
        _frictions(outcome, found, fit, inertia, inertia_uncertainty)
    return outcome.as_dict()


def _reached(speeds: FloatArray) -> float:
    """Return the end of a coast-down (n,) over its beginning; by medians, for single readings may be none."""
    ends = float(np.median(speeds[:_AT_ENDS])), float(np.median(speeds[-_AT_ENDS:]))
    return min(ends) / max(ends)


def _frictions(
    outcome: AnalysisOutcome, rates: dict[str, UncertainReal], fit: Fit, inertia: float, uncertainty: float
) -> None:
    """Add the frictions that follow from a known inertia."""
    outcome.assume(
        text(
            "inertia {inertia:g} kg·m² with a standard uncertainty of {uncertainty:g} kg·m²",
            inertia=inertia,
            uncertainty=uncertainty,
        )
    )
    known = outcome.uncertainties.standard("inertia as given", inertia, uncertainty)
    for name, rate in (("coulomb_friction", "coulomb_deceleration"), ("viscous_friction", "viscous_rate")):
        outcome.parameter(
            name,
            known * rates[rate],
            estimator="fit of the whole coast-down × inertia",
            misfit=fit.misfit.of(rate, name),
        )


def _fit(records: Sequence[RampRecord], error: ErrorInput | None = None, by: float = 0.0, *, driven: bool) -> Fit:
    parts = [part for record in records for part in split(record.ramp(error, by))]
    if driven:
        return fit_ramps(parts)
    return fit_coast_downs(parts)


def _uses(records: Sequence[RampRecord]) -> dict[str, Sequence[str]]:
    """Return the channels by kind."""
    torques = dict.fromkeys(record.torque_name for record in records if record.torque_name)
    uses: dict[str, Sequence[str]] = {"speed": tuple(dict.fromkeys(record.speed.name for record in records))}
    if torques:
        uses["torque"] = tuple(torques)
    uses["time"] = ("time",)
    return uses
