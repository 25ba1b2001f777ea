"""Single figures out of the database, for what needs them one by one: gauge studies and golden motors."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, select, true

from bench.eol.limits import ParameterLimits, limits_of
from bench.eol.store.records import utc
from bench.eol.store.schema import FIGURE, MOTOR
from bench.eol.store.selection import Selection
from bench.eol.store.tallies import ends_of
from bench.i18n.errors import InputError
from drivers.interfaces.text import text

#: A study is some dozens of motors; what has more is a batch.
_MOST = 10_000
_APPRAISERS = {"person": text("person"), "socket": text("socket")}


@dataclass(frozen=True)
class Crossed:
    """A crossed study of one parameter: `values` by appraiser, part (serial number) and trial, in `unit`."""

    parameter: str
    unit: str
    appraisers: tuple[str, ...]
    parts: tuple[str, ...]
    values: NDArray[np.float64]


def crossed(
    connection: Connection,
    parameter: str,
    selection: Selection,
    appraiser: Literal["person", "socket"],
    *,
    once: bool = False,
) -> Crossed:
    """Return the selection's figures as a crossed study: part = serial number, trial = repetition in the order kept.

    With `once` one repetition is enough (range method). Raises InputError where the study is not complete; it says which part
    and appraiser has how many.
    """
    query = (
        select(MOTOR.c.serial_number, MOTOR.c[appraiser], FIGURE.c.value, FIGURE.c.unit)
        .join(MOTOR, MOTOR.c.id == FIGURE.c.motor)
        .where(FIGURE.c.parameter == parameter, selection.holds(FIGURE.c.motor))
        .order_by(FIGURE.c.motor)
        .limit(_MOST + 1)
    )
    rows = connection.execute(query).all()
    if len(rows) > _MOST:
        raise InputError(
            text(
                "{parameter}: a gauge study has at most {most} figures; name the batches of the study",
                parameter=parameter,
                most=_MOST,
            )
        )
    cells: dict[tuple[str, str], list[float | None]] = {}
    for part, who, value, _ in rows:
        cells.setdefault((who, part), []).append(value)
    appraisers = sorted({who for who, _ in cells})
    parts = sorted({part for _, part in cells})
    trials = max((len(cell) for cell in cells.values()), default=0)
    for who in appraisers:
        for part in parts:
            cell = cells.get((who, part), [])
            if len(cell) != trials or None in cell:
                raise InputError(
                    text(
                        "{parameter}: {part} has {count} figures by {appraiser} {who!r} and "
                        "others have {trials}; in a crossed study every {appraiser} measures every motor equally often",
                        parameter=parameter,
                        part=part,
                        count=len([v for v in cell if v is not None]),
                        appraiser=_APPRAISERS[appraiser],
                        who=who,
                        trials=trials,
                    )
                )
    if min(len(appraisers), len(parts)) < 2 or trials < (1 if once else 2):
        raise InputError(
            text(
                "{parameter}: a crossed study needs 2 {appraiser}s, 2 motors and {least} repetitions at least; the records have "
                "{people}, {motors} and {trials}",
                least=1 if once else 2,
                parameter=parameter,
                appraiser=_APPRAISERS[appraiser],
                people=len(appraisers),
                motors=len(parts),
                trials=trials,
            )
        )
    values = np.array([[cells[who, part] for part in parts] for who in appraisers], dtype=np.float64)
    return Crossed(parameter, rows[0][3], tuple(appraisers), tuple(parts), values)


def figures_of(
    connection: Connection, parameter: str, selection: Selection, serial_numbers: Sequence[str]
) -> tuple[dict[str, list[float]], str]:
    """Return all figures of some motors by serial number, in the order kept, and their unit. Raises InputError for a motor without."""
    query = (
        select(MOTOR.c.serial_number, FIGURE.c.value, FIGURE.c.unit)
        .join(MOTOR, MOTOR.c.id == FIGURE.c.motor)
        .where(
            MOTOR.c.serial_number.in_(serial_numbers),
            FIGURE.c.parameter == parameter,
            FIGURE.c.value.is_not(None),
            selection.holds(FIGURE.c.motor),
        )
        .order_by(FIGURE.c.motor)
        .limit(_MOST)
    )
    rows = connection.execute(query).all()
    figures = {serial: [row.value for row in rows if row.serial_number == serial] for serial in serial_numbers}
    missing = [serial for serial, values in figures.items() if not values]
    if missing:
        raise InputError(text("{parameter}: there are no figures of {names}", parameter=parameter, names=missing))
    return figures, rows[0].unit


def latest_limits(connection: Connection, parameter: str, selection: Selection) -> ParameterLimits:
    """Return the limits of a parameter's latest figure; open ones where there is none."""
    rows = ends_of(connection, parameter, true(), selection, 1)
    return limits_of(rows[0].low, rows[0].high) if rows else ParameterLimits()


def tests_of(
    connection: Connection, parameter: str, serial_numbers: Sequence[str]
) -> dict[tuple[str, str, str], list[tuple[datetime, float]]]:
    """Return when (UTC) and with which value each of some motors was measured, by serial number, station and socket, the earliest first.

    Of very many tests the latest 10 000.
    """
    tests = connection.execute(
        select(MOTOR.c.id, MOTOR.c.serial_number, MOTOR.c.station, MOTOR.c.socket, MOTOR.c.started)
        .where(MOTOR.c.serial_number.in_(serial_numbers))
        .order_by(MOTOR.c.started.desc(), MOTOR.c.id.desc())
        .limit(_MOST)
    ).all()[::-1]
    if not tests:
        # Of no motor a database would look through all figures of the parameter.
        return {}
    figures = select(FIGURE.c.motor, FIGURE.c.value).where(
        FIGURE.c.parameter == parameter,
        FIGURE.c.motor.in_([test.id for test in tests]),
        FIGURE.c.value.is_not(None),
    )
    values = {row.motor: row.value for row in connection.execute(figures)}
    values_there: dict[tuple[str, str, str], list[tuple[datetime, float]]] = {}
    for key, serial, station, socket, started in tests:
        if key in values:
            values_there.setdefault((serial, station, socket), []).append((utc(started), values[key]))
    return dict(sorted(values_there.items()))
