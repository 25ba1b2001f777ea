"""The column of time of a plain table: which one it is, and its unit."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from bench.captures.capture import CaptureChannel, CaptureError
from bench.captures.no_heading import refuse_another_time
from bench.captures.units import si, split_heading
from drivers.interfaces.text import Text, text

_TIME = {"t", "time", "timestamp", "zeit", "x-axis", "seconds", "second"}


def take_time(
    path: Path,
    columns: list[CaptureChannel],
    assumptions: list[Text],
    first: int,
    time_column: str | None,
    time_unit: str | None,
    *,
    no_heading: bool,
    said: str,
) -> tuple[bool, bool]:
    """Put the column of time to the front, in s; return whether there is one, and whether its unit is open.

    `first` is the first row of numbers, `said` the unit as the first column's heading says it. Raises CaptureError.
    """
    if time_column is not None:
        columns.insert(0, columns.pop(_place(path, columns, time_column)))
        if columns[0].unit not in ("", "s"):
            raise CaptureError(
                str(path),
                text(
                    "--time-column {name}: it is in {unit}; allowed is a column in s, ms, µs or min, or without a unit",
                    name=time_column,
                    unit=columns[0].unit,
                ),
            )
    else:
        _time_to_the_front(columns, assumptions)
        if columns[0].unit != "s" and columns[0].name.lower() not in _TIME:
            return False, False
    if columns[0].unit not in ("", "s"):
        raise CaptureError(
            str(path),
            text(
                "the time column '{name}' is in '{unit}', which is not a known unit of time; allowed are s, "
                "ms, µs, ns and min",
                name=columns[0].name,
                unit=said or columns[0].unit,
            ),
            first,
        )
    unit_open = not columns[0].unit or no_heading
    if time_unit is not None:
        columns[0] = _in_unit(path, columns[0], time_unit, unit_open=unit_open)
        assumptions.append(text("time is in {unit}, as --time-unit says", unit=time_unit))
        unit_open = False
    elif not columns[0].unit:
        assumptions.append(text("time taken to be in s"))
    if no_heading and time_column is None:
        refuse_another_time(path, columns, first)
    return True, unit_open


def _time_to_the_front(columns: list[CaptureChannel], assumptions: list[Text]) -> None:
    """Put the one column that is a time to the front, where the first is none."""
    named = [k for k, each in enumerate(columns) if each.unit == "s" or (each.name.lower() in _TIME and not each.unit)]
    if len(named) == 1 and named[0] and columns[0].unit != "rad" and np.all(np.diff(columns[named[0]].values) > 0.0):
        columns.insert(0, columns.pop(named[0]))
        assumptions.append(text("time is column '{name}'", name=columns[0].name))


def _in_unit(path: Path, time: CaptureChannel, unit: str, *, unit_open: bool) -> CaptureChannel:
    """Return the column of time in s, from the unit that was typed. Raises CaptureError where the file says one."""
    known = si(unit)
    if not unit_open or known is None:
        raise CaptureError(
            str(path),
            text(
                "--time-unit {unit}: column '{name}' states its unit itself; if that unit is wrong, correct the "
                "heading",
                unit=unit,
                name=time.name,
            ),
        )
    return replace(time, unit="s", values=time.values * known[1])


def _place(path: Path, columns: list[CaptureChannel], wanted: str) -> int:
    """Return the index of a column by its name, or by its number from 1. Raises CaptureError for one that is not there."""
    names = [column.name.lower() for column in columns]
    for name in (wanted.lower(), split_heading(wanted)[0].lower()):
        if name in names:
            return names.index(name)
    if wanted.isdecimal() and 1 <= int(wanted) <= len(columns):
        return int(wanted) - 1
    raise CaptureError(
        str(path),
        text(
            "--time-column {name}: no such column; allowed are {names}, or a number from 1 to {count}",
            name=wanted,
            names=[column.name for column in columns],
            count=len(columns),
        ),
    )
