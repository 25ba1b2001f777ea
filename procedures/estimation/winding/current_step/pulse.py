"""Detects voltages that are not the step of a plain supply: of a switching drive, or a pulse that ends before the current."""

import numpy as np

from procedures.estimation.fitting.fit import FloatArray, WithheldError
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit

#: A voltage switches that rises so many times from one level to the other, this share of its samples within so much of their distance of
#: either, which is that share of the largest voltage.
_RISES, _SHARE, _NEAR, _APART = 4, 0.7, 0.15, 0.3
#: A voltage is on above the first share of its level, and off below the second.
_ON, _OFF = 0.8, 0.3
#: A pulse is on for so many samples, all but this share of those from its first to its last, and for so many times as long as it falls.
_LEAST_ON, _WITHOUT, _SHARP = 20, 0.1, 5.0
#: What is off zero by less than this share of the levels' distance is an offset.
_LOW = 0.02
#: Of records that end with a voltage the last tenth is looked at.
_LAST = 10


def check_switching(time: FloatArray, voltage: FloatArray, edge: int, resolution: float) -> None:
    """Raise WithheldError where a voltage (n,) takes two levels many times from sample `edge` on, as that of a drive does.

    `resolution` (V) is one converter step. What the winding got between two samples is not known of such a voltage.
    """
    v = voltage[edge:]
    middle = 0.5 * (float(np.max(v)) + float(np.min(v)))
    above = v > middle
    if not np.any(above) or np.all(above):
        return
    high, low = float(np.median(v[above])), float(np.median(v[~above]))
    apart = high - low
    if apart < max(_APART * float(np.max(np.abs(v))), 3.0 * resolution):
        return
    if np.mean(np.minimum(np.abs(v - high), np.abs(v - low)) < _NEAR * apart) < _SHARE:
        return
    # What lies between the levels changes nothing.
    state = np.where(v > low + (1.0 - _OFF) * apart, 1, np.where(v < low + _OFF * apart, -1, 0))
    rises = np.flatnonzero(np.diff(state[state != 0]) > 0)
    if rises.size < _RISES:
        return
    places = np.flatnonzero(state != 0)[rises]
    figures: dict[str, float | str] = {
        "record": "step",
        "low": low if abs(low) > _LOW * apart else 0.0,
        "high": high,
        "frequency": float((rises.size - 1) / (time[edge + places[-1]] - time[edge + places[0]])),
    }
    raise WithheldError(
        "the voltage switches between two levels: use a step of a plain supply",
        Misfit((Finding(Cause.SWITCHING, Answer.WITHHELD, figures=figures),)),
    )


def ended_from(voltage: FloatArray) -> int | None:
    """Return the sample before which a pulse of voltage (n,) ends, None where the voltage lasts or dies away slowly."""
    moved = voltage - float(np.median(voltage[: max(3, voltage.size // 200)]))
    moved *= float(np.sign(moved[np.argmax(np.abs(moved))]))
    largest = float(np.max(moved))
    if largest <= 0.0:
        return None
    level = float(np.median(moved[moved > 0.5 * largest]))
    again = _next_pulse(moved, level)
    # Between two pulses the rest may be short.
    last = voltage.size // _LAST if again == voltage.size else _LEAST_ON // 2
    moved = moved[:again]
    if float(np.median(moved[-max(3, last) :])) > _OFF * level:
        return None
    on = np.flatnonzero(moved > _ON * level)
    if on.size < max(_LEAST_ON, (1.0 - _WITHOUT) * (on[-1] - on[0] + 1)):
        return None
    fall = int(np.argmax(moved[on[-1] :] < _OFF * level))
    return int(on[-1]) - fall if 0 < _SHARP * fall < on.size else None


def _next_pulse(moved: FloatArray, level: float) -> int:
    """Return the sample at which a second pulse of a few begins, after at least as long a rest as a pulse takes to count; n where none
    does. Of many, the voltage switches.
    """
    state = np.where(moved > _ON * level, 1, np.where(moved < _OFF * level, -1, 0))
    clear = np.flatnonzero(state)
    rises = clear[1:][np.diff(state[clear]) > 0]
    falls = clear[1:][np.diff(state[clear]) < 0]
    if not 2 <= rises.size < _RISES or not falls.size or falls[0] > rises[1]:
        return int(moved.size)
    return int(rises[1]) if rises[1] - falls[0] >= _LEAST_ON else int(moved.size)
