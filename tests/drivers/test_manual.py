"""Manual instruments: what a person is told and asked, and what is done with the answers."""

import math
from typing import Any

import pytest

from drivers.interfaces import (
    Accuracy,
    ChannelSettings,
    InstrumentError,
    MeasurementError,
    OutputMode,
    ProbeKind,
    SetpointError,
    Slope,
    Trigger,
    Wanted,
)
from drivers.interfaces.text import Text
from drivers.manual.drive import ManualDrive
from drivers.manual.dynamometer import ManualDynamometer
from drivers.manual.inverter import ManualInverter
from drivers.manual.lcr_meter import ManualLcrMeter
from drivers.manual.options import (
    ManualDriveOptions,
    ManualDynamometerOptions,
    ManualInverterOptions,
    ManualLcrMeterOptions,
    ManualOscilloscopeOptions,
    ManualSupplyOptions,
    ManualTachometerOptions,
)
from drivers.manual.oscilloscope import ManualOscilloscope
from drivers.manual.supply import ManualSupply
from drivers.manual.tachometer import ManualTachometer
from tests.drivers.person import Person

RPM = 2 * math.pi / 60
STATED = Accuracy(gain=0.01, source="manual")


def supply(person: Person, clock: Any) -> ManualSupply:
    return ManualSupply(person, clock, ManualSupplyOptions(30.0, 3.0, "PS 303", STATED))


def test_a_supply_is_set_switched_on_and_off(clock: Any) -> None:
    person = Person(1.99, 2)
    made = supply(person, clock)
    clock.time = 5.0
    with made.energised(2.0, 0.5):
        reading = made.measure_voltage()
        assert made.output_mode() is OutputMode.CONSTANT_VOLTAGE
    assert person.told == [
        "Set the supply to 2 V, current limit 0.5 A; over-current protection on where it has one.",
        "Switch the supply's output on.",
        "Switch the supply's output off and make sure that it is.",
    ]
    assert (reading.value, reading.unit, reading.accuracy, reading.time) == (1.99, "V", STATED, 5.0)
    assert person.asked[0] == ("voltage", "V", 0.0, 30.0, "")


def test_a_person_who_said_that_it_is_off_is_not_asked_again_until_it_was_on(clock: Any) -> None:
    person = Person()
    made = supply(person, clock)
    off = "Switch the supply's output off and make sure that it is."
    made.make_safe()
    made.output_off()
    assert person.told == [off], "nobody knew how it was left"
    for _ in range(2):
        with made.energised(2.0, 0.5):
            pass
        made.output_off()
        made.make_safe()
    assert person.told.count(off) == 3
    assert person.told[-1] == off


def test_a_person_who_did_not_answer_is_asked_again(clock: Any) -> None:
    class Leaves(Person):
        def confirm(self, task: Text) -> None:
            super().confirm(task)
            if len(self.told) == 3:
                raise KeyboardInterrupt

    person = Leaves()
    made = supply(person, clock)
    with pytest.raises(KeyboardInterrupt), made.energised(2.0, 0.5):
        pass
    made.make_safe()
    assert person.told[2:] == ["Switch the supply's output off and make sure that it is."] * 2


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_the_person_is_told_to_switch_off_after_an_exception(clock: Any, error: type[BaseException]) -> None:
    person = Person()
    with pytest.raises(error), supply(person, clock).energised(2.0, 0.5):
        raise error
    assert person.told[-1].startswith("Switch the supply's output off")


def test_nothing_is_asked_for_a_value_beyond_the_limits(clock: Any) -> None:
    person = Person()
    with pytest.raises(SetpointError, match="voltage = 31 V"), supply(person, clock).energised(31.0, 0.5):
        pass
    assert person.told == []


def test_a_reading_without_a_stated_accuracy_is_refused_before_it_is_asked(clock: Any) -> None:
    person = Person(1.0)
    with pytest.raises(MeasurementError, match=r"no accuracy is stated for its current.*station file"):
        supply(person, clock).measure_current()
    assert person.asked == []


def test_an_unusable_answer_is_asked_again(clock: Any) -> None:
    person = Person(math.nan, 31.0, 3.0)
    assert supply(person, clock).measure_voltage().value == 3.0
    assert [context for *_, context in person.asked] == [
        "",
        "(nan V is outside 0 … 30 V)",
        "(31 V is outside 0 … 30 V)",
    ]


def test_three_unusable_answers_are_an_error_naming_the_range(clock: Any) -> None:
    person = Person(math.inf, -1.0, 99.0)
    with pytest.raises(MeasurementError, match="voltage: the value typed is outside 0 … 30 V"):
        supply(person, clock).measure_voltage()


def meter(person: Person, clock: Any, **options: Any) -> ManualLcrMeter:
    given = {"resistance_accuracy": STATED, "inductance_accuracy": STATED, "frequencies": (100.0, 1000.0)}
    return ManualLcrMeter(person, clock, ManualLcrMeterOptions("UT603", **(given | options)))


