"""What an impedance bridge's table says beside its inductances: the test frequency, and that they are those of a parallel circuit."""

import re
from dataclasses import replace

import numpy as np

from bench.captures import Capture, CaptureChannel, CaptureError
from drivers.interfaces.text import Text, text

_FREQUENCY = re.compile(r"f|freq\w*(\W.*)?", re.IGNORECASE)
_PARALLEL, _LOSS = (
    re.compile(r"l[\s_]?p(ar)?\b|.*parallel", re.IGNORECASE),
    re.compile(r"r[\s_]?p(ar)?\b", re.IGNORECASE),
)
#: "L_p" and "Lp_uH" are the same name.
_JOINED = str.maketrans("_", " ")
_IN_A_NAME = re.compile(r"(\d+(?:\.\d+)?)\s*(k?)hz", re.IGNORECASE)
#: Frequencies that differ by less than this share are one.
_SAME = 0.01


def at_one_frequency(capture: Capture, wanted: float | None) -> tuple[Capture, float | None]:
    """Return the rows of one test frequency, and that frequency (Hz), None where nothing states it.

    `wanted` (Hz) chooses among several, or states it where no column does. Raises CaptureError where a column has several and none of them
    is wanted.
    """
    column = next(
        (c for c in capture.channels if c.unit == "Hz" or (not c.unit and _FREQUENCY.fullmatch(c.name))), None
    )
    if column is None:
        return capture, wanted
    there: list[float] = []
    for value in column.values:
        if not any(abs(value - known) <= _SAME * known for known in there):
            there.append(float(value))
    chosen = wanted if wanted is not None else there[0]
    kept = np.abs(column.values - chosen) <= _SAME * chosen
    if (wanted is None and len(there) > 1) or not np.any(kept):
        raise CaptureError(
            capture.source,
            text(
                "column '{name}' has readings at {there} Hz. An inductance differs with the test frequency: choose one with --frequency",
                name=column.name,
                there=[f"{value:g}" for value in sorted(there)],
            ),
        )
    rest = tuple(replace(c, values=c.values[kept]) for c in capture.channels if c is not column)
    time = None if capture.time is None else capture.time[kept]
    return replace(capture, channels=rest, time=time, first_line=capture.first_line if np.all(kept) else 0), chosen


def in_series(
    capture: Capture, inductance: CaptureChannel, frequency: float | None
) -> tuple[CaptureChannel, CaptureChannel | None, Text | None]:
    """Return the inductances of the series circuit, the column that is the parallel resistance if there is one, and what was done.

    Ls = Lp·Q²/(1 + Q²), with Q from its own column, from D = 1/Q, or from Rp and the `frequency` (Hz). Raises CaptureError for parallel
    inductances without any of these.
    """
    if not _PARALLEL.match(inductance.name.translate(_JOINED)):
        return inductance, None, None
    q = next((c for c in capture.channels if c.name.lower() == "q"), None)
    d = next((c for c in capture.channels if c.name.lower() == "d"), None)
    lossy = next((c for c in capture.channels if c.unit == "Ω" and _LOSS.match(c.name.translate(_JOINED))), None)
    named = _IN_A_NAME.search(inductance.name)
    if frequency is None and named:
        frequency = float(named[1]) * (1e3 if named[2] else 1.0)
    with np.errstate(divide="ignore"):
        if q is not None:
            squared = np.square(q.values)
        elif d is not None:
            squared = 1.0 / np.square(d.values)
        elif lossy is not None and frequency:
            squared = np.square(lossy.values / (2.0 * np.pi * frequency * inductance.values))
        else:
            raise CaptureError(
                capture.source,
                text(
                    "'{name}' is read as the inductance of a parallel circuit (Lp), which is larger than that of the winding in series "
                    "with its resistance by a share of 1/Q². Set the meter to Ls; or add a column Q, D, or Rp (Ohm) with --frequency in "
                    "Hz. If the name means something else, rename the column L",
                    name=inductance.name,
                ),
            )
        values = inductance.values / (1.0 + 1.0 / squared)
    if not np.all(squared > 0.0):
        raise CaptureError(
            capture.source,
            text(
                "Q, D and Rp must be other than zero in every row; correct the readings beside {name}",
                name=inductance.name,
            ),
        )
    by = q or d or lossy
    return (
        replace(inductance, values=values),
        lossy,
        text(
            "'{name}' is the inductance of a parallel circuit; converted to that of the series circuit with {by}",
            name=inductance.name,
            by=by.name if by else "",
        ),
    )
