"""Records as flat rows, one a figure: what CSV and Parquet have in common."""

import math
from collections.abc import Iterator
from typing import Any

from bench.eol.record import MeasuredFigure, MotorRecord

#: Columns of the motor, then of the figure; the latter are empty in the one row of a motor that has no figure.
MOTOR_COLUMNS = (
    "identifier",
    "batch",
    "number",
    "serial_number",
    "model",
    "plan",
    "plan_sha256",
    "station",
    "socket",
    "person",
    "started",
    "ended",
    "motor_verdict",
    "first_pass",
    "bench_time",
    "cause",
    "run",
    "journal_sha256",
    "diagnosis",
    "rework",
    "test_number",
    "again_by",
    "golden",
)
FIGURE_COLUMNS = (
    "parameter",
    "value",
    "unit",
    "standard_uncertainty",
    "expanded",
    "low",
    "high",
    "verdict",
)


def rows(record: MotorRecord) -> Iterator[dict[str, Any]]:
    """Give a record's rows; None stands for a number that is none and for a limit that is not there."""
    motor = {name: getattr(record, name) for name in MOTOR_COLUMNS if name != "motor_verdict"}
    motor["motor_verdict"] = record.verdict.value
    if not record.measured:
        yield {**motor, **dict.fromkeys(FIGURE_COLUMNS)}
    for figure in record.measured:
        yield {**motor, **_figure(figure)}


def _figure(figure: MeasuredFigure) -> dict[str, Any]:
    numbers = {name: getattr(figure, name) for name in ("value", "standard_uncertainty", "expanded", "low", "high")}
    return {
        "parameter": figure.parameter,
        "unit": figure.unit,
        "verdict": figure.verdict.value,
        **{name: number if math.isfinite(number) else None for name, number in numbers.items()},
    }
