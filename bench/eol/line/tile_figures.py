"""A motor's figures on its socket's tile: those outside, and of the others the one nearest a limit."""

import math
from typing import Any

from bench.eol.record import MeasuredFigure, MotorRecord
from bench.eol.verdict import Verdict
from bench.journal.stored_result import store_text
from procedures.core.parameters import PARAMETERS
from reports.labels import ParameterLabels
from reports.tables.figures import decimals_for, figure, scale_of

#: Share of the limits' width that a picture shows beyond either limit.
_BEYOND = 0.5


def tile_figures(record: MotorRecord) -> dict[str, Any]:
    """Return, ready for JSON, `outside` (a list), `inside` and `limited` (counts), and `closest` (None where no figure has two limits)."""
    labels = ParameterLabels({one.parameter: one.label for one in record.measured})
    limited = [one for one in record.measured if math.isfinite(one.low) or math.isfinite(one.high)]
    failed = [one for one in limited if one.verdict is Verdict.FAIL]
    inside = [one for one in limited if one.verdict is Verdict.PASS]
    closest = min(inside, key=_left, default=None)
    if closest is not None and not math.isfinite(_left(closest)):
        closest = None
    return {
        "outside": [{"label": store_text(labels[one.parameter]), **_printed(one)} for one in failed],
        "inside": len(inside),
        "limited": len(limited),
        "closest": None
        if closest is None
        else {"label": store_text(labels[closest.parameter]), "left": round(_left(closest), 1)},
    }


def _left(one: MeasuredFigure) -> float:
    """Return how much (%) of the way from the middle to a limit is left; infinite where a side is open."""
    half = (one.high - one.low) / 2.0
    if not math.isfinite(half) or half <= 0.0:
        return math.inf
    return 100.0 * min(one.value - one.low, one.high - one.value) / half


def _printed(one: MeasuredFigure) -> dict[str, Any]:
    definition = PARAMETERS.get(one.parameter)
    scale = scale_of(one.value, (definition.reader_unit if definition is not None else "") or one.unit)
    value = one.value / scale.factor
    decimals = decimals_for(one.expanded / scale.factor, value)

    def limit(bound: float) -> str:
        return figure(bound / scale.factor, decimals) if math.isfinite(bound) else ""

    width = one.high - one.low
    place = None
    if math.isfinite(width) and width > 0.0:
        place = min(max((one.value - one.low) / width, -_BEYOND), 1.0 + _BEYOND)
    return {
        "value": figure(value, decimals),
        "unit": scale.unit,
        "low": limit(one.low),
        "high": limit(one.high),
        "place": None if place is None else round((place + _BEYOND) / (1.0 + 2.0 * _BEYOND), 4),
    }