def test_a_meter_is_set_and_read(clock: Any) -> None:
    person = Person(2.1, 1e-3)
    made = meter(person, clock)
    made.configure(1000.0)
    made.correct_short()
    reading = made.measure()
    assert (reading.resistance, reading.inductance, reading.frequency) == (2.1, 1e-3, 1000.0)
    assert person.told[0] == "Set the meter to series R and L (Ls, Rs) at 1000 Hz."
    assert [(asked[0], asked[1], asked[4]) for asked in person.asked] == [
        ("resistance Rs", "Ω", "at 1000 Hz"),
        ("inductance Ls", "H", "at 1000 Hz"),
    ]


@pytest.mark.parametrize(("asked", "missing"), [(Wanted.RESISTANCE, "inductance"), (Wanted.INDUCTANCE, "resistance")])
def test_only_what_is_asked_for(clock: Any, asked: Wanted, missing: str) -> None:
    person = Person(0.5)
    made = meter(person, clock, **{f"{missing}_accuracy": None})
    made.configure(100.0)
    reading = made.measure(asked)
    assert math.isnan(getattr(reading, missing))
    assert getattr(reading, asked.value) == 0.5
    assert len(person.asked) == 1
    stated = made.accuracy_at(1.0, 1.0, 100.0)
    assert stated == ((STATED, Accuracy()) if asked is Wanted.RESISTANCE else (Accuracy(), STATED))


def test_a_dc_meter_has_no_frequency(clock: Any) -> None:
    person = Person(2.0)
    made = meter(person, clock, direct_current=True)
    made.configure(20.0)
    reading = made.measure()
    assert (reading.frequency, reading.resistance) == (0.0, 2.0)
    assert math.isnan(reading.inductance)


def test_what_a_meter_does_not_offer(clock: Any) -> None:
    made = meter(Person(), clock)
    with pytest.raises(
        SetpointError,
        match=r"frequency = 20 Hz is not one of the values that it offers, 100, 1000 Hz.*--set frequency=100",
    ):
        made.configure(20.0)
    with pytest.raises(SetpointError, match="level = 11 V rms"):
        made.configure(100.0, level=11.0)
    with pytest.raises(MeasurementError, match=r"configure\(\) first"):
        made.measure()
    with pytest.raises(MeasurementError, match="beyond its range"):
        made.accuracy_at(1e9, 1.0, 100.0)


def test_a_screen_is_read_but_gives_no_waveform(clock: Any) -> None:
    person = Person(53.76, 7.4)
    options = ManualOscilloscopeOptions(
        probes={2: ProbeKind.CURRENT, 1: ProbeKind.VOLTAGE},
        frequency_accuracy=STATED,
        amplitude_accuracy={1: STATED},
    )
    scope = ManualOscilloscope(person, clock, options)
    assert scope.channels(ProbeKind.CURRENT) == (2,)
    scope.configure_channel(1, ChannelSettings(8.0, 1.0))
    scope.configure_acquisition(0.1, 1000, 0.5)
    scope.configure_trigger(Trigger(1, 0.5, Slope.FALLING))
    scope.configure_trigger(Trigger(None))
    scope.initiate()
    assert person.told == [
        "Switch channel 1 on: full screen 8 V, mid-screen 1 V.",
        "Set the screen's width to 0.1 s, the trigger at 50 % from the left.",
        "Set the edge trigger to channel 1, 0.5 V, falling.",
        "Set the trigger to automatic.",
        "Press Single.",
    ]
    with pytest.raises(MeasurementError, match=r"gives no waveform of channels 1, 2 .*measure_frequency"):
        scope.fetch([1, 2], timeout=1.0)
    assert scope.measure_frequency(1).value == 53.76
    amplitude = scope.measure_amplitude(1)
    assert (amplitude.value, amplitude.unit) == (3.7, "V")
    with pytest.raises(MeasurementError, match="amplitude on channel 2"):
        scope.measure_amplitude(2)
    with pytest.raises(SetpointError, match="channel = 3"):
        scope.measure_frequency(3)


def test_a_dynamometer_is_run_and_read(clock: Any) -> None:
    person = Person(1500.0, -0.8)
    made = ManualDynamometer(person, clock, ManualDynamometerOptions(200.0, 5.0, "drill", STATED, STATED))
    with made.driving_speed(1500 * RPM):
        made.set_speed(1200 * RPM)
        reading = made.measure()
    made.zero_torque()
    made.command_zero()
    made.stop()
    assert reading.speed == pytest.approx(1500 * RPM)
    assert reading.power == pytest.approx(-0.8 * 1500 * RPM)
    assert person.told == [
        "Drive the shaft at 1500 rpm and wait until the speed is steady.",
        "Drive the shaft at 1200 rpm and wait until the speed is steady.",
        "Switch the dynamometer off and let the shaft coast.",
        "With the shaft at rest, zero the torque display.",
        "Brake the shaft to a standstill and switch the dynamometer off.",
    ]
    with pytest.raises(RuntimeError), made.driving_torque(1.0):
        raise RuntimeError
    assert person.told[-1] == "Switch the dynamometer off and let the shaft coast."
    with pytest.raises(SetpointError, match="torque = 6"):
        made.driving_torque(6.0).__enter__()


