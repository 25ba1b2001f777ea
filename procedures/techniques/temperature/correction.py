"""Copper and magnets at the temperature they were measured at, and at 25 °C."""

from typing import Any

from GTC.lib import UncertainReal

from drivers.interfaces.text import text
from procedures.core.actions import EnterReading
from procedures.core.bench import ProcedureError
from procedures.core.budget import Uncertainties
from procedures.core.nameplate import Nameplate
from procedures.core.procedure import Procedure
from procedures.techniques.temperature.settings import COLD

#: By which share the temperature coefficient of the remanence differs between grades of one magnet material.
MAGNET_SPREAD = 0.3
#: A doubtful temperature is taken once it was read so many times in a row within this (K); it is asked for so many times at most.
_CONFIRMED, _ALIKE, _QUESTIONS = 3, 1.0, 6
#: The truth is at one of two ends, which a root of squares does not move, and the resistance bends between them: so much further.
_TWO_ENDS = 1.6
#: What an ordinary room is at (°C).
_ROOM = (15.0, 30.0)
_KEY, _RANGE = "winding_temperature", (-60.0, 250.0)


def winding_temperature(procedure: Procedure[Any], given: float | None, half_width: float) -> UncertainReal:
    """Return the winding's temperature (°C), known within ± `half_width` (K): as set, as last read, else as a person reads it now.

    One unlike a room's, or unlike the winding's before, is asked for again before it is used; confirmed twice it is taken, with a
    notice. Raises ProcedureError where it is above the motor's, or where what is typed contradicts itself.
    """
    bench, nameplate = procedure.bench, procedure.nameplate
    now = bench.clock.now()
    known = bench.thermometer.known(now) if given is None else given
    if known is None:
        known = _read(procedure)
    if given is None and bench.thermometer.unlike is not None:
        low, high = bench.thermometer.unlike
        procedure.notice(
            "winding-temperature",
            text(
                "winding temperature {typed:g} °C is unlike what is usual here, {low:g} … {high:g} °C, and was "
                "confirmed: all values referred to 25 °C depend on it",
                typed=known,
                low=low,
                high=high,
            ),
        )
    read = bench.thermometer.take(check_temperature(nameplate, known), half_width, now)
    other = _with_other_point(known) if given is None and bench.thermometer.unlike is not None else None
    if other is None:
        return read
    procedure.notice(
        "decimal-point",
        text(
            "with its decimal point moved, winding temperature {typed:g} °C would be {other:g} °C, an ordinary room's: the interval holds "
            "both. Where {typed:g} °C is right, state it as the setting winding_temperature",
            typed=known,
            other=other,
        ),
    )
    half = 0.5 * (other - known)
    return read + bench.uncertainties.limit("winding temperature, decimal point", half, _TWO_ENDS * abs(half))


def _read(procedure: Procedure[Any]) -> float:
    bench = procedure.bench
    low, high = bench.thermometer.usual(procedure.nameplate.maximum_winding_temperature)
    typed = [bench.reading(EnterReading(_KEY, text("the winding's temperature"), "°C", *_RANGE, (low, high)))]
    while not low <= typed[-1] <= high:
        doubted = {"typed": typed[-1], "low": low, "high": high}
        latest = typed[-_CONFIRMED:]
        if len(latest) == _CONFIRMED and max(latest) - min(latest) <= _ALIKE:
            break
        if len(typed) == _QUESTIONS:
            raise ProcedureError(
                text(
                    "the winding's temperature was read as {typed} °C, which contradict each other and what is usual here, "
                    "{low:g} … {high:g} °C; look at the thermometer, and run again",
                    **{**doubted, "typed": [f"{value:g}" for value in typed]},
                )
            )
        again = text(
            "the winding's temperature once more ({typed:g} °C is unlike what is usual here, {low:g} … {high:g} °C; look at the decimal "
            "point and the unit)",
            **doubted,
        )
        typed.append(bench.reading(EnterReading(_KEY, again, "°C", *_RANGE)))
    bench.thermometer.unlike = None if low <= typed[-1] <= high else (low, high)
    return typed[-1]


def _with_other_point(typed: float) -> float | None:
    """Return a temperature (°C) with its decimal point moved to where it is an ordinary room's; None where no place makes it one."""
    low, high = _ROOM
    return next((other for other in (0.1 * typed, 10.0 * typed) if low <= other <= high), None)


def check_temperature(nameplate: Nameplate, temperature: float) -> float:
    """Return a winding's temperature (°C). Raises ProcedureError where it is above the motor's."""
    limit = nameplate.maximum_winding_temperature
    if limit is not None and temperature > limit:
        raise ProcedureError(
            text(
                "winding temperature = {temperature:.4g} °C is above {limit:.4g} °C, the limit of the motor "
                "(nameplate.maximum_winding_temperature); let it cool",
                temperature=temperature,
                limit=limit,
            )
        )
    return temperature


def warmed(temperature: float, rise: float, coefficient: float, reference: float) -> float:
    """Return the temperature (°C) of copper whose resistance rose by `rise` (relative) from what it was at `temperature`.

    `coefficient` (1/K) holds at `reference` (°C).
    """
    return temperature + rise * (1.0 / coefficient + temperature - reference)


def magnet_factor(
    uncertainties: Uncertainties, measured_at: UncertainReal, coefficient: float, half_width: float | None = None
) -> UncertainReal:
    """Return what takes a flux linkage from a temperature (°C) to 25 °C.

    `coefficient` (1/K) is the magnets', about −0.001, known within ± `half_width`, or within the spread of NdFeB grades.
    """
    known = abs(coefficient) * MAGNET_SPREAD if half_width is None else half_width
    magnets = uncertainties.limit("magnets' temperature coefficient", coefficient, known)
    return 1.0 / (1.0 + magnets * (measured_at - COLD))
