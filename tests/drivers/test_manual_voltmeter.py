"""A voltmeter read by hand: what a person is told and asked, and what is done with the answers."""

import math
from typing import Any

import pytest

from drivers.interfaces import Accuracy, MeasurementError, SetpointError
from drivers.manual.options import ManualVoltmeterOptions
from drivers.manual.voltmeter import ManualVoltmeter
from tests.drivers.person import Person

STATED = Accuracy(gain=5e-4, offset=2e-5, source="manual")


def voltmeter(person: Person, clock: Any, accuracy: Accuracy | None = STATED) -> ManualVoltmeter:
    return ManualVoltmeter(person, clock, ManualVoltmeterOptions("UT61E", 600.0, accuracy))


def test_it_is_set_and_read(clock: Any) -> None:
    person = Person(-0.0321)
    made = voltmeter(person, clock)
    made.configure(0.1)
    clock.time = 5.0
    reading = made.measure_voltage()
    assert (reading.value, reading.unit, reading.accuracy, reading.time) == (-0.0321, "V", STATED, 5.0)
    assert person.told == [
        "Set the voltmeter to DC volts, the smallest range that holds 0.1 V, "
        "integrating over 10 power-line cycles or its slowest rate."
    ]
    assert person.asked == [("DC voltage", "V", -0.1, 0.1, "with its sign, in volts")]
    assert made.identity.model == "UT61E"
    made.make_safe()
    made.close()
    assert len(person.told) == 1


def test_millivolts_typed_for_volts_are_asked_again(clock: Any) -> None:
    person = Person(32.1, math.nan, 0.0321)
    made = voltmeter(person, clock)
    made.configure(0.1)
    assert made.measure_voltage().value == 0.0321
    assert person.asked[1][4] == "with its sign, in volts (32.1 V is outside -0.1 … 0.1 V)"


def test_three_unusable_answers_are_an_error_naming_the_range(clock: Any) -> None:
    made = voltmeter(Person(32.1, 32.1, 32.1), clock)
    made.configure(0.1)
    with pytest.raises(MeasurementError, match=r"DC voltage: the value typed is outside -0\.1 … 0\.1 V"):
        made.measure_voltage()


@pytest.mark.parametrize(
    ("full_scale", "cycles", "message"),
    [(601.0, 10.0, "full scale = 601 V is outside 0 … 600 V"), (1.0, -1.0, "integration time = -1 power-line cycles")],
)
def test_nothing_is_asked_for_what_cannot_be(clock: Any, full_scale: float, cycles: float, message: str) -> None:
    person = Person()
    with pytest.raises(SetpointError, match=message):
        voltmeter(person, clock).configure(full_scale, cycles)
    assert person.told == []


def test_a_reading_needs_a_range_and_a_stated_accuracy(clock: Any) -> None:
    person = Person(1.0)
    with pytest.raises(MeasurementError, match=r"configure\(\) first"):
        voltmeter(person, clock).measure_voltage()
    made = voltmeter(person, clock, accuracy=None)
    made.configure(1.0)
    with pytest.raises(MeasurementError, match="no accuracy is stated for its voltage"):
        made.measure_voltage()
    assert person.asked == []


def test_accuracy_is_the_stations(clock: Any) -> None:
    made = voltmeter(Person(), clock)
    assert made.accuracy_at(-600.0) is STATED
    with pytest.raises(MeasurementError, match="601 V is beyond its range, 600 V"):
        made.accuracy_at(601.0)