def test_a_tachometer_is_read_in_rpm(clock: Any) -> None:
    person = Person(1600.0)
    reading = ManualTachometer(person, clock, ManualTachometerOptions(accuracy=STATED)).measure_speed()
    assert reading.value == pytest.approx(1600 * RPM)
    assert reading.unit == "rad/s"
    assert person.asked[0][1] == "rpm"


def test_an_inverter_is_run_and_read(clock: Any) -> None:
    person = Person(53.76, 2.0)
    made = ManualInverter(person, clock, ManualInverterOptions(10.0, 400.0, "ESC", STATED, STATED))
    with made.driving_frequency(53.76, 2.0):
        assert made.measure_frequency().value == 53.76
    with pytest.raises(RuntimeError), made.driving_current(2.0):
        raise RuntimeError
    with made.driving_current(2.0):
        made.set_current(-1.0)
        assert made.measure_current().value == 2.0
    made.command_zero()
    assert person.told == [
        "Start the inverter at 53.76 Hz with 2 A peak and wait until the ramp has ended.",
        "Switch the inverter off.",
        "Set the inverter to regulate a torque-producing current of 2 A peak.",
        "Switch the inverter off.",
        "Set the inverter to regulate a torque-producing current of 2 A peak.",
        "Set the inverter to regulate a torque-producing current of -1 A peak.",
        "Switch the inverter off.",
    ]
    for refused in (lambda: made.driving_frequency(401.0, 1.0), lambda: made.driving_current(11.0)):
        with pytest.raises(InstrumentError, match="is outside"):
            refused().__enter__()


def six_step(person: Person, clock: Any, **options: Any) -> ManualDrive:
    return ManualDrive(person, clock, ManualDriveOptions(60.0, 10.0, **options))


def test_a_drive_is_switched_on_read_and_switched_off(clock: Any) -> None:
    person = Person(24.1, -0.35, 133.3, 101)
    drive = six_step(
        person, clock, voltage_accuracy=STATED, current_accuracy=STATED, frequency_accuracy=STATED, model="BLD-50"
    )
    assert drive.identity.model == "BLD-50"
    clock.time = 2.0
    with drive.running():
        readings = (drive.measure_bus_voltage(), drive.measure_bus_current(), drive.measure_frequency())
        assert drive.hall_state() == (True, False, True)
    assert [(reading.value, reading.unit, reading.time) for reading in readings] == [
        (24.1, "V", 2.0),
        (-0.35, "A", 2.0),
        (133.3, "Hz", 2.0),
    ]
    assert person.told == [
        "Switch the six-step drive on, at full voltage.",
        "Switch the six-step drive off and make sure that it is.",
    ]
    assert [asked[:4] for asked in person.asked] == [
        ("DC link voltage", "V", 0.0, 60.0),
        ("current out of the DC source", "A", -10.0, 10.0),
        ("frequency of a Hall signal", "Hz", 0.0, 5000.0),
        ("Hall signals H1 H2 H3 as three digits, each 0 or 1", "", 0, 111),
    ]
    drive.close()


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_the_person_is_told_to_switch_the_drive_off_after_an_exception(clock: Any, error: type[BaseException]) -> None:
    person = Person()
    with pytest.raises(error), six_step(person, clock).running():
        raise error
    assert person.told[-1] == "Switch the six-step drive off and make sure that it is."


@pytest.mark.parametrize(
    ("typed", "state"),
    [(0, (False, False, False)), (1, (False, False, True)), (10, (False, True, False)), (110, (True, True, False))],
)
def test_hall_digits_with_leading_zeros(clock: Any, typed: float, state: tuple[bool, bool, bool]) -> None:
    assert six_step(Person(typed), clock).hall_state() == state


def test_hall_digits_that_are_none_are_asked_again_and_then_refused(clock: Any) -> None:
    assert six_step(Person(20, 1.5, 11), clock).hall_state() == (False, True, True)
    with pytest.raises(
        MeasurementError, match="each 0 or 1: 102 is not one of the answers 0, 1, 10, 11, 100, 101, 110, 111"
    ):
        six_step(Person(5, 12, 102), clock).hall_state()


def test_readings_of_a_drive_without_an_accuracy_are_refused(clock: Any) -> None:
    drive = six_step(Person(), clock)
    for read in (drive.measure_bus_voltage, drive.measure_bus_current, drive.measure_frequency):
        with pytest.raises(MeasurementError, match="no accuracy is stated"):
            read()
