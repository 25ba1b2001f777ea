"""A motor that was tested again: what has changed since."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from bench.eol.record import MeasuredFigure, MotorRecord


@dataclass(frozen=True)
class ChangedFigure:
    """A figure of two tests that differs by more than both intervals, or in its verdict; values in `unit`."""

    parameter: str
    before: float
    after: float
    unit: str
    verdict_before: str
    verdict_after: str
    label: str = ""


def changed_figures(before: MotorRecord, after: MotorRecord) -> Iterator[ChangedFigure]:
    """Give what has changed between two tests of one motor, in the later one's order."""
    earlier = {figure.parameter: figure for figure in before.measured}
    for figure in after.measured:
        old = earlier.get(figure.parameter)
        if old is not None and (old.verdict is not figure.verdict or differs(old, figure)):
            yield ChangedFigure(
                figure.parameter,
                old.value,
                figure.value,
                figure.unit,
                old.verdict.value,
                figure.verdict.value,
                figure.label,
            )


def differs(before: MeasuredFigure, after: MeasuredFigure) -> bool:
    """Tell whether two figures differ by more than both expanded uncertainties."""
    if math.isnan(before.value) and math.isnan(after.value):
        return False
    reach = math.hypot(before.expanded, after.expanded)
    return abs(after.value - before.value) > reach if math.isfinite(reach) else before.value != after.value
