"""The deceleration of a coast-down at named speeds, with the stated accuracy of speed and time."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from bench.analysis.applied import AppliedAccuracy
from bench.analysis.outcome import AnalysisOutcome
from bench.analysis.ramp_record import RampRecord
from bench.captures import CaptureError
from drivers.interfaces.text import text
from procedures.core.parameter_definition import ParameterDefinition
from procedures.estimation.fitting.misfit import Cause, Misfit
from procedures.estimation.mechanics.deceleration import Deceleration, deceleration, top_of
from procedures.estimation.mechanics.turning import Run, SpeedRamp, turning

#: Where no speeds are asked for: shares of the top speed.
_SHARES = (0.25, 0.5, 0.75)
_RPM = math.pi / 30.0
_ESTIMATOR = "slope without a law of friction"
_DECELERATION = ParameterDefinition("deceleration", "", "rad/s²", text("Deceleration"), type_value=False)
_TORQUE = ParameterDefinition("friction_torque", "", "N·m", text("Friction torque"), type_value=False)


def detail_decelerations(
    outcome: AnalysisOutcome,
    record: RampRecord,
    applied: AppliedAccuracy,
    misfit: Misfit,
    at_speed: Sequence[float],
    inertia: float | None,
    inertia_uncertainty: float,
) -> None:
    """Add the table of decelerations (rad/s²) `at_speed` (rpm), or at 25, 50 and 75 % of the top speed as far as the record carries
    them; with an `inertia` (kg·m²) also of the friction torque (N·m).

    A filter that the `misfit` found is undone. Raises CaptureError for a speed that the shaft does not pass.
    """
    run = behind_filter(record.ramp(), misfit)
    top, low = top_of(run), float(run.speed[-1])
    for speed in at_speed:
        if not low < speed * _RPM < top:
            raise CaptureError(
                "--at-speed",
                text(
                    "{speed:g} rpm is not passed; allowed are speeds between {low:.5g} and {top:.5g} rpm, without a sign whichever way "
                    "the shaft turns",
                    speed=speed,
                    top=top / _RPM,
                    low=low / _RPM,
                ),
            )
    rows = []
    for speed in [each * _RPM for each in at_speed] or [share * top for share in _SHARES]:
        found = deceleration(run, speed)
        if found is not None and found.told:
            rows.append(_row(outcome, record, applied, misfit, found, inertia, inertia_uncertainty))
        elif at_speed:
            rows.append({"speed_rpm": speed / _RPM, "withheld": True})
    outcome.detail(decelerations=rows)


def behind_filter(ramp: SpeedRamp, misfit: Misfit) -> Run:
    """Return the part of a ramp that coasts, behind the filter that was found."""
    filters = [
        float(each.figures["time_constant"])
        for each in misfit.findings
        if each.cause is Cause.SPEED_FILTER and "time_constant" in each.figures
    ]
    run = turning(ramp, 1)
    return replace(run, speed_filter=run.speed_filter or max(filters, default=0.0))


def _row(
    outcome: AnalysisOutcome,
    record: RampRecord,
    applied: AppliedAccuracy,
    misfit: Misfit,
    found: Deceleration,
    inertia: float | None,
    inertia_uncertainty: float,
) -> Mapping[str, Any]:
    made = outcome.uncertainties
    quantity = made.statistical(
        text("slope at {speed:.5g} rpm", speed=found.speed / _RPM),
        found.value,
        found.uncertainty,
        found.degrees_of_freedom,
    )
    for error in applied.inputs():
        moved = [deceleration(behind_filter(record.ramp(error, by), misfit), found.speed) for by in (1.0, -1.0)]
        if moved[0] is not None and moved[1] is not None:
            quantity = applied.change(made, quantity, error, 0.5 * (moved[0].value - moved[1].value))
    figures = [(_DECELERATION, quantity)]
    if inertia is not None:
        figures.append((_TORQUE, quantity * made.standard("inertia as given", inertia, inertia_uncertainty)))
    row: dict[str, Any] = {"speed_rpm": found.speed / _RPM, "withheld": False}
    for each, value in figures:
        parameter = made.parameter(
            each.name, each.unit, value, procedure="inertia", section="3.5", estimator=_ESTIMATOR, definition=each
        )
        row[each.name] = {
            "value": parameter.value,
            "standard_uncertainty": parameter.standard_uncertainty,
            "coverage_interval": list(parameter.coverage_interval),
        }
    return row
