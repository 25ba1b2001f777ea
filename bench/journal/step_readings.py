"""Settings and readings of a step, from its events: one entry for each instrument and quantity."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TypeGuard

from bench.journal.codec import UnknownEvent
from bench.journal.events.instruments import Energising, InstrumentCall, ReadingTaken, SettingDone
from drivers.interfaces.text import Text, text
from procedures.core.actions import EnterReading
from procedures.core.events import ActionDone, ActionStarted, Event
from reports.document.record import ReadingsRecord

#: Quantities of readings that have several, with their units; what is not named here is no reading of its own.
_PARTS: Mapping[str, tuple[Text, str]] = {
    "resistance": (text("resistance"), "Ω"),
    "inductance": (text("inductance"), "H"),
    "speed": (text("speed"), "rad/s"),
    "torque": (text("torque"), "N·m"),
    "power": (text("power"), "W"),
    "d_current": (text("d-axis current"), "A"),
    "q_current": (text("q-axis current"), "A"),
    "d_voltage": (text("d-axis voltage"), "V"),
    "q_voltage": (text("q-axis voltage"), "V"),
    "electrical_speed": (text("electrical speed"), "rad/s"),
}
#: Quantities of readings of one value, by the call that gave them.
_CALLS: Mapping[str, Text] = {
    "measure_voltage": text("voltage"),
    "measure_current": text("current"),
    "measure_speed": text("speed"),
    "measure_frequency": text("frequency"),
    "measure_bus_voltage": text("bus voltage"),
    "measure_bus_current": text("bus current"),
    "measure_amplitude": text("amplitude"),
}
#: What calls set, by their arguments in order.
_SETTINGS: Mapping[tuple[str, str], tuple[tuple[Text, str], ...]] = {
    ("supply", "energised"): ((text("voltage"), "V"), (text("current limit"), "A")),
    ("inverter", "driving_frequency"): ((text("frequency"), "Hz"), (text("current"), "A")),
    ("inverter", "driving_current"): ((text("current"), "A"),),
    ("inverter", "set_current"): ((text("current"), "A"),),
    ("inverter", "driving_dq_current"): ((text("d-axis current"), "A"), (text("q-axis current"), "A")),
    ("inverter", "set_dq_current"): ((text("d-axis current"), "A"), (text("q-axis current"), "A")),
    ("inverter", "alternate_dq_current"): (
        (text("d-axis current"), "A"),
        (text("q-axis current"), "A"),
        (text("other d-axis current"), "A"),
        (text("other q-axis current"), "A"),
    ),
    ("dynamometer", "driving_speed"): ((text("speed"), "rad/s"),),
    ("dynamometer", "set_speed"): ((text("speed"), "rad/s"),),
    ("dynamometer", "driving_torque"): ((text("torque"), "N·m"),),
    ("lcr_meter", "configure"): ((text("frequency"), "Hz"), (text("level"), "V")),
}
_MARKS = text("marked angles")


class _Gathered:
    """Values of one quantity as they come; `name` tells quantities of one English word apart by their translation."""

    def __init__(self, instrument: str, quantity: Text, unit: str, *, was_set: bool) -> None:
        self.instrument, self.quantity, self.unit, self.was_set = instrument, quantity, unit, was_set
        self.values: list[float] = []


def readings_of(events: Iterable[Event | UnknownEvent]) -> tuple[ReadingsRecord, ...]:
    """Return what a step's events set and read, in the order in which each quantity came first."""
    found: dict[tuple[str, str, str, bool], _Gathered] = {}
    asked: Text | None = None
    unit = ""
    for event in events:
        if isinstance(event, ActionStarted):
            action = event.details
            asked, unit = (action.quantity, action.unit) if isinstance(action, EnterReading) else (None, "")
            continue
        for instrument, quantity, quantity_unit, value, was_set in _values(event, asked, unit):
            key = (instrument, str(quantity), quantity_unit, was_set)
            gathered = found.setdefault(key, _Gathered(instrument, quantity, quantity_unit, was_set=was_set))
            gathered.values.append(value)
    return tuple(ReadingsRecord(g.instrument, g.quantity, g.unit, tuple(g.values), g.was_set) for g in found.values())


def _values(event: Event | UnknownEvent, asked: Text | None, unit: str) -> Iterator[tuple[str, Text, str, float, bool]]:
    match event:
        case ReadingTaken():
            for quantity, quantity_unit, value in quantities_read(event):
                yield event.instrument, quantity, quantity_unit, value, False
        case Energising() | SettingDone():
            for quantity, quantity_unit, value in set_points(event):
                yield event.instrument, quantity, quantity_unit, value, True
        case ActionDone(given=given):
            if asked is not None and _is_number(given):
                yield "", asked, unit, float(given), False
            elif isinstance(given, Sequence) and not isinstance(given, str):
                for value in given:
                    yield "", _MARKS, "rad", float(value), False


def set_points(call: InstrumentCall) -> Iterator[tuple[Text, str, float]]:
    """Yield quantity, unit and value of each figure that a call sets."""
    known = _SETTINGS.get((call.instrument, call.call), ())
    for (quantity, unit), value in zip(known, call.arguments, strict=False):
        if _is_number(value):
            yield quantity, unit, float(value)


def quantities_read(reading: ReadingTaken) -> Iterator[tuple[Text, str, float]]:
    """Yield quantity, unit and value of each figure in a reading's event; a figure that has no name here is left out."""
    value = reading.value
    if not isinstance(value, Mapping):
        return
    if "value" in value and _is_number(value["value"]):
        quantity = _CALLS.get(reading.call)
        if quantity is not None:
            yield quantity, str(value.get("unit", "")), float(value["value"])
        return
    for name, (quantity, unit) in _PARTS.items():
        part = value.get(name)
        if _is_number(part):
            yield quantity, unit, float(part)


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)
