"""The set points and readings of a procedure's steps, as a table."""

from collections.abc import Iterable

from drivers.interfaces.text import Text, text
from reports.document.model import Cell, Column, Table, TableRow
from reports.document.record import ProcedureStepRecord, ReadingsRecord
from reports.labels import role_name
from reports.tables.figures import scale_of

#: More values than this are told by their range.
_LISTED = 6


def readings_table(steps: Iterable[ProcedureStepRecord]) -> Table | None:
    """Return a row for every quantity set or read in a step; None where there was nothing."""
    rows = [
        TableRow(
            [step.identifier, role_name(taken.instrument) if taken.instrument else "", _what(taken), *_values(taken)]
        )
        for step in steps
        for taken in step.readings
    ]
    if not rows:
        return None
    return Table(
        [
            Column(text("Step")),
            Column(text("Instrument")),
            Column(text("Quantity")),
            Column("n", right=True),
            Column(text("Values"), wide=True),
        ],
        rows,
    )


def _what(taken: ReadingsRecord) -> Text:
    return text("{quantity}, set", quantity=taken.quantity) if taken.was_set else taken.quantity


def _values(taken: ReadingsRecord) -> tuple[Cell, Cell]:
    values = list(taken.values)
    largest = max((abs(value) for value in values), default=0.0)
    scale = scale_of(largest, taken.unit)
    shown = [f"{value / scale.factor:.6g}" for value in values]
    unit = f" {scale.unit}" if scale.unit else ""
    low, high = min(values), max(values)
    if low == high:
        return str(len(values)), shown[0] + unit
    if len(values) <= _LISTED:
        return str(len(values)), ", ".join(shown) + unit
    return str(len(values)), f"{low / scale.factor:.6g} … {high / scale.factor:.6g}{unit}"
