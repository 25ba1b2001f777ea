"""Readings of a map that earlier sessions of a run took, put together again from what their instruments did."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, TypeVar

from drivers.interfaces import Accuracy, DqReading, DynamometerReading, Role
from procedures.core.earlier_call import EarlierAttempt
from procedures.estimation.flux.plan import PlannedReading
from procedures.techniques.maps.readings import MapPoint, MapReadings

#: Below so many readings a session is measured again: they would tell less than tying them takes.
_LEAST = 16
_SETS = ("driving_dq_current", "set_dq_current")

R = TypeVar("R", DqReading, DynamometerReading)


def earlier_points(attempt: EarlierAttempt, session: int) -> Sequence[MapPoint]:
    """Return the points that an attempt at a flux map read to their end, both instruments' readings, as those of a session."""
    made: list[MapPoint] = []
    wanted, reading = (0.0, 0.0), None
    for call in attempt:
        if call.role == Role.INVERTER.value and call.call in _SETS and len(call.arguments) == 2:
            wanted, reading = (float(call.arguments[0]), float(call.arguments[1])), None
        elif call.role == Role.INVERTER.value and call.call == "measure_dq" and isinstance(call.value, Mapping):
            reading = _restored(DqReading, call.value)
        elif call.role == Role.DYNAMOMETER.value and call.call == "measure" and reading is not None:
            if isinstance(call.value, Mapping):
                shaft = _restored(DynamometerReading, call.value)
                planned = PlannedReading(*wanted, 1 if shaft.speed > 0.0 else -1)
                made.append(MapPoint(planned, reading, shaft, session))
            reading = None
    return made


def earlier_readings(attempts: Sequence[EarlierAttempt]) -> MapReadings:
    """Return what earlier sessions read, and the number of the next one; a session with too few readings to be tied is left out."""
    taken = MapReadings()
    for attempt in attempts:
        points = earlier_points(attempt, taken.session)
        if len(points) >= _LEAST:
            taken.points += points
            taken.session += 1
    return taken


def _restored(kind: type[R], stored: Mapping[str, Any]) -> R:
    """Return a reading from what the journal has of it; numbers without a form in JSON stand there as words."""
    values: dict[str, Any] = {}
    for name in (each.name for each in fields(kind)):
        if name not in stored:
            continue
        value = stored[name]
        values[name] = _accuracy(value) if isinstance(value, Mapping) else float(value)
    return kind(**values)


def _accuracy(stored: Mapping[str, Any]) -> Accuracy:
    numbers = {name: float(value) for name, value in stored.items() if name != "source"}
    return Accuracy(**numbers, source=str(stored.get("source", "")))
