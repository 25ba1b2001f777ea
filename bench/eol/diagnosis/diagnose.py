"""From what a failed motor's procedures found to the parts at fault."""

import math
from collections.abc import Collection, Mapping
from typing import Any

from bench.eol.diagnosis.diagnosed import Diagnosis, Evidence
from bench.eol.diagnosis.rotor import drag_faults, hall_faults, insulation_faults, magnet_faults
from bench.eol.diagnosis.windings import lead_faults, winding_faults
from bench.eol.record import MeasuredFigure
from bench.eol.verdict import Verdict
from procedures.core.procedure_error import MotorFaultError, OnlyBoundedError
from procedures.verification.verifier import WiringError

_RULES = (lead_faults, insulation_faults, winding_faults, magnet_faults, hall_faults, drag_faults)


def diagnose(
    findings: Mapping[str, Mapping[str, Any]],
    figures: Collection[MeasuredFigure],
    errors: Collection[BaseException],
    expected: Mapping[str, float] | None = None,
) -> tuple[Diagnosis, ...]:
    """Return the parts at fault of a motor that failed, the likeliest first; nothing where no rule knows what it was.

    `findings` are its procedures' by name, `errors` what ended those that gave nothing, `expected` the type's values.
    """
    mistakes = [dict(mistake) for error in errors if isinstance(error, WiringError) for mistake in error.possible]
    evidence = Evidence(
        findings,
        {figure.parameter: _over_middle(figure) for figure in figures if _is_outside(figure)},
        {figure.parameter: figure.value for figure in figures if math.isfinite(figure.value)},
        mistakes,
        [error.part for error in errors if isinstance(error, MotorFaultError)],
        expected or {},
        {error.parameter: error.low for error in errors if isinstance(error, OnlyBoundedError)},
    )
    return tuple(diagnosis for rule in _RULES for diagnosis in rule(evidence))


def _is_outside(figure: MeasuredFigure) -> bool:
    """Say whether a figure that failed is itself beyond its limits, and farther from their middle than it may be wrong.

    One that only its uncertainty reaches over them, or that may as well be the middle, accuses no part.
    """
    if figure.verdict is not Verdict.FAIL or figure.low <= figure.value <= figure.high:
        return False
    middle = 0.5 * (figure.low + figure.high)
    return not (math.isfinite(middle) and abs(figure.value - middle) <= figure.expanded)


def _over_middle(figure: MeasuredFigure) -> float:
    middle = 0.5 * (figure.low + figure.high)
    return figure.value / middle if math.isfinite(middle) and middle else math.nan
